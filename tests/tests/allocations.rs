//! What is off takes no memory either: allocations are counted.

use std::path::Path;

use allocation_counter::{AllocationInfo, measure};
use selvedge_integrator::{Outcome, Simulation};
use selvedge_scene::build::{Built, BuiltScene};
use selvedge_scene::file;

const SCENE: &str = r#"
[[cloth]]
kind = "sheet"
size = [0.2, 0.2]
points = [12, 12]
fabric = "plain"

[[body]]
kind = "sphere"
center = [0.0, -0.102, 0.0]
radius = 0.1

[fabric.plain]
density = 0.2
membrane = { form = "isotropic", stiffness = 500.0, poisson = 0.3 }
bending = { form = "isotropic", rigidity = 5e-5 }
damping = { drag = 0.0, membrane = 0.0, bending = 0.0 }
friction = 0.3

[relaxation]
enabled = false

[stop]
early = false
"#;

/// Keys and values that replace those of a scene.
type Set = [(&'static str, &'static str)];

fn scene(set: &Set) -> BuiltScene {
    let set: Vec<(String, String)> = [("assembly.threads", "1")]
        .iter()
        .chain(set)
        .map(|(k, v)| ((*k).to_owned(), (*v).to_owned()))
        .collect();
    let parsed = file::parse(SCENE, Path::new("scene.toml"), &set).expect("a scene");
    BuiltScene::new(parsed).expect("a scene that can be built")
}

fn build(scene: &BuiltScene) -> Built {
    let state = scene.geometry.start();
    let stage = scene.drape_stage();
    scene.simulation(state, &stage).expect("a simulation")
}

fn steps(s: &mut Simulation, count: u64) {
    let until = s.counters().steps + count;
    while s.counters().steps < until {
        if let Outcome::Ended(reason) = s.advance().expect("a step") {
            panic!("{reason:?}");
        }
    }
}

fn on_one_thread<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    pool.expect("a thread").install(work)
}

/// Memory of a simulation and allocations of its first steps.
fn cost(set: &Set) -> (usize, AllocationInfo) {
    on_one_thread(|| {
        let mut s = build(&scene(set)).simulation;
        (s.heap_bytes(), measure(|| steps(&mut s, 25)))
    })
}

/// A scene without an effect and one that switches it off hold the same memory
/// and make the same allocations while stepping; one that has it holds more.
#[test]
fn off_allocates_nothing() {
    // What is absent, how it is switched off, how it is on.
    let effects: [(&str, &Set, &Set, &Set); 5] = [
        (
            "damping",
            &[],
            &[("damping.kind", "none")],
            &[("damping.drag", "5")],
        ),
        (
            "friction",
            &[("contact.friction", "0")],
            &[("contact.friction_model", "none")],
            &[],
        ),
        (
            "self-contact",
            &[("contact.self", "false")],
            &[("contact.self", "false"), ("contact.stiffness", "50")],
            &[("contact.self", "true")],
        ),
        (
            "relaxation",
            &[],
            &[("relaxation.enabled", "true"), ("relaxation.duration", "0")],
            &[],
        ),
        ("early stop", &[], &[("stop.percentile", "50")], &[]),
    ];
    for (what, absent, off, on) in effects {
        let (a, b, c) = (cost(absent), cost(off), cost(on));
        println!("{what}: {:?}, {:?}, on {:?}", a.1, b.1, c.1);
        assert_eq!(a.1.count_total, b.1.count_total, "steps without {what}");
        assert_eq!(a.1.bytes_total, b.1.bytes_total, "steps without {what}");
        assert_eq!(a.0, b.0, "memory without {what}");
        if !on.is_empty() {
            assert!(c.0 > a.0, "{what} takes no memory: {} bytes", c.0);
        }
    }
}

/// Once its buffers have grown, a step of cloth on a body allocates a few
/// small things, whatever the size of the cloth.
#[test]
fn steps_reuse_their_buffers() {
    let per_step = |points: &'static str| {
        on_one_thread(move || {
            let scene = scene(&[("contact.self", "true"), ("cloth.0.points", points)]);
            let mut s = build(&scene).simulation;
            steps(&mut s, 100);
            let later = measure(|| steps(&mut s, 50));
            let bytes_per_point = 24 * s.plan().layout.points as u64;
            (
                later.count_total / 50,
                later.bytes_total / 50,
                bytes_per_point,
            )
        })
    };
    for points in ["[12, 12]", "[30, 30]"] {
        let (count, bytes, vector) = per_step(points);
        println!("{points}: {count} allocations of {bytes} bytes a step");
        assert!(count < 30, "{count} allocations a step");
        assert!(
            bytes < vector,
            "{bytes} bytes a step, a vector has {vector}"
        );
    }
}
