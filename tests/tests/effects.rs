//! An effect that a scene does not call for is absent, and costs nothing.

use std::path::Path;

use selvedge_integrator::{Outcome, Simulation};
use selvedge_scene::build::{Built, BuiltScene};
use selvedge_scene::effects::EffectRow;
use selvedge_scene::file;
use selvedge_tests::bits;

/// Nothing but elastic cloth in a vacuum.
const BARE: &str = r#"
[[cloth]]
kind = "sheet"
size = [0.2, 0.2]
points = [12, 12]
fabric = "plain"

[fabric.plain]
density = 0.2
membrane = { form = "isotropic", stiffness = 500.0, poisson = 0.3 }
bending = { form = "isotropic", rigidity = 5e-5 }
damping = { drag = 0.0, membrane = 0.0, bending = 0.0 }

[relaxation]
enabled = false

[stop]
early = false
"#;

const BALL: &str = "
[[body]]
kind = \"sphere\"
center = [0.0, -0.102, 0.0]
radius = 0.1
friction = 0.3
";

/// Keys and values that replace those of a scene.
type Set = [(&'static str, &'static str)];

fn build(text: &str, set: &Set) -> Built {
    let set: Vec<_> = set
        .iter()
        .map(|(k, v)| (k.to_string(), v.to_string()))
        .collect();
    let parsed = file::parse(text, Path::new("scene.toml"), &set).expect("a valid scene");
    let built = BuiltScene::new(parsed).expect("a scene that can be built");
    let state = built.geometry.start();
    built
        .simulation(state, &built.drape_stage())
        .expect("a simulation")
}

fn terms(s: &Simulation) -> Vec<&str> {
    s.plan().terms.iter().map(|t| t.batch.name()).collect()
}

fn contacts(s: &Simulation) -> Vec<&str> {
    s.plan().contacts.iter().map(|c| c.name()).collect()
}

fn row<'a>(rows: &'a [EffectRow], name: &str) -> &'a EffectRow {
    rows.iter()
        .find(|r| r.name == name)
        .unwrap_or_else(|| panic!("no row `{name}`"))
}

fn after(mut s: Simulation, steps: u64) -> (Vec<u64>, u64) {
    while s.counters().steps < steps {
        if let Outcome::Ended(reason) = s.advance().expect("a sheet") {
            panic!("{reason:?}");
        }
    }
    (bits(&s), s.counters().linear_iterations)
}

/// Bodies meet triangles when the scene says so: otherwise nothing of it is in
/// the plan, and every bit of a run is that without the key.
#[test]
fn body_faces_cost_nothing_when_off() {
    let scene = [BARE, BALL].concat();
    let key = "contact.body_faces";
    let (absent, off) = (build(&scene, &[]), build(&scene, &[(key, "false")]));
    for built in [&absent, &off] {
        assert!(!contacts(&built.simulation).contains(&"body-faces"));
        let row = row(&built.effects, "faces on bodies");
        assert_eq!((row.on, row.bytes), (false, 0));
    }
    assert_eq!(absent.simulation.heap_bytes(), off.simulation.heap_bytes());
    let on = build(&scene, &[(key, "true")]);
    assert!(contacts(&on.simulation).contains(&"body-faces"));
    assert!(row(&on.effects, "faces on bodies").on);
    let alone = build(BARE, &[(key, "true")]);
    assert!(alone.simulation.plan().contacts.is_empty());
    assert_eq!(row(&alone.effects, "faces on bodies").reason, "no bodies");
    assert_eq!(after(absent.simulation, 40), after(off.simulation, 40));
}

