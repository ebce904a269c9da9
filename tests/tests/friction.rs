//! Coulomb friction against closed forms.

use std::sync::Arc;

use approx::assert_relative_eq;
use selvedge_collision::body::{Cylinder, Plane};
use selvedge_collision::{Body, BodyContact, Friction, FrictionAnchored};
use selvedge_integrator::{Outcome, Simulation};
use selvedge_shell_model::{lumped_masses, sheet};
use selvedge_tests::{Setup, Solver, mean, plain_fabric, rows};

const G: f64 = 9.81;

fn contact(setup: &Setup, masses: &[f64], body: impl Body + 'static, mu: f64) -> BodyContact {
    let friction = Friction::Anchored(FrictionAnchored::new(mu));
    BodyContact::new(setup.positions.len(), vec![Arc::new(body)])
        .with_friction(friction, masses)
        .expect("friction")
}

/// Mass-weighted mean of positions and velocities along a direction.
fn along(s: &Simulation, d: [f64; 3]) -> [f64; 2] {
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

fn until(s: &mut Simulation, time: f64) {
    while s.state().time < time - 1e-9 {
        if let Outcome::Ended(_) = s.advance().expect("a patch on a plane") {
            break;
        }
    }
}

/// A patch laid onto a plane inclined by `slope` with `tan` of the angle given,
/// at the depth at which the plane carries it.
fn incline(mu: f64, slope: f64) -> (Simulation, [f64; 3], f64) {
    let angle = slope.atan();
    let (s, c) = angle.sin_cos();
    let (down, normal) = ([c, -s, 0.0], [s, c, 0.0]);
    let sheet = sheet::equilateral(8, 8, [0.1, 0.1]).expect("sheet");
    let fabric = plain_fabric(500.0, 1e-5, 0.2);
    let masses = lumped_masses(&sheet.mesh, std::slice::from_ref(&fabric)).expect("masses");
    let place = |([u, v], m): (&[f64; 2], &f64)| -> [f64; 3] {
        let gap = 1.5e-3 - m * G * c / 100.0;
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
    (setup.simulation(), down, G * (s - mu * c))
}

/// A patch on an incline of 0.98 μ settles by micrometres onto the anchors and
/// then does not move at all; anchors do not creep.
#[test]
fn sticks_below_the_angle_of_friction() {
    for mu in [0.3, 0.8] {
        let (mut s, down, _) = incline(mu, 0.98 * mu);
        let start = along(&s, down)[0];
        until(&mut s, 0.5);
        let settled = along(&s, down)[0];
        until(&mut s, 1.0);
        let [end, speed] = along(&s, down);
        println!(
            "stick μ {mu}: settled {:.2e} m, then {:.2e} m, {speed:.2e} m/s",
            settled - start,
            end - settled
        );
        assert!(settled - start < 1e-4, "{}", settled - start);
        assert!(
            (end - settled).abs() < 1e-9 && speed.abs() < 1e-9,
            "{} {speed}",
            end - settled
        );
    }
}

/// Above it the patch slides with `g (sin φ − μ cos φ)`.
#[test]
fn slips_above_the_angle_of_friction() {
    for (mu, factor) in [(0.3, 1.02), (0.8, 1.02), (0.3, 2.0)] {
        let (mut s, down, expected) = incline(mu, factor * mu);
        until(&mut s, 0.4);
        let before = along(&s, down)[1];
        until(&mut s, 0.9);
        let found = (along(&s, down)[1] - before) / 0.5;
        println!(
            "slip μ {mu} × {factor}: {found} against {expected}, {:.2e}",
            found / expected - 1.0
        );
        assert_relative_eq!(found, expected, max_relative = 1e-2);
    }
}

/// A weightless strip over half a cylinder with a mass at either end: it slips
/// when the masses' ratio exceeds `e^{μπ}`, and while it slips the tensions
/// have that ratio.
#[test]
fn capstan() {
    let (mu, radius, light) = (0.3, 0.05, 1e-3);
    let factor = (mu * std::f64::consts::PI).exp();
    let slide = |ratio: f64| {
        let (wrap, free, columns, cells) = (std::f64::consts::PI * (radius + 1.5e-3), 0.06, 3, 110);
        let length = wrap + 2.0 * free;
        let edge = length / cells as f64 / 0.75_f64.sqrt();
        let sheet =
            sheet::equilateral(columns, cells, [edge * columns as f64, length]).expect("sheet");
        let r = radius + 1.5e-3;
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
        let fabric = plain_fabric(2000.0, 1e-9, 1e-3);
        let all = rows(&sheet);
        let mut masses = lumped_masses(&sheet.mesh, std::slice::from_ref(&fabric)).expect("masses");
        let weigh = |masses: &mut [f64], row: &[u32], total: f64| {
            let here: f64 = row.iter().map(|p| masses[*p as usize]).sum();
            for p in row {
                masses[*p as usize] *= total / here;
            }
        };
        weigh(&mut masses, &all[0], light);
        weigh(&mut masses, all.last().expect("rows"), ratio * light);
        let mut setup = Setup::new(sheet.mesh, positions, fabric);
        let body = Cylinder::new([-0.5, 0.0, 0.0], [0.5, 0.0, 0.0], radius, 0.0).expect("cylinder");
        setup.contacts = vec![Box::new(contact(&setup, &masses, body, mu))];
        setup.solver = Solver::Direct;
        setup.newton.tolerance = 1e-6;
        setup.newton.iterations = 60;
        setup.newton.line_search_tries = 12;
        setup.settings.duration = 0.2;
        let mut s = setup.simulation();
        s.plan_mut().inertia.masses = masses;
        let tip = all.last().expect("rows");
        let begin = mean(&s, tip)[1];
        until(&mut s, 0.1);
        let middle = (mean(&s, tip)[1], s.state().v[3 * tip[1] as usize + 1]);
        until(&mut s, 0.2);
        let end = (mean(&s, tip)[1], s.state().v[3 * tip[1] as usize + 1]);
        println!("capstan: {:?}", s.counters());
        let acceleration = (middle.1 - end.1) / 0.1;
        println!(
            "capstan {ratio:.3}: {:.2e} m, {:.2e} m, acceleration {acceleration}",
            begin - middle.0,
            middle.0 - end.0
        );
        (middle.0 - end.0, acceleration)
    };
    let (moved, _) = slide(0.95 * factor);
    assert!(moved.abs() < 1e-5, "slipped by {moved} m");
    let ratio = 1.3 * factor;
    let (_, a) = slide(ratio);
    let tensions = ratio * (G - a) / (G + a);
    println!(
        "capstan: tensions {tensions} against {factor}, {:.2e}",
        tensions / factor - 1.0
    );
    assert_relative_eq!(tensions, factor, max_relative = 3e-2);
}
