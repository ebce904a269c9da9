//! OBJ meshes: reading, and finding what is wrong with them.

use std::path::Path;

use proptest::prelude::*;
use selvedge_scene::file::obj::{Purpose, parse, read};

const TETRA: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

fn codes(text: &str, scale: f64, purpose: Purpose) -> Vec<String> {
    let findings = match parse(text, "m.obj", scale, purpose) {
        Ok(checked) => checked.warnings,
        Err(findings) => findings,
    };
    let show = |f: &selvedge_scene::diagnostic::Finding| match f.line {
        Some(line) => format!("{}:{line}", f.code),
        None => f.code.to_owned(),
    };
    findings.findings().iter().map(show).collect()
}

/// A sound body has no finding; each defect has its own, with its line.
#[test]
fn defects() {
    let body = |text: &str| codes(text, 1.0, Purpose::Body);
    let cloth = |text: &str| codes(text, 1.0, Purpose::Cloth);
    assert!(body(TETRA).is_empty());
    assert_eq!(codes(TETRA, 100.0, Purpose::Body), ["mesh::scale"]);
    assert_eq!(codes(TETRA, 1e-3, Purpose::Body), ["mesh::scale"]);
    let inverted = TETRA
        .replace("f 1 3 2", "f 1 2 3")
        .replace("f 1 2 4", "f 1 4 2")
        .replace("f 1 4 3", "f 1 3 4")
        .replace("f 2 3 4", "f 2 4 3");
    assert_eq!(body(&inverted), ["mesh::inside-out"]);
    let one_turned = TETRA.replace("f 2 3 4", "f 2 4 3");
    assert_eq!(body(&one_turned), ["mesh::orientation:8"]);
    assert_eq!(cloth(&one_turned), ["mesh::orientation:8"]);
    assert_eq!(body(&TETRA.replace("f 2 3 4\n", "")), ["mesh::open:5"]);
    assert!(cloth(&TETRA.replace("f 2 3 4\n", "")).is_empty());
    let fin = format!("{TETRA}v 1 1 1\nf 1 2 5\n");
    assert_eq!(cloth(&fin)[0], "mesh::non-manifold:10");
    assert_eq!(cloth(&format!("{TETRA}v 5 5 5\n")), ["mesh::loose-points"]);
    let flat = "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n";
    assert_eq!(cloth(flat), ["mesh::degenerate:4"]);
    assert_eq!(cloth(""), ["mesh::empty"]);
    assert_eq!(cloth("v 0 0 0\n"), ["mesh::empty"]);
    assert_eq!(
        cloth("v 0 0\nf 1 2 9\n"),
        ["mesh::syntax:1", "mesh::syntax:2"]
    );
    assert_eq!(cloth("v 0 nan 0\n"), ["mesh::syntax:1"]);
}

/// Cloth a hundred times too large or too small is at least suspicious, a
/// napkin in cm and a garment at a hundredth of its size included.
#[test]
fn cloth_in_another_unit() {
    let sheet = |size: f64| format!("v 0 0 0\nv {size} 0 0\nv 0 0 {size}\nf 1 3 2\n");
    for size in [0.2, 1.0, 2.0] {
        assert!(codes(&sheet(size), 1.0, Purpose::Cloth).is_empty());
        assert_eq!(codes(&sheet(size), 100.0, Purpose::Cloth), ["mesh::scale"]);
        let small = codes(&sheet(size), 0.01, Purpose::Cloth);
        assert_eq!(small.len(), usize::from(size < 2.0), "{size}");
    }
}

/// Quads become two triangles; texture coordinates follow the corners; numbers
/// may count from the end.
#[test]
fn forms_of_faces() {
    let text = "v 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\nvt 0 0\nvt 2 0\nvt 2 2\nvt 0 2\n\
                g one\nf 1/1 2/2 3/3 -1/-1\n";
    let mesh = parse(text, "m.obj", 0.5, Purpose::Cloth).unwrap().mesh;
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(mesh.texture[1], [[0.0, 0.0], [2.0, 2.0], [0.0, 2.0]]);
    assert_eq!(mesh.bounds(), ([0.0; 3], [0.5, 0.0, 0.5]));
    let mixed = text.replace("-1/-1", "-1//7");
    let mesh = parse(&mixed, "m.obj", 1.0, Purpose::Cloth).unwrap().mesh;
    assert!(mesh.texture.is_empty());
}

/// The body of the pattern data set reads without an error.
#[test]
fn measured_body() {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../shared/data/bodies/mean_all.obj"
    );
    if !Path::new(path).exists() {
        println!("skipped: {path} is absent");
        return;
    }
    let checked = read(Path::new(path), 1.0, Purpose::Body).unwrap();
    let (min, max) = checked.mesh.bounds();
    assert!((1.5..2.0).contains(&(max[1] - min[1])));
    assert!(checked.mesh.triangles.len() > 10_000);
    let in_cm = read(Path::new(path), 100.0, Purpose::Body).unwrap_err();
    assert!(in_cm.has_errors());
    assert!(in_cm.to_string().contains("`scale = 0.01`"), "{in_cm}");
}

proptest! {
    /// Damaged files give findings or meshes, never a panic.
    #[test]
    fn never_panics(cut in 0usize..90, at in 0usize..90, noise in "[-v/f 0-9.e#\n]{0,20}|.{0,8}") {
        let mut text = TETRA.to_owned();
        text.truncate(cut);
        text.insert_str(at.min(text.len()), &noise);
        for purpose in [Purpose::Cloth, Purpose::Body] {
            if let Ok(checked) = parse(&text, "m", 1.0, purpose) {
                let n = checked.mesh.positions.len();
                prop_assert!(checked.mesh.triangles.iter().flatten().all(|i| (*i as usize) < n));
            }
        }
    }
}
