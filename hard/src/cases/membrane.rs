//! Stretch, compression, collapsed and thin triangles.

use selvedge_shell_model::sheet;

use super::scenes::{BALL, BARE, DAMPED, FLOOR, GENTLE, SHEET, STIFF, obj, scene};
use crate::case::{Case, Expected, Figures, Pace, SOLVES, at_least, at_most, below, equal};
use crate::sim::{area, distance};
use crate::{Bench, HardError};

pub static CASES: [Case; 7] = [
    Case {
        number: 4,
        name: "stiffness-ratio",
        setup: "hanging sheet of 0.3 m, k a²/B = 1e6 … 1e9, 0.3 s",
        naive: "the linear solver stalls, cloth locks or is rubber",
        bounds: &[
            at_most("Newton iterations", "1", 5.0),
            at_most("linear iterations", "1", 500.0),
            below("stretch over the exact", "1", 1.2),
        ],
        pace: Pace::Quick,
        axes: SOLVES,
        expected: Expected::Passes,
        run: stiffness_ratio,
    },
    Case {
        number: 7,
        name: "slivers",
        setup: "sheet on a ball with every 20th triangle cut at an aspect of 1e3, 0.3 s; block-jacobi",
        naive: "condition numbers explode, the step goes to zero",
        bounds: &[
            at_least("least step", "1", 1.0 / 64.0),
            below("linear iterations", "1", 500.0),
            below("distance to the clean mesh", "m", 5e-3),
        ],
        pace: Pace::Quick,
        axes: SOLVES,
        expected: Expected::Passes,
        run: slivers,
    },
    Case {
        number: 9,
        name: "stretched-start",
        setup: "sheet on a smooth floor begins at twice its size, gentle start, 1 s",
        naive: "explosion",
        bounds: &[
            equal("finite", "1", 1.0),
            below("speed", "m/s", 2.0),
            below("distance to the run at rest size", "m", 3e-3),
        ],
        pace: Pace::Quick,
        axes: SOLVES,
        expected: Expected::Passes,
        run: stretched,
    },
    Case {
        number: 10,
        name: "compressed-start",
        setup: "exactly flat sheet at half its size with 1e-9 m of noise, no gravity, 1 s",
        naive: "stuck flat on an unstable equilibrium, or an indefinite matrix",
        bounds: &[equal("finite", "1", 1.0), below("area error", "1", 1e-2)],
        pace: Pace::Quick,
        axes: SOLVES,
        expected: Expected::Passes,
        run: compressed,
    },
    Case {
        number: 11,
        name: "collapsed-triangle",
        setup: "one triangle of a sheet with its three points in one place",
        naive: "a normal of NaN",
        bounds: &[
            equal("finite", "1", 1.0),
            at_least("area after 0.5 s", "1", 0.9),
        ],
        pace: Pace::Quick,
        axes: SOLVES,
        expected: Expected::Passes,
        run: collapsed,
    },
    Case {
        number: 27,
        name: "stretch-limit",
        setup: "sheet pulled to three times its length within 0.2 s",
        naive: "the cubic stiffening of the law stalls Newton's method",
        bounds: &[
            equal("finite", "1", 1.0),
            at_least("stretch", "1", 2.9),
            at_most("Newton iterations", "1", 5.0),
            at_least("last step", "1", 1.0 / 64.0),
        ],
        pace: Pace::Quick,
        axes: SOLVES,
        expected: Expected::Passes,
        run: limit,
    },
    Case {
        number: 32,
        name: "no-stiffness",
        setup: "fabric of 1e-12 N/m and 1e-18 N·m falls on the floor, 0.2 s",
        naive: "singular blocks",
        bounds: &[equal("finite", "1", 1.0), at_least("least step", "1", 1e-3)],
        pace: Pace::Quick,
        axes: SOLVES,
        expected: Expected::Passes,
        run: no_stiffness,
    },
];

