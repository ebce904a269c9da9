//! Garments that are sewn on a coarser mesh first.

mod common;

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use common::TUBE;
use selvedge_scene::build::BuiltScene;
use selvedge_scene::driver::{self, Progress, RunOptions, RunResult, Silent, Tick};
use selvedge_scene::file;
use selvedge_scene::summary::Status;

const SCENE: &str = r#"
name = "tube"
[simulation]
duration = 0.1
gravity = [0, 0, -2]
[mesh]
edge_length = 0.03
[assemble]
coarsest = 0.06
seam_time = 0.1
settle_time = 0.1
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

struct Bench {
    folder: tempfile::TempDir,
}

impl Bench {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("tube.json"), TUBE).expect("a file");
        Self { folder }
    }

    fn path(&self) -> &Path {
        self.folder.path()
    }

    fn built(&self, text: &str, set: &[(&str, &str)]) -> BuiltScene {
        let own = |(k, v): &(&str, &str)| ((*k).to_owned(), (*v).to_owned());
        let set: Vec<_> = set.iter().map(own).collect();
        let path = self.path().join("tube.toml");
        let parsed = file::parse(text, &path, &set).expect("a valid scene");
        BuiltScene::new(parsed).expect("a scene that can be built")
    }

    fn options(&self, name: &str, resume: bool) -> RunOptions {
        RunOptions {
            directory: self.path().join(name),
            resume,
            scene_text: SCENE.to_owned(),
            version: "test".to_owned(),
        }
    }

    fn run(&self, built: &BuiltScene, name: &str) -> RunResult {
        let never = AtomicBool::new(false);
        driver::run(built, &self.options(name, false), &mut Silent, &never).expect("a run")
    }
}

fn stages(result: &RunResult) -> Vec<&str> {
    let all = &result.summary.assembly;
    all.iter().map(|s| s.name.as_str()).collect()
}

/// The fine drape begins at the end of the coarse one: its seams are closed,
/// its edges unstretched and it has not moved, which a drape that is sewn on
/// its own mesh has before its first step as little as a coarse one.
#[test]
fn finer_begins_where_coarser_rests() {
    let bench = Bench::new();
    let two = bench.run(&bench.built(SCENE, &[("mesh.edge_length", "0.015")]), "two");
    assert_eq!(
        stages(&two),
        [
            "wrap, 60 mm",
            "close seams, 60 mm",
            "untangle, 60 mm",
            "drape, 60 mm",
            "carry over, 30 mm",
            "drape, 30 mm",
            "carry over"
        ]
    );
    let stages = &two.summary.assembly;
    let (coarse, carried) = (&stages[5], &stages[6]);
    assert_eq!(carried.self_intersections, 0);
    assert!(coarse.steps > 0 && coarse.simulated_s > 0.0, "{coarse:?}");
    // Long edges cut the corner of the column, by 1/6 (h/2r)² of their length;
    // what is pushed out of it is as much longer.
    assert!(coarse.mean_abs_edge_strain < 1e-3, "{coarse:?}");
    let corner = (0.03_f64 / 0.2).powi(2) / 6.0;
    assert!(carried.mean_abs_edge_strain < corner, "{carried:?}");
    assert_ne!(two.summary.status, Status::Failed);
    // Stages without work end where they begin: what is carried is the drape.
    let still = [
        ("simulation.duration", "1e-5"),
        ("integrator.max_step", "1e-5"),
        ("integrator.min_step", "1e-6"),
    ];
    let built = bench.built(SCENE, &still);
    let carried = bench.run(&built, "carried").positions;
    let coarse_text = SCENE.replace("edge_length = 0.03", "edge_length = 0.06");
    let coarse = bench.built(&coarse_text, &still);
    let rest = bench.run(&coarse, "rest").positions;
    let below = |x: &[f64]| x.chunks(3).map(|p| p[1]).fold(f64::INFINITY, f64::min);
    let wide = |x: &[f64]| x.chunks(3).map(|p| p[0].hypot(p[2])).fold(0.0, f64::max);
    assert!((below(&carried) - below(&rest)).abs() < 1e-3);
    assert!((wide(&carried) - wide(&rest)).abs() < 5e-3);
}

/// Interrupts the drape on the scene's own mesh, or on a coarser one.
struct Stop {
    raised: Arc<AtomicBool>,
    stage: &'static str,
    steps: u64,
    own_mesh: bool,
    carried: bool,
}

impl Progress for Stop {
    fn tick(&mut self, tick: &Tick<'_>) {
        let here = self.carried == self.own_mesh && tick.stage == self.stage;
        if here && tick.steps >= self.steps {
            self.raised.store(true, Ordering::Relaxed);
        }
    }
    fn note(&mut self, text: &str) {
        self.carried |= text.starts_with("assembly: carried");
    }
}

/// A run that is interrupted after the change of meshes goes on bit for bit,
/// without softening the fabric again.
#[test]
fn resumes_bit_for_bit() {
    let bench = Bench::new();
    let built = bench.built(SCENE, &[("output.recording", "true")]);
    let whole = bench.run(&built, "whole").summary;
    let raised = Arc::new(AtomicBool::new(false));
    let mut stop = Stop {
        raised: raised.clone(),
        stage: "drape",
        steps: 20,
        own_mesh: true,
        carried: false,
    };
    let cut = driver::run(&built, &bench.options("cut", false), &mut stop, &raised);
    let cut = cut.expect("a run").summary;
    assert_eq!(cut.status, Status::Stopped);
    assert!(cut.simulated_s > 0.0);
    let never = AtomicBool::new(false);
    let rest = driver::run(&built, &bench.options("cut", true), &mut Silent, &never);
    let rest = rest.expect("a run").summary;
    assert_eq!(rest.final_state_hash, whole.final_state_hash);
}

/// A run that is interrupted on a coarser mesh says so.
#[test]
fn interrupted_on_the_coarser_mesh() {
    let bench = Bench::new();
    let built = bench.built(SCENE, &[]);
    let raised = Arc::new(AtomicBool::new(false));
    let mut stop = Stop {
        raised: raised.clone(),
        stage: "drape",
        steps: 2,
        own_mesh: false,
        carried: false,
    };
    let cut = driver::run(&built, &bench.options("cut", false), &mut stop, &raised);
    let cut = cut.expect("a run").summary;
    assert_eq!(cut.status, Status::Stopped);
    assert_eq!((cut.steps, cut.simulated_s), (0, 0.0));
    assert!(cut.reason.contains("60 mm"), "{}", cut.reason);
}

/// What moves has no rest to begin from, and 0 sews on the mesh itself.
#[test]
fn only_where_it_applies() {
    let bench = Bench::new();
    let short = ("simulation.duration", "1e-3");
    let alone = bench.run(
        &bench.built(SCENE, &[short, ("assemble.coarsest", "0")]),
        "alone",
    );
    assert_eq!(stages(&alone), ["wrap", "close seams", "untangle"]);
    let motion = "[[body.motion]]\ntime = 0\n[[body.motion]]\ntime = 1\n\
                  translation = [0, 0.1, 0]\n";
    let moving = format!("{SCENE}{motion}");
    let moving = bench.run(&bench.built(&moving, &[short]), "moving");
    assert_eq!(stages(&moving), stages(&alone));
    assert_eq!(moving.positions.len(), alone.positions.len());
}
