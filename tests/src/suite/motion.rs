//! Fall, momentum and energy of free patches.

use selvedge_integrator::{Outcome, Simulation};
use selvedge_shell_model::fabric::Fabric;
use selvedge_shell_model::sheet;

use super::{Case, Effort, Judged, Ladder, Measured, cells, climb, step};
use crate::{GRAVITY, Setup, plain_fabric, point, run};

/// A square patch of 0.2 m, so many cells a side.
///
/// # Panics
/// For no cells.
pub fn patch(n: usize, fabric: Fabric) -> Setup {
    let sheet = sheet::equilateral(n, n, [0.2, 0.2]).expect("sheet");
    let q = sheet.positions(|[u, v]| [u, 0.0, v]);
    Setup::new(sheet.mesh, q.as_chunks::<3>().0.to_vec(), fabric)
}

/// Linear and angular momentum about the origin [kg·m/s, kg·m²/s].
pub fn momenta(s: &Simulation) -> [[f64; 3]; 2] {
    let [mut p, mut l] = [[0.0; 3]; 2];
    let (x, v) = (
        s.state().q.as_chunks::<3>().0,
        s.state().v.as_chunks::<3>().0,
    );
    for ((m, x), v) in s.plan().inertia.masses.iter().zip(x).zip(v) {
        for i in 0..3 {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            p[i] += m * v[i];
            l[i] += m * (x[j] * v[k] - x[k] * v[j]);
        }
    }
    [p, l]
}

/// A patch that falls freely for a time, and where it began.
///
/// # Panics
/// When the run fails.
pub fn fallen(n: usize, h: f64, duration: f64) -> (Simulation, Vec<[f64; 3]>) {
    let mut setup = patch(n, plain_fabric(500.0, 1e-5, 0.2));
    setup.newton = selvedge_integrator::NewtonSettings::default();
    setup.linear_tolerance = 1e-12;
    setup.settings.duration = duration;
    setup.settings.control.max_step = h;
    let start = setup.positions.clone();
    let mut s = setup.simulation();
    run(&mut s).expect("free fall");
    (s, start)
}

/// Fall of the mean [m], and the largest distance of any point from where
/// backward Euler's closed form has it [m].
fn fall(n: usize, h: f64) -> [f64; 2] {
    let (s, start) = fallen(n, h, FALL);
    let steps = (FALL / h).round();
    let scheme = GRAVITY * h * h * steps * (steps + 1.0) / 2.0;
    let (mut sum, mut off) = (0.0, 0.0_f64);
    for (i, from) in start.iter().enumerate() {
        let to = point(&s, i as u32);
        sum += from[1] - to[1];
        let d = [to[0] - from[0], to[1] - from[1] + scheme, to[2] - from[2]];
        off = off.max(d.iter().map(|x| x * x).sum::<f64>().sqrt());
    }
    [sum / start.len() as f64, off]
}

const FALL: f64 = 0.4;

fn free_fall(effort: Effort) -> Measured {
    let steps: &[f64] = effort.pick(&[4e-3, 2e-3, 1e-3], &[4e-3, 2e-3, 1e-3, 5e-4]);
    let meshes: &[usize] = effort.pick(&[4, 8, 16], &[8, 16, 32]);
    let exact = 0.5 * GRAVITY * FALL * FALL;
    let in_time = climb(steps, step, |h| fall(8, h)[0]);
    let in_space = climb(meshes, cells, |n| fall(n, 1e-3)[1]);
    vec![
        Ladder::new("fall in 0.4 s, 8 cells a side [m]", "step", exact, in_time)
            .of_order(1.0)
            .within(1e-6, Judged::Extrapolated),
        Ladder::new(
            "largest distance of a point from the scheme's closed form, step 1 ms [m]",
            "cells a side",
            0.0,
            in_space,
        )
        .relative_to(exact)
        .within(1e-9, Judged::Every),
    ]
    .into()
}

/// Relative changes of linear and of angular momentum over 0.05 s of a patch
/// that drifts, spins at 3 rad/s about two axes and is being stretched.
///
/// # Panics
/// When the run fails.
pub fn momentum_changes(n: usize, h: f64) -> [f64; 2] {
    let mut setup = patch(n, plain_fabric(200.0, 1e-5, 0.2));
    setup.gravity = [0.0; 3];
    setup.settings.duration = 0.05;
    setup.settings.control.max_step = h;
    setup.newton.tolerance = 1e-10;
    setup.linear_tolerance = 1e-12;
    for (p, v) in setup.positions.iter().zip(&mut setup.velocities) {
        *v = [
            0.5 - 3.0 * p[1] + 0.5 * p[0],
            3.0 * p[0] - 2.0 * p[2],
            2.0 * p[1],
        ];
    }
    let mut s = setup.simulation();
    let before = momenta(&s);
    run(&mut s).expect("a free patch");
    let after = momenta(&s);
    let size = |a: [f64; 3]| a.iter().map(|x| x * x).sum::<f64>().sqrt();
    std::array::from_fn(|k| {
        let change = std::array::from_fn(|i| after[k][i] - before[k][i]);
        size(change) / size(before[k])
    })
}

