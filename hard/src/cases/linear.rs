//! Linear systems: masses far apart, refinement, filters; and what yarns will
//! need.

use std::sync::Arc;

use selvedge_energy::EvalPoint;
use selvedge_linsolve::{
    BlockFilter, BlockIc, Bsr, Filter, LinearSolver, Mpcg, MpcgSettings, Pattern, Refined,
};

use super::scenes::{BARE, SHEET, STIFF, scene};
use crate::case::{
    ALONE, Case, Expected, Figures, Pace, SOLVES, at_most, below, equal, nothing, told,
};
use crate::{Bench, HardError};

pub static CASES: [Case; 5] = [
    Case {
        number: 21,
        name: "mass-ratio",
        setup: "a point of 1 g among points of 1e-9 kg, hanging by a corner, 20 steps; \
                `integrator.point_tolerance` of 5e-4 m/s, and none",
        naive: "the residual sees the heavy point only",
        bounds: &[
            equal("finite", "1", 1.0),
            below("velocity error of light points", "m/s", 1e-3),
            told("without a tolerance for points", "m/s"),
        ],
        pace: Pace::Quick,
        axes: SOLVES,
        expected: Expected::Passes,
        run: mass_ratio,
    },
    Case {
        number: 23,
        name: "refinement",
        setup: "grid operator of condition 1e6, single precision inside with incomplete Cholesky, \
                double outside",
        naive: "single precision stalls at the condition number times 6e-8",
        bounds: &[
            below("relative residual", "1", 1e-10),
            at_most("passes", "1", 5.0),
        ],
        pace: Pace::Quick,
        axes: ALONE,
        expected: Expected::Passes,
        run: refinement,
    },
    Case {
        number: 35,
        name: "opposed-constraints",
        setup: "one point pinned, kept in a plane and on a line, all at odds",
        naive: "the filter is no projector",
        bounds: &[
            below("S² − S", "1", 1e-14),
            equal("violations reported", "1", 1.0),
        ],
        pace: Pace::Quick,
        axes: ALONE,
        expected: Expected::Passes,
        run: opposed,
    },
    Case {
        number: 37,
        name: "point-without-yarn",
        setup: "hybrid point that no yarn node reaches: BᵀB is singular",
        naive: "Cholesky fails",
        bounds: &[below("BᵀF", "1", 1e-10)],
        pace: Pace::Quick,
        axes: ALONE,
        expected: Expected::NotYet("yarns inside triangles"),
        run: nothing,
    },
    Case {
        number: 38,
        name: "light-yarn-nodes",
        setup: "low-rank mass of 1e-8 kg",
        naive: "a capacitance of condition 1e17",
        bounds: &[below("relative error", "1", 1e-10)],
        pace: Pace::Quick,
        axes: ALONE,
        expected: Expected::NotYet("yarns inside triangles"),
        run: nothing,
    },
];

fn mass_ratio(b: &Bench) -> Result<Figures, HardError> {
    let [finite, with] = light_points(b, &[("integrator.point_tolerance", "5e-4")])?;
    let [_, without] = light_points(b, &[])?;
    Ok(vec![
        ("finite", finite),
        ("velocity error of light points", with),
        ("without a tolerance for points", without),
    ])
}

