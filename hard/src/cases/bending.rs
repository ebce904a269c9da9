//! Folding, degenerate hinges, closed shells, precision.

use std::f64::consts::PI;

use selvedge_energy::{DofLayout, EvalPoint, StencilEnergy};
use selvedge_shell_model::{BendingHinge, HingeRest, Undamped};

use super::scenes::{BARE, DAMPED, FLOOR, STIFF, icosphere, obj, obj_with_rest, scene};
use crate::case::{ALONE, Case, Expected, Figures, Pace, SOLVES, at_most, below, equal, told};
use crate::sim::{cross, norm, sub};
use crate::{Bench, HardError};

pub static CASES: [Case; 6] = [
    Case {
        number: 12,
        name: "folded-pair",
        setup: "two triangles folded onto each other, π − 1e-6, no gravity, 0.5 s",
        naive: "the angle jumps by 2π and the force changes its sign",
        bounds: &[
            equal("finite", "1", 1.0),
            below("largest jump of the angle", "rad", 1.0),
            below("final angle", "rad", 1.5),
        ],
        pace: Pace::Quick,
        axes: SOLVES,
        expected: Expected::Passes,
        run: folded,
    },
    Case {
        number: 13,
        name: "hinge-sweep",
        setup: "one hinge swept twice around through ±π with history",
        naive: "the force changes its sign at π",
        bounds: &[below("energy error", "1", 1e-12)],
        pace: Pace::Quick,
        axes: ALONE,
        expected: Expected::Passes,
        run: sweep,
    },
    Case {
        number: 14,
        name: "degenerate-hinge",
        setup: "wing of a folded hinge closes to 1e-9 of its height",
        naive: "the gradient of the angle grows without bound",
        bounds: &[
            equal("finite", "1", 1.0),
            at_most("force over k π / (0.02 η)", "1", 1.0),
        ],
        pace: Pace::Quick,
        axes: ALONE,
        expected: Expected::Passes,
        run: degenerate,
    },
    Case {
        number: 22,
        name: "precision-noise",
        setup: "3 mm mesh of 1e-6 N·m at rest on the floor, linear systems in mixed precision",
        naive: "wrinkles made of round-off",
        bounds: &[
            below("surface noise", "m", 1e-5),
            told("surface noise in f64", "m"),
        ],
        pace: Pace::Quick,
        axes: SOLVES,
        expected: Expected::Passes,
        run: noise,
    },
    Case {
        number: 24,
        name: "catenary",
        setup: "strip of 1 m between supports 0.8 m apart, to rest",
        naive: "a wrong sag from stretch, or a lopsided one",
        bounds: &[below("sag error", "1", 1e-2), below("asymmetry", "m", 1e-4)],
        pace: Pace::Quick,
        axes: SOLVES,
        expected: Expected::Passes,
        run: catenary,
    },
    Case {
        number: 43,
        name: "closed-sphere",
        setup: "closed ball of cloth, rest angles those of the ball, no gravity, 1 s",
        naive: "it inflates or shrinks by itself",
        bounds: &[below("displacement", "m", 1e-8)],
        pace: Pace::Quick,
        axes: ALONE,
        expected: Expected::Passes,
        run: closed,
    },
];

/// Angle between two triangles (0, 1, 2) and (1, 0, 3), 0 when flat.
fn angle(x: &[[f64; 3]]) -> f64 {
    let n = cross(sub(x[1], x[0]), sub(x[2], x[0]));
    let m = cross(sub(x[0], x[1]), sub(x[3], x[1]));
    let dot: f64 = n.iter().zip(m).map(|(a, b)| a * b).sum();
    norm(cross(n, m)).atan2(dot)
}

