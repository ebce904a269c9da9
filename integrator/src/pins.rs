//! What pins do to velocities and residuals.

use selvedge_linsolve::Filter;

use crate::Pins;

/// Gives constrained directions the velocity that brings them to their target.
pub(crate) fn prescribe(pins: &Pins, q: &[f64], time_end: f64, dt: f64, v: &mut [f64]) {
    // v ← S v + (I − S) w with w the velocity towards the target: S is linear,
    // so S (v − w) + w does it.
    let (q, _) = q.as_chunks::<3>();
    let shift = |v: &mut [f64], sign: f64| {
        let (v, _) = v.as_chunks_mut::<3>();
        for (k, &p) in pins.points.iter().enumerate() {
            let p = p as usize;
            let target = pins.trajectory.position(k, time_end);
            for i in 0..3 {
                v[p][i] += sign * (target[i] - q[p][i]) / dt;
            }
        }
    };
    shift(v, -1.0);
    Filter::<f64>::project(&pins.filter, v);
    shift(v, 1.0);
}

/// Takes the constrained directions out of a residual.
pub(crate) fn project(pins: &Option<Pins>, b: &mut [f64]) {
    if let Some(pins) = pins {
        Filter::<f64>::project(&pins.filter, b);
    }
}

/// [`project`], and what it takes from the points of pins.
pub(crate) fn hold(pins: &Option<Pins>, b: &mut [f64], taken: &mut Vec<[f64; 3]>) {
    taken.clear();
    let Some(held) = pins else { return };
    let at = |b: &[f64], p: u32| b.as_chunks::<3>().0[p as usize];
    taken.extend(held.points.iter().map(|&p| at(b, p)));
    project(pins, b);
    for (taken, &p) in taken.iter_mut().zip(&held.points) {
        let left = at(b, p);
        for i in 0..3 {
            taken[i] -= left[i];
        }
    }
}
