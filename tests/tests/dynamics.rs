//! Motion against closed forms: fall, momentum, energy, hanging and bending.

use approx::assert_relative_eq;
use selvedge_integrator::{Outcome, StepError};
use selvedge_tests::suite::motion::{energies, fallen, largest_growth, momentum_changes, patch};
use selvedge_tests::{Solver, plain_fabric, point};

/// Free fall follows backward Euler's own closed form `−g h² n (n+1) / 2`
/// point by point, at the default tolerances: no drift, no hang in mid-air.
#[test]
fn free_fall() {
    let (s, start) = fallen(9, 1e-3, 1.0);
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
        let [linear, angular] = momentum_changes(7, h);
        assert!(linear < 1e-10, "momentum: {linear}");
        angular
    };
    let (coarse, fine) = (drift(1e-3), drift(5e-4));
    assert!(coarse < 2e-2, "{coarse}");
    assert_relative_eq!(coarse / fine, 2.0, max_relative = 0.15);
}

/// A closed, damped system never gains energy.
#[test]
fn energy_never_grows() {
    let all = energies(9, 1e-3);
    let growth = largest_growth(&all);
    assert!(growth <= 1e-9, "grows by {growth}");
    let [first, last] = [all[0], all[all.len() - 1]];
    assert!(last < 0.5 * first, "nothing was dissipated");
}

/// A matrix that is not positive definite is projected and the step goes on,
/// for a factorisation as for conjugate gradients: no step of a sheet pressed
/// together by a tenth is refused because of it.
#[test]
fn indefinite_matrices_are_projected() {
    for solver in [Solver::Direct, Solver::Double] {
        let mut setup = patch(9, plain_fabric(500.0, 1e-6, 0.2));
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
