//! Runs that end while a garment is sewn.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use selvedge_scene::build::BuiltScene;
use selvedge_scene::driver::{self, Progress, RunOptions, Tick};
use selvedge_scene::file;
use selvedge_scene::summary::Status;

/// Half a tube in front of a column and half behind it, sewn together.
const TUBE: &str = r#"{"pattern": {"panels": {
    "front": {"vertices": [[0, 0], [34, 0], [34, 20], [0, 20]],
        "edges": [{"endpoints": [0, 1]}, {"endpoints": [1, 2]},
                  {"endpoints": [2, 3]}, {"endpoints": [3, 0]}],
        "translation": [-17, 0, 14], "rotation": [0, 0, 0]},
    "back": {"vertices": [[0, 0], [34, 0], [34, 20], [0, 20]],
        "edges": [{"endpoints": [0, 1]}, {"endpoints": [1, 2]},
                  {"endpoints": [2, 3]}, {"endpoints": [3, 0]}],
        "translation": [17, 0, -14], "rotation": [0, 180, 0]}},
    "stitches": [[{"panel": "front", "edge": 3}, {"panel": "back", "edge": 1}],
                 [{"panel": "front", "edge": 1}, {"panel": "back", "edge": 3}]]},
    "properties": {"units_in_meter": 100}}"#;

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
