//! `integrator.kind = "static"`: cloth of triangles and of yarns brought to rest
//! without motion.

mod text;

use selvedge_integrator::{EndReason, Outcome, Simulation};
use selvedge_scene::build::BuiltScene;
use text::{build, simulation};

/// What a run ended with.
struct Rested {
    built: BuiltScene,
    simulation: Simulation,
    end: EndReason,
    /// Largest unbalanced force [N].
    force: f64,
}

impl Rested {
    /// Points in the scene's order [m].
    fn points(&self) -> Vec<[f64; 3]> {
        let q = self
            .built
            .geometry
            .flat_to_scene(&self.simulation.state().q);
        q.as_chunks::<3>().0.to_vec()
    }

    /// From the lowest to the highest point [m].
    fn height(&self) -> f64 {
        let y: Vec<f64> = self.points().iter().map(|p| p[1]).collect();
        let low = y.iter().copied().fold(f64::INFINITY, f64::min);
        y.iter().copied().fold(f64::NEG_INFINITY, f64::max) - low
    }
}

/// Runs to the end. The energy of a static solve falls from step to step.
fn rest(text: &str, overrides: &[(&str, &str)], threads: usize) -> Rested {
    let built = build(text, overrides).expect("a scene");
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.expect("threads").install(|| {
        let mut simulation = simulation(&built);
        let mut force = f64::NAN;
        let end = loop {
            match simulation.advance().expect("a step") {
                Outcome::Accepted { report, .. } => {
                    force = report.rest.map_or(f64::NAN, |r| r.force);
                    assert!(report.rest.is_none_or(|r| r.force == report.residual));
                }
                Outcome::Rejected { .. } => {}
                Outcome::Ended(end) => break end,
            }
        };
        println!("{:?} {force:.2e} N {end:?}", simulation.counters());
        Rested {
            built,
            simulation,
            end,
            force,
        }
    })
}

const STATIC: (&str, &str) = ("integrator.kind", "static");

/// A strip of 1 m held at its left edge, lying flat.
const STRIP: &str = "[[cloth]]\nkind = \"sheet\"\nsize = [1.0, 0.05]\npoints = [41, 3]\n\
    fabric = \"thin\"\n[[pin]]\nselect = { edge = \"left\" }\n\
    [fabric.thin]\ndensity = 0.2\nmembrane = { form = \"isotropic\", stiffness = 100.0, poisson = 0.0 }\n\
    bending = { form = \"isotropic\", rigidity = 1e-9 }\n[contact]\nself = false\n\
    [simulation]\nduration = 5.0\ngravity = [0, -9.81, 0]\n";

/// The strip swings down and hangs as long as the Saint Venant-Kirchhoff law
/// says: `L' = (k/2w) [¾ (s⁴ − 1) − ½ (s² − 1)]`, `½ k (s³ − s) = w L`.
#[test]
fn a_strip_hangs() {
    let r = rest(STRIP, &[STATIC], 1);
    assert_eq!(r.end, EndReason::AtRest);
    assert!(r.force < 1e-6);
    let (k, w) = (100.0, 0.2 * 9.81);
    let mut s: f64 = 1.0;
    for _ in 0..60 {
        s -= (0.5 * k * (s * s * s - s) - w) / (0.5 * k * (3.0 * s * s - 1.0));
    }
    let exact = k / (2.0 * w) * (0.75 * (s.powi(4) - 1.0) - 0.5 * (s * s - 1.0));
    let (found, foreseen) = (r.height() - 1.0, exact - 1.0);
    println!("elongation {found:.6} m, closed form {foreseen:.6} m");
    assert!((found / foreseen - 1.0).abs() < 2e-3, "{found} {foreseen}");
}

/// A strip of 1 m between supports 1 m apart sags as the elastic catenary.
#[test]
fn a_strip_sags() {
    let text = format!("{STRIP}[[pin]]\nselect = {{ edge = \"right\" }}\n");
    let set = [
        STATIC,
        ("cloth.0.points", "[81, 3]"),
        ("fabric.thin.membrane.stiffness", "5000.0"),
    ];
    let r = rest(&text, &set, 1);
    assert_eq!(r.end, EndReason::AtRest);
    let (k, w, length) = (5000.0, 0.2 * 9.81, 1.0);
    let half = |h: f64| h * 0.5 * length / k + h / w * (0.5 * w * length / h).asinh();
    let (mut low, mut high) = (1e-3, 100.0);
    for _ in 0..200 {
        let h = 0.5 * (low + high);
        if half(h) < 0.5 { low = h } else { high = h }
    }
    let (h, s) = (0.5 * (low + high), 0.5 * length);
    let exact = w * s * s / (2.0 * k) + h / w * ((1.0 + (w * s / h).powi(2)).sqrt() - 1.0);
    let sag = r.height();
    println!("sag {sag:.6} m, closed form {exact:.6} m");
    assert!((sag / exact - 1.0).abs() < 5e-3);
}

