//! Cloth of yarns from the scene file to a simulation.

mod text;

use selvedge_integrator::{Outcome, Simulation};
use selvedge_scene::build::BuiltScene;
use text::{build, simulation};

fn run(built: &BuiltScene, steps: usize, threads: usize) -> Simulation {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.expect("threads").install(|| {
        let mut simulation = simulation(built);
        for _ in 0..steps {
            let outcome = simulation.advance().expect("a step");
            assert!(matches!(outcome, Outcome::Accepted { .. }), "{outcome:?}");
        }
        simulation
    })
}

const KNIT: &str = "[[cloth]]\nkind = \"knit\"\nstitches = [10, 10]\n\
                    [simulation]\ngravity = [0, 0, 0]\n";

const FREE: &str = "[[cloth]]\nkind = \"knit\"\nstitches = [10, 10]\n\
                    [simulation]\ngravity = [0, 0, 0]\n\
                    [solver]\nproduct = \"matrix-free\"\n";

const WOVEN: &str = "[[cloth]]\nkind = \"woven\"\nyarns = [8, 9]\n\
                     yarn = \"weaving\"\n[[pin]]\nselect = { edge = \"left\" }\n";

/// Points in the scene's order and the width along course and wale [m].
fn extent(built: &BuiltScene, simulation: &Simulation) -> [f64; 3] {
    let q = built.geometry.flat_to_scene(&simulation.state().q);
    let (points, _) = q.as_chunks::<3>();
    std::array::from_fn(|i| {
        let of = points.iter().map(|p| p[i]);
        of.clone().fold(f64::NEG_INFINITY, f64::max) - of.fold(f64::INFINITY, f64::min)
    })
}

/// Mean of `y` weighted by the squared distance from the middle along course
/// and wale: positive where those edges rise to the right side [m].
fn curl(built: &BuiltScene, simulation: &Simulation) -> [f64; 2] {
    let q = built.geometry.flat_to_scene(&simulation.state().q);
    let (points, _) = q.as_chunks::<3>();
    let n = points.len() as f64;
    let mean = points.iter().map(|p| p[1]).sum::<f64>() / n;
    [0, 2].map(|axis| {
        let weight = |p: &[f64; 3]| p[axis] * p[axis];
        let sum: f64 = points.iter().map(weight).sum();
        let moment: f64 = points.iter().map(|p| weight(p) * (p[1] - mean)).sum();
        moment / sum
    })
}

/// The middle of the mass falls as `½ g t (t + h)`, whatever the yarns do meanwhile: no
/// curvature that a linearised step uses may hold cloth to its place.
#[test]
fn cloth_falls_freely() {
    let yarn = "[yarn.light]\nlibrary = \"weaving\"\nmass_damping = 0\n";
    let woven = "[[cloth]]\nkind = \"woven\"\nyarns = [8, 8]\nyarn = \"light\"\n";
    let knit = "[[cloth]]\nkind = \"knit\"\nstitches = [6, 6]\nyarn = \"light\"\n";
    // Loops that are laid push each other with a thousand times their weight, so that the
    // linear tolerance alone would leave the weight over. Arc lengths have momentum of their
    // own, and products in single precision round.
    for (cloth, sliding, precision, tolerance) in [
        (woven, "true", "f64", 1e-9),
        (woven, "true", "mixed", 5e-5),
        (woven, "false", "f64", 1e-9),
        (knit, "true", "f64", 1e-3),
        (knit, "true", "mixed", 2e-3),
        (knit, "false", "f64", 1e-9),
        (knit, "false", "mixed", 2e-3),
    ] {
        let text = format!("{cloth}{yarn}");
        let set = [
            ("cloth.0.sliding", sliding),
            ("solver.precision", precision),
        ];
        let built = build(&text, &set).expect("a scene");
        let steps = 60;
        let simulation = run(&built, steps, 1);
        let (x, _) = simulation.state().q.as_chunks::<3>();
        let masses = &simulation.plan().inertia.masses;
        let moment: f64 = x.iter().zip(masses).map(|(x, m)| m * x[1]).sum();
        let fallen = -moment / masses.iter().sum::<f64>();
        let (t, h) = (1e-3 * f64::from(steps as u32), 1e-3);
        let error = fallen / (0.5 * 9.81 * t * (t + h)) - 1.0;
        assert!(
            error.abs() < tolerance,
            "{cloth}{sliding} {precision}: {error:e}"
        );
    }
}

