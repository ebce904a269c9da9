use std::ops::Range;

use crate::{Curvature, EvalPoint, StencilEnergy};

/// A homogeneous array of stencils behind one object-safe door.
///
/// Callers evaluate ranges of some 64 stencils, so that the virtual call is
/// free and the local matrices stay in cache.
pub trait EnergyBatch: Send + Sync {
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
    /// Sum of the values [J] of a range.
    fn value(&self, at: &EvalPoint<'_>, range: Range<usize>) -> f64;
    /// Writes `M` gradient entries [N] a stencil; returns the sum of values.
    fn gradients(&self, at: &EvalPoint<'_>, range: Range<usize>, gradients: &mut [f64]) -> f64;
    /// Writes `M` gradient entries [N] and `M × M` row-major second
    /// derivatives [N/m] a stencil; returns the sum of values.
    fn hessians(
        &self,
        at: &EvalPoint<'_>,
        curvature: Curvature,
        range: Range<usize>,
        gradients: &mut [f64],
        hessians: &mut [f64],
    ) -> f64;
    /// Whether the gradients are the derivative of the values.
    fn is_conservative(&self) -> bool;
    /// Freezes lagged quantities at the start of a step.
    fn begin_step(&mut self, at: &EvalPoint<'_>);
    /// Takes over history; the only place where it may change.
    fn commit(&mut self, at: &EvalPoint<'_>);
    /// State that a later step depends on, for checkpoints.
    fn history(&self) -> &[f64];
    /// Takes back what [`history`](Self::history) gave.
    fn restore_history(&mut self, history: &[f64]);
    /// Why stencil `e` has no finite value, where the energy knows.
    fn complaint(&self, _at: &EvalPoint<'_>, _e: usize) -> Option<String> {
        None
    }
    /// Heap memory held [bytes].
    fn heap_bytes(&self) -> usize;

    /// Local unknowns of a stencil, `M`.
    fn local_dim(&self) -> usize {
        self.node_dims().iter().sum()
    }
}

/// [`EnergyBatch`] of any [`StencilEnergy`].
#[derive(Clone, Debug)]
pub struct Batch<E, const N: usize, const M: usize> {
    name: String,
    energy: E,
}

impl<E: StencilEnergy<N, M>, const N: usize, const M: usize> Batch<E, N, M> {
    /// Wraps an energy.
    ///
    /// # Panics
    /// When `M` is not the sum of the node dimensions, or one of them is
    /// neither 3 nor 1.
    pub fn new(name: impl Into<String>, energy: E) -> Self {
        assert_eq!(E::NODE_DIMS.iter().sum::<usize>(), M, "local dimension");
        assert!(
            E::NODE_DIMS.iter().all(|d| *d == 3 || *d == 1),
            "node dimension"
        );
        Self {
            name: name.into(),
            energy,
        }
    }

    /// The wrapped energy.
    pub fn energy(&self) -> &E {
        &self.energy
    }

    /// The wrapped energy, to change its parameters between steps.
    pub fn energy_mut(&mut self) -> &mut E {
        &mut self.energy
    }
}

impl<E: StencilEnergy<N, M>, const N: usize, const M: usize> EnergyBatch for Batch<E, N, M> {
    fn name(&self) -> &str {
        &self.name
    }

    fn len(&self) -> usize {
        self.energy.stencils().len()
    }

    fn node_dims(&self) -> &[usize] {
        &E::NODE_DIMS
    }

    fn nodes(&self, e: usize) -> &[u32] {
        &self.energy.stencils()[e]
    }

    fn value(&self, at: &EvalPoint<'_>, range: Range<usize>) -> f64 {
        let stencils = self.energy.stencils();
        let mut sum = 0.0;
        for e in range {
            let q = at.gather::<N, M>(&E::NODE_DIMS, &stencils[e]);
            sum += self.energy.value(e, &q, at);
        }
        sum
    }

    fn gradients(&self, at: &EvalPoint<'_>, range: Range<usize>, gradients: &mut [f64]) -> f64 {
        let (gradients, _) = gradients.as_chunks_mut::<M>();
        self.energy.gradients(range, at, gradients)
    }

    fn hessians(
        &self,
        at: &EvalPoint<'_>,
        curvature: Curvature,
        range: Range<usize>,
        gradients: &mut [f64],
        hessians: &mut [f64],
    ) -> f64 {
        let (gradients, _) = gradients.as_chunks_mut::<M>();
        let (rows, _) = hessians.as_chunks_mut::<M>();
        let (hessians, _) = rows.as_chunks_mut::<M>();
        self.energy
            .hessians(range, at, curvature, gradients, hessians)
    }

    fn is_conservative(&self) -> bool {
        self.energy.is_conservative()
    }

    fn begin_step(&mut self, at: &EvalPoint<'_>) {
        self.energy.begin_step(at);
    }

    fn commit(&mut self, at: &EvalPoint<'_>) {
        self.energy.commit(at);
    }

    fn history(&self) -> &[f64] {
        self.energy.history()
    }

    fn restore_history(&mut self, history: &[f64]) {
        self.energy.restore_history(history);
    }

    fn complaint(&self, at: &EvalPoint<'_>, e: usize) -> Option<String> {
        let q = at.gather::<N, M>(&E::NODE_DIMS, &self.energy.stencils()[e]);
        self.energy.complaint(e, &q)
    }

    fn heap_bytes(&self) -> usize {
        self.energy.heap_bytes()
    }
}
