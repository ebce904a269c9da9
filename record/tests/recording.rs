//! Writing, reading and resuming within one process.

mod common;

use std::fs;

use common::{advance, assert_frames, checkpoint, diagnostics, header, options, record, state};
use selvedge_record::{LogLevel, RecordError, Recorder, Recording};
use serde_json::json;

/// Verifies that everything comes back bit for bit from a finished recording.
#[test]
fn round_trip() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("deep/er/run.mcap");
    let header = header(6);
    record(&path, &header, 20, 5);
    let recording = Recording::open(&path).unwrap();
    assert_eq!(recording.warnings(), &[] as &[String]);
    assert!(recording.is_complete());
    assert_eq!(recording.outcome(), Some(&json!({ "status": "finished" })));
    assert_eq!(recording.header(), &header);
    assert_eq!(recording.frames().len(), 20);
    assert_frames(&recording, &header);
    let expected: Vec<_> = (0..20).map(diagnostics).collect();
    assert_eq!(recording.diagnostics(), expected);
    assert_eq!(recording.logs().len(), 3);
    assert_eq!(recording.logs()[1].message, "step 7");
    assert_eq!(recording.logs()[1].level, LogLevel::Warning);
    let last = recording.last_checkpoint().unwrap();
    assert_eq!(last.digest(), checkpoint(&header, 19).digest());
    assert_eq!(recording.frame_near(0.1), Some(6));
    assert!(matches!(
        recording.frame(20),
        Err(RecordError::NoFrame { count: 20, .. })
    ));
    assert!(!folder.path().join("deep/er/run.mcap.part").exists());
}

/// Verifies that equal runs give equal files, byte for byte, and so does a
/// run that was interrupted anywhere between two checkpoints.
#[test]
fn resumed_equals_uninterrupted() {
    let folder = tempfile::tempdir().unwrap();
    let header = header(6);
    let whole = folder.path().join("whole.mcap");
    record(&whole, &header, 24, 5);
    let expected = fs::read(&whole).unwrap();
    let again = folder.path().join("again.mcap");
    record(&again, &header, 24, 5);
    assert!(
        fs::read(&again).unwrap() == expected,
        "two equal runs differ"
    );

    for stop in [5, 6, 9, 10, 23] {
        let path = folder.path().join(format!("stopped at {stop}.mcap"));
        let mut recorder = Recorder::create(&path, &header, options()).unwrap();
        advance(&mut recorder, &header, 0..stop, 5, |_| {}).unwrap();
        drop(recorder);
        let (mut recorder, from) = Recorder::resume(&path, &header, options()).unwrap();
        assert_eq!(from.step, stop / 5 * 5 - 1);
        assert_eq!(from.digest(), checkpoint(&header, from.step).digest());
        assert_eq!(recorder.frame_count(), from.step + 1);
        advance(&mut recorder, &header, from.step + 1..24, 5, |_| {}).unwrap();
        recorder.finish(&json!({ "status": "finished" })).unwrap();
        assert!(
            fs::read(&path).unwrap() == expected,
            "resumed at {}",
            from.step
        );
    }
}

