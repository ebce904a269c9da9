//! Runs that end badly: killed at any moment, disk full, folders that take
//! nothing. The victim is this test program itself, started again.

#![cfg(unix)]

mod common;

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;
use std::{env, fs};

use common::{advance, assert_frames, bits, checkpoint, header, options, record, state};
use selvedge_record::{RecordError, Recorder, Recording};
use serde_json::json;

const PATH: &str = "SELVEDGE_TEST_RECORDING";
const STEPS: u64 = 60;
const EVERY: u64 = 4;
const SIZE: usize = 24;

fn part(path: &Path) -> PathBuf {
    path.with_file_name("run.mcap.part")
}

/// The victim. Says on its output what it has flushed.
#[test]
#[ignore = "started by the other tests"]
fn victim() {
    let Some(path) = env::var_os(PATH).map(PathBuf::from) else {
        return;
    };
    let header = header(SIZE);
    let options = options();
    let every = options.flush_frames as u64;
    let mut recorder = match Recorder::create(&path, &header, options) {
        Ok(recorder) => recorder,
        Err(error) => return println!("\nERROR {error}"),
    };
    println!("\nCREATED");
    let mut since = 0;
    let result = advance(&mut recorder, &header, 0..STEPS, EVERY, |step| {
        since += 1;
        if step % EVERY == EVERY - 1 {
            println!("SAFE {step} {step}");
            since = 0;
        } else if since == every {
            println!("SAFE {step} {}", step / EVERY * EVERY);
            since = 0;
        }
    });
    let result = result.and_then(|()| recorder.finish(&json!({ "status": "finished" })));
    match result {
        Ok(_) => println!("FINISHED"),
        Err(error) => println!("ERROR {error}"),
    }
}

fn start(path: &Path) -> Command {
    let mut command = Command::new(env::current_exe().unwrap());
    command
        .args([
            "--exact",
            "victim",
            "--ignored",
            "--nocapture",
            "--test-threads=1",
        ])
        .env(PATH, path)
        .stdout(Stdio::piped())
        .stderr(Stdio::null());
    command
}

/// Verifies that a run killed at any moment leaves everything flushed so far
/// readable, the earlier result untouched, and that the resumed run gives the
/// very file of an uninterrupted one.
#[test]
fn killed_at_any_moment() {
    let folder = tempfile::tempdir().unwrap();
    let header = header(SIZE);
    let whole = folder.path().join("whole.mcap");
    record(&whole, &header, STEPS, EVERY);
    let expected = fs::read(&whole).unwrap();
    let path = folder.path().join("run.mcap");
    record(&path, &header, 3, 2);
    let earlier = fs::read(&path).unwrap();

    let mut resumed = 0;
    for round in 0..24_u64 {
        let mut child = start(&path).spawn().unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
        // After some lines, and then at an odd moment of what follows.
        let wait_for = 1 + (round * 7) % 19;
        let mut safe = None;
        let mut seen = 0;
        let mut note = |line: &str| {
            if let Some(rest) = line.strip_prefix("SAFE ") {
                safe = rest.split(' ').next().and_then(|s| s.parse::<u64>().ok());
            }
        };
        for line in lines.by_ref() {
            let line = line.unwrap();
            assert!(!line.starts_with("ERROR"), "{line}");
            note(&line);
            seen += u64::from(line == "CREATED" || line.starts_with("SAFE"));
            if seen >= wait_for {
                break;
            }
        }
        std::thread::sleep(Duration::from_micros(round * 371 % 2900));
        child.kill().unwrap();
        child.wait().unwrap();
        for line in lines.map_while(Result::ok) {
            note(&line);
        }

        if !part(&path).exists() {
            // It was faster than the kill.
            assert!(fs::read(&path).unwrap() == expected);
            fs::write(&path, &earlier).unwrap();
            continue;
        }
        assert!(
            fs::read(&path).unwrap() == earlier,
            "the earlier result was touched"
        );
        let recording = Recording::open(&part(&path)).unwrap();
        assert_frames(&recording, &header);
        assert!(!recording.warnings().is_empty() || recording.is_complete());
        let frames = recording.frames().len() as u64;
        assert!(
            frames > safe.unwrap_or(0) || safe.is_none(),
            "{frames} frames, {safe:?} safe"
        );
        drop(recording);

        match Recorder::resume(&path, &header, options()) {
            Ok((mut recorder, from)) => {
                assert!(
                    from.step + EVERY > safe.unwrap_or(0),
                    "{} {safe:?}",
                    from.step
                );
                assert!(bits(from.section("q").unwrap()) == bits(&state(&header, from.step).0));
                assert_eq!(from.digest(), checkpoint(&header, from.step).digest());
                advance(&mut recorder, &header, from.step + 1..STEPS, EVERY, |_| {}).unwrap();
                recorder.finish(&json!({ "status": "finished" })).unwrap();
                assert!(
                    fs::read(&path).unwrap() == expected,
                    "resumed at {}",
                    from.step
                );
                resumed += 1;
            }
            Err(RecordError::NoCheckpoint { .. }) => assert!(safe.unwrap_or(0) < EVERY - 1),
            Err(RecordError::AlreadyComplete { .. }) => {}
            Err(error) => panic!("{error}"),
        }
        let _ = fs::remove_file(part(&path));
        fs::write(&path, &earlier).unwrap();
    }
    assert!(resumed >= 12, "only {resumed} rounds came to a resume");
}

