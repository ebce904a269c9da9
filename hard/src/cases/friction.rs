//! Friction: thresholds, anchors, long times.

use selvedge_collision::ContactResponse;
use selvedge_energy::EvalPoint;

use super::scenes::{BALL, BARE, DAMPED, GENTLE, SHEET, scene};
use crate::case::{Case, Expected, Figures, Pace, TOUCHES, below, equal, told};
use crate::sim::distance;
use crate::{Bench, HardError, Sim};

pub static CASES: [Case; 4] = [
    Case {
        number: 33,
        name: "inclined-plane",
        setup: "patch on a plane at the angle of friction (μ = 0.3) less and more 2 %, 1 s",
        naive: "a wrong threshold, or creep",
        bounds: &[
            below("speed below the threshold", "m/s", 1e-9),
            below("acceleration error above it", "1", 1e-3),
        ],
        pace: Pace::Quick,
        axes: TOUCHES,
        expected: Expected::Passes,
        run: incline,
    },
    Case {
        number: 34,
        name: "anchor-handoff",
        setup: "patch drawn over the edges of a held sheet at 0.1 m/s, μ = 0.3",
        naive: "the friction force jumps where a contact passes to the next triangle",
        bounds: &[
            equal("finite", "1", 1.0),
            below("largest jump over μ N", "1", 0.2),
            told("friction over μ N", "1"),
        ],
        pace: Pace::Quick,
        axes: TOUCHES,
        expected: Expected::Passes,
        run: handoff,
    },
    Case {
        number: 39,
        name: "long-rest",
        setup: "sheet at rest on a ball, held for 60 s",
        naive: "it drifts and creeps",
        bounds: &[below("displacement from 10 s to 60 s", "m", 5e-4)],
        pace: Pace::Slow,
        axes: TOUCHES,
        expected: Expected::Passes,
        run: long_rest,
    },
    Case {
        number: 58,
        name: "friction-none-and-ten",
        setup: "sheet on a ball with μ = 0 and with μ = 10, 0.3 s",
        naive: "division by the coefficient, or a force that turns the motion round",
        bounds: &[equal("finite", "1", 1.0), below("speed", "m/s", 3.0)],
        pace: Pace::Quick,
        axes: TOUCHES,
        expected: Expected::Passes,
        run: extremes,
    },
];

fn incline(b: &Bench) -> Result<Figures, HardError> {
    let mu = 0.3_f64;
    let slide = |factor: f64| -> Result<(Sim, [f64; 3], f64), HardError> {
        let phi = (factor * mu).atan();
        let (s, c) = phi.sin_cos();
        let text = format!(
            "{BARE}{DAMPED}[[cloth]]\nkind = \"sheet\"\nsize = [0.1, 0.1]\npoints = [8, \
             8]\nrotation = [0, 0, {:?}]\ncenter = [{:?}, {:?}, 0]\nfabric = \"f\"\n[[body]]\nkind \
             = \"plane\"\nnormal = [{s:?}, {c:?}, 0]\n",
            -phi.to_degrees(),
            1.4995e-3 * s,
            1.4995e-3 * c,
        );
        let friction = format!("{mu:?}");
        let set = [
            ("simulation.duration", "1.0"),
            ("contact.friction", friction.as_str()),
            ("contact.self", "false"),
            ("damping.kind", "none"),
            ("integrator.newton_tolerance", "1e-9"),
            ("integrator.newton_iterations", "30"),
        ];
        let sim = b.sim(&text, &set)?;
        Ok((sim, [c, -s, 0.0], 9.81 * (s - mu * c)))
    };
    let along = |sim: &Sim, d: [f64; 3]| -> f64 {
        let masses = &sim.s.plan().inertia.masses;
        let v = sim.s.state().v.as_chunks::<3>().0;
        let sum: f64 = masses
            .iter()
            .zip(v)
            .map(|(m, v)| m * (v[0] * d[0] + v[1] * d[1] + v[2] * d[2]))
            .sum();
        sum / masses.iter().sum::<f64>()
    };
    let (mut stuck, d, _) = slide(0.98)?;
    stuck.run()?;
    let still = along(&stuck, d).abs();
    let (mut slips, d, exact) = slide(1.02)?;
    slips.until(0.4)?;
    let (v0, t0) = (along(&slips, d), slips.s.state().time);
    slips.until(0.9)?;
    let a = (along(&slips, d) - v0) / (slips.s.state().time - t0);
    Ok(vec![
        ("speed below the threshold", still),
        ("acceleration error above it", (a / exact - 1.0).abs()),
    ])
}

