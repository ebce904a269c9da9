use std::path::Path;
use std::sync::atomic::AtomicBool;

use selvedge_integrator::Outcome;

use super::*;
use crate::driver::{self, RunOptions, RunResult, Silent};
use crate::file;
use crate::summary::Status;

const SCENE: &str = r#"
[[cloth]]
kind = "sheet"
size = [0.2, 0.2]
points = [9, 9]
fabric = "f"
[fabric.f]
density = 0.2
membrane = { form = "isotropic", stiffness = 1000.0, poisson = 0.3 }
bending = { form = "isotropic", rigidity = 1e-5 }
damping = { drag = 0.0, membrane = 0.0, bending = 0.0 }
[simulation]
duration = 0.02
[relaxation]
enabled = false
[stop]
early = false
[output]
report = false
recording = false
"#;

fn built(set: &[(&str, &str)]) -> BuiltScene {
    let set: Vec<_> = set
        .iter()
        .map(|(k, v)| ((*k).to_owned(), (*v).to_owned()))
        .collect();
    let parsed = file::parse(SCENE, Path::new("watched.toml"), &set).expect("a scene");
    BuiltScene::new(parsed).expect("a scene that can be built")
}

fn run(folder: &Path, set: &[(&str, &str)]) -> RunResult {
    let options = RunOptions {
        directory: folder.to_owned(),
        resume: false,
        scene_text: SCENE.to_owned(),
        version: "test".to_owned(),
    };
    driver::run(&built(set), &options, &mut Silent, &AtomicBool::new(false)).expect("a run")
}

/// A velocity of NaN ends the run in the same step, with the point in the
/// scene's order and a dump that replays to the same error.
#[test]
fn not_finite_is_named_and_replayed() {
    let folder = tempfile::tempdir().expect("a folder");
    let built = built(&[]);
    let state = built.geometry.start();
    let start = state.q.clone();
    let mut parts = built
        .simulation(state, &built.drape_stage())
        .expect("a simulation");
    let simulation = &mut parts.simulation;
    simulation.state_mut().v[3 * 30] = f64::NAN;
    let mut dog = Watchdog::new(built.scene()).expect("a watchdog");
    let scope = Scope {
        built: &built,
        directory: folder.path(),
        start: &start,
        version: "test",
        stage: Stage::drape(),
    };
    dog.begin(simulation);
    let Ok(Outcome::Rejected { dt, reason }) = simulation.advance() else {
        panic!("a step from NaN")
    };
    let Verdict::Stop(text) = dog.rejected(simulation, dt, &reason, &scope) else {
        panic!("the run goes on")
    };
    assert!(text.contains("not finite"), "{text}");
    let event = dog.events.last().expect("a finding");
    assert_eq!(event.trouble, Trouble::NotFinite);
    assert_eq!(event.points, [built.geometry.order.old_of_new[30]]);
    let path = folder.path().join(DUMP);
    let replay = Dump::read(&path)
        .expect("a dump")
        .replay(&path, &[])
        .expect("a replay");
    assert!(
        !replay.accepted && replay.outcome.contains("not finite"),
        "{replay:?}"
    );
}

/// Steps that are accepted without being solved give crumpled cloth energy:
/// that is found, taken back and mended; noted only, it stays.
#[test]
fn injected_energy_is_taken_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let bad = [
        ("cloth.0.noise", "4e-3"),
        ("integrator.newton_tolerance", "1e6"),
        ("integrator.newton_iterations", "1"),
        ("integrator.curvature", "exact"),
        ("solver.tolerance", "0.5"),
        ("simulation.gravity", "[0, 0, 0]"),
    ];
    let mut noted = bad.to_vec();
    noted.push(("watchdog.answer", "note"));
    let noted = run(folder.path(), &noted).summary;
    let found = noted
        .watchdog
        .iter()
        .filter(|e| e.trouble == Trouble::Energy)
        .count();
    assert!(found > 0, "{noted:?}");
    assert!(noted.watchdog.iter().all(|e| e.answer == Answer::Noted));
    let event = &noted.watchdog[0];
    assert!(event.term.is_some() && event.at.is_some() && !event.points.is_empty());
    let mended = run(folder.path(), &bad).summary;
    let answered = mended
        .watchdog
        .iter()
        .any(|e| e.answer == Answer::TighterTolerance);
    assert!(answered, "{:?}", mended.watchdog);
    // The same scene without a guard is the same as with one that only notes.
    let mut off = bad.to_vec();
    off.push(("watchdog.enabled", "false"));
    let off = run(folder.path(), &off).summary;
    assert_eq!(off.final_state_hash, noted.final_state_hash);
    assert!(off.watchdog.is_empty() && !off.stages.contains_key("watchdog"));
}

