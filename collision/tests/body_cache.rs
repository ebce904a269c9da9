//! The disk cache of mesh bodies.

mod body_support;

use body_support::sphere;
use selvedge_collision::body::{CacheNote, FieldSettings, MeshBody};
use std::fs;
use std::path::{Path, PathBuf};

fn build(dir: &Path, rings: usize, voxel: f64) -> (MeshBody, CacheNote) {
    let (points, triangles) = sphere([0.0; 3], 0.08, rings);
    let settings = FieldSettings { voxel, band: 0.012 };
    MeshBody::build_cached("ball", &points, &triangles, &settings, dir).unwrap()
}

fn entries(dir: &Path) -> Vec<PathBuf> {
    fs::read_dir(dir)
        .unwrap()
        .map(|e| e.unwrap().path())
        .collect()
}

/// The second build reads the first one's bits; another mesh or other settings
/// get entries of their own; no temporary file is left.
#[test]
fn round_trip() {
    let dir = tempfile::tempdir().unwrap();
    let inner = dir.path().join("not").join("yet");
    let (first, note) = build(&inner, 12, 0.006);
    assert_eq!(note, CacheNote::Stored);
    let (second, note) = build(&inner, 12, 0.006);
    assert_eq!(note, CacheNote::Read);
    assert_eq!(first.field(), second.field());
    assert_eq!(first.report(), second.report());
    assert_eq!(build(&inner, 13, 0.006).1, CacheNote::Stored);
    assert_eq!(build(&inner, 12, 0.007).1, CacheNote::Stored);
    let found = entries(&inner);
    assert!(found.len() == 3 && found.iter().all(|p| p.extension().unwrap() == "sdf"));
}

/// Entries that are cut short anywhere, have a flipped bit anywhere, are empty
/// or are another mesh's are found out and replaced.
#[test]
fn damage_is_repaired() {
    let dir = tempfile::tempdir().unwrap();
    let (clean, _) = build(dir.path(), 10, 0.008);
    let path = entries(dir.path()).remove(0);
    let bytes = fs::read(&path).unwrap();
    let mut damaged: Vec<Vec<u8>> = [0, 7, 31, 32, 100, bytes.len() / 2, bytes.len() - 1]
        .map(|n| bytes[..n].to_vec())
        .into();
    for at in [0, 20, 45, 80, 200, bytes.len() / 2, bytes.len() - 3] {
        let mut copy = bytes.clone();
        copy[at] ^= 0x10;
        damaged.push(copy);
    }
    let mut longer = bytes.clone();
    longer.push(0);
    damaged.push(longer);
    for (n, content) in damaged.iter().enumerate() {
        fs::write(&path, content).unwrap();
        let (body, note) = build(dir.path(), 10, 0.008);
        assert!(
            matches!(note, CacheNote::Replaced { .. }),
            "case {n}: {note}"
        );
        assert_eq!(body.field(), clean.field());
        assert_eq!(fs::read(&path).unwrap(), bytes, "case {n}");
    }

    let (_, note) = build(dir.path(), 11, 0.008);
    assert_eq!(note, CacheNote::Stored);
    let other = entries(dir.path())
        .into_iter()
        .find(|p| *p != path)
        .unwrap();
    fs::copy(&other, &path).unwrap();
    let (body, note) = build(dir.path(), 10, 0.008);
    assert_eq!(
        note,
        CacheNote::Replaced {
            damage: "of another mesh".to_owned()
        }
    );
    assert_eq!(body.field(), clean.field());
}

/// A folder that cannot be written, or an entry that cannot be read, is
/// reported and is no error.
#[test]
fn unusable_folder_is_no_error() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("a file");
    fs::write(&file, b"").unwrap();
    let (body, note) = build(&file, 8, 0.008);
    assert!(
        matches!(&note, CacheNote::NotStored { reason } if !reason.is_empty()),
        "{note}"
    );
    assert!(body.field().brick_count() > 0);

    // A folder where the entry should be.
    let (_, note) = build(dir.path(), 9, 0.008);
    assert_eq!(note, CacheNote::Stored);
    let path = entries(dir.path())
        .into_iter()
        .find(|p| p.extension().is_some())
        .unwrap();
    fs::remove_file(&path).unwrap();
    fs::create_dir(&path).unwrap();
    let (_, note) = build(dir.path(), 9, 0.008);
    assert!(matches!(note, CacheNote::NotStored { .. }), "{note}");
    assert_eq!(
        entries(dir.path())
            .iter()
            .filter(|p| p.extension().is_some_and(|e| e == "tmp"))
            .count(),
        0
    );
}
