//! Error estimates beside exact shapes, and wanted errors that are met.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use selvedge_estimate::{EFFECTIVITY, Session, Target, drape_within, estimate, total};
use selvedge_scene::build::BuiltScene;
use selvedge_scene::driver::{RunResult, Silent};
use selvedge_scene::file::{self, Parsed};
use selvedge_tests::GRAVITY;
use selvedge_tests::suite::exact;

/// A strip of 1 m that hangs from its upper edge at rest.
const HANGING: &str = r#"
[simulation]
duration = 60
[integrator]
kind = "static"
max_step = 0.5
[relaxation]
enabled = false
[contact]
self = false
[[cloth]]
name = "strip"
size = [0.08, 1.0]
points = [3, 26]
rotation = [90, 0, 0]
fabric = "f"
[[pin]]
select = { edge = "top" }
[fabric.f]
density = 0.2
membrane = { form = "isotropic", stiffness = 20.0 }
bending = { form = "isotropic", rigidity = 1e-5 }
"#;

/// A square that falls for 0.3 s.
const FALLING: &str = r#"
[simulation]
duration = 0.3
[integrator]
max_step = 4e-3
[relaxation]
enabled = false
[stop]
early = false
[contact]
self = false
[damping]
drag = 0.0
[[cloth]]
name = "square"
size = [0.2, 0.2]
points = [9, 9]
fabric = "f"
[fabric.f]
density = 0.2
membrane = { form = "isotropic", stiffness = 1000.0 }
bending = { form = "isotropic", rigidity = 1e-5 }
"#;

type Shape = fn([f64; 3], &[[f64; 3]]) -> [f64; 3];

/// Where a point of the hanging strip ends; `all` are the starts.
fn hung([x, y, z]: [f64; 3], all: &[[f64; 3]]) -> [f64; 3] {
    let top = all.iter().fold(f64::NEG_INFINITY, |m, p| m.max(p[1]));
    // What is below a point hangs from it.
    let length = |l: f64| match l > 0.0 {
        true => exact::hanging(20.0, 0.2 * GRAVITY, l),
        false => 0.0,
    };
    [x, top - (length(1.0) - length(1.0 - (top - y))), z]
}

/// Where a point of the falling square ends.
fn fallen([x, y, z]: [f64; 3], _: &[[f64; 3]]) -> [f64; 3] {
    [x, y - 0.5 * GRAVITY * 0.3 * 0.3, z]
}

fn parsed(text: &str) -> Parsed {
    file::parse(text, Path::new("strip.toml"), &[]).expect("a valid scene")
}

fn session<R>(parsed: &Parsed, work: impl FnOnce(&mut Session<'_>) -> R) -> R {
    let folder = tempfile::tempdir().expect("a folder");
    work(&mut Session {
        parsed,
        scene_text: "",
        version: "test",
        directory: folder.path().to_owned(),
        progress: &mut Silent,
        interrupt: &AtomicBool::new(false),
        resume: false,
        cpu_s: 0.0,
    })
}

/// Mean distance of the points to the exact shape [m].
fn error(built: &BuiltScene, result: &RunResult, shape: Shape) -> f64 {
    let points = |q: &[f64]| q.as_chunks::<3>().0.to_vec();
    // In the scene's order, as the result.
    let starts = points(&built.geometry.flat_to_scene(&built.geometry.start().q));
    let ends = points(&result.positions);
    let distance = |(start, end): (&[f64; 3], &[f64; 3])| {
        let exact = shape(*start, &starts);
        let squares = exact.iter().zip(end).map(|(a, b)| (a - b) * (a - b));
        squares.sum::<f64>().sqrt()
    };
    starts.iter().zip(&ends).map(distance).sum::<f64>() / starts.len() as f64
}

const CASES: [(&str, &str, Shape, f64); 2] = [
    ("hanging strip", HANGING, hung, 1e-4),
    ("falling square", FALLING, fallen, 1e-3),
];

/// The figures that reports show beside an estimate are those of these cases.
#[test]
fn effectivity_on_exact_shapes() {
    for (name, text, shape, _) in CASES {
        let parsed = parsed(text);
        session(&parsed, |session| {
            let run = session.run("run", None, parsed.scene.clone(), false);
            let run = run.expect("a strip");
            let result = run.result.as_ref().expect("a result");
            let report = estimate(session, &run.built, result).expect("an estimate");
            let (told, error) = (
                total(&report).expect("known"),
                error(&run.built, result, shape),
            );
            println!(
                "{name}: estimate {told:.3e} m, error {error:.3e} m, {:.2}",
                told / error
            );
            let stated = EFFECTIVITY.iter().find(|e| e.case == name).expect(name);
            approx::assert_relative_eq!(told / error, stated.value, max_relative = 0.02);
        });
    }
}

/// What was asked for is met, by the exact shape.
#[test]
fn wanted_errors_are_met_on_exact_shapes() {
    for (name, text, shape, target) in CASES {
        let parsed = parsed(text);
        session(&parsed, |session| {
            let wanted = Target {
                error: target,
                max_points: 5_000,
            };
            let within = drape_within(session, &parsed.scene, wanted).expect("a search");
            let error = error(&within.built, &within.result, shape);
            println!(
                "{name}: asked for {target} m, error {error:.3e} m, {:#?}",
                within.report
            );
            assert!(within.met, "{name}: {:#?}", within.report);
            assert!(error < target, "{name}: {error} m");
        });
    }
}