fn stiffness_ratio(b: &Bench) -> Result<Figures, HardError> {
    let (mut newton, mut linear, mut stretch) = (0, 0.0_f64, 0.0_f64);
    for ratio in [1e6, 1e7, 1e8, 1e9] {
        let (k, edge) = (2000.0, 0.3 / 11.0);
        let text = format!(
            "{GENTLE}\n[fabric.f]\ndensity = 0.2\nmembrane = {{ form = \"isotropic\", stiffness = \
             {k:?}, poisson = 0.0 }}\nbending = {{ form = \"isotropic\", rigidity = {:?} }}\n\
             [[cloth]]\nkind = \"sheet\"\nsize = [0.3, 0.3]\npoints = [12, 12]\nrotation = \
             [90, 0, 0]\nfabric = \"f\"\n[[pin]]\nselect = {{ edge = \"top\" }}\n",
            k * edge * edge / ratio
        );
        let set = [
            ("simulation.duration", "0.3"),
            ("simulation.gravity", "[0, 9.81, 0]"),
        ];
        let mut sim = b.sim(&text, &set)?;
        // Gravity pulls away from the pinned edge, wherever that is.
        let points = sim.points();
        let pinned = sim.s.plan().pins.as_ref().map(|p| p.points[0]);
        let held = pinned.map_or([0.0; 3], |p| {
            let q = &sim.s.state().q;
            std::array::from_fn(|i| q[3 * p as usize + i])
        });
        let center = points.iter().map(|p| p[1]).sum::<f64>() / points.len() as f64;
        let down = if held[1] > center { -9.81 } else { 9.81 };
        sim.s.plan_mut().inertia.gravity = [0.0, down, 0.0];
        sim.run()?;
        newton = newton.max(sim.log.max_newton);
        linear = linear.max(sim.log.max_linear);
        let exact = 0.2 * 9.81 * 0.3 / (2.0 * k);
        stretch = stretch.max((sim.mean_stretch() - 1.0) / exact);
    }
    Ok(vec![
        ("Newton iterations", newton as f64),
        ("linear iterations", linear),
        ("stretch over the exact", stretch),
    ])
}

fn slivers(b: &Bench) -> Result<Figures, HardError> {
    let flat = sheet::equilateral(9, 10, [0.2, 0.2])?;
    let mut points: Vec<[f64; 3]> = flat
        .flat
        .iter()
        .map(|[u, v]| [u - 0.1, 0.0, v - 0.1])
        .collect();
    let clean = flat.mesh.triangles().to_vec();
    let mut cut = Vec::new();
    for (i, &[p, q, r]) in clean.iter().enumerate() {
        if i % 20 != 7 {
            cut.push([p, q, r]);
            continue;
        }
        // A point a thousandth of the height off the middle of an edge.
        let [x, y, z] = [p, q, r].map(|p| points[p as usize]);
        let new = std::array::from_fn(|k| {
            let middle = 0.5 * (x[k] + y[k]);
            middle + 1e-3 * (z[k] - middle)
        });
        let n = points.len() as u32;
        points.push(new);
        cut.extend([[p, q, n], [q, r, n], [r, p, n]]);
    }
    let old = flat.flat.len();
    // Facing up: the sheet's plane is turned over by its map into space.
    let flip = |t: &[[u32; 3]]| t.iter().map(|t| [t[0], t[2], t[1]]).collect::<Vec<_>>();
    b.file("clean.obj", &obj(&points[..old], &flip(&clean)))?;
    b.file("cut.obj", &obj(&points, &flip(&cut)))?;
    let drape = |file: &str| -> Result<crate::Sim, HardError> {
        let cloth = format!(
            "[[cloth]]\nkind = \"mesh\"\nfile = \"{file}\"\nrest = \"shape\"\nfabric = \"f\"\n"
        );
        let text = scene(&[GENTLE, DAMPED, &cloth, BALL]);
        let set = [
            ("simulation.duration", "0.3"),
            ("contact.self", "false"),
            ("solver.preconditioner", "block-jacobi"),
        ];
        let mut sim = b.sim(&text, &set)?;
        sim.run()?;
        Ok(sim)
    };
    let (clean, cut) = (drape("clean.obj")?, drape("cut.obj")?);
    Ok(vec![
        ("least step", (cut.least_step() * 16.0).min(1.0)),
        ("linear iterations", cut.log.max_linear),
        (
            "distance to the clean mesh",
            distance(&clean.points(), &cut.points()[..old])[0],
        ),
    ])
}

