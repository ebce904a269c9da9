//! The driver: interruptions, folders that vanish, the watchdog: ours.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use selvedge_scene::build::BuiltScene;
use selvedge_scene::driver::{self, Progress, RunOptions, RunResult, Silent, Tick};
use selvedge_scene::summary::Status;
use selvedge_scene::watchdog::{DUMP, Dump};

use super::scenes::{BALL, BARE, DAMPED, SHEET, scene};
use crate::case::{ALONE, Case, Expected, Figures, Pace, at_least, equal};
use crate::{Bench, HardError};

pub static CASES: [Case; 4] = [
    Case {
        number: 67,
        name: "ctrl-c",
        setup: "a run is interrupted twice and resumed, against one that was not",
        naive: "what was computed is lost, or goes on differently",
        bounds: &[
            equal("stopped in order", "1", 2.0),
            equal("same final hash", "1", 1.0),
        ],
        pace: Pace::Quick,
        axes: ALONE,
        expected: Expected::Passes,
        run: interrupted,
    },
    Case {
        number: 68,
        name: "vanishing-folder",
        setup: "the folder of the results is removed while the run goes on",
        naive: "a panic, or success without results",
        bounds: &[equal("error that names the folder, or results", "1", 1.0)],
        pace: Pace::Quick,
        axes: ALONE,
        expected: Expected::Passes,
        run: vanishing,
    },
    Case {
        number: 69,
        name: "watchdog-dump",
        setup: "a scene that no step size can solve: a tolerance of 1e-30 with one iteration",
        naive: "a bare abort: nobody can look at the step again",
        bounds: &[
            equal("failed with a finding and a dump", "1", 1.0),
            equal("replayed step fails again", "1", 1.0),
            equal("replayed with a sane tolerance it passes", "1", 1.0),
        ],
        pace: Pace::Quick,
        axes: ALONE,
        expected: Expected::Passes,
        run: dump,
    },
    Case {
        number: 70,
        name: "watchdog-is-silent",
        setup: "a healthy drape with the watchdog on and off",
        naive: "guarding changes the result",
        bounds: &[
            equal("same final hash", "1", 1.0),
            equal("findings", "1", 0.0),
            at_least("steps", "1", 100.0),
        ],
        pace: Pace::Quick,
        axes: ALONE,
        expected: Expected::Passes,
        run: silent,
    },
];

pub(super) fn options(b: &Bench, folder: &str) -> RunOptions {
    RunOptions {
        directory: b.folder().join(folder),
        resume: false,
        scene_text: String::new(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
    }
}

pub(super) fn run(built: &BuiltScene, options: &RunOptions) -> Result<RunResult, HardError> {
    let never = AtomicBool::new(false);
    Ok(driver::run(built, options, &mut Silent, &never)?)
}

/// Does something after a number of steps.
struct After<F: FnMut()> {
    steps: u64,
    act: F,
}

impl<F: FnMut()> Progress for After<F> {
    fn tick(&mut self, tick: &Tick<'_>) {
        if tick.steps == self.steps {
            (self.act)();
        }
    }
    fn note(&mut self, _: &str) {}
}

fn drape(b: &Bench, set: &[(&str, &str)]) -> Result<BuiltScene, HardError> {
    let mut all = vec![("simulation.duration", "0.12")];
    all.extend_from_slice(set);
    b.built(&scene(&[BARE, DAMPED, SHEET, BALL]), &all)
}

fn interrupted(b: &Bench) -> Result<Figures, HardError> {
    let built = drape(b, &[])?;
    let whole = run(&built, &options(b, "whole"))?;
    let mut stopped = 0;
    for (steps, resume) in [(30, false), (70, true)] {
        let flag = Arc::new(AtomicBool::new(false));
        let raise = flag.clone();
        let mut progress = After {
            steps,
            act: move || raise.store(true, Ordering::Relaxed),
        };
        let options = RunOptions {
            resume,
            ..options(b, "cut")
        };
        let result = driver::run(&built, &options, &mut progress, &flag)?;
        stopped += i32::from(result.summary.status == Status::Stopped);
    }
    let options = RunOptions {
        resume: true,
        ..options(b, "cut")
    };
    let resumed = run(&built, &options)?;
    let same = resumed.summary.final_state_hash == whole.summary.final_state_hash;
    Ok(vec![
        ("stopped in order", f64::from(stopped)),
        ("same final hash", f64::from(u8::from(same))),
    ])
}

fn vanishing(b: &Bench) -> Result<Figures, HardError> {
    let built = drape(b, &[])?;
    let options = options(b, "gone");
    let folder = options.directory.clone();
    let mut progress = After {
        steps: 40,
        act: move || {
            let _ = std::fs::remove_dir_all(&folder);
        },
    };
    let never = AtomicBool::new(false);
    let good = match driver::run(&built, &options, &mut progress, &never) {
        Ok(_) => options.directory.join("summary.json").is_file(),
        Err(e) => e.to_string().contains("gone"),
    };
    Ok(vec![(
        "error that names the folder, or results",
        f64::from(u8::from(good)),
    )])
}

fn dump(b: &Bench) -> Result<Figures, HardError> {
    let built = drape(
        b,
        &[
            ("integrator.newton_tolerance", "1e-30"),
            ("integrator.newton_iterations", "1"),
            ("integrator.min_step", "1e-5"),
            ("watchdog.rejections", "4"),
            ("cloth.0.noise", "1e-3"),
        ],
    )?;
    let options = options(b, "dump");
    let result = run(&built, &options)?;
    let path = options.directory.join(DUMP);
    let failed = result.summary.status == Status::Failed
        && result
            .summary
            .watchdog
            .last()
            .is_some_and(|e| e.dump.is_some() && e.term.is_some())
        && path.is_file();
    if !failed {
        return Ok(vec![("failed with a finding and a dump", 0.0)]);
    }
    let read = |e: selvedge_scene::watchdog::ReplayError| std::io::Error::other(e.to_string());
    let dump = Dump::read(&path).map_err(read)?;
    let again = dump.replay(&path, &[]).map_err(read)?;
    let set = [
        ("integrator.newton_tolerance", "1e-2"),
        ("integrator.newton_iterations", "5"),
    ];
    let set = set.map(|(k, v)| (k.to_owned(), v.to_owned()));
    let mended = dump.replay(&path, &set).map_err(read)?;
    Ok(vec![
        ("failed with a finding and a dump", 1.0),
        (
            "replayed step fails again",
            f64::from(u8::from(!again.accepted)),
        ),
        (
            "replayed with a sane tolerance it passes",
            f64::from(u8::from(mended.accepted)),
        ),
    ])
}

fn silent(b: &Bench) -> Result<Figures, HardError> {
    let on = run(
        &drape(b, &[("watchdog.enabled", "true")])?,
        &options(b, "on"),
    )?;
    let off = run(
        &drape(b, &[("watchdog.enabled", "false")])?,
        &options(b, "off"),
    )?;
    let same = on.summary.final_state_hash == off.summary.final_state_hash;
    Ok(vec![
        ("same final hash", f64::from(u8::from(same))),
        ("findings", on.summary.watchdog.len() as f64),
        ("steps", on.summary.steps as f64),
    ])
}