/// A plan for bare cloth holds membrane and bending and no more; every other
/// effect is listed as off, with a reason, no stencils and no memory.
#[test]
fn bare_cloth_is_two_terms() {
    let Built {
        simulation,
        attachments,
        effects,
        ..
    } = build(BARE, &[]);
    assert_eq!(terms(&simulation), ["membrane", "bending"]);
    assert!(simulation.plan().contacts.is_empty());
    assert!(simulation.plan().pins.is_none());
    assert!(attachments.is_empty());
    let on: Vec<&str> = effects
        .iter()
        .filter(|r| r.on)
        .map(|r| r.name.as_str())
        .collect();
    assert_eq!(on, ["membrane", "bending", "recording", "report"]);
    for r in effects.iter().filter(|r| !r.on) {
        assert!(!r.reason.is_empty(), "`{}` is off without a reason", r.name);
        assert_eq!(
            (r.stencils, r.bytes, r.seconds),
            (0, 0, 0.0),
            "`{}`",
            r.name
        );
    }
}

/// Each effect, asked for alone, brings exactly its own part of the plan and
/// its own row.
#[test]
fn each_effect_adds_its_own_part() {
    let bare = build(BARE, &[]);
    let bytes = |b: &Built| -> usize {
        b.simulation
            .plan()
            .terms
            .iter()
            .map(|t| t.batch.heap_bytes())
            .sum()
    };

    let drag = build(BARE, &[("damping.drag", "5")]);
    assert_eq!(terms(&drag.simulation), ["membrane", "bending", "drag"]);
    assert!(row(&drag.effects, "drag").on);
    assert_eq!(
        row(&drag.effects, "drag").stencils,
        drag.simulation.plan().layout.points
    );
    assert!(bytes(&drag) > bytes(&bare));

    for (key, name) in [
        ("damping.membrane", "membrane damping"),
        ("damping.bending", "bending damping"),
    ] {
        let damped = build(BARE, &[(key, "0.01")]);
        assert_eq!(terms(&damped.simulation), ["membrane", "bending"]);
        let others: Vec<_> = damped.effects.iter().filter(|r| r.name != name).collect();
        assert!(row(&damped.effects, name).on, "{name}");
        for (a, b) in others
            .iter()
            .zip(bare.effects.iter().filter(|r| r.name != name))
        {
            assert_eq!(a.on, b.on, "`{}` with {name}", a.name);
        }
    }

    let layered = build(BARE, &[("cloth.0.layer", "1"), ("contact.friction", "0")]);
    assert_eq!(contacts(&layered.simulation), ["self-contact"]);
    assert_eq!(terms(&layered.simulation), ["membrane", "bending"]);
    assert!(row(&layered.effects, "layers").on && row(&layered.effects, "self-contact").on);

    let own = build(BARE, &[("contact.self", "true"), ("contact.friction", "0")]);
    assert_eq!(contacts(&own.simulation), ["self-contact"]);
    assert!(row(&own.effects, "self-contact").on);
    assert!(!row(&own.effects, "friction of cloth on cloth").on);
    assert!(!row(&own.effects, "body contact").on);

    let ball = build(&format!("{BARE}{BALL}"), &[("contact.self", "false")]);
    assert_eq!(contacts(&ball.simulation), ["body-contact"]);
    assert!(row(&ball.effects, "friction on bodies").on);
    assert!(!row(&ball.effects, "self-contact").on);

    let pinned = build(
        &format!("{BARE}[[pin]]\nselect = {{ corner = \"all\" }}\n"),
        &[],
    );
    assert_eq!(
        pinned
            .simulation
            .plan()
            .pins
            .as_ref()
            .map(|p| p.points.len()),
        Some(4)
    );
    assert_eq!(row(&pinned.effects, "pins").stencils, 4);
    assert_eq!(terms(&pinned.simulation), ["membrane", "bending"]);

    let held = build(
        &format!("{BARE}[[attachment]]\nselect = {{ edge = \"top\" }}\n"),
        &[],
    );
    assert_eq!(
        terms(&held.simulation),
        ["membrane", "bending", "attachment"]
    );
    assert!(held.simulation.plan().pins.is_none());
    assert!(row(&held.effects, "attachments").on && !row(&held.effects, "pins").on);
}