fn stretched(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[GENTLE, DAMPED, SHEET, FLOOR]);
    let run = |stretch: &str| -> Result<crate::Sim, HardError> {
        let set = [
            ("simulation.duration", "1.0"),
            ("cloth.0.stretch", stretch),
            ("contact.friction", "0"),
            ("contact.self", "false"),
        ];
        let mut sim = b.sim(&text, &set)?;
        sim.run()?;
        Ok(sim)
    };
    let (still, wide) = (run("1")?, run("2")?);
    Ok(vec![
        ("finite", wide.finite()),
        ("speed", wide.log.speed),
        (
            "distance to the run at rest size",
            distance(&still.points(), &wide.points())[0],
        ),
    ])
}

fn compressed(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[GENTLE, DAMPED, SHEET]);
    let set = [
        ("simulation.duration", "1.0"),
        ("simulation.gravity", "[0, 0, 0]"),
        ("cloth.0.stretch", "0.5"),
        ("cloth.0.noise", "1e-9"),
    ];
    let mut sim = b.sim(&text, &set)?;
    sim.run()?;
    Ok(vec![
        ("finite", sim.finite()),
        ("area error", (sim.area() - 1.0).abs()),
    ])
}

fn collapsed(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[BARE, DAMPED, SHEET]);
    let set = [
        ("simulation.duration", "0.5"),
        ("simulation.gravity", "[0, 0, 0]"),
    ];
    let mut sim = b.sim(&text, &set)?;
    let mesh = &sim.built.geometry.mesh;
    let middle = mesh.triangles()[mesh.triangles().len() / 2];
    let rest = mesh.rest_area(mesh.triangles().len() / 2);
    let (q, _) = sim.s.state_mut().q.as_chunks_mut::<3>();
    let place = q[middle[0] as usize];
    for p in middle {
        q[p as usize] = place;
    }
    sim.run()?;
    let (q, _) = sim.s.state().q.as_chunks::<3>();
    Ok(vec![
        ("finite", sim.finite()),
        ("area after 0.5 s", area(q, &middle) / rest),
    ])
}

fn limit(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[
        BARE,
        DAMPED,
        SHEET,
        "[[pin]]\nselect = { edge = \"left\" }\n[[pin]]\nselect = { edge = \"right\" }\nmotion = \
         [{ time = 0 }, { time = 0.2, translation = [0.40002, 0, 0] }]\n",
    ]);
    let mut sim = b.sim(&text, &[("simulation.duration", "0.3")])?;
    sim.run()?;
    let last = sim.s.next_dt() / sim.s.settings().control.max_step;
    let points = sim.points();
    let reach = points.iter().map(|p| p[0]).fold(f64::MIN, f64::max)
        - points.iter().map(|p| p[0]).fold(f64::MAX, f64::min);
    Ok(vec![
        ("finite", sim.finite()),
        ("stretch", reach / 0.2),
        ("Newton iterations", sim.log.max_newton as f64),
        ("last step", last),
    ])
}

fn no_stiffness(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[BARE, STIFF, SHEET, FLOOR]);
    let set = [
        ("simulation.duration", "0.2"),
        (
            "fabric.f.membrane",
            "{ warp = 1e-12, weft = 1e-12, shear = 1e-12, coupling = 0.0 }",
        ),
        (
            "fabric.f.bending",
            "{ form = \"isotropic\", rigidity = 1e-18 }",
        ),
    ];
    let mut sim = b.sim(&text, &set)?;
    sim.run()?;
    Ok(sim.usual())
}