/// Every point is held: the contact forces are those of the motion alone.
fn handoff(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[
        BARE,
        DAMPED,
        "[[cloth]]\nname = \"under\"\nkind = \"sheet\"\nsize = [0.2, 0.1]\nedge_length = \
         0.01\nfabric = \"f\"\n[[cloth]]\nname = \"over\"\nkind = \"sheet\"\nsize = [0.03, \
         0.03]\nedge_length = 0.007\ncenter = [-0.05, 0.0005, 0.001]\nlayer = 1\nfabric = \
         \"f\"\n[[pin]]\ncloth = \"under\"\nselect = { box = { min = [-1, -1, -1], max = [1, 1, 1] \
         } }\n[[pin]]\ncloth = \"over\"\nselect = { box = { min = [-1, -1, -1], max = [1, 1, 1] } \
         }\nmotion = [{ time = 0 }, { time = 0.5, translation = [0.05, 0, 0] }]\n",
    ]);
    let set = [("simulation.duration", "0.5"), ("contact.friction", "0.3")];
    let mut sim = b.sim(&text, &set)?;
    let over = sim.built.geometry.parts[1].points.clone();
    let order = sim.built.geometry.order.old_of_new.clone();
    let (mut last, mut jump): (Option<f64>, f64) = (None, 0.0);
    let mut q_start = sim.s.state().q.clone();
    let mut time = 0.0;
    while sim.step()? {
        let state = sim.s.state().clone();
        let at = EvalPoint {
            layout: state.layout,
            q: &state.q,
            q_start: &q_start,
            dt: state.time - time,
        };
        let mut response = ContactResponse::default();
        for contact in &mut sim.s.plan_mut().contacts {
            contact.evaluate(&at, false, &mut response)?;
        }
        let (mut drag, mut load) = (0.0, 0.0);
        for ((nodes, weights), f) in response
            .nodes
            .iter()
            .zip(&response.weights)
            .zip(&response.force)
        {
            for (n, w) in nodes.iter().zip(weights) {
                if over.contains(&order[*n as usize]) {
                    drag += w * f[0];
                    load += w * f[1];
                }
            }
        }
        // Anchors take hold over the first millimetres.
        if state.time > 0.15 && load.abs() > 0.0 {
            let ratio = drag / (0.3 * load.abs());
            if let Some(last) = last {
                jump = jump.max((ratio - last).abs());
            }
            last = Some(ratio);
        }
        time = state.time;
        q_start = state.q;
    }
    let finite = if last.is_some() { sim.finite() } else { 0.0 };
    Ok(vec![
        ("finite", finite),
        ("largest jump over μ N", jump),
        ("friction over μ N", last.unwrap_or(f64::NAN)),
    ])
}

fn long_rest(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[GENTLE, DAMPED, SHEET, BALL]);
    let set = [
        ("simulation.duration", "60.0"),
        ("integrator.max_step", "5e-3"),
        ("contact.friction", "0.5"),
    ];
    let mut sim = b.sim(&text, &set)?;
    sim.until(10.0)?;
    let early = sim.points();
    sim.run()?;
    let moved = distance(&early, &sim.points())[0];
    Ok(vec![("displacement from 10 s to 60 s", moved)])
}

fn extremes(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[GENTLE, DAMPED, SHEET, BALL]);
    let (mut finite, mut speed) = (1.0, 0.0_f64);
    for mu in ["0", "10"] {
        let set = [("simulation.duration", "0.3"), ("contact.friction", mu)];
        let mut sim = b.sim(&text, &set)?;
        sim.run()?;
        finite *= sim.finite();
        speed = speed.max(sim.log.speed);
    }
    Ok(vec![("finite", finite), ("speed", speed)])
}
