//! Diagonal shifts of incomplete factorisations that break down.

use crate::LinsolveError;

/// First shift of most methods, relative to the diagonal.
pub(super) const FIRST: f64 = 1e-3;

/// Largest shift that is tried.
const LAST: f64 = 1e6;

/// Twice the shift, at least `first`.
///
/// # Errors
/// [`LinsolveError::ShiftExhausted`] beyond the largest.
pub(super) fn larger(shift: f64, first: f64, method: &'static str) -> Result<f64, LinsolveError> {
    let shift = (2.0 * shift).max(first);
    if shift > LAST {
        return Err(LinsolveError::ShiftExhausted {
            method,
            shift: LAST,
        });
    }
    Ok(shift)
}
