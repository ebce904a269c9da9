//! Stencils of points and scalars, and inertia that couples unknowns.

use std::ops::Range;

use selvedge_energy::{Curvature, EnergyBatch, EvalPoint, MassBatch, RatePoint};
use selvedge_linsolve::{BorderPattern, Pattern, Real};

use super::{BLOCK, blocks};
use crate::sink::Sink;

/// Patterns of a matrix with scalars.
#[derive(Clone, Copy)]
pub(crate) struct Patterns<'a> {
    pub(crate) points: &'a Pattern,
    pub(crate) border: &'a BorderPattern,
}

/// Values of a matrix with scalars: points' blocks, couplings, scalars' entries.
pub(crate) struct Values<'a, T> {
    pub(crate) blocks: &'a mut [T],
    pub(crate) coupling: &'a mut [T],
    pub(crate) scalars: &'a mut [T],
}

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

/// The points that each stencil touches, scalars by their owners; all stencils
/// have the same number of nodes.
pub(super) fn touched(stencils: &impl Stencils, owners: &[u32]) -> Vec<u32> {
    let dims = stencils.dims();
    let mut out = Vec::with_capacity(stencils.count() * dims.len());
    for e in 0..stencils.count() {
        for (&node, &dim) in stencils.stencil(e).iter().zip(dims) {
            out.push(if dim == 3 {
                node
            } else {
                owners[node as usize]
            });
        }
    }
    out
}

/// Slots of the pairs of every stencil in the order of [`LocalMatrices`]: points'
/// blocks, couplings by rows of scalars, scalars' entries.
pub(super) fn slots(stencils: &impl Stencils, patterns: Patterns<'_>) -> Vec<u32> {
    let dims = stencils.dims();
    let mut all = Vec::with_capacity(stencils.count() * dims.len() * dims.len());
    for e in 0..stencils.count() {
        let nodes = stencils.stencil(e);
        for (&i, &di) in nodes.iter().zip(dims) {
            for (&j, &dj) in nodes.iter().zip(dims) {
                let slot = match (di, dj) {
                    (3, 3) => patterns.points.slot(i, j),
                    (3, _) => continue,
                    (_, 3) => patterns.border.point_slot(i, j),
                    _ => patterns.border.scalar_slot(i, j),
                };
                // The patterns are built from these very stencils.
                all.push(slot.expect("every pair of a stencil is in the patterns"));
            }
        }
    }
    all.shrink_to_fit();
    all
}

/// Slots that one stencil takes in [`slots`].
fn slots_each(dims: &[usize]) -> usize {
    let points = dims.iter().filter(|d| **d == 3).count();
    let scalars = dims.len() - points;
    points * points + scalars * dims.len()
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

/// Where local matrices go.
pub(super) trait LocalMatrices<T: Real> {
    /// Adds `scale ·` the local matrices of a range of stencils.
    fn add(
        &mut self,
        stencils: &impl Stencils,
        slots: &[u32],
        range: Range<usize>,
        local: &[f64],
        scale: f64,
    );
}

/// Points' blocks, couplings and scalars' entries of one matrix.
impl<T: Real, S: Sink<T>> LocalMatrices<T> for [S; 3] {
    fn add(
        &mut self,
        stencils: &impl Stencils,
        slots: &[u32],
        range: Range<usize>,
        local: &[f64],
        scale: f64,
    ) {
        let [blocks, coupling, scalars] = self;
        let dims = stencils.dims();
        let m: usize = dims.iter().sum();
        let each = slots_each(dims);
        for (e, h) in range.zip(local.chunks_exact(m * m)) {
            let mut slots = slots[e * each..(e + 1) * each].iter();
            let mut row = 0;
            for &di in dims {
                let mut column = 0;
                for &dj in dims {
                    let at = row * m + column;
                    match (di, dj) {
                        (3, 3) => {
                            let slot = slots.next().copied().unwrap_or_default();
                            let line = |r: usize| {
                                let from = at + r * m;
                                [h[from], h[from + 1], h[from + 2]]
                            };
                            let block = [line(0), line(1), line(2)];
                            blocks.add_block(slot as usize, &block, scale);
                        }
                        (3, _) => {}
                        (_, 3) => {
                            let slot = slots.next().copied().unwrap_or_default();
                            let line = [h[at], h[at + 1], h[at + 2]];
                            coupling.add_point(slot as usize, &line, scale);
                        }
                        _ => {
                            let slot = slots.next().copied().unwrap_or_default();
                            scalars.add_value(slot as usize, h[at], scale);
                        }
                    }
                    column += dj;
                }
                row += di;
            }
        }
    }
}

/// Gradients and second derivatives of an energy.
pub(super) struct MixedWork<'a> {
    pub(super) batch: &'a dyn EnergyBatch,
    pub(super) at: &'a EvalPoint<'a>,
    pub(super) curvature: Curvature,
    pub(super) factor: f64,
    pub(super) slots: &'a [u32],
}