fn momentum(effort: Effort) -> Measured {
    let steps: &[f64] = effort.pick(&[1e-3, 5e-4, 2.5e-4], &[1e-3, 5e-4, 2.5e-4, 1.25e-4]);
    let meshes: &[usize] = effort.pick(&[4, 7], &[4, 8, 16]);
    let linear = climb(meshes, cells, |n| momentum_changes(n, 1e-3)[0]);
    let angular = climb(steps, step, |h| momentum_changes(8, h)[1]);
    vec![
        Ladder::new("change of momentum, step 1 ms", "cells a side", 0.0, linear)
            .relative_to(1.0)
            .within(1e-10, Judged::Every),
        Ladder::new(
            "change of angular momentum, 8 cells a side",
            "step",
            0.0,
            angular,
        )
        .relative_to(1.0)
        .of_order(1.0)
        .within(1e-3, Judged::Extrapolated),
    ]
    .into()
}

/// Energies after the steps of a closed, damped patch, crumpled by 1 mm [J].
///
/// # Panics
/// When the run fails.
pub fn energies(n: usize, h: f64) -> Vec<f64> {
    let mut fabric = plain_fabric(500.0, 1e-5, 0.2);
    fabric.membrane_damping = 1e-3;
    fabric.bending_damping = 1e-2;
    let mut setup = patch(n, fabric);
    setup.gravity = [0.0; 3];
    setup.settings.duration = 0.1;
    setup.settings.control.max_step = h;
    setup.newton.tolerance = 1e-9;
    setup.linear_tolerance = 1e-9;
    let mut seed = 1u64;
    for p in &mut setup.positions {
        for x in p {
            seed = seed
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            *x += 2e-3 * ((seed >> 33) as f64 / (1u64 << 31) as f64 - 0.5);
        }
    }
    let mut s = setup.simulation();
    let mut all = Vec::new();
    loop {
        match s.advance().expect("a crumpled patch") {
            Outcome::Accepted { report, .. } => {
                let elastic: f64 = report.energies.iter().map(|e| e.value).sum();
                all.push(elastic + s.state().kinetic_energy(&s.plan().inertia.masses));
            }
            Outcome::Rejected { .. } => {}
            Outcome::Ended(_) => break,
        }
    }
    all
}

/// Largest growth in one step over the first energy; zero when it never grows.
pub fn largest_growth(energies: &[f64]) -> f64 {
    let steps = energies.windows(2).map(|e| (e[1] - e[0]) / energies[0]);
    steps.fold(0.0, |most, g| if g <= most { most } else { g })
}

fn energy(effort: Effort) -> Measured {
    let steps: &[f64] = effort.pick(&[2e-3, 1e-3], &[4e-3, 2e-3, 1e-3, 5e-4]);
    let meshes: &[usize] = effort.pick(&[5, 9], &[5, 9, 18]);
    let in_time = climb(steps, step, |h| largest_growth(&energies(9, h)));
    let in_space = climb(meshes, cells, |n| largest_growth(&energies(n, 1e-3)));
    let ladder = |what: &str, refined, rungs| {
        let quantity = format!("largest growth of energy in a step, {what}");
        Ladder::new(quantity, refined, 0.0, rungs)
            .relative_to(1.0)
            .within(1e-9, Judged::Every)
    };
    vec![
        ladder("9 cells a side", "step", in_time),
        ladder("step 1 ms", "cells a side", in_space),
    ]
    .into()
}

pub(super) fn cases() -> [Case; 3] {
    [
        Case {
            name: "free-fall",
            title: "Free fall",
            text: "A square patch of 0.2 m falls freely for 0.4 s. Its fall is held against the \
                   parabola, with an error of first order in the step; and every point against \
                   backward Euler's own closed form at 1 ms, where only round-off may be left.",
            formula: "y = ½ g t²;  backward Euler: y_n = g h² n (n + 1)/2",
            source: "Summation of the scheme",
            run: free_fall,
        },
        Case {
            name: "momentum",
            title: "Momentum",
            text: "A patch drifts, spins at 3 rad/s about two axes and is being stretched, for \
                   0.05 s without outside forces. Linear momentum stays to round-off. Angular \
                   momentum loses what the scheme itself takes, which must vanish with the \
                   step. Changes are relative to the value at the start.",
            formula: "Δp = 0,  ΔL = −h Σ v × m Δv → 0",
            source: "Conservation laws; the scheme's own loss",
            run: momentum,
        },
        Case {
            name: "energy",
            title: "Energy of a closed, damped system",
            text: "A patch crumpled by 1 mm at random moves without gravity for 0.1 s with \
                   membrane friction of 1 ms and bending friction of 10 ms. Elastic and kinetic \
                   energy together never grow from one step to the next; the figure is the \
                   largest growth over the first energy.",
            formula: "E_{n+1} ≤ E_n",
            source: "Second law",
            run: energy,
        },
    ]
}
