//! Buttons and buttonholes in scenes.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use selvedge_integrator::Outcome;
use selvedge_scene::build::{Built, BuiltScene};
use selvedge_scene::driver::{self, RunOptions, Silent};
use selvedge_scene::file;
use selvedge_scene::summary::Status;

const G: f64 = 9.81;

/// Two strips of linen that overlap by 2 cm; the lower one hangs on two
/// buttons of the upper one.
const HANGING: &str = r#"
[simulation]
duration = 3.0
[mesh]
edge_length = 0.02
[contact]
friction = 0.0
[integrator]
max_step = 4e-3
newton_tolerance = 1e-5
[stop]
kinetic_energy = 1e-13

[[cloth]]
name = "upper"
size = [0.2, 0.1]
center = [0, 0.05, 0]
rotation = [90, 0, 0]
fabric = "linen"

[[cloth]]
name = "lower"
size = [0.2, 0.1]
center = [0, -0.03, 0.001]
rotation = [90, 0, 0]
fabric = "linen"

[[pin]]
cloth = "upper"
select = { edge = "top" }

[[button]]
name = "left"
cloth = "upper"
at = [0.04, 0.01]
mass = 1e-3

[[button]]
name = "right"
cloth = "upper"
at = [0.16, 0.01]
mass = 2e-3
radius = 8e-3

[[buttonhole]]
button = "left"
cloth = "lower"
at = [0.04, 0.09]

[[buttonhole]]
button = "right"
cloth = "lower"
at = [0.16, 0.09]
"#;

fn scene(text: &str, set: &[(&str, &str)]) -> BuiltScene {
    let set: Vec<_> = set
        .iter()
        .map(|(k, v)| (k.to_string(), v.to_string()))
        .collect();
    let parsed = file::parse(text, Path::new("s.toml"), &set).expect("a valid scene");
    BuiltScene::new(parsed).expect("a scene that can be built")
}

fn start(built: &BuiltScene) -> Built {
    let state = built.geometry.start();
    built
        .simulation(state, &built.drape_stage())
        .expect("a simulation")
}

/// The lower strip hangs on its buttons: the holes carry its weight, the
/// threads that of the buttons as well. Where the strips touch, their contact
/// carries some per cent, up or down. Buttons stay on the outside, level with
/// the cloth, and no point of theirs is drawn as cloth.
#[test]
fn cloth_hangs_on_its_buttons() {
    for (contact, tolerance) in [("false", 2e-3), ("true", 5e-2)] {
        let built = scene(HANGING, &[("contact.self", contact)]);
        let mut simulation = start(&built).simulation;
        while !matches!(simulation.advance().expect("a step"), Outcome::Ended(_)) {}
        let g = &built.geometry;
        let masses = &simulation.plan().inertia.masses;
        let lower: f64 = g.parts[1]
            .points
            .clone()
            .map(|p| masses[g.order.new_of_old[p as usize] as usize])
            .sum();
        let trims = built.trims.summary(&built.parsed, &simulation);
        // A hole is pulled up, the cloth that the button is sewn to down.
        let carried: f64 = trims.iter().map(|t| t.hole_force_n[0][1]).sum();
        let sewn: f64 = trims.iter().map(|t| -t.sewn_force_n[1]).sum();
        let (holes, threads) = (carried / (lower * G), sewn / ((lower + 3e-3) * G));
        println!(
            "contact {contact}, after {} s: holes {holes:.5} and threads {threads:.5} of the weight",
            simulation.state().time,
        );
        assert!((holes - 1.0).abs() < tolerance, "{trims:?}");
        assert!((threads - 1.0).abs() < tolerance, "{trims:?}");
        for t in &trims {
            assert!(t.axis[2] > 0.8, "{t:?}");
            assert!(t.center_m[2] > 5e-4 && t.center_m[2] < 2e-2, "{t:?}");
        }
        let drawn = g.flat_to_scene(&simulation.state().q);
        assert_eq!(drawn.len(), 3 * g.mesh.points());
        let lowest = drawn.chunks(3).map(|p| p[1]).fold(0.0, f64::min);
        assert!(lowest > -0.1, "the strip fell to {lowest} m");
    }
}