/// Whether all is finite, and the largest velocity error of a light point [m/s].
fn light_points(b: &Bench, more: &[(&str, &str)]) -> Result<[f64; 2], HardError> {
    let text = scene(&[
        BARE,
        STIFF,
        SHEET,
        "[[pin]]\nselect = { corner = \"top-left\" }\n",
    ]);
    // 1e-9 kg a point: 2.5e-6 kg/m² over the sheet's hundred points.
    let set = [
        ("simulation.duration", "0.02"),
        ("fabric.f.density", "2.5e-6"),
    ];
    let set: Vec<_> = set.iter().chain(more).copied().collect();
    let mut sim = b.sim(&text, &set)?;
    let heavy = sim.built.geometry.order.new_of_old[45] as usize;
    sim.s.plan_mut().inertia.masses[heavy] = 1e-3;
    let mut worst = 0.0_f64;
    let mut before = (sim.s.state().q.clone(), sim.s.state().v.clone(), 0.0);
    while sim.step()? {
        let state = sim.s.state();
        let h = state.time - before.2;
        if h <= 0.0 {
            continue;
        }
        let at = EvalPoint {
            layout: state.layout,
            q: &state.q,
            q_start: &before.0,
            dt: h,
        };
        let plan = sim.s.plan();
        let masses = &plan.inertia.masses;
        let mut r: Vec<f64> = (0..state.v.len())
            .map(|k| masses[k / 3] * (before.1[k] - state.v[k] + h * plan.inertia.gravity[k % 3]))
            .collect();
        for term in &plan.terms {
            let batch = term.batch.as_ref();
            let mut g = vec![0.0; batch.local_dim()];
            for e in 0..batch.len() {
                batch.gradients(&at, e..e + 1, &mut g);
                for (n, g) in batch.nodes(e).iter().zip(g.as_chunks::<3>().0) {
                    for i in 0..3 {
                        r[3 * *n as usize + i] -= h * g[i];
                    }
                }
            }
        }
        if let Some(pins) = &plan.pins {
            Filter::<f64>::project(&pins.filter, &mut r);
        }
        for (p, m) in masses.iter().enumerate().filter(|(p, _)| *p != heavy) {
            for i in 0..3 {
                worst = worst.max((r[3 * p + i] / m).abs());
            }
        }
        before = (state.q.clone(), state.v.clone(), state.time);
    }
    Ok([sim.finite(), worst])
}

fn refinement(_: &Bench) -> Result<Figures, HardError> {
    let n = 24_u32;
    let at = |i: u32, j: u32| j * n + i;
    let mut groups: Vec<[u32; 2]> = Vec::new();
    for j in 0..n {
        for i in 0..n {
            if i + 1 < n {
                groups.push([at(i, j), at(i + 1, j)]);
            }
            if j + 1 < n {
                groups.push([at(i, j), at(i, j + 1)]);
            }
        }
    }
    let points = (n * n) as usize;
    let pattern = Pattern::from_groups(points, groups.iter().map(|g| &g[..]));
    let mut a = Bsr::<f64>::zeros(Arc::new(pattern));
    let unit = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let pattern = a.pattern().clone();
    for [p, q] in &groups {
        for (i, j, s) in [(p, p, 1.0), (q, q, 1.0), (p, q, -1.0), (q, p, -1.0)] {
            if let Some(slot) = pattern.slot(*i, *j) {
                a.add_block(slot as usize, &unit, s);
            }
        }
    }
    // The largest eigenvalue is near 8.
    for i in 0..points {
        a.add_diagonal(i, 8e-6);
    }
    let b: Vec<f64> = (0..3 * points)
        .map(|k| ((k * k) as f64 * 0.37).sin())
        .collect();
    let settings = MpcgSettings {
        tolerance: 1e-6,
        max_iterations: 5000,
        ..MpcgSettings::default()
    };
    let inner = Mpcg::<f32>::new(Box::new(BlockIc::default()), settings);
    let mut solver = Refined::new(inner, 1e-10);
    let mut x = vec![0.0; b.len()];
    let report = solver.solve(&a, &b, &selvedge_linsolve::NoFilter, &mut x)?;
    Ok(vec![
        ("relative residual", report.relative_residual),
        ("passes", solver.passes() as f64),
    ])
}

fn opposed(_: &Bench) -> Result<Figures, HardError> {
    let mut filter = BlockFilter::new();
    let mut violation = filter.fix(0, [0.1, 0.2, 0.3])?;
    violation += filter.constrain(0, [0.3, 0.9, -0.2], 9.0)?.abs();
    violation += filter.line(1, [1.0, 1.0, 1e-3])?;
    violation += filter.constrain(1, [0.2, -0.7, 0.4], 0.0)?.abs();
    let mut worst = 0.0_f64;
    for point in [0, 1] {
        let Some(s) = filter.projector(point) else {
            continue;
        };
        for i in 0..3 {
            for j in 0..3 {
                let square: f64 = (0..3).map(|k| s[3 * i + k] * s[3 * k + j]).sum();
                worst = worst.max((square - s[3 * i + j]).abs());
            }
        }
    }
    Ok(vec![
        ("S² − S", worst),
        ("violations reported", f64::from(u8::from(violation > 0.0))),
    ])
}
