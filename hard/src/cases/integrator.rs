//! Time stepping: fall, momentum, step size, energy, restart.

use selvedge_integrator::{ControlSettings, StepControl, StepError};

use super::scenes::{BALL, BARE, DAMPED, GENTLE, SHEET, SOFT, STIFF, scene};
use crate::case::{
    ALONE, Case, Expected, Figures, Pace, SOLVES, at_least, at_most, below, equal, told,
};
use crate::sim::{Sim, cross, distance, norm, sub};
use crate::{Bench, HardError};

pub static CASES: [Case; 8] = [
    Case {
        number: 1,
        name: "free-fall",
        setup: "flat sheet of 0.2 m in a vacuum, 1 s; linear tolerance 1e-12 in f64, then 1e-2",
        naive: "a convergence test at entry leaves it in mid-air; a loose linear solve gives each \
                point its own gravity",
        bounds: &[
            below("position error", "m", 1e-9),
            below("shape change", "m", 1e-9),
            below("centroid error at 1e-2", "m", 1e-9),
        ],
        pace: Pace::Quick,
        axes: SOLVES,
        expected: Expected::Passes,
        run: free_fall,
    },
    Case {
        number: 2,
        name: "momentum",
        setup: "spinning, stretching patch without gravity, 0.1 s; direct solver",
        naive: "forces that do not sum to zero",
        bounds: &[
            below("momentum change", "1", 1e-12),
            below("angular momentum identity", "1", 1e-10),
            at_least("ratio at half the step", "1", 1.7),
        ],
        pace: Pace::Quick,
        axes: ALONE,
        expected: Expected::Passes,
        run: momentum,
    },
    Case {
        number: 5,
        name: "loose-linear-solve",
        setup: "nearly flat sheet of 323 points on two pins, no damping, Newton tolerance 1e-3 N·s \
                (one iteration a step), 0.3 s; linear tolerance 1e-2 and 1e-1, soft and stiff",
        naive: "energy appears, the motion is wrong, nobody notices",
        bounds: &[
            at_most("gain at 1e-2, soft", "J", 0.0),
            at_most("gain at 1e-2, stiff", "J", 0.0),
            at_least("detected at 1e-1, soft", "J", 1e-9),
            at_least("detected at 1e-1, stiff", "J", 1e-9),
        ],
        pace: Pace::Quick,
        axes: ALONE,
        expected: Expected::Passes,
        run: loose,
    },
    Case {
        number: 6,
        name: "step-sweep",
        setup: "sheet of 0.2 m draped over a ball for 0.3 s with steps from 1e-5 to 4e-2 s, \
                compared with 1e-4 s",
        naive: "divergence at large steps, stagnation at round-off at small ones",
        bounds: &[
            equal("finite", "1", 1.0),
            below("distance to the step of 1e-4 s", "m", 5e-3),
            below("rejected at 1e-5 s", "1", 1.0),
        ],
        pace: Pace::Slow,
        axes: ALONE,
        expected: Expected::Fails(
            "with steps of 40 ms, of which most are refused, the ladder of steps decides between \
             two drapes, 3.3 to 3.8 and 4.9 to 5.5 mm from that of 1e-4 s; which one, a change of \
             the step by 1 ms turns",
        ),
        run: step_sweep,
    },
    Case {
        number: 28,
        name: "negative-curvature",
        setup: "sheet pressed together by a third; exact curvature, and the default",
        naive: "conjugate gradients diverge in silence",
        bounds: &[
            at_least("negative curvature met", "1", 1.0),
            at_least("steps, default", "1", 20.0),
            equal("finite", "1", 1.0),
        ],
        pace: Pace::Quick,
        axes: SOLVES,
        expected: Expected::Passes,
        run: negative_curvature,
    },
    Case {
        number: 36,
        name: "weld-mid-run",
        setup: "points welded across 1 mm while the cloth moves",
        naive: "a jump of energy",
        bounds: &[below("energy jump", "J", 1e-6)],
        pace: Pace::Quick,
        axes: ALONE,
        expected: Expected::NotYet("welding while a run goes on"),
        run: crate::case::nothing,
    },
    Case {
        number: 46,
        name: "rejection-storm",
        setup: "every second step above an eighth of the largest is refused, 2000 tries; then all",
        naive: "the step oscillates for ever",
        bounds: &[
            below("rejections per accepted step", "1", 1.0),
            at_most("rejections to underflow", "1", 49.0),
        ],
        pace: Pace::Quick,
        axes: ALONE,
        expected: Expected::Passes,
        run: storm,
    },
    Case {
        number: 47,
        name: "crumple",
        setup: "sheet of the stiff fabric with 2 mm of noise, no damping, no relaxation, 1 ms, 50 ms",
        naive: "accepting failed steps gives it more energy than it stores",
        bounds: &[
            below("gain, exact", "1", 1e-6),
            below("gain, default at 1e-3 N·s", "1", 2e-2),
            below("gain, default at 1e-5 N·s", "1", 1e-6),
            told("rejected, exact", "1"),
            at_most("rejected, default over exact", "1", 1.0),
        ],
        pace: Pace::Quick,
        axes: SOLVES,
        expected: Expected::Passes,
        run: crumple,
    },
];

