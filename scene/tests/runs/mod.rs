//! Whole runs, and runs that are stopped.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use selvedge_scene::build::BuiltScene;
use selvedge_scene::driver::{self, Progress, RunOptions, RunResult, Silent, Tick};

/// Of a run into a folder, which may go on from what is there.
pub fn options(text: &str, directory: &Path, resume: bool) -> RunOptions {
    RunOptions {
        directory: directory.to_owned(),
        resume,
        scene_text: text.to_owned(),
        version: "test".to_owned(),
    }
}

/// A run that nobody interrupts.
pub fn uninterrupted(built: &BuiltScene, options: &RunOptions) -> RunResult {
    let never = AtomicBool::new(false);
    driver::run(built, options, &mut Silent, &never).expect("a run")
}

/// Raises the interrupt at a step.
pub struct StopAt(pub Arc<AtomicBool>, pub u64);

impl Progress for StopAt {
    fn tick(&mut self, tick: &Tick<'_>) {
        if tick.steps == self.1 {
            self.0.store(true, Ordering::Relaxed);
        }
    }
    fn note(&mut self, _: &str) {}
}