/// Verifies that every reason not to resume has its own error, which leaves
/// the files alone.
#[test]
fn refuses_to_resume() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let part = folder.path().join("run.mcap.part");
    let header = header(4);
    let resume = |header| Recorder::resume(&path, header, options()).map(|r| r.1);
    assert!(matches!(
        resume(&header),
        Err(RecordError::NothingToResume { .. })
    ));

    record(&path, &header, 4, 2);
    assert!(matches!(
        resume(&header),
        Err(RecordError::AlreadyComplete { .. })
    ));

    // No checkpoint yet.
    let mut recorder = Recorder::create(&path, &header, options()).unwrap();
    let in_use = Recorder::create(&path, &header, options());
    assert!(
        matches!(in_use, Err(RecordError::InUse { .. })),
        "{in_use:?}"
    );
    assert!(matches!(resume(&header), Err(RecordError::InUse { .. })));
    advance(&mut recorder, &header, 0..4, 100, |_| {}).unwrap();
    drop(recorder);
    assert!(matches!(
        resume(&header),
        Err(RecordError::NoCheckpoint { .. })
    ));

    // Another setting, named.
    let mut recorder = Recorder::create(&path, &header, options()).unwrap();
    advance(&mut recorder, &header, 0..4, 2, |_| {}).unwrap();
    drop(recorder);
    let before = fs::read(&part).unwrap();
    let mut other = header.clone();
    other.effective["integrator"]["max_step"] = json!(0.5);
    let error = resume(&other).unwrap_err().to_string();
    assert!(error.contains("integrator.max_step"), "{error}");
    let mut other = header.clone();
    other.version = "0.2.0".into();
    assert!(resume(&other).unwrap_err().to_string().contains("0.2.0"));
    let mut other = header.clone();
    other.material[0][0][0] += 1e-9;
    assert!(matches!(
        resume(&other),
        Err(RecordError::HeaderMismatch { .. })
    ));
    assert!(fs::read(&part).unwrap() == before);

    // A comment in the scene file and notes are no difference.
    let mut other = header.clone();
    other.scene_text += "# comment\n";
    other.notes = json!(null);
    assert_eq!(resume(&other).unwrap().step, 3);

    // Killed between the end of the file and its renaming.
    fs::rename(&path, &part).unwrap();
    assert!(matches!(
        resume(&header),
        Err(RecordError::AlreadyComplete { .. })
    ));
    assert!(Recording::open(&path).unwrap().is_complete());

    // Not a recording.
    fs::write(&part, b"hello").unwrap();
    assert!(matches!(resume(&header), Err(RecordError::NotMcap { .. })));
}

/// Verifies that the earlier result is there, unchanged, until a new one is
/// finished, however the new one fails.
#[test]
fn earlier_result_stays() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let header = header(4);
    record(&path, &header, 4, 2);
    let before = fs::read(&path).unwrap();
    let mut recorder = Recorder::create(&path, &header, options()).unwrap();
    advance(&mut recorder, &header, 0..9, 2, |_| {}).unwrap();
    assert!(fs::read(&path).unwrap() == before);
    drop(recorder);
    assert!(fs::read(&path).unwrap() == before);
    let part = Recording::open(&folder.path().join("run.mcap.part")).unwrap();
    assert!(!part.is_complete());
    assert_eq!(part.frames().len(), 9);
}

/// Verifies that wrong data is refused with numbers, and that the recording
/// goes on afterwards.
#[test]
fn refuses_wrong_data() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let header = header(4);
    let mut recorder = Recorder::create(&path, &header, options()).unwrap();
    let (mut q, v) = state(&header, 0);
    let short = recorder.frame(0.0, 0, &q[1..], &v);
    assert!(
        matches!(
            short,
            Err(RecordError::Length {
                found: 48,
                expected: 49,
                ..
            })
        ),
        "{short:?}"
    );
    for time in [-1e-3, f64::NAN, 1e11] {
        assert!(matches!(
            recorder.frame(time, 0, &q, &v),
            Err(RecordError::Time { .. })
        ));
    }
    q[7] = f64::NAN;
    let error = recorder.frame(0.0, 0, &q, &v);
    assert!(
        matches!(error, Err(RecordError::NotFinite { index: 7, .. })),
        "{error:?}"
    );
    q[7] = 0.0;
    recorder.frame(0.0, 0, &q, &v).unwrap();
    recorder.finish(&json!({})).unwrap();
    assert_eq!(Recording::open(&path).unwrap().frames().len(), 1);

    let mut bad = header.clone();
    bad.triangles[3][1] = 16;
    let error = Recorder::create(&path, &bad, options());
    assert!(matches!(error, Err(RecordError::InvalidHeader { .. })));
}

/// Verifies that a file without the mesh for viewers still holds all states.
#[test]
fn without_mesh() {
    let folder = tempfile::tempdir().unwrap();
    let header = header(20);
    let size = |mesh_channel| {
        let path = folder.path().join("run.mcap");
        let options = selvedge_record::RecorderOptions {
            mesh_channel,
            ..options()
        };
        let mut recorder = Recorder::create(&path, &header, options).unwrap();
        advance(&mut recorder, &header, 0..10, 5, |_| {}).unwrap();
        recorder.finish(&json!({})).unwrap();
        assert_frames(&Recording::open(&path).unwrap(), &header);
        fs::metadata(&path).unwrap().len()
    };
    let (with, without) = (size(true), size(false));
    assert!(without < with * 9 / 10, "{without} {with}");
}