/// Stockinette curls to the back at its sides and to the front at top and
/// bottom; rib draws together across and stays flatter.
#[test]
fn knits_curl_and_draw_together() {
    let stockinette = build(KNIT, &[]).expect("a scene");
    let curled = run(&stockinette, 300, 1);
    let [sides, ends] = curl(&stockinette, &curled);
    assert!(sides < -1e-4 && ends > 1e-4, "{sides} {ends}");
    let size = [0, 2].map(|i| extent(&stockinette, &simulation(&stockinette))[i]);

    let rib = build(
        KNIT,
        &[
            ("cloth.0.chart", "rib-2x2"),
            ("cloth.0.stitches", "[12, 10]"),
        ],
    );
    let rib = rib.expect("a scene");
    let before = extent(&rib, &simulation(&rib));
    let drawn = extent(&rib, &run(&rib, 300, 1));
    assert!(drawn[0] < 0.75 * before[0], "{before:?} {drawn:?}");
    assert!(drawn[2] > 0.8 * before[2], "{before:?} {drawn:?}");
    assert!(size[0] > 0.0 && size[1] > 0.0);
}

/// The same bits for one thread and two.
#[test]
fn threads_do_not_matter() {
    for text in [KNIT, WOVEN] {
        let built = build(text, &[]).expect("a scene");
        let (one, two) = (run(&built, 20, 1), run(&built, 20, 2));
        assert_eq!(one.state(), two.state());
        assert!(one.state().q.iter().all(|x| x.is_finite()));
    }
}

/// A snapshot holds all that later steps depend on: anchors, angles, normals.
#[test]
fn resumed_runs_continue_bit_for_bit() {
    for text in [KNIT, WOVEN] {
        let built = build(text, &[]).expect("a scene");
        let mut first = run(&built, 15, 1);
        let mut second = simulation(&built);
        second.restore(&first.snapshot()).expect("the same plan");
        for _ in 0..15 {
            first.advance().expect("a step");
            second.advance().expect("a step");
        }
        assert_eq!(first.state(), second.state());
    }
}

/// What a scene does not call for is absent: no scalars without sliding, no
/// wrapping in woven cloth, no shear in knits, no friction without a
/// coefficient.
#[test]
fn effects_are_there_when_called_for() {
    let names = |text: &str, overrides: &[(&str, &str)]| {
        let built = build(text, overrides).expect("a scene");
        let simulation = simulation(&built);
        let plan = simulation.plan();
        let names = plan.terms.iter().map(|t| t.batch.name().to_owned());
        (names.collect::<Vec<_>>(), plan.layout.scalars)
    };
    let has = |names: &[String], name: &str| names.iter().any(|n| n == name);
    let (knit, scalars) = names(KNIT, &[]);
    assert!(has(&knit, "stitch wrapping") && has(&knit, "yarn friction"));
    assert!(has(&knit, "stitch length") && !has(&knit, "yarn shear") && scalars > 0);
    assert!(!has(&knit, "yarn gravity"));
    let (woven, scalars) = names(WOVEN, &[]);
    assert!(has(&woven, "yarn shear") && has(&woven, "yarn gravity"));
    assert!(!has(&woven, "stitch wrapping") && !has(&woven, "stitch length") && scalars > 0);
    let (locked, scalars) = names(WOVEN, &[("cloth.0.sliding", "false")]);
    assert!(!has(&locked, "yarn friction") && !has(&locked, "parallel yarns"));
    assert_eq!(scalars, 0);
    let smooth = format!("{WOVEN}[yarn.weaving]\nlibrary = \"weaving\"\nfriction = 0\n");
    assert!(!has(&names(&smooth, &[]).0, "yarn friction"));
}

/// Cloth of yarns takes one linear system a step unless told otherwise.
#[test]
fn defaults_of_yarns() {
    let kind = |text: &str| {
        let built = build(text, &[]).expect("a scene");
        let effective = built.scene().effective();
        (
            effective["integrator.kind"].clone(),
            effective["relaxation.enabled"].clone(),
        )
    };
    assert_eq!(kind(KNIT), ("linearised-euler".into(), false.into()));
    assert_eq!(kind(WOVEN), ("linearised-euler".into(), false.into()));
    let sheet = "[[cloth]]\nkind = \"sheet\"\nsize = [0.1, 0.1]\n";
    assert_eq!(kind(sheet), ("backward-euler".into(), true.into()));
}

