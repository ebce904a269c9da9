//! Coulomb friction against closed forms.

use approx::assert_relative_eq;
use selvedge_tests::suite::friction::{Incline, along, incline, until};

/// A patch on an incline of 0.98 μ settles by micrometres onto the anchors and
/// then does not move at all; anchors do not creep.
#[test]
fn sticks_below_the_angle_of_friction() {
    for mu in [0.3, 0.8] {
        let Incline {
            simulation: mut s,
            down,
            ..
        } = incline(mu, 0.98 * mu, 8, 1e-3);
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
    for (mu, factor) in [(0.8, 1.02), (0.3, 2.0)] {
        let Incline {
            simulation: mut s,
            down,
            acceleration: expected,
        } = incline(mu, factor * mu, 8, 1e-3);
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
