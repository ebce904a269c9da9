use std::ops::Range;

use crate::DofLayout;

/// Unknowns and their rates at the start of a step.
#[derive(Clone, Copy, Debug)]
pub struct RatePoint<'a> {
    /// Shape of both slices.
    pub layout: DofLayout,
    /// Unknowns [m].
    pub q: &'a [f64],
    /// Their rates [m/s].
    pub v: &'a [f64],
}

/// Inertia that depends on the unknowns: local mass matrices on stencils.
///
/// An integrator evaluates it at the start of a step and keeps it frozen until
/// the end of that step.
pub trait MassBatch: Send + Sync {
    /// Name in messages and in the cost ledger.
    fn name(&self) -> &str;
    /// Number of stencils.
    fn len(&self) -> usize;
    /// Whether there is no stencil.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// Unknowns of each node of a stencil: 3 or 1.
    fn node_dims(&self) -> &[usize];
    /// Nodes of stencil `e`.
    fn nodes(&self, e: usize) -> &[u32];
    /// Writes the symmetric positive semidefinite `M × M` row-major mass
    /// matrix [kg] of every stencil of a range.
    fn masses(&self, at: &RatePoint<'_>, range: Range<usize>, masses: &mut [f64]);
    /// Writes the forces [N] quadratic in the rates, `∂T/∂q − Ṁ q̇`, `M` a
    /// stencil, and returns the kinetic energy [J] of the range.
    fn rate_forces(&self, at: &RatePoint<'_>, range: Range<usize>, forces: &mut [f64]) -> f64;
    /// Heap memory held [bytes].
    fn heap_bytes(&self) -> usize;

    /// Local unknowns of a stencil, `M`.
    fn local_dim(&self) -> usize {
        self.node_dims().iter().sum()
    }
}
