use std::ops::Range;

use crate::EvalPoint;

/// Which second derivative an energy returns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Curvature {
    /// The symmetric part of the true second derivative; may be indefinite.
    Exact,
    /// A positive semidefinite matrix, at least as large as the exact one
    /// where the energy's documentation does not say otherwise.
    Projected,
    /// Products of first derivatives only; positive semidefinite.
    GaussNewton,
}

/// The mathematics of one stencil with `N` nodes and `M` local unknowns.
///
/// `M` must be the sum of [`NODE_DIMS`](Self::NODE_DIMS). Local unknowns come
/// gathered in node order. A dissipative force is an energy whose gradient
/// reads the rate `(q - q_start) / dt`; derivatives are always taken with
/// respect to `q`, so that a rate's own derivative carries a factor `1 / dt`.
pub trait StencilEnergy<const N: usize, const M: usize>: Send + Sync {
    /// Unknowns of each node: 3 (a point) or 1 (a scalar).
    const NODE_DIMS: [usize; N];

    /// Nodes of every stencil.
    fn stencils(&self) -> &[[u32; N]];

    /// Energy of stencil `e` [J]. For a non-conservative term, any function
    /// that falls when the term does work on the outside, or zero.
    fn value(&self, e: usize, q: &[f64; M], at: &EvalPoint<'_>) -> f64;

    /// Writes the gradient (minus the force [N]) and returns the value.
    fn gradient(&self, e: usize, q: &[f64; M], at: &EvalPoint<'_>, gradient: &mut [f64; M]) -> f64;

    /// Writes gradient and second derivative [N/m], both overwritten whole,
    /// and returns the value.
    fn hessian(
        &self,
        e: usize,
        q: &[f64; M],
        at: &EvalPoint<'_>,
        curvature: Curvature,
        gradient: &mut [f64; M],
        hessian: &mut [[f64; M]; M],
    ) -> f64;

    /// [`gradient`](Self::gradient) of consecutive stencils; returns the sum of
    /// values. To be written anew where several at a time are faster, with the
    /// same bits.
    fn gradients(
        &self,
        range: Range<usize>,
        at: &EvalPoint<'_>,
        gradients: &mut [[f64; M]],
    ) -> f64 {
        let mut sum = 0.0;
        for (e, g) in range.zip(gradients) {
            let q = at.gather::<N, M>(&Self::NODE_DIMS, &self.stencils()[e]);
            sum += self.gradient(e, &q, at, g);
        }
        sum
    }

    /// [`hessian`](Self::hessian) of consecutive stencils; returns the sum of
    /// values. To be written anew where several at a time are faster, with the
    /// same bits.
    fn hessians(
        &self,
        range: Range<usize>,
        at: &EvalPoint<'_>,
        curvature: Curvature,
        gradients: &mut [[f64; M]],
        hessians: &mut [[[f64; M]; M]],
    ) -> f64 {
        let mut sum = 0.0;
        for ((e, g), h) in range.zip(gradients).zip(hessians) {
            let q = at.gather::<N, M>(&Self::NODE_DIMS, &self.stencils()[e]);
            sum += self.hessian(e, &q, at, curvature, g, h);
        }
        sum
    }

    /// Whether the gradient is the derivative of [`value`](Self::value).
    fn is_conservative(&self) -> bool {
        true
    }

    /// Freezes quantities that stay constant during a step; reads `q_start`.
    fn begin_step(&mut self, _at: &EvalPoint<'_>) {}

    /// Takes over history at the end of an accepted step; reads `q`.
    fn commit(&mut self, _at: &EvalPoint<'_>) {}

    /// State that a later step depends on, for checkpoints.
    fn history(&self) -> &[f64] {
        &[]
    }

    /// Takes back what [`history`](Self::history) gave; same length.
    fn restore_history(&mut self, _history: &[f64]) {}

    /// Why stencil `e` has no finite value at `q`, in words; `None` where it has
    /// one, or where the energy cannot say.
    fn complaint(&self, _e: usize, _q: &[f64; M]) -> Option<String> {
        None
    }

    /// Heap memory held [bytes].
    fn heap_bytes(&self) -> usize {
        size_of_val(self.stencils())
    }
}
