//! Precisions of the linear systems as scenes choose them.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use selvedge_scene::build::BuiltScene;
use selvedge_scene::driver::{self, RunOptions, RunResult, Silent};
use selvedge_scene::file;
use selvedge_scene::summary::Status;

/// A sheet that falls on a ball, held at a corner.
const SCENE: &str = r#"
name = "pinned"

[simulation]
duration = 0.1

[[cloth]]
kind = "sheet"
size = [0.2, 0.2]
points = [12, 12]
center = [0.0, 0.104, 0.0]
fabric = "cotton-poplin"

[[pin]]
select = { corner = "top-left" }

[[body]]
kind = "sphere"
radius = 0.1

[relaxation]
enabled = false

[stop]
early = false

[integrator]
newton_tolerance = 1e-3

[output]
report = false
recording = false
"#;

fn run(set: &[(&str, &str)]) -> RunResult {
    let set: Vec<_> = set
        .iter()
        .map(|(k, v)| (format!("solver.{k}"), (*v).to_owned()))
        .collect();
    let folder = tempfile::tempdir().expect("a folder");
    let parsed = file::parse(SCENE, Path::new("pinned.toml"), &set).expect("valid");
    let built = BuiltScene::new(parsed).expect("a scene that can be built");
    let options = RunOptions {
        directory: folder.path().to_owned(),
        resume: false,
        scene_text: SCENE.to_owned(),
        version: "test".to_owned(),
    };
    let never = Arc::new(AtomicBool::new(false));
    let result = driver::run(&built, &options, &mut Silent, &never).expect("a run");
    let reason = &result.summary.reason;
    assert_eq!(result.summary.status, Status::Finished, "{set:?}: {reason}");
    result
}

/// Largest distance of a coordinate [m].
fn apart(a: &RunResult, b: &RunResult) -> f64 {
    let pairs = a.positions.iter().zip(&b.positions);
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// With both storages and every preconditioner, single precision throughout
/// leads to the cloth of double precision, to what the tolerances allow.
#[test]
fn single_precision_throughout() {
    let tolerance = ("tolerance", "1e-4");
    let double = run(&[("precision", "f64"), tolerance]);
    for (key, value) in [
        ("matrix", "dual"),
        ("matrix", "reassembled"),
        ("preconditioner", "none"),
        ("preconditioner", "diagonal"),
        ("preconditioner", "block-jacobi"),
        ("preconditioner", "incomplete-cholesky"),
        ("preconditioner", "chebyshev"),
        ("preconditioner", "multigrid"),
    ] {
        let single = run(&[("precision", "f32"), tolerance, (key, value)]);
        let apart = apart(&single, &double);
        println!("{key} = {value}: {apart:.2e} m");
        assert!(apart < 1e-5 && apart > 0.0, "{value}: {apart:e} m");
    }
}

/// A linear tolerance that single precision never reaches: solves stagnate, and
/// Newton's method goes on from what they give.
#[test]
fn stagnating_solves_are_survived() {
    let double = run(&[("precision", "f64"), ("tolerance", "1e-8")]);
    let single = run(&[("precision", "f32"), ("tolerance", "1e-10")]);
    let apart = apart(&single, &double);
    let [a, b] = [&double, &single].map(|r| &r.summary);
    println!(
        "{apart:.2e} m; linear iterations {} and {}",
        a.linear_iterations, b.linear_iterations
    );
    assert!(apart < 1e-6 && apart > 0.0, "{apart:e} m");
    // a stall would take the limit of 500 in every solve
    assert!(
        b.linear_iterations < 300 * b.newton_iterations,
        "{} in {}",
        b.linear_iterations,
        b.newton_iterations
    );
}
