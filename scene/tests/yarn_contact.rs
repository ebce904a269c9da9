//! Yarns that no stitch joins touch, where the scene says so.

mod runs;
mod text;

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use runs::{StopAt, options, uninterrupted};
use selvedge_collision::{ContactResponse, StepStart};
use selvedge_energy::EvalPoint;
use selvedge_integrator::{Outcome, Simulation};
use selvedge_scene::build::BuiltScene;
use selvedge_scene::driver::{self, RunResult};
use selvedge_scene::summary::Status;
use text::{build, simulation};

const KNIT: &str = "[[cloth]]\nkind = \"knit\"\nstitches = [8, 8]\n\
                    [simulation]\ngravity = [0, 0, 0]\n[contact]\nself = true\n";

/// A ribbon held at its ends, and a patch 4 mm above it.
const LAYERS: &str = "[simulation]\nduration = 0.15\n[stop]\nearly = false\n\
    [output]\nrecording = false\nreport = false\n\
    [[cloth]]\nname = \"below\"\nkind = \"woven\"\nyarns = [12, 8]\nyarn = \"cord\"\n\
    [[cloth]]\nname = \"above\"\nkind = \"woven\"\nyarns = [6, 6]\nyarn = \"cord\"\n\
    center = [0, 4e-3, 0]\n\
    [yarn.cord]\nlibrary = \"weaving\"\n\
    [[pin]]\ncloth = \"below\"\nselect = { edge = \"left\" }\n\
    [[pin]]\ncloth = \"below\"\nselect = { edge = \"right\" }\n";

fn run(built: &BuiltScene, steps: usize, threads: usize) -> (Simulation, usize) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.expect("threads").install(|| {
        let mut simulation = simulation(built);
        let most = advance(&mut simulation, steps);
        (simulation, most)
    })
}

/// Takes `steps` steps, refused ones not counted; the most contacts of one.
fn advance(simulation: &mut Simulation, steps: usize) -> usize {
    let (mut most, mut done) = (0, 0);
    while done < steps {
        match simulation.advance().expect("a step") {
            Outcome::Accepted { report, .. } => {
                most = most.max(report.contacts);
                done += 1;
            }
            Outcome::Rejected { .. } => {}
            Outcome::Ended(end) => panic!("{end:?}"),
        }
    }
    most
}

/// Active contacts of the cloth where the scene lays it.
fn active_at_start(built: &BuiltScene) -> usize {
    let mut simulation = simulation(built);
    let state = simulation.state().clone();
    let contacts = &mut simulation.plan_mut().contacts;
    let touching = contacts.iter_mut().find(|c| c.name() == "self-contact");
    let touching = touching.expect("contact of yarns");
    let step = StepStart {
        q_start: &state.q,
        q_predicted: &state.q,
        dt: 1e-3,
        time: 0.0,
    };
    touching.detect(&step).expect("positions");
    let at = EvalPoint {
        layout: state.layout,
        q: &state.q,
        q_start: &state.q,
        dt: 1e-3,
    };
    let mut out = ContactResponse::default();
    touching.evaluate(&at, false, &mut out).expect("positions");
    touching.active()
}

/// What stitches and crossings hold together does not touch where it is laid:
/// knits and weaves of every built-in kind, and loops at rest.
#[test]
fn laid_cloth_does_not_touch() {
    for (chart, stitches, rest) in [
        ("stockinette", "[8, 8]", "laid"),
        ("stockinette", "[8, 8]", "relaxed"),
        ("garter", "[8, 8]", "laid"),
        ("garter", "[8, 8]", "relaxed"),
        ("rib-2x2", "[8, 8]", "laid"),
        ("seed", "[8, 8]", "laid"),
        ("feather-and-fan", "[18, 4]", "laid"),
        ("openwork-diamonds", "[13, 8]", "laid"),
        ("flame-chevron", "[16, 16]", "laid"),
    ] {
        let set = [
            ("cloth.0.chart", chart),
            ("cloth.0.stitches", stitches),
            ("cloth.0.rest_shape", rest),
        ];
        let built = build(KNIT, &set).expect(chart);
        assert_eq!(active_at_start(&built), 0, "{chart} {rest}");
    }
    for draft in ["plain", "twill-2-2", "satin-5", "basket-2-2"] {
        let text = format!(
            "[[cloth]]\nkind = \"woven\"\nyarns = [10, 10]\nyarn = \"weaving\"\n\
             draft = \"{draft}\"\n[contact]\nself = true\n"
        );
        assert_eq!(active_at_start(&build(&text, &[]).expect(draft)), 0);
    }
}

