//! Coulomb friction against closed forms.

use std::f64::consts::PI;
use std::sync::Arc;

use selvedge_collision::body::{Cylinder, Plane};
use selvedge_collision::{Body, BodyContact, Friction, FrictionAnchored};
use selvedge_integrator::{Outcome, Simulation};
use selvedge_shell_model::{lumped_masses, sheet};

use super::{Case, Effort, Judged, Ladder, Measured, Rung, cells, climb, step};
use crate::{GRAVITY, Setup, Solver, mean, plain_fabric, rows};

/// Half the thickness of cloth in contact [m], the default of contacts.
const OFFSET: f64 = 1.5e-3;

fn contact(setup: &Setup, masses: &[f64], body: impl Body + 'static, mu: f64) -> BodyContact {
    let friction = Friction::Anchored(FrictionAnchored::new(mu));
    BodyContact::new(setup.positions.len(), vec![Arc::new(body)])
        .with_friction(friction, masses)
        .expect("friction")
}

/// Mass-weighted mean of positions [m] and velocities [m/s] along a direction.
pub fn along(s: &Simulation, d: [f64; 3]) -> [f64; 2] {
    let (mut sum, mut total) = ([0.0; 2], 0.0);
    let (x, v) = (
        s.state().q.as_chunks::<3>().0,
        s.state().v.as_chunks::<3>().0,
    );
    for ((m, x), v) in s.plan().inertia.masses.iter().zip(x).zip(v) {
        for i in 0..3 {
            sum[0] += m * x[i] * d[i];
            sum[1] += m * v[i] * d[i];
        }
        total += m;
    }
    sum.map(|x| x / total)
}

/// Goes on until a time [s].
///
/// # Panics
/// When a step fails.
pub fn until(s: &mut Simulation, time: f64) {
    while s.state().time < time - 1e-9 {
        if let Outcome::Ended(_) = s.advance().expect("a step with friction") {
            break;
        }
    }
}

/// A patch on an inclined plane.
pub struct Incline {
    /// The patch, ready to run for 1 s.
    pub simulation: Simulation,
    /// Direction down the slope.
    pub down: [f64; 3],
    /// `g (sin φ − μ cos φ)` [m/s²].
    pub acceleration: f64,
}

/// A patch of 0.1 m, so many cells a side, laid onto a plane inclined by
/// `slope` with `tan` of the angle given, at the depth at which the plane
/// carries it.
///
/// # Panics
/// For no cells.
pub fn incline(mu: f64, slope: f64, n: usize, h: f64) -> Incline {
    let angle = slope.atan();
    let (s, c) = angle.sin_cos();
    let (down, normal) = ([c, -s, 0.0], [s, c, 0.0]);
    let sheet = sheet::equilateral(n, n, [0.1, 0.1]).expect("sheet");
    let fabric = plain_fabric(500.0, 1e-5, 0.2);
    let masses = lumped_masses(&sheet.mesh, std::slice::from_ref(&fabric)).expect("masses");
    let place = |([u, v], m): (&[f64; 2], &f64)| -> [f64; 3] {
        let gap = OFFSET - m * GRAVITY * c / 100.0;
        [
            u * down[0] + gap * normal[0],
            u * down[1] + gap * normal[1],
            *v,
        ]
    };
    let positions = sheet.flat.iter().zip(&masses).map(place).collect();
    let mut setup = Setup::new(sheet.mesh, positions, fabric);
    let plane = Plane::new([0.0; 3], normal).expect("plane");
    setup.contacts = vec![Box::new(contact(&setup, &masses, plane, mu))];
    setup.newton.tolerance = 1e-9;
    setup.settings.duration = 1.0;
    setup.settings.control.max_step = h;
    Incline {
        simulation: setup.simulation(),
        down,
        acceleration: GRAVITY * (s - mu * c),
    }
}

/// Way down the slope between 0.3 and 0.6 s [m].
fn creep(mu: f64, n: usize, h: f64) -> f64 {
    let mut i = incline(mu, 0.98 * mu, n, h);
    until(&mut i.simulation, 0.3);
    let settled = along(&i.simulation, i.down)[0];
    until(&mut i.simulation, 0.6);
    along(&i.simulation, i.down)[0] - settled
}

/// Mean acceleration between 0.3 and 0.6 s [m/s²].
fn slide(mu: f64, n: usize, h: f64) -> f64 {
    let mut i = incline(mu, 1.02 * mu, n, h);
    until(&mut i.simulation, 0.3);
    let before = along(&i.simulation, i.down)[1];
    until(&mut i.simulation, 0.6);
    (along(&i.simulation, i.down)[1] - before) / 0.3
}