fn folded(b: &Bench) -> Result<Figures, HardError> {
    let (s, c) = (PI - 1e-6).sin_cos();
    let points = [
        [0.0, 0.0, 0.0],
        [0.02, 0.0, 0.0],
        [0.01, 0.02, 0.0],
        [0.01, -0.02 * c, -0.02 * s],
    ];
    let rest = [[0.0, 0.0], [0.02, 0.0], [0.01, 0.02], [0.01, -0.02]];
    b.file(
        "pair.obj",
        &obj_with_rest(&points, &rest, &[[0, 1, 2], [1, 0, 3]]),
    )?;
    let text = scene(&[
        BARE,
        STIFF,
        "[[cloth]]\nkind = \"mesh\"\nfile = \"pair.obj\"\nrest = \"texture\"\nfabric = \"f\"\n",
    ]);
    let set = [
        ("simulation.duration", "0.5"),
        ("simulation.gravity", "[0, 0, 0]"),
        ("contact.self", "false"),
        (
            "fabric.f.damping",
            "{ drag = 5.0, membrane = 0.01, bending = 0.1 }",
        ),
    ];
    let mut sim = b.sim(&text, &set)?;
    let (mut last, mut jump) = (angle(&sim.points()), 0.0_f64);
    while sim.step()? {
        let now = angle(&sim.points());
        jump = jump.max((now - last).abs());
        last = now;
    }
    Ok(vec![
        ("finite", sim.finite()),
        ("largest jump of the angle", jump),
        ("final angle", last),
    ])
}

fn wing(theta: f64, height: f64) -> [f64; 12] {
    let (s, c) = theta.sin_cos();
    let w = 0.008 * height;
    [
        0.0,
        0.0,
        0.0,
        0.01,
        0.0,
        0.0,
        0.004,
        0.009,
        0.0,
        0.0055,
        -w * c,
        -w * s,
    ]
}

fn hinge(stiffness: f64) -> BendingHinge<Undamped> {
    BendingHinge::new(&[HingeRest {
        points: [0, 1, 2, 3],
        stiffness,
        angle: 0.0,
        length: 0.01,
        heights: [0.009, 0.008],
        damping: 0.0,
    }])
}

fn at(q: &[f64]) -> EvalPoint<'_> {
    EvalPoint {
        layout: DofLayout::points(4),
        q,
        q_start: q,
        dt: 1e-3,
    }
}

fn sweep(_: &Bench) -> Result<Figures, HardError> {
    let mut energy = hinge(2.0);
    let mut worst = 0.0_f64;
    for i in 0..=4000 {
        let theta = PI * f64::from(i) / 1000.0;
        let q = wing(theta, 1.0);
        let mut g = [0.0; 12];
        let value = energy.gradient(0, &q, &at(&q), &mut g);
        let exact = theta * theta;
        worst = worst.max((value - exact).abs() / (1.0 + exact));
        energy.commit(&at(&q));
    }
    Ok(vec![("energy error", worst)])
}

fn degenerate(_: &Bench) -> Result<Figures, HardError> {
    let k = 1e-5;
    let mut energy = hinge(k);
    let bound = k * PI / (0.02 * 0.008);
    let (mut finite, mut worst) = (1.0, 0.0_f64);
    for exponent in 0..=90 {
        let q = wing(2.0, 10_f64.powf(-0.1 * f64::from(exponent)));
        energy.begin_step(&at(&q));
        let mut g = [0.0; 12];
        let value = energy.gradient(0, &q, &at(&q), &mut g);
        if !value.is_finite() || g.iter().any(|g| !g.is_finite()) {
            finite = 0.0;
        }
        for f in g.as_chunks::<3>().0 {
            worst = worst.max(norm(*f) / bound);
        }
        energy.commit(&at(&q));
    }
    Ok(vec![
        ("finite", finite),
        ("force over k π / (0.02 η)", worst),
    ])
}

fn noise(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[
        BARE,
        DAMPED,
        "[[cloth]]\nkind = \"sheet\"\nsize = [0.06, 0.06]\nedge_length = 0.003\ncenter = [0, \
         -0.0006, 0]\nfabric = \"f\"\n",
        FLOOR,
    ]);
    let measure = |precision: &str| -> Result<f64, HardError> {
        let mut set = vec![
            ("simulation.duration", "0.1"),
            ("contact.self", "false"),
            (
                "fabric.f.bending",
                "{ form = \"isotropic\", rigidity = 1e-6 }",
            ),
        ];
        if !precision.is_empty() {
            set.push(("solver.precision", precision));
        }
        let mut sim = b.sim(&text, &set)?;
        sim.run()?;
        let y: Vec<f64> = sim.points().iter().map(|p| p[1]).collect();
        let mean = y.iter().sum::<f64>() / y.len() as f64;
        let square: f64 = y.iter().map(|y| (y - mean).powi(2)).sum();
        Ok((square / y.len() as f64).sqrt())
    };
    Ok(vec![
        ("surface noise", measure("")?),
        ("surface noise in f64", measure("f64")?),
    ])
}