impl MixedWork<'_> {
    pub(super) fn run<T: Real>(
        &self,
        range: Range<usize>,
        [g, h]: &mut [Vec<f64>; 2],
        out: &mut impl Sink<f64>,
        matrix: &mut impl LocalMatrices<T>,
    ) -> f64 {
        let (batch, at) = (self.batch, self.at);
        let m = batch.local_dim();
        g.resize(BLOCK * m, 0.0);
        h.resize(BLOCK * m * m, 0.0);
        let mut value = 0.0;
        for block in blocks(range) {
            let g = &mut g[..block.len() * m];
            let h = &mut h[..block.len() * m * m];
            value += batch.hessians(at, self.curvature, block.clone(), g, h);
            let scale = -at.dt * self.factor;
            add_local(&batch, at.layout.points, block.clone(), g, scale, out);
            let scale = at.dt * at.dt * self.factor;
            matrix.add(&batch, self.slots, block, h, scale);
        }
        value
    }
}

/// Inertia that couples unknowns, evaluated at the start of a step.
#[derive(Clone, Copy)]
pub struct MassEvaluation<'a> {
    /// The inertia.
    pub batch: &'a dyn MassBatch,
    /// Unknowns and rates at the start of the step.
    pub start: RatePoint<'a>,
    /// `v_0 − (1 + dt α) v` [m/s].
    pub change: &'a [f64],
    /// Mass-proportional damping α [1/s].
    pub damping: f64,
    /// Length of the step [s].
    pub dt: f64,
}

impl MassEvaluation<'_> {
    /// `out += M change + dt Q`, and `(1 + dt α) M` to a matrix.
    pub(super) fn run<T: Real>(
        &self,
        slots: &[u32],
        range: Range<usize>,
        [f, m]: &mut [Vec<f64>; 2],
        out: &mut impl Sink<f64>,
        mut matrix: Option<&mut impl LocalMatrices<T>>,
    ) -> f64 {
        let n = self.batch.local_dim();
        f.resize(BLOCK * n, 0.0);
        m.resize(BLOCK * n * n, 0.0);
        let mut kinetic = 0.0;
        for block in blocks(range) {
            let f = &mut f[..block.len() * n];
            let m = &mut m[..block.len() * n * n];
            kinetic += self.batch.rate_forces(&self.start, block.clone(), f);
            self.batch.masses(&self.start, block.clone(), m);
            for ((e, f), m) in block
                .clone()
                .zip(f.chunks_exact_mut(n))
                .zip(m.chunks_exact(n * n))
            {
                f.iter_mut().for_each(|f| *f *= self.dt);
                self.add_product(e, m, f);
            }
            let points = self.start.layout.points;
            add_local(&self.batch, points, block.clone(), f, 1.0, out);
            if let Some(matrix) = matrix.as_deref_mut() {
                let scale = 1.0 + self.dt * self.damping;
                matrix.add(&self.batch, slots, block, m, scale);
            }
        }
        kinetic
    }

    /// `f += M_e change_e`
    fn add_product(&self, e: usize, m: &[f64], f: &mut [f64]) {
        let layout = self.start.layout;
        let n = f.len();
        let mut column = 0;
        for (&node, &dim) in self.batch.nodes(e).iter().zip(self.batch.node_dims()) {
            let from = layout.offset(node, dim);
            for k in 0..dim {
                let w = self.change[from + k];
                for (r, f) in f.iter_mut().enumerate() {
                    *f += m[r * n + column + k] * w;
                }
            }
            column += dim;
        }
    }
}
