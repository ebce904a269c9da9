//! The solver contract.

use crate::{ExplicitOperator, Filter, LinsolveError, Real};

/// How an iteration ended. Only [`Converged`](Self::Converged) meets the
/// tolerance; the iterate of the others is finite and may still be of use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SolveStatus {
    /// The true residual meets the tolerance (within a tenth of it).
    Converged,
    /// The limit of iterations came first.
    IterationLimit,
    /// A direction `p` with `pᵀAp ≤ 0`: the matrix is not positive definite.
    NegativeCurvature,
    /// The residual grew too far
    /// ([`MpcgSettings::divergence`](crate::MpcgSettings::divergence)) or is not
    /// finite.
    Diverged,
    /// The true residual does not meet the tolerance, and restarting from it no
    /// longer helps: the precision is exhausted. The best iterate is returned.
    Stagnated,
}

/// What a solve did.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolveReport {
    /// Name of the solver.
    pub solver: &'static str,
    /// Products with the matrix in the main loop; refinement passes for direct
    /// solvers.
    pub iterations: usize,
    /// `‖S(b − A x)‖ / ‖S(b − A z)‖` of the returned `x`, `z` its prescribed part.
    pub relative_residual: f64,
    /// `‖S(b − A x)‖` in the unit of `b`.
    pub residual: f64,
    /// The residual relative to the tolerance, in the norm of the stop test
    /// (≤ 1 when it is met).
    pub stop_ratio: f64,
    /// How it ended.
    pub status: SolveStatus,
}

impl SolveReport {
    /// Whether the tolerance was met.
    pub fn converged(&self) -> bool {
        self.status == SolveStatus::Converged
    }
}

/// Solves `A x = b` on the allowed subspace of a filter.
///
/// ```text
/// x = z + Z (Zᵀ A Z)⁻¹ Zᵀ (b − A z),   z = (I − S) x_on_entry,   range Z = range S
/// ```
pub trait LinearSolver<T: Real>: Send {
    /// Name in scene files and reports.
    fn name(&self) -> &str;

    /// Solves; `x` holds the starting vector on entry, whose filtered-out part
    /// is prescribed and kept.
    ///
    /// # Errors
    /// Operands that do not fit or are not finite, a preconditioner or
    /// factorisation that fails. An iteration that stops early is reported in
    /// [`SolveReport::status`], with the best finite `x`.
    fn solve(
        &mut self,
        a: &dyn ExplicitOperator<T>,
        b: &[f64],
        filter: &dyn Filter<T>,
        x: &mut [f64],
    ) -> Result<SolveReport, LinsolveError>;

    /// Sets the relative tolerance of the stop test.
    fn set_tolerance(&mut self, relative: f64);

    /// Heap memory in bytes.
    fn heap_bytes(&self) -> usize;
}