/// An effect switched off by name and one that is not there give the same
/// plan, the same memory and the same bits.
#[test]
fn off_is_absent() {
    let scene = format!("{BARE}{BALL}");
    // Left: absent or zero. Right: switched off by its own key.
    let pairs: [(&str, &Set, &Set); 4] = [
        ("damping", &[], &[("damping.kind", "none")]),
        (
            "friction",
            &[("contact.friction", "0"), ("body.0.friction", "0")],
            &[("contact.friction_model", "none")],
        ),
        (
            "relaxation",
            &[],
            &[("relaxation.enabled", "true"), ("relaxation.duration", "0")],
        ),
        ("damping form", &[], &[("damping.kind", "incremental")]),
    ];
    for (what, absent, off) in pairs {
        let (a, b) = (build(&scene, absent), build(&scene, off));
        assert_eq!(terms(&a.simulation), terms(&b.simulation), "{what}");
        assert_eq!(contacts(&a.simulation), contacts(&b.simulation), "{what}");
        assert_eq!(
            a.simulation.plan().heap_bytes(),
            b.simulation.plan().heap_bytes(),
            "memory without {what}"
        );
        let (x, y) = (after(a.simulation, 25), after(b.simulation, 25));
        assert_eq!(x.1, y.1, "linear iterations without {what}");
        assert!(x.0 == y.0, "{what}: other bits");
    }
}

/// Coefficients come from the materials, a geometric mean for two of them,
/// unless the scene names one for all; none are left where one side is smooth.
#[test]
fn friction_of_materials() {
    let scene = format!("{BARE}{BALL}");
    let reason = |set: &Set| {
        let built = build(&scene, set);
        ["friction on bodies", "friction of cloth on cloth"].map(|name| {
            let row = row(&built.effects, name);
            row.on.then(|| row.reason.clone())
        })
    };
    let own = |mu: f64| Some(format!("anchored, coefficient {mu} (of the materials)"));
    assert_eq!(reason(&[]), [own(0.3), own(0.3)]);
    let rough = ("fabric.plain.friction", "1.2");
    assert_eq!(reason(&[rough]), [own(0.6), own(1.2)]);
    let said = Some("anchored, coefficient 0.2 (`contact.friction`)".to_owned());
    let all = [rough, ("contact.friction", "0.2")];
    assert_eq!(reason(&all), [said.clone(), said]);
    assert_eq!(reason(&[("body.0.friction", "0")]), [None, own(0.3)]);
    let smooth = ("fabric.plain.friction", "0");
    assert_eq!(reason(&[smooth]), [None, None]);
    let (a, b) = (
        build(&scene, &[smooth]),
        build(&scene, &[("contact.friction_model", "none")]),
    );
    assert_eq!(
        a.simulation.plan().heap_bytes(),
        b.simulation.plan().heap_bytes()
    );
    assert!(after(a.simulation, 25).0 == after(b.simulation, 25).0);
}

/// Contact that never happens leaves no trace in the motion: a sheet in free
/// fall far above a body has the bits of one without any body.
#[test]
fn contact_that_does_not_happen() {
    let far = BALL.replace("-0.102", "-3.0");
    let alone = build(BARE, &[]);
    let above = build(&format!("{BARE}{far}"), &[("contact.self", "false")]);
    assert_eq!(contacts(&above.simulation), ["body-contact"]);
    assert!(after(alone.simulation, 25).0 == after(above.simulation, 25).0);
}

/// Effects that are on do change the motion: the comparisons above can fail.
#[test]
fn effects_have_effects() {
    let scene = format!("{BARE}{BALL}");
    let plain = after(build(&scene, &[]).simulation, 25).0;
    for set in [
        ("damping.drag", "5"),
        ("damping.membrane", "0.01"),
        ("damping.bending", "0.1"),
        ("body.0.friction", "0"),
        ("relaxation.enabled", "true"),
    ] {
        let other = after(build(&scene, &[set]).simulation, 25).0;
        assert!(plain != other, "{set:?} has no effect");
    }
}
