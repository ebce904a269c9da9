//! What is evaluated on the stencils of a chunk, and where it goes.

use std::ops::Range;

use selvedge_energy::{Curvature, EnergyBatch, EvalPoint, MassBatch};
use selvedge_linsolve::Real;

use super::schedule::Scratch;
use crate::sink::Sink;

/// Stencils evaluated by one virtual call: their local matrices stay in the
/// first-level cache.
pub(super) const BLOCK: usize = 16;

/// Nodes of stencils, whatever is evaluated on them.
pub(crate) trait Stencils {
    fn count(&self) -> usize;
    fn dims(&self) -> &[usize];
    fn stencil(&self, e: usize) -> &[u32];
}

impl Stencils for &dyn EnergyBatch {
    fn count(&self) -> usize {
        self.len()
    }
    fn dims(&self) -> &[usize] {
        self.node_dims()
    }
    fn stencil(&self, e: usize) -> &[u32] {
        self.nodes(e)
    }
}

impl Stencils for &dyn MassBatch {
    fn count(&self) -> usize {
        self.len()
    }
    fn dims(&self) -> &[usize] {
        self.node_dims()
    }
    fn stencil(&self, e: usize) -> &[u32] {
        self.nodes(e)
    }
}

/// Where local matrices go.
pub(super) trait LocalMatrices<T: Real> {
    /// Adds `scale ·` the local matrices of a range of stencils.
    fn add(&mut self, stencils: &impl Stencils, range: Range<usize>, local: &[f64], scale: f64);
}

/// Keeps nothing, where forces alone are asked for.
pub(super) struct Nowhere;

impl LocalMatrices<f64> for Nowhere {
    fn add(&mut self, _: &impl Stencils, _: Range<usize>, _: &[f64], _: f64) {}
}

pub(super) fn blocks(range: Range<usize>) -> impl Iterator<Item = Range<usize>> {
    let end = range.end;
    range
        .step_by(BLOCK)
        .map(move |from| from..(from + BLOCK).min(end))
}

/// Adds `scale ·` local vectors of a range to a vector of unknowns.
pub(super) fn add_local(
    stencils: &impl Stencils,
    points: usize,
    range: Range<usize>,
    local: &[f64],
    scale: f64,
    out: &mut impl Sink<f64>,
) {
    let dims = stencils.dims();
    let mut rest = local;
    for e in range {
        for (&node, &dim) in stencils.stencil(e).iter().zip(dims) {
            let (head, tail) = rest.split_at(dim);
            if let &[x, y, z] = head {
                out.add_point(node as usize, &[x, y, z], scale);
            } else {
                out.add_value(3 * points + node as usize, head[0], scale);
            }
            rest = tail;
        }
    }
}

/// Gradients of the chunks of one term.
pub(super) struct ForceWork<'a> {
    pub(super) batch: &'a dyn EnergyBatch,
    pub(super) at: &'a EvalPoint<'a>,
    pub(super) factor: f64,
}

impl ForceWork<'_> {
    pub(super) fn run(
        &self,
        range: Range<usize>,
        [g, _]: &mut Scratch,
        out: &mut impl Sink<f64>,
    ) -> f64 {
        let m = self.batch.local_dim();
        g.resize(BLOCK * m, 0.0);
        let mut value = 0.0;
        for block in blocks(range) {
            let g = &mut g[..block.len() * m];
            value += self.batch.gradients(self.at, block.clone(), g);
            self.scatter(block, g, out);
        }
        value
    }

    fn scatter(&self, block: Range<usize>, gradients: &[f64], out: &mut impl Sink<f64>) {
        let scale = -self.at.dt * self.factor;
        if self.batch.node_dims().iter().any(|d| *d != 3) {
            let points = self.at.layout.points;
            return add_local(&self.batch, points, block, gradients, scale, out);
        }
        let mut gradients = gradients.as_chunks::<3>().0.iter();
        for e in block {
            for (&node, g) in self.batch.nodes(e).iter().zip(&mut gradients) {
                out.add_point(node as usize, g, scale);
            }
        }
    }
}

/// Gradients and second derivatives of the chunks of one term.
pub(super) struct MatrixWork<'a> {
    pub(super) forces: ForceWork<'a>,
    pub(super) curvature: Curvature,
}

impl MatrixWork<'_> {
    pub(super) fn run<T: Real>(
        &self,
        range: Range<usize>,
        [g, h]: &mut Scratch,
        out: &mut impl Sink<f64>,
        matrix: &mut impl LocalMatrices<T>,
    ) -> f64 {
        let ForceWork { batch, at, factor } = self.forces;
        let m = batch.local_dim();
        let scale = at.dt * at.dt * factor;
        g.resize(BLOCK * m, 0.0);
        h.resize(BLOCK * m * m, 0.0);
        let mut value = 0.0;
        for block in blocks(range) {
            let g = &mut g[..block.len() * m];
            let h = &mut h[..block.len() * m * m];
            value += batch.hessians(at, self.curvature, block.clone(), g, h);
            self.forces.scatter(block.clone(), g, out);
            matrix.add(&batch, block, h, scale);
        }
        value
    }
}
