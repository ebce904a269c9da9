//! From the text of a scene to its results.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use selvedge_record::Recording;
use selvedge_scene::build::BuiltScene;
use selvedge_scene::driver::{self, Progress, RunOptions, RunResult, Silent, Tick};
use selvedge_scene::file;
use selvedge_scene::summary::Status;

const SCENE: &str = r#"
name = "handkerchief"

[simulation]
duration = 0.2

[[cloth]]
kind = "sheet"
size = [0.2, 0.2]
points = [12, 12]
center = [0.0, 0.104, 0.0]
fabric = "cotton-poplin"

[[body]]
kind = "sphere"
radius = 0.1

[relaxation]
duration = 0.02

[output]
frame_rate = 100
report = false
"#;

fn built() -> BuiltScene {
    let parsed = file::parse(SCENE, Path::new("handkerchief.toml"), &[]).expect("a valid scene");
    BuiltScene::new(parsed).expect("a scene that can be built")
}

/// An interrupt that nobody raised.
fn never() -> Arc<AtomicBool> {
    Arc::new(AtomicBool::new(false))
}

fn options(directory: &Path, resume: bool) -> RunOptions {
    RunOptions {
        directory: directory.to_owned(),
        resume,
        scene_text: SCENE.to_owned(),
        version: "test".to_owned(),
    }
}

fn run(directory: &Path) -> RunResult {
    driver::run(&built(), &options(directory, false), &mut Silent, &never()).expect("a run")
}

/// Loose linear solves early in Newton's iteration take fewer of their
/// iterations and lead to the same cloth, to what the tolerance allows.
#[test]
fn eisenstat_walker() {
    let run = |forcing: &str| {
        let folder = tempfile::tempdir().expect("a folder");
        let set = [
            ("solver.forcing", forcing),
            ("solver.tolerance", "1e-4"),
            ("integrator.newton_tolerance", "1e-4"),
        ];
        let set = set.map(|(k, v)| (k.to_owned(), v.to_owned()));
        let parsed = file::parse(SCENE, Path::new("handkerchief.toml"), &set).expect("valid");
        let built = BuiltScene::new(parsed).expect("a scene that can be built");
        driver::run(
            &built,
            &options(folder.path(), false),
            &mut Silent,
            &never(),
        )
        .expect("a run")
    };
    let (constant, forced) = (run("constant"), run("eisenstat-walker"));
    let (a, b) = (&constant.summary, &forced.summary);
    println!(
        "{} and {} linear iterations",
        a.linear_iterations, b.linear_iterations
    );
    assert!(b.linear_iterations < a.linear_iterations);
    let distance = |(a, b): (&f64, &f64)| (a - b).abs();
    let pairs = constant.positions.iter().zip(&forced.positions);
    let largest = pairs.map(distance).fold(0.0, f64::max);
    println!("{largest:.2e} m apart");
    assert!(largest < 1e-3 && largest > 0.0);
}

fn summary(directory: &Path) -> serde_json::Value {
    let text = std::fs::read_to_string(directory.join("summary.json")).expect("summary.json");
    serde_json::from_str(&text).expect("JSON")
}

/// Raises the interrupt after some steps.
struct StopAfter {
    steps: u64,
    interrupt: Arc<AtomicBool>,
}

impl Progress for StopAfter {
    fn tick(&mut self, tick: &Tick<'_>) {
        if tick.steps >= self.steps {
            self.interrupt.store(true, Ordering::Relaxed);
        }
    }
    fn note(&mut self, _: &str) {}
}