/// A strip that hangs over and lies on a floor: where motion with damping ends,
/// the static solve ends.
#[test]
fn a_drape_is_that_of_motion() {
    let text = format!(
        "{STRIP}[[body]]\nkind = \"plane\"\npoint = [0.0, -0.06, 0.0]\nnormal = [0.0, 1.0, 0.0]\n"
    );
    let shape = [
        ("cloth.0.size", "[0.2, 0.03]"),
        ("cloth.0.points", "[21, 4]"),
        ("fabric.thin.bending.rigidity", "2e-5"),
        ("contact.friction", "0"),
    ];
    let mut set = shape.to_vec();
    set.push(STATIC);
    let still = rest(&text, &set, 1);
    assert_eq!(still.end, EndReason::AtRest);
    let mut set = shape.to_vec();
    set.extend([
        ("damping.drag", "8"),
        ("integrator.newton_tolerance", "1e-6"),
        ("integrator.newton_iterations", "30"),
        ("stop.kinetic_energy", "1e-16"),
        ("simulation.duration", "8.0"),
        ("integrator.max_step", "4e-3"),
    ]);
    let moving = rest(&text, &set, 1);
    let apart = still
        .points()
        .into_iter()
        .zip(moving.points())
        .map(|(a, b)| {
            let d: f64 = (0..3).map(|k| (a[k] - b[k]).powi(2)).sum();
            d.sqrt()
        });
    let most = apart.fold(0.0, f64::max);
    println!("static and dynamic drape: {most:.2e} m apart");
    assert!(most < 1e-4, "{most} m");
}

const KNIT: &str = "[[cloth]]\nkind = \"knit\"\nrest_shape = \"relaxed\"\nstitches = [10, 10]\n\
    [simulation]\ngravity = [0, 0, 0]\nduration = 3.0\n";

/// A free patch of stockinette comes to rest, with the same bits on one thread
/// and two.
#[test]
fn stockinette_comes_to_rest() {
    let text = KNIT.replace("[10, 10]", "[8, 8]");
    let set = [STATIC, ("cloth.0.rest_shape", "laid")];
    let one = rest(&text, &set, 1);
    assert_eq!(one.end, EndReason::AtRest);
    assert!(one.force < 1e-6);
    let few = [set[0], set[1], ("simulation.duration", "0.03")];
    let (one, two) = (rest(&text, &few, 1), rest(&text, &few, 2));
    assert_eq!(one.simulation.state(), two.simulation.state());
}

/// A free patch of garter comes to rest, and neighbouring loops inside are
/// equal within a few percent.
#[test]
fn garter_comes_to_rest() {
    let r = rest(KNIT, &[STATIC, ("cloth.0.chart", "garter")], 1);
    assert_eq!(r.end, EndReason::AtRest);
    assert!(r.force < 1e-6);
    let yarns = r.built.geometry.yarns.as_ref().expect("yarns");
    let points = r.simulation.state().q.as_chunks::<3>().0;
    let spread = yarns.network.loop_spread(points, [1, 2], 3);
    println!("{spread:?}");
    assert!(spread.pairs >= 20 && spread.mean < 0.05, "{spread:?}");
}

/// Woven cloth hangs from an edge until all forces are balanced, with yarns that
/// stick or cannot slide. (Without friction its yarns slide on.)
#[test]
fn weave_comes_to_rest() {
    let text = "[[cloth]]\nkind = \"woven\"\nyarns = [8, 9]\nyarn = \"weaving\"\n\
        [[pin]]\nselect = { edge = \"left\" }\n[simulation]\nduration = 0.5\n";
    for hold in [
        ("cloth.0.sliding", "false"),
        ("integrator.static_friction", "true"),
    ] {
        let r = rest(text, &[STATIC, hold], 1);
        assert_eq!(r.end, EndReason::AtRest, "{hold:?}");
        assert!(r.force < 1e-6);
    }
}

/// Neither damping nor friction is there unless asked for; nothing moves.
#[test]
fn a_static_plan_has_no_losses() {
    let text = KNIT.replace("rest_shape = \"relaxed\"\n", "");
    let names = |overrides: &[(&str, &str)]| {
        let built = build(&text, overrides).expect("a scene");
        let simulation = simulation(&built);
        let terms = simulation.plan().terms.iter();
        let names: Vec<String> = terms.map(|t| t.batch.name().to_owned()).collect();
        (names, built.scene().effective())
    };
    let (terms, settings) = names(&[STATIC]);
    assert!(!terms.iter().any(|n| n.contains("friction")), "{terms:?}");
    assert_eq!(settings["solver.kind"], "direct");
    assert_eq!(settings["solver.precision"], "f64");
    let (terms, _) = names(&[STATIC, ("integrator.static_friction", "true")]);
    assert!(terms.iter().any(|n| n == "yarn friction"), "{terms:?}");
    let changing = build(&text, &[STATIC, ("topology.changes", "true")]);
    assert!(changing.err().unwrap_or_default().contains("static solve"));
}

/// Too few iterations: the run says how far from rest it is, and goes on from a
/// snapshot with the same bits.
#[test]
fn a_static_solve_can_be_resumed() {
    let text = STRIP;
    let set = [STATIC, ("simulation.duration", "0.02")];
    let whole = rest(text, &set, 1);
    assert_eq!(whole.end, EndReason::Duration);
    assert!(whole.force > 1e-6);
    let built = build(text, &set).expect("a scene");
    let mut first = simulation(&built);
    for _ in 0..7 {
        first.advance().expect("a step");
    }
    let mut second = simulation(&built);
    second.restore(&first.snapshot()).expect("the same plan");
    while !matches!(second.advance().expect("a step"), Outcome::Ended(_)) {}
    assert_eq!(second.state(), whole.simulation.state());
}
