//! Runs that end while a garment is sewn.

mod common;

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use common::TUBE;
use selvedge_scene::build::BuiltScene;
use selvedge_scene::driver::{self, Progress, RunOptions, RunResult, Silent, Tick};
use selvedge_scene::file;
use selvedge_scene::summary::Status;
use selvedge_scene::watchdog::{Dump, Trouble};

const SCENE: &str = r#"
name = "tube"
[simulation]
duration = 0.3
[mesh]
edge_length = 0.03
[output]
recording = false
report = false
[[cloth]]
kind = "pattern"
file = "tube.json"
[[body]]
kind = "capsule"
from = [0, -0.2, 0]
to = [0, 0.4, 0]
radius = 0.1
"#;

/// Raises the interrupt after some steps of the first stage.
struct StopSewing(Arc<AtomicBool>);

impl Progress for StopSewing {
    fn tick(&mut self, tick: &Tick<'_>) {
        if tick.steps >= 3 {
            self.0.store(true, Ordering::Relaxed);
        }
    }
    fn note(&mut self, _: &str) {}
}

/// Time spent on sewing is the stage's, not the drape's, and the reason says
/// where the run was stopped.
#[test]
fn stopped_while_sewing() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("tube.json"), TUBE).expect("a file");
    let path = folder.path().join("tube.toml");
    let parsed = file::parse(SCENE, &path, &[]).expect("a valid scene");
    let built = BuiltScene::new(parsed).expect("a scene that can be built");
    let options = RunOptions {
        directory: folder.path().join("out"),
        resume: false,
        scene_text: SCENE.to_owned(),
        version: "test".to_owned(),
    };
    let interrupt = Arc::new(AtomicBool::new(false));
    let mut stop = StopSewing(interrupt.clone());
    let result = driver::run(&built, &options, &mut stop, &interrupt).expect("a run");
    let s = &result.summary;
    assert_eq!(s.status, Status::Stopped);
    assert_eq!((s.simulated_s, s.steps), (0.0, 0));
    let last = s.assembly.last().expect("a stage");
    assert!(last.simulated_s > 0.0, "{last:?}");
    assert!(s.reason.contains(&last.name), "{}", s.reason);
    assert!(options.directory.join("final.obj").is_file());
}

/// Runs a scene with some keys changed.
fn run(text: &str, path: &Path, folder: &Path, set: &[(&str, &str)]) -> RunResult {
    let own = |(k, v): &(&str, &str)| ((*k).to_owned(), (*v).to_owned());
    let set: Vec<_> = set.iter().map(own).collect();
    let parsed = file::parse(text, path, &set).expect("a valid scene");
    let built = BuiltScene::new(parsed).expect("a scene that can be built");
    let options = RunOptions {
        directory: folder.to_owned(),
        resume: false,
        scene_text: text.to_owned(),
        version: "test".to_owned(),
    };
    driver::run(&built, &options, &mut Silent, &AtomicBool::new(false)).expect("a run")
}

/// Displacements of the start are felt by a garment, which begins from its
/// panels: the floor of repeatability would be zero otherwise.
#[test]
fn displaced_start_is_sewn() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("tube.json"), TUBE).expect("a file");
    let path = folder.path().join("tube.toml");
    let set = [
        ("assemble.seam_time", "0.02"),
        ("simulation.duration", "0.005"),
    ];
    let end = |seed: Option<u64>| {
        let set: Vec<_> = set.map(|(k, v)| (k.to_owned(), v.to_owned())).to_vec();
        let parsed = file::parse(SCENE, &path, &set).expect("a valid scene");
        let mut built = BuiltScene::new(parsed).expect("a scene that can be built");
        if let Some(seed) = seed {
            built.perturb(1e-9, seed);
        }
        let options = RunOptions {
            directory: folder.path().join("out"),
            resume: false,
            scene_text: SCENE.to_owned(),
            version: "test".to_owned(),
        };
        let never = AtomicBool::new(false);
        driver::run(&built, &options, &mut Silent, &never)
            .expect("a run")
            .positions
    };
    let largest = |a: &[f64], b: &[f64]| {
        let differences = a.iter().zip(b).map(|(a, b)| (a - b).abs());
        differences.fold(0.0, f64::max)
    };
    let (still, one) = (end(None), end(Some(1)));
    assert_eq!(one, end(Some(1)));
    for other in [&one, &end(Some(2))] {
        let d = largest(&still, other);
        assert!(d > 1e-12 && d < 1e-2, "{d}");
    }
    assert!(largest(&one, &end(Some(2))) > 1e-12);
}