/// A run leaves a summary with every promised key, a mesh and a recording that
/// can be read and agree with each other; the same scene run again ends with
/// the same hash.
#[test]
fn a_run_leaves_its_results() {
    let folder = tempfile::tempdir().expect("a folder");
    let result = run(folder.path());
    assert_eq!(
        result.summary.status,
        Status::Finished,
        "{}",
        result.summary.reason
    );

    let summary = summary(folder.path());
    for key in [
        "schema",
        "status",
        "reason",
        "simulated_s",
        "wall_s",
        "cpu_s",
        "threads",
        "steps",
        "rejected_steps",
        "newton_iterations",
        "linear_iterations",
        "points",
        "scalars",
        "triangles",
        "peak_memory_bytes",
        "simulation_bytes",
        "max_penetration_m",
        "self_intersections",
        "max_abs_edge_strain",
        "mean_abs_edge_strain",
        "max_seam_gap_m",
        "kinetic_energy_j",
        "residual",
        "error_estimate",
        "stages",
        "assembly",
        "effects",
        "settings",
        "version",
        "final_state_hash",
        "warnings",
    ] {
        assert!(summary.get(key).is_some(), "summary.json has no `{key}`");
    }
    assert_eq!(summary["schema"], 1);
    assert_eq!(summary["status"], "finished");
    assert_eq!(summary["final_state_hash"], result.summary.final_state_hash);
    assert!((summary["simulated_s"].as_f64().expect("a number") - 0.2).abs() < 1e-9);
    assert_eq!(summary["self_intersections"], 0);

    let text = std::fs::read_to_string(folder.path().join("final.obj")).expect("final.obj");
    let vertices: Vec<f64> = text
        .lines()
        .filter_map(|l| l.strip_prefix("v "))
        .flat_map(|l| l.split_whitespace().map(|x| x.parse().expect("a number")))
        .collect();
    assert_eq!(vertices.len(), result.positions.len());
    for (a, b) in vertices.iter().zip(&result.positions) {
        assert!((a - b).abs() < 1e-6, "{a} {b}");
    }
    let faces = text.lines().filter(|l| l.starts_with("f ")).count();
    assert_eq!(Some(faces as u64), summary["triangles"].as_u64());

    let recording = Recording::open(&folder.path().join("run.mcap")).expect("run.mcap");
    assert!(recording.is_complete() && recording.warnings().is_empty());
    assert_eq!(recording.header().scene_text, SCENE);
    assert_eq!(recording.frames().len(), 21);
    let last = recording
        .frame(recording.frames().len() - 1)
        .expect("the last frame");
    assert_eq!(last.positions, result.positions);
    assert!((last.time - 0.2).abs() < 1e-9);
    let outcome = recording.outcome().expect("an outcome");
    assert_eq!(outcome["final_state_hash"], result.summary.final_state_hash);
    let accepted = recording
        .diagnostics()
        .iter()
        .filter(|d| d.accepted)
        .count();
    assert_eq!(accepted as u64, result.summary.steps);

    let again = tempfile::tempdir().expect("a folder");
    let second = run(again.path());
    assert_eq!(
        second.summary.final_state_hash,
        result.summary.final_state_hash
    );
}

/// An interrupted run is `stopped` and can be resumed, twice over; in the end
/// it has the hash of the run that nobody interrupted.
#[test]
fn interrupted_and_resumed() {
    let whole = tempfile::tempdir().expect("a folder");
    let expected = run(whole.path()).summary;

    let folder = tempfile::tempdir().expect("a folder");
    let built = built();
    for (steps, resume) in [(60, false), (130, true)] {
        let interrupt = never();
        let mut stop = StopAfter {
            steps,
            interrupt: interrupt.clone(),
        };
        let options = options(folder.path(), resume);
        let stopped = driver::run(&built, &options, &mut stop, &interrupt).expect("a run");
        assert_eq!(stopped.summary.status, Status::Stopped);
        assert_eq!(stopped.summary.steps, steps);
        assert_eq!(summary(folder.path())["status"], "stopped");
        assert!(
            !folder.path().join("run.mcap").exists(),
            "a stopped run is not complete"
        );
    }
    let options = options(folder.path(), true);
    let resumed = driver::run(&built, &options, &mut Silent, &never())
        .expect("a run")
        .summary;
    assert_eq!(resumed.status, Status::Finished, "{}", resumed.reason);
    assert_eq!(resumed.steps, expected.steps);
    assert_eq!(resumed.newton_iterations, expected.newton_iterations);
    assert_eq!(resumed.final_state_hash, expected.final_state_hash);
    let recording = Recording::open(&folder.path().join("run.mcap")).expect("run.mcap");
    let plain = Recording::open(&whole.path().join("run.mcap")).expect("run.mcap");
    let times = |r: &Recording| r.frames().iter().map(|f| f.step).collect::<Vec<_>>();
    let mut all = times(&recording);
    // A frame was recorded wherever the run was cut.
    all.retain(|s| times(&plain).contains(s));
    assert_eq!(all, times(&plain));
}