fn free_fall(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[BARE, STIFF, SHEET]);
    let fall = |tolerance: &str| -> Result<[f64; 3], HardError> {
        let set = [
            ("simulation.duration", "1.0"),
            ("solver.precision", "f64"),
            ("solver.tolerance", tolerance),
        ];
        let mut sim = b.sim(&text, &set)?;
        let start = sim.points();
        sim.run()?;
        let way = 9.81 * 1e-6 * 1000.0 * 1001.0 / 2.0;
        let end = sim.points();
        let moved: Vec<[f64; 3]> = start.iter().map(|p| [p[0], p[1] - way, p[2]]).collect();
        let error = distance(&end, &moved)[0];
        let masses = &sim.s.plan().inertia.masses;
        let (mut sum, mut total) = ([0.0; 3], 0.0);
        for (m, p) in masses.iter().zip(sim.s.state().q.as_chunks::<3>().0) {
            total += m;
            for i in 0..3 {
                sum[i] += m * p[i];
            }
        }
        let center = sum.map(|x| x / total);
        let shift = sub(end[0], moved[0]);
        let moved: Vec<[f64; 3]> = end.iter().map(|p| sub(*p, shift)).collect();
        let whole: Vec<[f64; 3]> = start.iter().map(|p| [p[0], p[1] - way, p[2]]).collect();
        Ok([error, distance(&moved, &whole)[0], (center[1] + way).abs()])
    };
    let [error, shape, _] = fall("1e-12")?;
    let [_, _, centroid] = fall("1e-2")?;
    Ok(vec![
        ("position error", error),
        ("shape change", shape),
        ("centroid error at 1e-2", centroid),
    ])
}

fn momenta(sim: &Sim) -> [[f64; 3]; 2] {
    let state = sim.s.state();
    let (mut p, mut l) = ([0.0; 3], [0.0; 3]);
    let masses = &sim.s.plan().inertia.masses;
    let (x, v) = (state.q.as_chunks::<3>().0, state.v.as_chunks::<3>().0);
    for ((m, x), v) in masses.iter().zip(x).zip(v) {
        let arm = cross(*x, *v);
        for i in 0..3 {
            p[i] += m * v[i];
            l[i] += m * arm[i];
        }
    }
    [p, l]
}

fn momentum(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[BARE, STIFF, SHEET]);
    let drift = |step: &str| -> Result<[f64; 3], HardError> {
        let set = [
            ("simulation.duration", "0.1"),
            ("simulation.gravity", "[0, 0, 0]"),
            ("solver.kind", "direct"),
            ("solver.precision", "f64"),
            ("integrator.max_step", step),
            ("integrator.newton_tolerance", "1e-12"),
            ("integrator.newton_iterations", "30"),
        ];
        let mut sim = b.sim(&text, &set)?;
        sim.push(|p| {
            [
                0.5 - 3.0 * p[1] + 0.5 * p[0],
                3.0 * p[0] - 2.0 * p[2],
                2.0 * p[1],
            ]
        });
        let [p0, l0] = momenta(&sim);
        let mut owed = [0.0; 3];
        let mut before = sim.s.state().v.clone();
        let mut time = 0.0;
        while sim.step()? {
            let state = sim.s.state();
            let h = state.time - time;
            let v = state.v.as_chunks::<3>().0;
            let old = before.as_chunks::<3>().0;
            for ((m, v), old) in sim.s.plan().inertia.masses.iter().zip(v).zip(old) {
                let turn = cross(*v, *old);
                for i in 0..3 {
                    owed[i] += h * m * turn[i];
                }
            }
            time = state.time;
            before.clone_from(&state.v);
        }
        let [p1, l1] = momenta(&sim);
        let change = sub(l1, l0);
        Ok([
            norm(sub(p1, p0)) / norm(p0),
            norm(sub(change, owed)) / norm(l0),
            norm(change) / norm(l0),
        ])
    };
    let (coarse, fine) = (drift("1e-3")?, drift("5e-4")?);
    Ok(vec![
        ("momentum change", coarse[0]),
        ("angular momentum identity", coarse[1]),
        ("ratio at half the step", coarse[2] / fine[2]),
    ])
}

