//! Errors of the crate.

/// What can go wrong when a system is prepared or solved.
///
/// An iteration that merely stops early is not an error: see
/// [`SolveStatus`](crate::SolveStatus).
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LinsolveError {
    /// Two operands disagree about the number of unknowns.
    #[error("{what} has {found} unknowns, the operator has {expected}")]
    DimensionMismatch {
        /// The operand that does not fit.
        what: &'static str,
        /// Unknowns of the operator.
        expected: usize,
        /// Unknowns of the operand.
        found: usize,
    },
    /// An operand holds NaN or infinity.
    #[error("{what} is not finite at unknown {index}")]
    NotFinite {
        /// The operand.
        what: &'static str,
        /// First offending unknown.
        index: usize,
    },
    /// A factorisation met a pivot that is not positive.
    #[error("{method}: the matrix is not positive definite (pivot {pivot})")]
    Indefinite {
        /// The factorisation.
        method: &'static str,
        /// Index of the pivot in elimination order.
        pivot: usize,
    },
    /// Incomplete Cholesky failed with every admitted shift.
    #[error("{method}: no positive pivots up to the diagonal shift {shift:e}")]
    ShiftExhausted {
        /// The factorisation.
        method: &'static str,
        /// Largest shift that was tried, relative to the diagonal.
        shift: f64,
    },
    /// The filter has no block form and the method needs one.
    #[error("{method} needs a filter made of one projector per point")]
    FilterNotBlocks {
        /// The method.
        method: &'static str,
    },
    /// The method handles points only and the matrix has scalar unknowns.
    #[error("{method} handles no scalar unknowns")]
    ScalarsUnsupported {
        /// The method.
        method: &'static str,
    },
    /// A constraint direction or value cannot be used.
    #[error("constraint on point {point}: {reason}")]
    BadConstraint {
        /// The point.
        point: usize,
        /// Why it was refused.
        reason: &'static str,
    },
    /// A setting is outside its range.
    #[error("{name} = {value:e} is outside {range}")]
    BadSetting {
        /// The setting.
        name: &'static str,
        /// Its value.
        value: f64,
        /// The admitted range.
        range: &'static str,
    },
    /// A component was asked for by a name that does not exist.
    #[error("unknown {what} \"{name}\"; valid names: {valid}")]
    UnknownName {
        /// The kind of component.
        what: &'static str,
        /// The name that was asked for.
        name: String,
        /// The valid names, separated by commas.
        valid: String,
    },
    /// The sparse direct solver could not allocate or index its factor.
    #[error("{method}: {reason}")]
    Factorisation {
        /// The factorisation.
        method: &'static str,
        /// The reason given by the factorisation.
        reason: String,
    },
}

pub(crate) fn check_len(
    what: &'static str,
    expected: usize,
    found: usize,
) -> Result<(), LinsolveError> {
    if expected == found {
        Ok(())
    } else {
        Err(LinsolveError::DimensionMismatch {
            what,
            expected,
            found,
        })
    }
}

pub(crate) fn check_finite(what: &'static str, v: &[f64]) -> Result<(), LinsolveError> {
    // the sum is finite in the usual case and costs one pass without branches
    if v.iter().map(|a| a * 0.0).sum::<f64>() == 0.0 {
        return Ok(());
    }
    match v.iter().position(|a| !a.is_finite()) {
        Some(index) => Err(LinsolveError::NotFinite { what, index }),
        None => Ok(()),
    }
}