/// A panel of a mesh is knitted and moves; a file of one flat square.
#[test]
fn meshes_are_knitted() {
    let folder = tempfile::tempdir().expect("a folder");
    let square = "v 0 0 0\nv 0.1 0 0\nv 0.1 0.1 0\nv 0 0.1 0\n\
                  vt 0 0\nvt 0.1 0\nvt 0.1 0.1\nvt 0 0.1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n";
    let file = folder.path().join("square.obj");
    std::fs::write(&file, square).expect("written");
    for kind in ["knit-mesh", "woven-mesh"] {
        let text = format!(
            "[[cloth]]\nkind = \"{kind}\"\nfile = {:?}\n[simulation]\ngravity = [0, 0, 0]\n",
            file.display().to_string()
        );
        let built = build(&text, &[]).unwrap_or_else(|e| panic!("{kind}: {e}"));
        let end = run(&built, 3, 1);
        assert!(end.state().layout.scalars > 100, "{kind}");
        assert!(end.state().first_not_finite().is_none(), "{kind}");
        assert_eq!(
            built.scene().effective()["integrator.kind"],
            "linearised-euler"
        );
    }
}

/// Charts, drafts and yarns that do not exist are named, with what there is.
#[test]
fn mistakes_are_named() {
    for (text, overrides, expected) in [
        (KNIT, ("cloth.0.chart", "stockinete"), "stockinette"),
        (KNIT, ("cloth.0.yarn", "wool"), "there is no yarn `wool`"),
        (WOVEN, ("cloth.0.draft", "twil"), "twill-2-2"),
        (KNIT, ("solver.matrix", "reassembled"), "solver.matrix"),
        (KNIT, ("solver.kind", "refined"), "solver.kind"),
        (
            FREE,
            ("solver.preconditioner", "node-ic"),
            "has no matrix to factor",
        ),
        (
            KNIT,
            ("cloth.0.chart", "feather-and-fan"),
            "feather-and-fan",
        ),
    ] {
        let error = build(text, &[overrides]).err().unwrap_or_default();
        assert!(error.contains(expected), "{overrides:?}: {error}");
    }
    let both = format!("{KNIT}[[cloth]]\nkind = \"sheet\"\nsize = [0.1, 0.1]\n");
    let error = build(&both, &[]).err().unwrap_or_default();
    assert!(error.contains("is a shell"), "{error}");
}

/// Stencil by stencil or put together: the same motion but for rounding, the
/// same bits for any number of threads.
#[test]
fn matrix_free_moves_alike() {
    // The same iteration, far below the bound: the systems of yarns amplify a
    // residual by orders of magnitude.
    let with = |product| {
        let all = [
            ("solver.precision", "f64"),
            ("solver.tolerance", "1e-12"),
            ("solver.preconditioner", "node-jacobi"),
            ("solver.max_iterations", "20000"),
            ("solver.product", product),
        ];
        build(KNIT, &all).expect("a scene")
    };
    let free = with("matrix-free");
    let a = run(&with("assembled"), 3, 1);
    let b = run(&free, 3, 1);
    assert!(b.plan().system.name().starts_with("matrix-free"));
    let (p, q) = (&a.state().v, &b.state().v);
    let size = p.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let apart = p.iter().zip(q).map(|(p, q)| (p - q).abs());
    let apart = apart.fold(0.0, f64::max);
    assert!(size > 0.0 && apart < 1e-7 * size, "{apart:e} of {size:e}");
    assert!(b.state().q == run(&free, 3, 2).state().q);
}

/// The same for a shell that hangs by a corner.
#[test]
fn matrix_free_shells_move_alike() {
    let sheet = "[[cloth]]\nsize = [0.1, 0.1]\npoints = [6, 6]\n\
                 [[pin]]\nselect = { corner = \"top-left\" }\n[relaxation]\nenabled = false\n";
    let with = |product| {
        let all = [
            ("solver.precision", "f64"),
            ("solver.tolerance", "1e-12"),
            ("solver.preconditioner", "block-jacobi"),
            ("solver.product", product),
        ];
        run(&build(sheet, &all).expect("a scene"), 10, 1)
    };
    let (a, b) = (with("assembled"), with("matrix-free"));
    assert!(b.plan().system.name().starts_with("matrix-free"));
    let (p, q) = (&a.state().v, &b.state().v);
    let size = p.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let apart = p.iter().zip(q).map(|(p, q)| (p - q).abs());
    let apart = apart.fold(0.0, f64::max);
    assert!(size > 0.0 && apart < 1e-9 * size, "{apart:e} of {size:e}");
}