fn loose(b: &Bench) -> Result<Figures, HardError> {
    let cloth = r#"
[[cloth]]
kind = "sheet"
size = [0.2, 0.19486]
points = [17, 19]
noise = 1e-5
fabric = "f"
[[pin]]
select = { corner = "bottom-left" }
[[pin]]
select = { corner = "bottom-right" }
"#;
    let gained = |fabric: &str, tolerance: &str| -> Result<f64, HardError> {
        let text = scene(&[BARE, fabric, cloth]);
        let set = [
            ("simulation.duration", "0.3"),
            ("integrator.residual_norm", "paper"),
            ("integrator.newton_tolerance", "1e-3"),
            ("solver.precision", "f64"),
            ("solver.preconditioner", "block-jacobi"),
            ("solver.tolerance", tolerance),
        ];
        let mut sim = b.sim(&text, &set)?;
        sim.run()?;
        Ok(sim.log.gained)
    };
    Ok(vec![
        ("gain at 1e-2, soft", gained(SOFT, "1e-2")?),
        ("gain at 1e-2, stiff", gained(STIFF, "1e-2")?),
        ("detected at 1e-1, soft", gained(SOFT, "1e-1")?),
        ("detected at 1e-1, stiff", gained(STIFF, "1e-1")?),
    ])
}

fn step_sweep(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[GENTLE, DAMPED, SHEET, BALL]);
    let drape = |step: &str| -> Result<(Vec<[f64; 3]>, f64, usize), HardError> {
        let set = [
            ("simulation.duration", "0.3"),
            ("integrator.max_step", step),
            ("contact.self", "false"),
        ];
        let mut sim = b.sim(&text, &set)?;
        sim.run()?;
        Ok((sim.points(), sim.finite(), sim.log.rejected))
    };
    let (reference, mut finite, _) = drape("1e-4")?;
    let (mut worst, mut stuck) = (0.0_f64, 0.0);
    for step in ["1e-5", "1e-3", "5e-3", "1e-2", "4e-2"] {
        let (x, good, rejected) = drape(step)?;
        finite *= good;
        worst = worst.max(distance(&x, &reference)[1]);
        if step == "1e-5" {
            stuck = rejected as f64;
        }
    }
    Ok(vec![
        ("finite", finite),
        ("distance to the step of 1e-4 s", worst),
        ("rejected at 1e-5 s", stuck),
    ])
}

fn negative_curvature(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[BARE, STIFF, SHEET]);
    let mut found = Vec::new();
    for policy in ["exact", "auto"] {
        let set = [
            ("simulation.duration", "0.02"),
            ("cloth.0.stretch", "0.67"),
            ("cloth.0.noise", "1e-4"),
            ("integrator.curvature", policy),
        ];
        let mut sim = b.sim(&text, &set)?;
        sim.run()?;
        found.push((
            sim.s.counters().negative_curvature,
            sim.log.steps,
            sim.finite(),
        ));
    }
    Ok(vec![
        ("negative curvature met", (found[0].0 + found[1].0) as f64),
        ("steps, default", found[1].1 as f64),
        ("finite", found[0].2 * found[1].2),
    ])
}

fn storm(_: &Bench) -> Result<Figures, HardError> {
    let settings = ControlSettings::default();
    let mut control = StepControl::new(settings, 1.0);
    let (mut accepted, mut rejected) = (0, 0);
    for k in 0..2000 {
        if k % 2 == 0 && control.dt() > settings.max_step / 8.0 {
            rejected += 1;
            if !control.reject() {
                break;
            }
        } else {
            accepted += 1;
            control.accept(1);
        }
    }
    let mut control = StepControl::new(settings, 1.0);
    let to_underflow = (1..1000).find(|_| !control.reject());
    Ok(vec![
        (
            "rejections per accepted step",
            f64::from(rejected) / f64::from(accepted.max(1)),
        ),
        (
            "rejections to underflow",
            to_underflow.map_or(f64::INFINITY, f64::from),
        ),
    ])
}

fn crumple(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[BARE, STIFF, SHEET]);
    let gained = |curvature: &str, tolerance: &str| -> Result<[f64; 2], HardError> {
        let set = [
            ("simulation.duration", "0.05"),
            ("simulation.gravity", "[0, 0, 0]"),
            ("cloth.0.points", "[17, 19]"),
            ("cloth.0.noise", "2e-3"),
            ("integrator.residual_norm", "paper"),
            ("integrator.newton_tolerance", tolerance),
            ("integrator.curvature", curvature),
        ];
        let mut sim = b.sim(&text, &set)?;
        let stored = sim.stored();
        sim.run()?;
        Ok([sim.log.gained / stored, sim.log.rejected as f64])
    };
    let exact = gained("exact", "1e-3")?;
    let loose = gained("auto", "1e-3")?;
    let tight = gained("auto", "1e-5")?;
    Ok(vec![
        ("gain, exact", exact[0]),
        ("gain, default at 1e-3 N·s", loose[0]),
        ("gain, default at 1e-5 N·s", tight[0]),
        ("rejected, exact", exact[1]),
        (
            "rejected, default over exact",
            if loose[1] <= exact[1] {
                1.0
            } else {
                loose[1] / exact[1].max(1.0)
            },
        ),
    ])
}

/// Whether an error names a value that is not finite.
pub(super) fn names_not_finite(e: &StepError) -> bool {
    matches!(e, StepError::NotFinite { .. })
}