/// The step of the drape does not decide where it begins.
#[test]
fn sewing_has_steps_of_its_own() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("tube.json"), TUBE).expect("a file");
    let path = folder.path().join("tube.toml");
    let sewn = |set: (&str, &str)| {
        let short = [
            ("assemble.seam_time", "0.02"),
            ("simulation.duration", "1e-3"),
        ];
        let set = [short[0], short[1], set];
        run(SCENE, &path, &folder.path().join("out"), &set)
            .summary
            .assembly
    };
    let own = sewn(("integrator.max_step", "1e-3"));
    let other = sewn(("integrator.max_step", "5e-4"));
    let finer = sewn(("assemble.max_step", "5e-4"));
    for ((a, b), c) in own.iter().zip(&other).zip(&finer).skip(1) {
        assert_eq!(a.steps, b.steps, "{}", a.name);
        assert_eq!(a.mean_abs_edge_strain, b.mean_abs_edge_strain, "{}", a.name);
        assert!(c.steps > a.steps, "{}: {} and {}", a.name, c.steps, a.steps);
    }
}

/// A stage of sewing that no step can solve ends with a finding that names the
/// stage, and with a step that fails again, and passes with a sane tolerance.
#[test]
fn sewing_is_watched() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("tube.json"), TUBE).expect("a file");
    let path = folder.path().join("tube.toml");
    let hopeless = [
        ("integrator.newton_tolerance", "1e-30"),
        ("integrator.newton_iterations", "1"),
        ("integrator.min_step", "1e-4"),
    ];
    let s = run(SCENE, &path, &folder.path().join("out"), &hopeless).summary;
    assert_eq!(s.status, Status::Failed, "{}", s.reason);
    assert!(s.reason.contains("close seams"), "{}", s.reason);
    let event = s.watchdog.last().expect("a finding");
    assert_eq!(event.stage, "close seams");
    assert_eq!(event.trouble, Trouble::Underflow);
    let dump = event.dump.as_ref().map(Path::new).expect("a dump");
    let whole = Dump::read(dump).expect("a dump");
    let again = whole.replay(dump, &[]).expect("a replay");
    assert!(!again.accepted, "{again:?}");
    let sane = [
        ("integrator.newton_tolerance".to_owned(), "1e-2".to_owned()),
        ("integrator.newton_iterations".to_owned(), "5".to_owned()),
    ];
    let mended = whole.replay(dump, &sane).expect("a replay");
    assert!(mended.accepted, "{mended:?}");
}

/// Final hashes of a scene with the watchdog on and off, and the findings.
fn hashes(text: &str, path: &Path, folder: &Path) -> ([String; 2], usize) {
    let on = run(text, path, &folder.join("on"), &[]).summary;
    let off = [("watchdog.enabled", "false")];
    let off = run(text, path, &folder.join("off"), &off).summary;
    assert_ne!(on.status, Status::Failed, "{}", on.reason);
    let hashes = [on.final_state_hash, off.final_state_hash];
    (hashes, on.watchdog.len())
}

/// Watching a healthy garment changes no bit of it.
#[test]
fn watching_a_garment_changes_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("tube.json"), TUBE).expect("a file");
    let (hashes, findings) = hashes(SCENE, &folder.path().join("tube.toml"), folder.path());
    assert_eq!((&hashes[0], findings), (&hashes[1], 0));
}

/// The same for the T-shirt on its mannequin, from the pattern to the end.
#[test]
#[ignore = "some minutes"]
fn watching_the_tshirt_changes_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/tshirt.toml");
    let text = std::fs::read_to_string(&path).expect("the scene");
    let (hashes, findings) = hashes(&text, &path, folder.path());
    assert_eq!((&hashes[0], findings), (&hashes[1], 0));
}