/// Half a tube in front of a column and half behind it, sewn together on one
/// side and open on the other.
const TUBE: &str = r#"{"pattern": {"panels": {
    "front": {"vertices": [[0, 0], [36, 0], [36, 20], [0, 20]],
        "edges": [{"endpoints": [0, 1]}, {"endpoints": [1, 2]},
                  {"endpoints": [2, 3]}, {"endpoints": [3, 0]}],
        "translation": [-18, 0, 14], "rotation": [0, 0, 0]},
    "back": {"vertices": [[0, 0], [36, 0], [36, 20], [0, 20]],
        "edges": [{"endpoints": [0, 1]}, {"endpoints": [1, 2]},
                  {"endpoints": [2, 3]}, {"endpoints": [3, 0]}],
        "translation": [18, 0, -14], "rotation": [0, 180, 0]}},
    "stitches": [[{"panel": "front", "edge": 3}, {"panel": "back", "edge": 1}]]},
    "properties": {"units_in_meter": 100}}"#;

const BUTTONED: &str = r#"
name = "tube"
[simulation]
duration = 0.3
gravity = [0, 0, 0]
[mesh]
edge_length = 0.025
[stop]
early = false
[output]
recording = false
report = false
[[cloth]]
kind = "pattern"
file = "tube.json"
panel_layer = { front = 1 }
[[body]]
kind = "capsule"
from = [0, -0.2, 0]
to = [0, 0.4, 0]
radius = 0.1
[[button]]
name = "top"
panel = "back"
at = [0.012, 0.15]
[[button]]
name = "bottom"
panel = "back"
at = [0.012, 0.05]
[[buttonhole]]
button = "top"
panel = "front"
at = [0.348, 0.15]
[[buttonhole]]
button = "bottom"
panel = "front"
at = [0.348, 0.05]
"#;

/// An open garment, its front a layer over its back, is closed by its buttons:
/// after sewing and draping every hole is within a fraction of a millimetre of
/// its place below the button, and the buttons are on the outside. Unknown panels and places beyond one
/// are refused.
#[test]
fn a_front_is_closed_by_its_buttons() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("tube.json"), TUBE).expect("a file");
    let path = folder.path().join("tube.toml");
    let build = |text: &str| {
        let parsed = file::parse(text, &path, &[]).expect("a valid scene");
        BuiltScene::new(parsed)
    };
    let options = RunOptions {
        directory: folder.path().join("out"),
        resume: false,
        scene_text: BUTTONED.to_owned(),
        version: "test".to_owned(),
    };
    let never = Arc::new(AtomicBool::new(false));
    let built = build(BUTTONED).expect("a scene that can be built");
    let result = driver::run(&built, &options, &mut Silent, &never).expect("a run");
    let s = &result.summary;
    println!("{:?} {} {:?} {:?}", s.status, s.reason, s.trims, s.assembly);
    assert_eq!(s.status, Status::Finished, "{}", s.reason);
    assert_eq!(s.trims.len(), 2);
    for t in &s.trims {
        let force = t.hole_force_n[0].iter().map(|f| f * f).sum::<f64>().sqrt();
        assert!(force / 1000.0 < 5e-4, "{t:?}");
        let [x, _, z] = t.center_m;
        let r = x.hypot(z);
        assert!(r > 0.1 && r < 0.13, "{t:?}");
        assert!((x * t.axis[0] + z * t.axis[2]) / r > 0.8, "{t:?}");
    }
    assert_eq!(s.points, built.geometry.mesh.points());

    let line = |from: &str, to: &str| {
        let findings = build(&BUTTONED.replacen(from, to, 1))
            .err()
            .expect("a mistake");
        let text = findings.findings()[0].to_string();
        text.split_once("tube.toml:")
            .map(|t| t.1.to_owned())
            .expect("a place")
    };
    assert_eq!(
        line("panel = \"back\"", "panel = \"bakc\""),
        "24:9: `button.0.panel`: cloth \"cloth\" has no panel \"bakc\" (known: back, front)"
    );
    assert_eq!(
        line("front = 1", "frond = 1"),
        "16:25: `cloth.0.panel_layer.frond`: the pattern has no panel \"frond\"; there are back, front"
    );
    assert_eq!(
        line("at = [0.348", "at = [0.42"),
        "33:6: `buttonhole.0.at` = (0.4200, 0.1500) m lies outside of panel `front` (it reaches \
         from (0.0000, 0.0000) to (0.3600, 0.2000) m)"
    );
}

