//! Where unknowns are within a step.

use selvedge_collision::StepStart;
use selvedge_energy::EvalPoint;

use crate::State;

/// Unknowns `q` at the end of a step that begins at `state`.
pub(crate) fn end_point<'a>(state: &'a State, q: &'a [f64], dt: f64) -> EvalPoint<'a> {
    EvalPoint {
        layout: state.layout,
        q,
        q_start: &state.q,
        dt,
    }
}

/// What contact is detected from: the way from the state to `q_predicted`.
pub(crate) fn step_start<'a>(state: &'a State, q_predicted: &'a [f64], dt: f64) -> StepStart<'a> {
    // Contact knows points alone.
    let points = 3 * state.layout.points;
    StepStart {
        q_start: &state.q[..points],
        q_predicted: &q_predicted[..points],
        dt,
        time: state.time,
    }
}

/// `out = q + dt (v + factor dv)`
pub(crate) fn extrapolate(
    q: &[f64],
    v: &[f64],
    along: Option<(&[f64], f64)>,
    dt: f64,
    out: &mut [f64],
) {
    match along {
        None => {
            for ((out, q), v) in out.iter_mut().zip(q).zip(v) {
                *out = q + dt * v;
            }
        }
        Some((dv, factor)) => {
            for (((out, q), v), dv) in out.iter_mut().zip(q).zip(v).zip(dv) {
                *out = q + dt * (v + factor * dv);
            }
        }
    }
}