/// A patch that falls on another stays above it, point by point; without the
/// effect it falls through. The effect is off unless the scene asks for it.
#[test]
fn layers_do_not_pass_through_each_other() {
    let ends = |set: &[(&str, &str)]| {
        let built = build(LAYERS, set).expect("a scene");
        let split = built.geometry.parts[0].points.len();
        let (simulation, most) = run(&built, 150, 1);
        let q = built.geometry.flat_to_scene(&simulation.state().q);
        let (below, above) = q.as_chunks::<3>().0.split_at(split);
        // Signed height of every upper point over the nearest lower one.
        let height = |p: &[f64; 3]| {
            let apart = |r: &&[f64; 3]| (r[0] - p[0]).hypot(r[2] - p[2]);
            let nearest = below.iter().min_by(|a, b| apart(a).total_cmp(&apart(b)));
            p[1] - nearest.expect("points")[1]
        };
        (above.iter().map(height).fold(f64::INFINITY, f64::min), most)
    };
    let (height, contacts) = ends(&[("contact.self", "true")]);
    println!("{height} m, {contacts} contacts");
    assert!(
        height > 0.0 && contacts > 10,
        "{height} m, {contacts} contacts"
    );
    let (height, contacts) = ends(&[]);
    assert!(
        height < -0.02 && contacts == 0,
        "{height} m, {contacts} contacts"
    );
}

/// What a run leaves says where yarns have passed into each other, whether they
/// touch or not.
#[test]
fn summaries_count_yarns_in_each_other() {
    let folder = tempfile::tempdir().expect("a folder");
    let count = |name: &str, set: &[(&str, &str)]| {
        let text = LAYERS.replace("duration = 0.15", "duration = 0.03");
        let built = build(&text, set).expect("a scene");
        let s = whole(&built, &folder.path().join(name)).summary;
        assert_eq!(s.self_intersections.min(20), s.defects.len());
        let row = s.effects.iter().find(|e| e.name == "self-contact");
        (s.self_intersections, row.expect("a row").on)
    };
    // Fallen by 4.4 mm the patch would lie in the other one.
    assert_eq!(count("on", &[("contact.self", "true")]), (0, true));
    let (through, on) = count("off", &[]);
    assert!(through > 5 && !on, "{through}");
}

/// The same bits on one thread and two, and from a snapshot.
#[test]
fn bits_do_not_depend_on_threads_or_interruption() {
    let built = build(LAYERS, &[("contact.self", "true")]).expect("a scene");
    let (one, most) = run(&built, 100, 1);
    assert!(most > 100, "{most} contacts");
    assert_eq!(one.state(), run(&built, 100, 2).0.state());
    let (mut first, _) = run(&built, 60, 1);
    let mut second = simulation(&built);
    second.restore(&first.snapshot()).expect("the same plan");
    advance(&mut first, 40);
    advance(&mut second, 40);
    assert_eq!(first.state(), second.state());
    assert_eq!(first.state(), one.state());
}

/// Loops laid flat let go so fast that points leave the margin of contact. Such steps
/// are taken again from their start, not refused: while nothing touches the
/// motion is that without contact, to the last bit.
#[test]
fn fast_starts_are_as_without_contact() {
    let end = |on: &str| {
        let set = [("cloth.0.stitches", "[12, 12]"), ("contact.self", on)];
        run(&build(KNIT, &set).expect("a scene"), 40, 1)
    };
    let (touching, most) = end("true");
    assert_eq!((most, touching.counters().rejected), (0, 0));
    assert_eq!(touching.state(), end("false").0.state());
}

/// The last row of a garter patch with open loops, pulled at its end.
const PULLED: &str = r#"
[[cloth]]
kind = "knit"
chart = "garter"
stitches = [4, 3]
yarn = "sweater"
bind_off = false
[topology]
changes = true
tail = 0.006
[contact]
self = true
[[pin]]
select = { edge = "bottom" }
[[pin]]
select = { yarn = { index = -1, end = "last" } }
motion = [{ time = 0 }, { time = 0.45, translation = [0, 0, -0.18] }]
[simulation]
duration = 0.4
gravity = [0, 0, 0]
"#;

fn whole(built: &BuiltScene, directory: &Path) -> RunResult {
    uninterrupted(built, &options("", directory, false))
}

/// Yarns that leave their contacts part softly and touch from then on; runs that
/// are stopped between events go on with the same bits.
#[test]
fn yarns_that_leave_their_contacts_touch() {
    let folder = tempfile::tempdir().expect("a folder");
    let built = build(PULLED, &[]).expect("a scene");
    let through = whole(&built, &folder.path().join("one")).summary;
    assert_eq!(through.status, Status::Finished, "{}", through.reason);
    let topology = through.topology.expect("counts");
    assert!(topology.drawn >= 4, "{topology:?}");
    assert!(
        through.max_abs_edge_strain < 0.7,
        "{}",
        through.max_abs_edge_strain
    );
    println!(
        "{} steps, {} refused, strain {}, {} in each other",
        through.steps,
        through.rejected_steps,
        through.max_abs_edge_strain,
        through.self_intersections
    );

    let part = folder.path().join("part");
    let interrupt = Arc::new(AtomicBool::new(false));
    let mut stop = StopAt(interrupt.clone(), 250);
    let cut = driver::run(&built, &options("", &part, false), &mut stop, &interrupt);
    assert_eq!(cut.expect("a run").summary.status, Status::Stopped);
    let rest = uninterrupted(&built, &options("", &part, true)).summary;
    assert_eq!(rest.final_state_hash, through.final_state_hash);
    assert_eq!(rest.topology, through.topology);
}