fn thresholds(effort: Effort) -> Measured {
    let coefficients: &[f64] = effort.pick(&[0.3], &[0.3, 0.8]);
    let meshes: &[usize] = effort.pick(&[4, 8], &[4, 8, 16]);
    let steps: &[f64] = effort.pick(&[2e-3], &[2e-3, 1e-3, 5e-4]);
    let mut ladders = Vec::new();
    for &mu in coefficients {
        let angle = (0.98 * mu).atan();
        let free = 0.5 * GRAVITY * angle.sin() * (0.6_f64.powi(2) - 0.3_f64.powi(2));
        let exact = incline(mu, 1.02 * mu, 1, 1e-3).acceleration;
        for (what, refined, runs) in [
            (
                "step 1 ms",
                "cells a side",
                runs(meshes, cells, |n| (n, 1e-3)),
            ),
            ("8 cells a side", "step", runs(steps, step, |h| (8, h))),
        ] {
            let rungs = |value: &dyn Fn(usize, f64) -> f64| -> Vec<Rung> {
                let rung = |(label, size, n, h): &(String, f64, usize, f64)| Rung {
                    label: label.clone(),
                    size: *size,
                    value: value(*n, *h),
                };
                runs.iter().map(rung).collect()
            };
            let way = format!("way at 0.98 μ = {:.3}, {what} [m]", 0.98 * mu);
            ladders.push(
                Ladder::new(way, refined, 0.0, rungs(&|n, h| creep(mu, n, h)))
                    .relative_to(free)
                    .within(1e-6, Judged::Every),
            );
            let slid = format!("acceleration at 1.02 μ = {:.3}, {what} [m/s²]", 1.02 * mu);
            ladders.push(
                Ladder::new(slid, refined, exact, rungs(&|n, h| slide(mu, n, h)))
                    .within(0.01, Judged::Every),
            );
        }
    }
    ladders.into()
}

/// Label, size, cells a side and step of every run of a ladder.
fn runs<T: Copy>(
    choices: &[T],
    label: impl Fn(T) -> (String, f64),
    run: impl Fn(T) -> (usize, f64),
) -> Vec<(String, f64, usize, f64)> {
    let one = |&c: &T| {
        let ((label, size), (n, h)) = (label(c), run(c));
        (label, size, n, h)
    };
    choices.iter().map(one).collect()
}

/// Lighter mass of a [`Capstan`] over the width of its strip [kg/m].
const PER_WIDTH: f64 = 0.1;

/// A strip over half a cylinder with a mass at either end.
#[derive(Clone, Copy, Debug)]
pub struct Capstan {
    /// Coefficient of friction.
    pub mu: f64,
    /// Rows of cells along the strip.
    pub cells: usize,
    /// Step [s].
    pub step: f64,
}

impl Capstan {
    /// `e^{μπ}`
    pub fn factor(&self) -> f64 {
        (self.mu * PI).exp()
    }

    /// Way of the heavier end in the second 0.1 s [m] and its acceleration
    /// downwards [m/s²], for a ratio of the masses.
    ///
    /// # Panics
    /// When a step fails.
    pub fn run(&self, ratio: f64) -> [f64; 2] {
        let radius = 0.05;
        let r = radius + OFFSET;
        let (wrap, free, columns) = (PI * r, 0.06, 3);
        let length = wrap + 2.0 * free;
        let edge = length / self.cells as f64 / 0.75_f64.sqrt();
        let size = [edge * columns as f64, length];
        let light = PER_WIDTH * size[0];
        let sheet = sheet::equilateral(columns, self.cells, size).expect("sheet");
        let place = |[u, v]: &[f64; 2]| {
            let s = v - free;
            if s < 0.0 {
                [*u, s, -r]
            } else if s > wrap {
                [*u, wrap - s, r]
            } else {
                let (sin, cos) = (s / r).sin_cos();
                [*u, r * sin, -r * cos]
            }
        };
        let positions = sheet.flat.iter().map(place).collect();
        let mut fabric = plain_fabric(2000.0, 1e-9, 1e-3);
        // Brings the masses to rest on the strip that they stretch.
        fabric.membrane_damping = 5e-3;
        let all = rows(&sheet);
        let mut masses = lumped_masses(&sheet.mesh, std::slice::from_ref(&fabric)).expect("masses");
        let weigh = |masses: &mut [f64], row: &[u32], total: f64| {
            let here: f64 = row.iter().map(|p| masses[*p as usize]).sum();
            for p in row {
                masses[*p as usize] *= total / here;
            }
        };
        let tip = all.last().expect("rows");
        weigh(&mut masses, &all[0], light);
        weigh(&mut masses, tip, ratio * light);
        let mut setup = Setup::new(sheet.mesh, positions, fabric);
        let body = Cylinder::new([-0.5, 0.0, 0.0], [0.5, 0.0, 0.0], radius, 0.0).expect("cylinder");
        setup.contacts = vec![Box::new(contact(&setup, &masses, body, self.mu))];
        setup.solver = Solver::Direct;
        setup.newton.tolerance = 1e-6;
        setup.newton.iterations = 60;
        setup.newton.line_search_tries = 12;
        setup.settings.duration = 0.2;
        setup.settings.control.max_step = self.step;
        let mut s = setup.simulation();
        s.plan_mut().inertia.masses = masses;
        let at = |s: &Simulation| {
            let v = tip.iter().map(|p| s.state().v[3 * *p as usize + 1]);
            (mean(s, tip)[1], v.sum::<f64>() / tip.len() as f64)
        };
        until(&mut s, 0.1);
        let middle = at(&s);
        until(&mut s, 0.2);
        let end = at(&s);
        [middle.0 - end.0, (middle.1 - end.1) / 0.1]
    }