/// Without its holes the strip falls: the test above can fail.
#[test]
fn cloth_without_holes_falls() {
    let text = HANGING.split("[[buttonhole]]").next().expect("text");
    let built = scene(text, &[("simulation.duration", "0.4")]);
    let mut simulation = start(&built).simulation;
    while !matches!(simulation.advance().expect("a step"), Outcome::Ended(_)) {}
    let q = &simulation.state().q[..3 * built.geometry.mesh.points()];
    assert!(q.chunks(3).any(|p| p[1] < -0.2));
}

/// Trims add two points a button, one term and one row; without them there is
/// nothing of the kind.
#[test]
fn trims_in_the_plan() {
    let built = scene(HANGING, &[]);
    let points = built.geometry.mesh.points();
    let Built {
        simulation,
        effects,
        ..
    } = start(&built);
    let plan = simulation.plan();
    assert_eq!(plan.layout.points, points + 4);
    assert_eq!(
        plan.inertia.weightless,
        [points as u32 + 1, points as u32 + 3]
    );
    let row = effects.iter().find(|r| r.name == "trims").expect("a row");
    assert!(row.on && row.bytes > 0);
    assert_eq!(row.stencils, 2 * 4 + 2);
    assert_eq!(row.reason, "buttons: 2, buttonholes: 2");

    let bare = HANGING.split("[[button]]").next().expect("text");
    let built = scene(bare, &[]);
    let Built {
        simulation,
        effects,
        ..
    } = start(&built);
    let plan = simulation.plan();
    assert_eq!(plan.layout.points, points);
    assert_eq!(plan.inertia.weightless.capacity(), 0);
    assert!(plan.terms.iter().all(|t| t.batch.name() != "trim"));
    assert!(effects.iter().any(|r| r.name == "trims" && !r.on));
    assert!(built.trims.summary(&built.parsed, &simulation).is_empty());
}

/// A snapshot in mid-motion goes on with the same bits.
#[test]
fn trims_resume() {
    let built = scene(HANGING, &[("relaxation.enabled", "false")]);
    let mut one = start(&built).simulation;
    let run = |s: &mut selvedge_integrator::Simulation, steps: u64| {
        while s.counters().steps < steps {
            s.advance().expect("a step");
        }
    };
    run(&mut one, 20);
    let snapshot = one.snapshot();
    run(&mut one, 40);
    let mut other = start(&built).simulation;
    other.restore(&snapshot).expect("a snapshot");
    run(&mut other, 40);
    assert!(one.state().q == other.state().q && one.state().v == other.state().v);
}

/// What is wrong with trims is said with file, line, column and what to do.
#[test]
fn mistakes() {
    let lines = |text: &str| -> Vec<String> {
        let findings = match file::parse(text, Path::new("s.toml"), &[]) {
            Err(findings) => findings,
            Ok(parsed) => match BuiltScene::new(parsed) {
                Err(findings) => findings,
                Ok(_) => panic!("no mistake found"),
            },
        };
        findings
            .findings()
            .iter()
            .map(ToString::to_string)
            .collect()
    };
    let sheet = "[[cloth]]\nsize = [0.3, 0.2]\n[mesh]\nedge_length = 0.05\n";
    for (trim, expected) in [
        (
            "[[button]]\nat = [0.1, 0.25]\n",
            "s.toml:6:6: `button.0.at` = (0.1000, 0.2500) m lies outside of cloth `cloth` (it \
             reaches from (0.0000, 0.0000) to (0.3000, 0.2000) m)",
        ),
        (
            "[[button]]\nat = [0.1, 0.1]\nmass = -1e-3\n",
            "s.toml:7:8: `button.0.mass` = -0.001 kg is out of range (it has to be greater than \
             0 and at most 1 kg; kg, not g)",
        ),
        (
            "[[button]]\nat = [0.1, 0.1]\npanel = \"front\"\n",
            "s.toml:7:9: `button.0.panel`: a sheet has no panels (leave it out)",
        ),
        (
            "[[button]]\nname = \"top\"\nat = [0.1, 0.1]\n[[buttonhole]]\nat = [0.2, 0.1]\n\
             button = \"tip\"\n",
            "s.toml:10:10: `buttonhole.0.button`: there is no button \"tip\" (known: \
             top)",
        ),
        (
            "[[buttonhole]]\nat = [0.2, 0.1]\n",
            "s.toml:5:1: `buttonhole.0` does not say which of 0 buttons it belongs to (add \
             `button = \"…\"`, one of )",
        ),
    ] {
        let found = lines(&format!("{sheet}{trim}"));
        assert_eq!(found, [expected], "{trim}");
    }
}
