//! Damaged files: never a panic, never wrong data without a warning.

mod common;

use std::fs;
use std::path::Path;
use std::sync::OnceLock;

use common::{assert_frames, bits, checkpoint, diagnostics, header, options, record, state};
use proptest::prelude::*;
use selvedge_record::{RecordError, Recorder, Recording, RunHeader};

const STEPS: u64 = 14;

struct Original {
    header: RunHeader,
    bytes: Vec<u8>,
}

fn original() -> &'static Original {
    static ORIGINAL: OnceLock<Original> = OnceLock::new();
    ORIGINAL.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.mcap");
        let header = header(5);
        record(&path, &header, STEPS, 4);
        Original {
            header,
            bytes: fs::read(path).unwrap(),
        }
    })
}

/// Opens a damaged copy; whatever it gives must be right or be announced.
fn examine(folder: &Path, bytes: &[u8]) -> Result<(), RecordError> {
    let part = folder.join("run.mcap.part");
    fs::write(&part, bytes).unwrap();
    let original = original();
    let recording = Recording::open(&part)?;
    let header = recording.header();
    let text_lost = header.scene_text.is_empty() && !recording.warnings().is_empty();
    assert!(header.scene_text == original.header.scene_text || text_lost);
    let header = RunHeader {
        scene_text: original.header.scene_text.clone(),
        ..header.clone()
    };
    assert_eq!(header, original.header);
    assert_frames(&recording, &original.header);
    for d in recording.diagnostics() {
        assert_eq!(*d, diagnostics(d.step));
    }
    for line in recording.logs() {
        assert!(line.message.starts_with("step "));
    }
    if let Some(last) = recording.last_checkpoint() {
        assert_eq!(
            last.digest(),
            checkpoint(&original.header, last.step).digest()
        );
    }
    let whole = recording.frames().len() == STEPS as usize
        && recording.diagnostics().len() == STEPS as usize
        && recording.logs().len() == 2
        && recording.is_complete();
    assert!(
        whole || !recording.warnings().is_empty(),
        "something is missing, no warning"
    );
    let (complete, usable) = (
        recording.is_complete(),
        recording.last_checkpoint().is_some(),
    );
    drop(recording);

    // Resuming must give the right checkpoint or an error.
    match Recorder::resume(&folder.join("run.mcap"), &original.header, options()) {
        Ok((recorder, from)) => {
            assert!(usable && !complete);
            assert_eq!(recorder.frame_count(), from.step + 1);
            assert_eq!(
                from.digest(),
                checkpoint(&original.header, from.step).digest()
            );
            drop(recorder);
            let resumed = Recording::open(&part).unwrap();
            assert_eq!(resumed.frames().len() as u64, from.step + 1);
            assert_frames(&resumed, &original.header);
            let (q, _) = state(&original.header, from.step);
            assert_eq!(bits(from.section("q").unwrap()), bits(&q));
        }
        Err(RecordError::AlreadyComplete { .. }) => assert!(complete),
        Err(RecordError::NoCheckpoint { .. }) => assert!(!usable),
        Err(error) => panic!("{error}"),
    }
    Ok(())
}

/// Errors that a damaged header may give.
fn is_header_error(error: &RecordError) -> bool {
    use RecordError::{Format, InvalidHeader, NoHeader, NotMcap};
    matches!(
        error,
        NotMcap { .. } | NoHeader { .. } | Format { .. } | InvalidHeader { .. }
    )
}

/// Verifies that the original itself passes the examination.
#[test]
fn undamaged() {
    let folder = tempfile::tempdir().unwrap();
    examine(folder.path(), &original().bytes).unwrap();
}

/// Verifies that a file cut at any byte gives a prefix of the run.
#[test]
fn cut_anywhere() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = &original().bytes;
    let mut readable = 0;
    // Every record starts and ends somewhere in here; 61 is no divisor of any.
    for end in (0..bytes.len()).step_by(61) {
        match examine(folder.path(), &bytes[..end]) {
            Ok(()) => readable += 1,
            Err(error) => assert!(is_header_error(&error), "cut at {end}: {error}"),
        }
    }
    assert!(readable > 50, "{readable}");
}

/// Verifies that no single changed byte goes unnoticed.
#[test]
fn any_changed_byte_is_noticed() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = &original().bytes;
    let path = folder.path().join("run.mcap");
    let end = {
        // The index at the end is for other readers; ours does not use it.
        let magic = bytes.len() - 8;
        let summary = u64::from_le_bytes(bytes[magic - 20..magic - 12].try_into().unwrap());
        summary as usize
    };
    for i in (0..end).step_by(23) {
        let mut bad = bytes.clone();
        bad[i] ^= 1 << (i % 8);
        fs::write(&path, &bad).unwrap();
        match Recording::open(&path) {
            Ok(recording) => assert!(!recording.warnings().is_empty(), "byte {i}"),
            Err(error) => assert!(is_header_error(&error), "byte {i}: {error}"),
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 192, failure_persistence: None, ..ProptestConfig::default() })]

    /// Verifies that changed, removed and inserted pieces are survived.
    #[test]
    fn mutated(
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..4_u8, 1..200_usize), 1..4),
        keep in prop::option::of(any::<prop::sample::Index>()),
    ) {
        let folder = tempfile::tempdir().unwrap();
        let mut bytes = original().bytes.clone();
        for (at, value, kind, length) in edits {
            if bytes.is_empty() {
                break;
            }
            let at = at.index(bytes.len());
            let end = (at + length).min(bytes.len());
            match kind {
                0 => bytes[at] = value,
                1 => bytes[at..end].fill(value),
                2 => drop(bytes.drain(at..end)),
                _ => drop(bytes.splice(at..at, vec![value; length])),
            }
        }
        if let Some(keep) = keep {
            bytes.truncate(keep.index(bytes.len() + 1));
        }
        if let Err(error) = examine(folder.path(), &bytes) {
            prop_assert!(is_header_error(&error), "{error}");
        }
    }

    /// Verifies that arbitrary bytes behind the start mark are survived.
    #[test]
    fn random(bytes in prop::collection::vec(any::<u8>(), 0..600), magic: bool, op in 0..16_u8) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.mcap");
        let mut file = Vec::new();
        if magic {
            file.extend(b"\x89MCAP0\r\n");
            // A record whose length fits, so that its body is looked at.
            file.push(op);
            file.extend((bytes.len() as u64).to_le_bytes());
        }
        file.extend(bytes);
        fs::write(&path, file).unwrap();
        let error = Recording::open(&path).unwrap_err();
        prop_assert!(is_header_error(&error), "{error}");
    }
}
