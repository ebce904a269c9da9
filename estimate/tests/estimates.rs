//! Estimates against references, and what cannot be estimated.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use selvedge_estimate::{
    EstimateError, MaterialMap, Session, Surface, Target, Within, coarser, drape_within, estimate,
    scaled_step, scaled_tolerance, total,
};
use selvedge_scene::driver::{Progress, Silent, Tick};
use selvedge_scene::file::{self, Parsed};
use selvedge_scene::summary::ErrorPart;

/// A strip that is let go from the horizontal, clamped at one end.
const STRIP: &str = r#"
name = "strip"
simulation.duration = 0.1
integrator.max_step = 4e-3
relaxation.enabled = false
stop.early = false
contact.self = false
[[cloth]]
name = "strip"
kind = "sheet"
size = [0.12, 0.03]
points = [25, 7]
fabric = "stiff"
[[pin]]
cloth = "strip"
select = { box = { min = [-0.07, -1.0, -1.0], max = [-0.0399, 1.0, 1.0] } }
[fabric.stiff]
density = 0.2
membrane = { form = "isotropic", stiffness = 1000.0, poisson = 0.0 }
bending = { form = "isotropic", rigidity = 2e-4 }
"#;

fn parsed(text: &str) -> Parsed {
    file::parse(text, Path::new("strip.toml"), &[]).expect("a valid scene")
}

/// Runs `work` in a session of its own.
fn session<R>(parsed: &Parsed, work: impl FnOnce(&mut Session<'_>) -> R) -> R {
    let folder = tempfile::tempdir().expect("a folder");
    let never = AtomicBool::new(false);
    work(&mut Session {
        parsed,
        scene_text: "",
        version: "test",
        directory: folder.path().to_owned(),
        progress: &mut Silent,
        interrupt: &never,
        resume: false,
        cpu_s: 0.0,
    })
}

fn surface(within: &Within) -> Surface<'_> {
    let g = &within.built.geometry;
    Surface {
        triangles: &g.scene_triangles,
        material: &g.scene_material,
        panel: &g.scene_panel,
        positions: &within.result.positions,
    }
}

/// The distance to a much finer run lies within a factor of three of what the
/// estimate says without it.
#[test]
fn estimates_are_of_the_right_size() {
    let parsed = parsed(STRIP);
    session(&parsed, |session| {
        let run = session
            .run("run", None, parsed.scene.clone(), false)
            .unwrap();
        let report = estimate(session, &run.built, run.result.as_ref().unwrap()).unwrap();
        let told = total(&report).unwrap();
        let fine = coarser(&parsed.scene, 0.5).unwrap();
        let fine = scaled_tolerance(&scaled_step(&fine, 0.125), 0.1);
        let fine = session.run("fine", None, fine, false).unwrap();
        let error = MaterialMap::new(fine.surface())
            .unwrap()
            .distance(&run.surface());
        println!("estimate {told:.3e} m, error {:.3e} m", error.mean);
        assert!(
            told < 3.0 * error.mean && 3.0 * told > error.mean,
            "{report:#?}"
        );
        assert!(report.cpu_s > 0.0);
        // Nothing here has two ways to go.
        assert!(report.path.error_m.is_some_and(|e| e > 0.0 && e < 1e-5));
    });
}

/// A strip that stands upright on its clamp: in balance, and by the mesh, the
/// steps and the tolerances exact, but anything tips it to one side.
#[test]
fn ends_that_chance_decides_are_not_promised() {
    let upright = STRIP
        .replace("duration = 0.1", "duration = 1.4")
        .replace(
            "points = [25, 7]",
            "points = [13, 4]\nrotation = [0.0, 0.0, 90.0]",
        )
        .replace(
            "min = [-0.07, -1.0, -1.0], max = [-0.0399, 1.0, 1.0]",
            "min = [-1.0, -0.07, -1.0], max = [1.0, -0.0399, 1.0]",
        )
        // A fifth of the rigidity that would stand, ρ g L³ / 7.84.
        .replace("rigidity = 2e-4", "rigidity = 5e-5");
    let parsed = parsed(&upright);
    session(&parsed, |session| {
        let target = Target {
            error: 1e-3,
            max_points: 300,
        };
        let within = drape_within(session, &parsed.scene, target).unwrap();
        let report = &within.report;
        let part = |p: &ErrorPart| p.error_m.unwrap();
        let rest = part(&report.space) + part(&report.time) + part(&report.algebraic);
        println!("path {:.3e} m, the rest {rest:.3e} m", part(&report.path));
        assert!(rest < target.error, "{report:#?}");
        assert!(part(&report.path) > target.error, "{report:#?}");
        assert!(!within.met);
    });
}