fn catenary(b: &Bench) -> Result<Figures, HardError> {
    let (span, k, cells) = (0.8, 5000.0, 40_u32);
    let (mut points, mut rest, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
    for j in 0..=cells {
        let v = f64::from(j) / f64::from(cells);
        for i in 0..=1_u32 {
            let u = 0.025 * f64::from(i);
            points.push([u, -0.9 * v * (1.0 - v), span * v]);
            rest.push([u, v]);
        }
    }
    for j in 0..cells {
        let [a, b, c, d] = [2 * j, 2 * j + 1, 2 * j + 3, 2 * j + 2];
        if j % 2 == 0 {
            triangles.extend([[a, b, c], [a, c, d]]);
        } else {
            triangles.extend([[a, b, d], [b, c, d]]);
        }
    }
    b.file("strip.obj", &obj_with_rest(&points, &rest, &triangles))?;
    let text = format!(
        "{BARE}[fabric.f]\ndensity = 0.2\nmembrane = {{ form = \"isotropic\", stiffness = {k:?}, \
         poisson = 0.0 }}\nbending = {{ form = \"isotropic\", rigidity = 1e-9 }}\n[[cloth]]\nkind \
         = \"mesh\"\nfile = \"strip.obj\"\nrest = \"texture\"\nfabric = \"f\"\n[[pin]]\nselect = \
         {{ points = [0, 1, {}, {}] }}\n",
        2 * cells,
        2 * cells + 1
    );
    let set = [
        ("simulation.duration", "10"),
        ("integrator.max_step", "0.02"),
        ("integrator.newton_tolerance", "1e-6"),
        ("integrator.newton_iterations", "60"),
        ("integrator.line_search_halvings", "20"),
    ];
    let mut sim = b.sim(&text, &set)?;
    sim.run()?;
    let x = sim.points();
    let row = |j: u32| -> [f64; 3] {
        let [p, q] = [2 * j, 2 * j + 1].map(|k| x[k as usize]);
        std::array::from_fn(|i| 0.5 * (p[i] + q[i]))
    };
    let sag = -row(cells / 2)[1];
    let solve = |length: f64| {
        let (mut low, mut high) = (0.05, 10.0);
        for _ in 0..100 {
            let a: f64 = 0.5 * (low + high);
            if 2.0 * a * (span / (2.0 * a)).sinh() > length {
                low = a;
            } else {
                high = a;
            }
        }
        (low, low * ((span / (2.0 * low)).cosh() - 1.0))
    };
    let (a, _) = solve(1.0);
    let tension = 0.2 * 9.81 * a * 0.5 * (span + a * (span / a).sinh());
    let (_, exact) = solve(1.0 + tension / k);
    let lopsided = (0..cells / 2).map(|j| {
        let (l, r) = (row(j), row(cells - j));
        (l[1] - r[1]).abs().max((l[2] + r[2] - span).abs())
    });
    Ok(vec![
        ("sag error", (sag / exact - 1.0).abs()),
        ("asymmetry", lopsided.fold(0.0, f64::max)),
    ])
}

fn closed(b: &Bench) -> Result<Figures, HardError> {
    let (points, triangles) = icosphere(2, 0.1);
    b.file("ball.obj", &obj(&points, &triangles))?;
    let text = scene(&[
        BARE,
        STIFF,
        "[[cloth]]\nkind = \"mesh\"\nfile = \"ball.obj\"\nrest = \"shape\"\nrest_angles = \"shape\"\nfabric = \"f\"\n",
    ]);
    let set = [
        ("simulation.duration", "1.0"),
        ("simulation.gravity", "[0, 0, 0]"),
        ("contact.self", "false"),
        (
            "fabric.f.bending",
            "{ form = \"isotropic\", rigidity = 1e-5 }",
        ),
    ];
    let mut sim = b.sim(&text, &set)?;
    let start = sim.points();
    sim.run()?;
    let moved = crate::sim::distance(&start, &sim.points())[0];
    Ok(vec![("displacement", moved)])
}
