//! Numbers that are not finite, and where they come from.

use selvedge_energy::EvalPoint;

use crate::{ScenePlan, State, StepError};

/// Refuses a state with an unknown or a rate that is not finite; `owners` holds
/// the point of every scalar.
pub(crate) fn check(state: &State, owners: &[u32]) -> Result<(), StepError> {
    match state.first_not_finite() {
        None => Ok(()),
        Some((place, what)) => {
            let point = state.point_of(place, owners);
            Err(error(state, point, what, None, None))
        }
    }
}

/// Names the term and the point behind a residual that is not finite.
pub(crate) fn in_residual(
    plan: &ScenePlan,
    state: &State,
    at: &EvalPoint<'_>,
    b: &[f64],
) -> StepError {
    let mut g = Vec::new();
    for term in &plan.terms {
        let batch = term.batch.as_ref();
        g.resize(batch.local_dim(), 0.0);
        for e in 0..batch.len() {
            let value = batch.gradients(at, e..e + 1, &mut g);
            if !value.is_finite() || g.iter().any(|g| !g.is_finite()) {
                let first = state.layout.offset(batch.nodes(e)[0], batch.node_dims()[0]);
                let point = state.point_of(first, &plan.owners);
                let term = Some(batch.name().into());
                return error(
                    state,
                    point,
                    "the force",
                    term,
                    batch.complaint(at, e).map(String::into),
                );
            }
        }
    }
    let place = b.iter().position(|b| !b.is_finite()).unwrap_or(0);
    let point = state.point_of(place, &plan.owners);
    error(state, point, "the residual", None, None)
}

fn error(
    state: &State,
    point: usize,
    what: &'static str,
    term: Option<Box<str>>,
    why: Option<Box<str>>,
) -> StepError {
    let at = |i: usize| state.q.get(3 * point + i).copied().unwrap_or(f64::NAN);
    StepError::NotFinite {
        what,
        point,
        x: at(0),
        y: at(1),
        z: at(2),
        term,
        why,
    }
}