    /// Ratio of the tensions while the strip slides, with masses of 1.3 times
    /// the ratio that just holds.
    pub fn tensions(&self) -> f64 {
        let ratio = 1.3 * self.factor();
        let [_, a] = self.run(ratio);
        ratio * (GRAVITY - a) / (GRAVITY + a)
    }
}

fn capstan(effort: Effort) -> Measured {
    let coefficients: &[f64] = effort.pick(&[0.3], &[0.3, 0.5]);
    let meshes: &[usize] = effort.pick(&[55], &[55, 110, 220]);
    let steps: &[f64] = effort.pick(&[], &[2e-3, 1e-3, 5e-4]);
    let mut ladders = Vec::new();
    for &mu in coefficients {
        let with = |cells, step| Capstan { mu, cells, step };
        let factor = with(1, 1.0).factor();
        let quantity = |what: &str| format!("T₂/T₁ at μ = {mu}, {what}");
        let in_space = climb(meshes, cells, |n| with(n, 1e-3).tensions());
        ladders.push(
            Ladder::new(quantity("step 1 ms"), "rows of cells", factor, in_space)
                .within(0.01, Judged::Finest),
        );
        if !steps.is_empty() {
            let in_time = climb(steps, step, |h| with(110, h).tensions());
            ladders.push(
                Ladder::new(quantity("110 rows of cells"), "step", factor, in_time)
                    .of_order(1.0)
                    .within(0.01, Judged::Finest),
            );
        }
        let held = climb(meshes, cells, |n| with(n, 1e-3).run(0.95 * factor)[0]);
        ladders.push(
            Ladder::new(
                format!("way in 0.1 s at 0.95 of the ratio, μ = {mu}, step 1 ms [m]"),
                "rows of cells",
                0.0,
                held,
            )
            .relative_to(0.5 * GRAVITY * 0.01)
            .within(1e-4, Judged::Every),
        );
    }
    ladders.into()
}

pub(super) fn cases() -> [Case; 2] {
    [
        Case {
            name: "incline",
            title: "Sticking and sliding on an incline",
            text: "A patch of 0.1 m lies on a plane whose slope is 2 % below or 2 % above the \
                   angle of friction. Below, the way between 0.3 and 0.6 s is held against \
                   nothing, relative to the way without friction. Above, the mean acceleration \
                   over the same time is held against Coulomb's law.",
            formula: "slides iff tan φ > μ,  a = g (sin φ − μ cos φ)",
            source: "Coulomb's law",
            run: thresholds,
        },
        Case {
            name: "capstan",
            title: "Capstan",
            text: "A strip runs over half a cylinder of 5 cm, with 100 g per metre of width at \
                   one end and more at the other. With masses in 1.3 times the ratio that just \
                   holds it slides, and the tensions follow from the mean acceleration between \
                   0.1 and 0.2 s; with 0.95 times it holds, and the way in that time is relative \
                   to that of free fall. Membrane friction of 5 ms lets the masses come to rest \
                   on the strip that they stretch: without it their swinging enters the \
                   acceleration. The strip weighs 0.3 % of the lighter mass, which is about what \
                   is left as an error. Mesh: equilateral, 3 cells across.",
            formula: "T₂/T₁ = exp(μ π)",
            source: "Euler and Eytelwein",
            run: capstan,
        },
    ]
}
