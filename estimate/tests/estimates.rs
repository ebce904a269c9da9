//! Estimates against references, and what cannot be estimated.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use selvedge_estimate::{
    EstimateError, MaterialMap, Session, Target, coarser, drape_within, estimate, scaled_step,
    scaled_tolerance, total,
};
use selvedge_scene::driver::Silent;
use selvedge_scene::file::{self, Parsed};

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
        cpu_s: 0.0,
    })
}

/// The distance to a much finer run lies within a factor of three of what the
/// estimate says without it.
#[test]
fn estimates_are_of_the_right_size() {
    let parsed = parsed(STRIP);
    session(&parsed, |session| {
        let run = session.run("run", parsed.scene.clone(), false).unwrap();
        let report = estimate(session, &run.built, &run.result).unwrap();
        let told = total([&report.space, &report.time, &report.algebraic]).unwrap();
        let fine = coarser(&parsed.scene, 0.5).unwrap();
        let fine = scaled_tolerance(&scaled_step(&fine, 0.125), 0.1);
        let fine = session.run("fine", fine, false).unwrap();
        let error = MaterialMap::new(fine.surface())
            .unwrap()
            .distance(&run.surface());
        println!("estimate {told:.3e} m, error {:.3e} m", error.mean);
        assert!(
            told < 3.0 * error.mean && 3.0 * told > error.mean,
            "{report:#?}"
        );
        assert!(report.cpu_s > 0.0);
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
        let chosen = within.run.built.scene().clone();
        let fine = coarser(&chosen, 0.5).unwrap();
        let fine = scaled_tolerance(&scaled_step(&fine, 0.25), 0.1);
        let fine = session.run("fine", fine, false).unwrap();
        let error = MaterialMap::new(fine.surface())
            .unwrap()
            .distance(&within.run.surface());
        println!("asked for 2 mm, got {:.3} mm", 1e3 * error.mean);
        assert!(error.mean < target.error);

        // More than the points allowed can give: the best there is, not met.
        let target = Target {
            error: 1e-6,
            max_points: 100,
        };
        let within = drape_within(session, &parsed.scene, target).unwrap();
        assert!(!within.met && within.run.result.summary.points <= 100);
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
        let run = session.run("run", parsed.scene.clone(), false).unwrap();
        let report = estimate(session, &run.built, &run.result).unwrap();
        assert!(report.space.error_m.is_none());
        assert!(report.space.how.contains("by number"), "{:?}", report.space);
        assert!(report.time.error_m.is_some_and(|e| e > 0.0));
        assert!(total([&report.space, &report.time, &report.algebraic]).is_none());
    });
}

#[test]
fn interrupts_end_the_estimate() {
    let parsed = parsed(STRIP);
    session(&parsed, |session| {
        let run = session.run("run", parsed.scene.clone(), false).unwrap();
        static STOP: AtomicBool = AtomicBool::new(true);
        session.interrupt = &STOP;
        let end = estimate(session, &run.built, &run.result);
        assert!(matches!(end, Err(EstimateError::Interrupted { .. })));
    });
}
