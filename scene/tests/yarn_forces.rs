//! Forces of pins on cloth of yarns.

use std::path::Path;

use selvedge_integrator::{Outcome, Simulation, StepReport};
use selvedge_scene::build::{Built, BuiltScene};
use selvedge_scene::file;
use selvedge_yarn_model::{Compression, CompressionSettings};

fn scene(name: &str, overrides: &[(&str, &str)]) -> BuiltScene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/yarn");
    let own = overrides.iter();
    let overrides: Vec<_> = own
        .map(|(k, v)| ((*k).to_owned(), (*v).to_owned()))
        .collect();
    let parsed = file::read(&path.join(name), &overrides).expect("a scene");
    BuiltScene::new(parsed).expect("cloth")
}

/// To the end: the simulation, its last report, and the points of every pin
/// with their places in the report.
fn run(built: &BuiltScene) -> (Simulation, StepReport, Vec<Vec<(u32, u32)>>) {
    let made = built.simulation(built.geometry.start(), &built.drape_stage());
    let Built {
        mut simulation,
        pins,
        ..
    } = made.expect("a simulation");
    let mut last = StepReport::default();
    loop {
        match simulation.advance().expect("a step") {
            Outcome::Accepted { report, .. } => last = report,
            Outcome::Rejected { reason, .. } => panic!("{reason}"),
            Outcome::Ended(_) => break,
        }
    }
    let pins = pins.into_iter().map(|p| p.members).collect();
    (simulation, last, pins)
}

fn force(report: &StepReport, pin: &[(u32, u32)]) -> [f64; 3] {
    pin.iter().fold([0.0; 3], |sum, (_, k)| {
        let f = report.pin_forces[*k as usize];
        std::array::from_fn(|i| sum[i] + f[i])
    })
}

/// The force that draws a yarn through crossings is the sum of the friction
/// `μ λ` at all of them, and what the pins of the warps hold along it. Friction
/// acts on arc lengths, whose force `½ k_s (|w|² − 1)` is that on the point,
/// `T = k_s (|w| − 1)`, and `T²/2k_s`.
#[test]
fn a_yarn_pulled_through_crossings() {
    let built = scene("capstan.toml", &[]);
    let (simulation, report, pins) = run(&built);
    let yarns = built.geometry.yarns.as_ref().expect("yarns");
    let n = &yarns.network;
    let (points, arcs) = simulation.state().q.split_at(3 * n.nodes());
    let mut compression = Compression::new(n, CompressionSettings::default());
    let normals: Vec<f64> = compression.normals().flatten().collect();
    compression.update(points, arcs, &normals);
    let sum: f64 = compression.lambda().iter().map(|l| 0.2 * l).sum();
    let [pulled, up, down] = [2, 0, 1].map(|k| force(&report, &pins[k]));
    println!("pulled with {pulled:?} N, friction {sum} N, warps hold {up:?}, {down:?}");
    assert!(sum > 1e-3);
    let stiffness = n.materials[0].stretch_stiffness();
    let on_arc = pulled[0] + pulled[0] * pulled[0] / (2.0 * stiffness);
    assert!((on_arc / sum - 1.0).abs() < 1e-3, "{on_arc} {sum}");
    assert!((pulled[0] / sum - 1.0).abs() < 0.01, "{pulled:?} {sum}");
    let held = -(up[0] + down[0]);
    assert!((held / pulled[0] - 1.0).abs() < 0.01, "{held} {pulled:?}");
}

/// Pins carry the weight of cloth that hangs still, and what is written down
/// for a step is their sum.
#[test]
fn pins_carry_the_weight() {
    let set = [
        ("cloth.0.yarns", "[6, 6]"),
        ("simulation.duration", "5"),
        ("stop.early", "false"),
        ("simulation.gravity", "[0, -9.81, 0]"),
    ];
    let built = scene("plain-weave.toml", &set);
    let (simulation, report, pins) = run(&built);
    let weight: f64 = simulation.plan().inertia.masses.iter().sum::<f64>() * 9.81;
    let held = pins.iter().fold(0.0, |sum, p| sum + force(&report, p)[1]);
    println!("{held} N of {weight} N");
    assert_eq!(pins.len(), 2);
    assert!((held / weight - 1.0).abs() < 0.01, "{held} {weight}");
}