/// Verifies that a disk (here: a file size limit) that fills up ends in an
/// error with path and reason, that the earlier result stays, and that the run
/// can be resumed when there is room again.
#[test]
fn disk_full() {
    let folder = tempfile::tempdir().unwrap();
    let header = header(SIZE);
    let path = folder.path().join("run.mcap");
    record(&path, &header, 3, 2);
    let earlier = fs::read(&path).unwrap();
    let mut resumed = 0;
    for blocks in [0, 8, 60, 120, 200, 300] {
        let inner = start(&path);
        let mut command = Command::new("sh");
        // Blocks of 512 bytes; without the signal the write returns an error.
        command
            .arg("-c")
            .arg(format!(
                "trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" \"$@\""
            ))
            .arg(inner.get_program())
            .args(inner.get_args())
            .env(PATH, &path)
            .stderr(Stdio::null());
        let output = String::from_utf8(command.output().unwrap().stdout).unwrap();
        let error = output
            .lines()
            .find(|l| l.starts_with("ERROR"))
            .unwrap_or_else(|| {
                panic!("{blocks} blocks were enough:\n{output}");
            });
        assert!(error.contains("run.mcap.part"), "{error}");
        assert!(error.contains("File too large"), "{error}");
        assert!(fs::read(&path).unwrap() == earlier);
        if !output.contains("CREATED") {
            assert!(!part(&path).exists(), "a recording without a header");
            continue;
        }
        let recording = Recording::open(&part(&path)).unwrap();
        assert_frames(&recording, &header);
        if recording.last_checkpoint().is_some() {
            let (recorder, from) = Recorder::resume(&path, &header, options()).unwrap();
            assert_eq!(recorder.frame_count(), from.step + 1);
            resumed += 1;
        }
        drop(recording);
        fs::remove_file(part(&path)).unwrap();
    }
    assert!(resumed >= 2, "{resumed}");
}

/// Verifies that a folder that cannot be made or written is named.
#[test]
fn unwritable_folder() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    fs::write(&file, b"").unwrap();
    let header = header(4);
    let error = Recorder::create(&file.join("run.mcap"), &header, options()).unwrap_err();
    let text = error.to_string();
    assert!(matches!(error, RecordError::Write { .. }), "{text}");
    assert!(text.contains("file"), "{text}");

    // A file system that takes no new files, whoever asks.
    if Path::new("/proc/self").exists() {
        let error = Recorder::create(Path::new("/proc/run.mcap"), &header, options()).unwrap_err();
        assert!(matches!(error, RecordError::Write { .. }), "{error}");
        assert!(error.to_string().contains("/proc/run.mcap.part"), "{error}");
    }
}
