//! Motion against closed forms: fall, momentum, energy, hanging and bending.

use approx::assert_relative_eq;
use selvedge_integrator::{Outcome, Simulation, StepError};
use selvedge_shell_model::sheet;
use selvedge_tests::{Setup, Solver, plain_fabric, point, run};

fn square(n: usize, fabric: selvedge_shell_model::fabric::Fabric) -> Setup {
    let sheet = sheet::equilateral(n, n, [0.2, 0.2]).expect("sheet");
    let q = sheet.positions(|[u, v]| [u, 0.0, v]);
    Setup::new(sheet.mesh, q.as_chunks::<3>().0.to_vec(), fabric)
}

fn momentum(s: &Simulation) -> [f64; 3] {
    let mut p = [0.0; 3];
    for (m, v) in s
        .plan()
        .inertia
        .masses
        .iter()
        .zip(s.state().v.as_chunks::<3>().0)
    {
        for i in 0..3 {
            p[i] += m * v[i];
        }
    }
    p
}

fn angular_momentum(s: &Simulation) -> [f64; 3] {
    let mut l = [0.0; 3];
    let (x, v) = (
        s.state().q.as_chunks::<3>().0,
        s.state().v.as_chunks::<3>().0,
    );
    for ((m, x), v) in s.plan().inertia.masses.iter().zip(x).zip(v) {
        for i in 0..3 {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            l[i] += m * (x[j] * v[k] - x[k] * v[j]);
        }
    }
    l
}

/// Free fall follows backward Euler's own closed form `−g h² n (n+1) / 2`
/// point by point, at the default tolerances: no drift, no hang in mid-air.
#[test]
fn free_fall() {
    let mut setup = square(9, plain_fabric(500.0, 1e-5, 0.2));
    setup.newton = selvedge_integrator::NewtonSettings::default();
    setup.linear_tolerance = 1e-12;
    let start = setup.positions.clone();
    let mut s = setup.simulation();
    run(&mut s).expect("free fall");
    let fall = 9.81 * 1e-6 * 1000.0 * 1001.0 / 2.0;
    for (i, from) in start.iter().enumerate() {
        let to = point(&s, i as u32);
        assert!(
            (to[0] - from[0]).abs() < 1e-9 && (to[2] - from[2]).abs() < 1e-9,
            "{to:?}"
        );
        assert!((to[1] + fall).abs() < 1e-9, "{} against {}", to[1], -fall);
    }
}

/// Without outside forces linear momentum stays to round-off, and angular
/// momentum changes by the scheme's own `h Σ v × m Δv`, which halves with `h`.
#[test]
fn momentum_is_kept() {
    let drift = |h: f64| {
        let mut setup = square(7, plain_fabric(200.0, 1e-5, 0.2));
        setup.gravity = [0.0; 3];
        setup.settings.duration = 0.05;
        setup.settings.control.max_step = h;
        setup.newton.tolerance = 1e-10;
        setup.linear_tolerance = 1e-12;
        for (p, v) in setup.positions.iter().zip(&mut setup.velocities) {
            // A spin of 3 rad/s about z and x, a drift, and a stretching.
            *v = [
                0.5 - 3.0 * p[1] + 0.5 * p[0],
                3.0 * p[0] - 2.0 * p[2],
                2.0 * p[1],
            ];
        }
        let mut s = setup.simulation();
        let (p, l) = (momentum(&s), angular_momentum(&s));
        run(&mut s).expect("a free patch");
        let (p1, l1) = (momentum(&s), angular_momentum(&s));
        let size = |a: [f64; 3]| a.iter().map(|x| x * x).sum::<f64>().sqrt();
        let change = |a: [f64; 3], b: [f64; 3]| size(std::array::from_fn(|i| a[i] - b[i]));
        assert!(change(p, p1) < 1e-10 * size(p), "momentum: {p:?} {p1:?}");
        change(l, l1) / size(l)
    };
    let (coarse, fine) = (drift(1e-3), drift(5e-4));
    assert!(coarse < 2e-2, "{coarse}");
    assert_relative_eq!(coarse / fine, 2.0, max_relative = 0.15);
}

/// A closed, damped system never gains energy.
#[test]
fn energy_never_grows() {
    let mut fabric = plain_fabric(500.0, 1e-5, 0.2);
    fabric.membrane_damping = 1e-3;
    fabric.bending_damping = 1e-2;
    let mut setup = square(9, fabric);
    setup.gravity = [0.0; 3];
    setup.settings.duration = 0.1;
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
    let mut last = f64::INFINITY;
    let mut first = None;
    loop {
        match s.advance().expect("a crumpled patch") {
            Outcome::Accepted { report, .. } => {
                let elastic: f64 = report.energies.iter().map(|e| e.value).sum();
                let kinetic = s.state().kinetic_energy(&s.plan().inertia.masses);
                let total = elastic + kinetic;
                let scale = *first.get_or_insert(total);
                assert!(total <= last + 1e-9 * scale, "{total} after {last}");
                last = total;
            }
            Outcome::Rejected { .. } => {}
            Outcome::Ended(_) => break,
        }
    }
    assert!(last < 0.5 * first.expect("steps"), "nothing was dissipated");
}

/// A matrix that is not positive definite is projected and the step goes on,
/// for a factorisation as for conjugate gradients: no step of a sheet pressed
/// together by a tenth is refused because of it.
#[test]
fn indefinite_matrices_are_projected() {
    for solver in [Solver::Direct, Solver::Double] {
        let mut setup = square(9, plain_fabric(500.0, 1e-6, 0.2));
        setup.solver = solver;
        setup.newton.tolerance = 1e-3;
        setup.settings.duration = 0.01;
        for (k, p) in setup.positions.iter_mut().enumerate() {
            *p = [0.9 * p[0], 1e-4 * (k as f64).sin(), p[2]];
        }
        let mut s = setup.simulation();
        loop {
            match s.advance().expect("a pressed sheet") {
                Outcome::Accepted { .. } => {}
                Outcome::Rejected { reason, .. } => {
                    assert!(
                        !matches!(reason, StepError::Linear(_)),
                        "{solver:?}: {reason}"
                    );
                }
                Outcome::Ended(_) => break,
            }
        }
        let projected = s.counters().projected;
        assert!(projected > 0, "{solver:?} met no indefinite matrix");
    }
}