/// Memory of the linear system with all that it keeps, for each point of a knit,
/// by product, preconditioner and precision.
#[test]
fn bytes_a_point() {
    let knit = "[[cloth]]\nkind = \"knit\"\nstitches = [16, 16]\n";
    for (product, preconditioner, precision, limit) in [
        ("assembled", "node-ic", "mixed", 4200),
        ("assembled", "node-ic", "f64", 7200),
        ("assembled", "node-jacobi", "mixed", 2000),
        ("matrix-free", "node-jacobi", "mixed", 3200),
    ] {
        let built = build(
            knit,
            &[
                ("solver.product", product),
                ("solver.preconditioner", preconditioner),
                ("solver.precision", precision),
            ],
        );
        let simulation = run(&built.expect("a scene"), 1, 1);
        let plan = simulation.plan();
        let bytes = plan.system.heap_bytes() / plan.layout.points;
        println!("{product} {preconditioner} {precision}: {bytes} bytes a point");
        assert!(bytes > limit / 2 && bytes < limit, "{bytes}");
    }
}

/// The seven built-in charts and four weaves take steps.
#[test]
fn everything_built_in_moves() {
    for (chart, stitches) in [
        ("stockinette", "[6, 6]"),
        ("garter", "[6, 6]"),
        ("rib-2x2", "[8, 6]"),
        ("seed", "[6, 6]"),
        ("feather-and-fan", "[18, 4]"),
        ("openwork-diamonds", "[13, 8]"),
        ("flame-chevron", "[16, 16]"),
    ] {
        let built = build(
            KNIT,
            &[("cloth.0.chart", chart), ("cloth.0.stitches", stitches)],
        );
        let built = built.unwrap_or_else(|e| panic!("{chart}: {e}"));
        let end = run(&built, 10, 1);
        assert!(end.state().first_not_finite().is_none(), "{chart}");
    }
    for draft in ["plain", "twill-2-2", "satin-5", "basket-2-2"] {
        let built = build(WOVEN, &[("cloth.0.draft", draft)]).expect(draft);
        let end = run(&built, 10, 1);
        assert!(end.state().first_not_finite().is_none(), "{draft}");
    }
}

/// Cloth laid with loops at rest moves less at the start than cloth laid flat,
/// and the cache gives the same loops again. A chart with increases is refused.
#[test]
fn relaxed_loops_start_calmer() {
    let speed = |rest_shape: &str| -> Result<f64, String> {
        let built = build(KNIT, &[("cloth.0.rest_shape", rest_shape)])?;
        let end = run(&built, 5, 1);
        let sum: f64 = end.state().v.iter().map(|v| v * v).sum();
        Ok((sum / end.state().v.len() as f64).sqrt())
    };
    let laid = speed("laid").expect("laid flat");
    let relaxed = speed("relaxed").expect("loops at rest");
    println!("{relaxed:.3e} of {laid:.3e} m/s");
    assert!(relaxed < 0.5 * laid, "{relaxed} of {laid} m/s");
    assert_eq!(Ok(relaxed), speed("relaxed"));
    let set = [
        ("cloth.0.rest_shape", "relaxed"),
        ("cloth.0.chart", "feather-and-fan"),
        ("cloth.0.stitches", "[18, 4]"),
    ];
    let error = build(KNIT, &set).err().unwrap_or_default();
    assert!(error.contains("increases or decreases"), "{error}");
}

/// A pattern is sewn and draped as a shell, then knitted where the shell lies:
/// outside its body by the thickness of the yarn, with yarns at rest length.
#[test]
fn patterns_are_knitted() {
    let pattern = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../scenes/patterns/tshirt.json"
    );
    let text = format!(
        "[[cloth]]\nkind = \"knit-pattern\"\nfile = {pattern:?}\nfabric = \"cotton-jersey\"\n\
         yarn = \"thick\"\ndrape_time = 0.02\n[yarn.thick]\nlibrary = \"pullover\"\n\
         radius = 4e-3\n[mesh]\nedge_length = 0.05\n[[body]]\nkind = \"mannequin\"\n"
    );
    let built = build(&text, &[]).expect("a scene");
    let n = &built.geometry.yarns.as_ref().expect("yarns").network;
    assert!(n.stitches.len() > 3000, "{} contacts", n.stitches.len());
    assert_eq!(built.body_thickness(), 8e-3);
    let strain = |[a, b]: [u32; 2]| {
        let [a, b] = [a, b].map(|s| n.strands[s as usize]);
        let [x, y] = [a, b].map(|s| n.points[s.node as usize]);
        let apart = (0..3).map(|k| (x[k] - y[k]).powi(2)).sum::<f64>().sqrt();
        (apart / (b.arc - a.arc) - 1.0).abs()
    };
    let strains: Vec<f64> = n.segments().map(strain).collect();
    let off = strains.iter().filter(|s| **s > 0.01).count();
    assert!(off * 1000 < strains.len(), "{off} of {}", strains.len());
    let end = run(&built, 2, 1);
    assert!(end.state().first_not_finite().is_none());
}