/// A wanted error is met, by the estimate and by a reference.
#[test]
fn wanted_errors_are_met() {
    let parsed = parsed(STRIP);
    session(&parsed, |session| {
        let target = Target {
            error: 2e-3,
            max_points: 2000,
        };
        let within = drape_within(session, &parsed.scene, target).unwrap();
        assert!(within.met, "{:#?}", within.report);
        let settings: Vec<&str> = within
            .report
            .decisions
            .iter()
            .map(|d| d.setting.as_str())
            .collect();
        let expected = [
            "solver.forcing",
            "integrator.max_step",
            "integrator.newton_tolerance",
            "solver.tolerance",
            "mesh.edge_length",
        ];
        assert_eq!(settings, expected);
        let chosen = within.built.scene().clone();
        let fine = coarser(&chosen, 0.5).unwrap();
        let fine = scaled_tolerance(&scaled_step(&fine, 0.25), 0.1);
        let fine = session.run("fine", None, fine, false).unwrap();
        let error = MaterialMap::new(fine.surface())
            .unwrap()
            .distance(&surface(&within));
        println!("asked for 2 mm, got {:.3} mm", 1e3 * error.mean);
        assert!(error.mean < target.error);

        // More than the points allowed can give: the best there is, not met.
        let target = Target {
            error: 1e-6,
            max_points: 100,
        };
        let within = drape_within(session, &parsed.scene, target).unwrap();
        assert!(!within.met && within.result.summary.points <= 100);
    });
}

/// What is missing is named, and the rest is still estimated.
#[test]
fn unknown_parts_say_why() {
    let numbered = STRIP.replace(
        "select = { box = { min = [-0.07, -1.0, -1.0], max = [-0.0399, 1.0, 1.0] } }",
        "select = { points = [0, 1, 2] }",
    );
    assert_ne!(numbered, STRIP);
    let parsed = parsed(&numbered);
    session(&parsed, |session| {
        let run = session
            .run("run", None, parsed.scene.clone(), false)
            .unwrap();
        let report = estimate(session, &run.built, run.result.as_ref().unwrap()).unwrap();
        assert!(report.space.error_m.is_none());
        assert!(report.space.how.contains("by number"), "{:?}", report.space);
        assert!(report.time.error_m.is_some_and(|e| e > 0.0));
        assert!(total(&report).is_none());
    });
}

#[test]
fn interrupts_end_the_estimate() {
    let parsed = parsed(STRIP);
    session(&parsed, |session| {
        let run = session
            .run("run", None, parsed.scene.clone(), false)
            .unwrap();
        static STOP: AtomicBool = AtomicBool::new(true);
        session.interrupt = &STOP;
        let end = estimate(session, &run.built, run.result.as_ref().unwrap());
        assert!(matches!(end, Err(EstimateError::Interrupted { .. })));
    });
}

/// Raises the interrupt once a companion of this name has gone some steps.
struct Stop {
    raised: Arc<AtomicBool>,
    name: &'static str,
    steps: u64,
    there: bool,
    notes: Vec<String>,
}

impl Progress for Stop {
    fn tick(&mut self, tick: &Tick<'_>) {
        if self.there && tick.steps >= self.steps {
            self.raised.store(true, Ordering::Relaxed);
        }
    }
    fn note(&mut self, text: &str) {
        self.there |= text.starts_with(self.name) && text.ends_with("points");
        self.notes.push(text.to_owned());
    }
}

/// A search that is interrupted on any of its runs goes on to the same end,
/// without those that were finished.
#[test]
fn an_interrupted_search_goes_on() {
    let mut parsed = parsed(STRIP);
    parsed.scene.output.checkpoint_seconds = 0.0;
    let folder = tempfile::tempdir().expect("a folder");
    let target = Target {
        error: 2e-3,
        max_points: 2000,
    };
    let search = |name: &str, resume: bool, progress: &mut Stop| {
        let raised = progress.raised.clone();
        let mut session = Session {
            parsed: &parsed,
            scene_text: "",
            version: "test",
            directory: folder.path().join(name),
            progress,
            interrupt: &raised,
            resume,
            cpu_s: 0.0,
        };
        drape_within(&mut session, &parsed.scene, target)
    };
    let listener = |name, steps| Stop {
        raised: Arc::default(),
        name,
        steps,
        there: false,
        notes: Vec::new(),
    };
    let whole = search("whole", false, &mut listener("none", 0)).unwrap();
    for (name, steps) in [("estimate/step-0", 3), ("estimate/mesh-1x", 20)] {
        let cut = search("cut", false, &mut listener(name, steps));
        assert!(
            matches!(&cut, Err(EstimateError::Interrupted { name: at }) if at == name),
            "{:?}",
            cut.err()
        );
        let mut rest = listener("none", 0);
        let end = search("cut", true, &mut rest).unwrap();
        assert_eq!(end.result.positions, whole.result.positions);
        assert_eq!(end.report.decisions, whole.report.decisions);
        assert_eq!(end.report.space, whole.report.space);
        let again = format!("{name}: ");
        let before = rest.notes.iter().take_while(|n| !n.starts_with(&again));
        let before: Vec<&String> = before.collect();
        assert!(!before.is_empty(), "{:?}", rest.notes);
        assert!(before.iter().all(|n| n.ends_with("finished before")));
        // A run with a recording is not begun again.
        let resumed = rest.notes.iter().any(|n| n.starts_with("resumed at"));
        assert_eq!(resumed, name.ends_with("mesh-1x"), "{:?}", rest.notes);
    }
    // Runs taken over include the last one: its result is made once more.
    let mut all = listener("none", 0);
    let end = search("cut", true, &mut all).unwrap();
    assert_eq!(end.result.positions, whole.result.positions);
}