/// A scene that no step solves climbs the ladder and ends with a dump; the
/// findings say which rung, and the list is capped.
#[test]
fn a_stall_climbs_the_ladder() {
    let folder = tempfile::tempdir().expect("a folder");
    let set = [
        ("cloth.0.noise", "1e-3"),
        ("integrator.newton_tolerance", "1e-30"),
        ("integrator.newton_iterations", "1"),
        ("integrator.min_step", "1e-5"),
        ("watchdog.rejections", "3"),
    ];
    let s = run(folder.path(), &set).summary;
    assert_eq!(s.status, Status::Failed);
    let answers: Vec<Answer> = s.watchdog.iter().map(|e| e.answer).collect();
    let ladder = [
        Answer::TighterTolerance,
        Answer::ProjectedCurvature,
        Answer::SmallerStep,
    ];
    assert_eq!(answers[..3], ladder);
    assert_eq!(answers.last(), Some(&Answer::Stopped));
    assert!(
        s.reason.contains("point") && s.reason.contains(DUMP),
        "{}",
        s.reason
    );
    let mut capped = set.to_vec();
    capped.push(("watchdog.most_events", "1"));
    let s = run(folder.path(), &capped).summary;
    assert!(
        s.watchdog.len() <= 2 && s.watchdog_unlisted > 0,
        "{:?}",
        s.watchdog
    );
    assert_eq!(s.watchdog.last().map(|e| e.answer), Some(Answer::Stopped));
}

/// Pins and bodies that move do work: nothing is found in a sheet that is
/// carried, swung and pushed.
#[test]
fn work_from_outside_is_no_injection() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = format!(
        "{SCENE}\n[[pin]]\nselect = {{ edge = \"left\" }}\nmotion = [{{ time = 0 }}, {{ time = \
         0.1, translation = [0, 0.3, 0.2] }}]\n[[body]]\nkind = \"sphere\"\ncenter = [0.05, -0.06, \
         0]\nradius = 0.05\nmotion = [{{ time = 0 }}, {{ time = 0.1, translation = [0, 0.2, 0] \
         }}]\n[[attachment]]\nselect = {{ corner = \"top-right\" }}\nstiffness = 50.0\nmotion = \
         [{{ time = 0 }}, {{ time = 0.1, translation = [0.1, 0.1, 0] }}]\n"
    );
    let set = [("simulation.duration".to_owned(), "0.12".to_owned())];
    let parsed = file::parse(&text, Path::new("watched.toml"), &set).expect("a scene");
    let built = BuiltScene::new(parsed).expect("a scene that can be built");
    let options = RunOptions {
        directory: folder.path().to_owned(),
        resume: false,
        scene_text: text,
        version: "test".to_owned(),
    };
    let never = AtomicBool::new(false);
    let s = driver::run(&built, &options, &mut Silent, &never)
        .expect("a run")
        .summary;
    assert_eq!(s.status, Status::Finished, "{}", s.reason);
    assert!(s.watchdog.is_empty(), "{:#?}", s.watchdog);
    // Most of what it has was given to it.
    assert!(s.kinetic_energy_j > 0.0);
}

/// Dumps that are damaged are refused with the reason.
#[test]
fn damaged_dumps_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let set = [
        ("cloth.0.noise", "1e-3"),
        ("integrator.newton_tolerance", "1e-30"),
        ("integrator.newton_iterations", "1"),
        ("integrator.min_step", "1e-4"),
    ];
    run(folder.path(), &set);
    let path = folder.path().join(DUMP);
    assert!(Dump::is_at(&path));
    let text = std::fs::read_to_string(&path).expect("a dump");
    let whole = Dump::read(&path).expect("a dump");
    assert!(whole.replay(&path, &[]).is_ok());
    let mut cut = whole.clone();
    cut.sections.truncate(3);
    assert!(cut.replay(&path, &[]).is_err());
    let mut odd = whole.clone();
    odd.sections[4].1.truncate(17);
    assert!(odd.replay(&path, &[]).is_err());
    let mut other = whole.clone();
    other
        .scene
        .overrides
        .push(("cloth.0.points".into(), "[5, 5]".into()));
    assert!(other.replay(&path, &[]).is_err());
    for bad in [
        "{}",
        "{\"format\": \"selvedge-step\"}",
        &text[..text.len() / 2],
        "",
    ] {
        std::fs::write(&path, bad).expect("a file");
        assert!(Dump::read(&path).is_err());
    }
    assert!(!Dump::is_at(folder.path()));
    assert!(!Dump::is_at(&folder.path().join("nowhere")));
}
