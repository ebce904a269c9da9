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
///
/// A slot is kept as its distance from the first one of its row: one byte where
/// all rows are that short.
#[derive(Default)]
pub(crate) struct Slots {
    near: Vec<u8>,
    far: Vec<u32>,
}

impl Slots {
    pub(super) fn new(stencils: &impl Stencils, patterns: Patterns<'_>) -> Self {
        let dims = stencils.dims();
        let mut all = Self {
            near: Vec::with_capacity(stencils.count() * slots_each(dims)),
            far: Vec::new(),
        };
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
                    let slot = slot.expect("every pair of a stencil is in the patterns");
                    all.push(slot - patterns.first(i, di, dj));
                }
            }
        }
        all
    }

    fn push(&mut self, distance: u32) {
        if self.far.is_empty() {
            if let Ok(near) = distance.try_into() {
                return self.near.push(near);
            }
            self.far.extend(self.near.iter().map(|&d| u32::from(d)));
            self.near = Vec::new();
        }
        self.far.push(distance);
    }

    #[inline(always)]
    fn at(&self, k: usize) -> u32 {
        match self.near.get(k) {
            Some(&d) => u32::from(d),
            None => self.far[k],
        }
    }

    pub(super) fn heap_bytes(&self) -> usize {
        self.near.capacity() + 4 * self.far.capacity()
    }
}

impl Patterns<'_> {
    /// First slot of a node's row of blocks, couplings or scalars' entries.
    #[inline(always)]
    fn first(&self, node: u32, dim: usize, other: usize) -> u32 {
        let first = match (dim, other) {
            (3, _) => return self.points.offsets()[node as usize],
            (_, 3) => self.border.point_row(node as usize).start,
            _ => self.border.scalar_row(node as usize).start,
        };
        first as u32
    }
}

/// Slots and the rows that they are counted in.
#[derive(Clone, Copy)]
pub(crate) struct SlotsOf<'a> {
    pub(super) slots: &'a Slots,
    pub(super) patterns: Patterns<'a>,
}

/// Slots that one stencil takes in [`Slots`].
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
        slots: Option<SlotsOf<'_>>,
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
        slots: Option<SlotsOf<'_>>,
        range: Range<usize>,
        local: &[f64],
        scale: f64,
    ) {
        let Some(SlotsOf { slots, patterns }) = slots else {
            return;
        };
        let [blocks, coupling, scalars] = self;
        let dims = stencils.dims();
        let m: usize = dims.iter().sum();
        let each = slots_each(dims);
        for (e, h) in range.zip(local.chunks_exact(m * m)) {
            let nodes = stencils.stencil(e);
            let mut at_slot = e * each;
            let mut slot = |first: u32| {
                at_slot += 1;
                (first + slots.at(at_slot - 1)) as usize
            };
            let mut row = 0;
            for (&i, &di) in nodes.iter().zip(dims) {
                let of_points = patterns.first(i, di, 3);
                let of_scalars = patterns.first(i, di, 1);
                let mut column = 0;
                for &dj in dims {
                    let at = row * m + column;
                    match (di, dj) {
                        (3, 3) => {
                            let line = |r: usize| {
                                let from = at + r * m;
                                [h[from], h[from + 1], h[from + 2]]
                            };
                            let block = [line(0), line(1), line(2)];
                            blocks.add_block(slot(of_points), &block, scale);
                        }
                        (3, _) => {}
                        (_, 3) => {
                            let line = [h[at], h[at + 1], h[at + 2]];
                            coupling.add_point(slot(of_points), &line, scale);
                        }
                        _ => scalars.add_value(slot(of_scalars), h[at], scale),
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
    pub(super) slots: Option<SlotsOf<'a>>,
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
        slots: Option<SlotsOf<'_>>,
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A star: point and scalar 0 couple with all others.
    struct Star(Vec<[u32; 4]>);

    impl Stencils for Star {
        fn count(&self) -> usize {
            self.0.len()
        }
        fn dims(&self) -> &[usize] {
            &[3, 3, 1, 1]
        }
        fn stencil(&self, e: usize) -> &[u32] {
            &self.0[e]
        }
    }

    /// Slots come back whether their rows are short or long.
    #[test]
    fn slots_of_short_and_long_rows() {
        for points in [5, 256, 257, 600] {
            let star = Star((1..points).map(|p| [0, p, 0, p]).collect());
            let pattern = Pattern::from_groups(points as usize, star.0.iter().map(|s| &s[..2]));
            let groups = star.0.iter().map(|s| (&s[..], star.dims()));
            let owners = (0..points).collect();
            let border = BorderPattern::from_groups(points as usize, owners, groups);
            let patterns = Patterns {
                points: &pattern,
                border: &border,
            };
            let slots = Slots::new(&star, patterns);
            assert_eq!(slots.far.is_empty(), points <= 256);
            assert!(slots.near.is_empty() != slots.far.is_empty());
            let each = slots_each(star.dims());
            for (e, &[i, j, s, t]) in star.0.iter().enumerate() {
                let at = |k: usize, node, dim, other| {
                    patterns.first(node, dim, other) + slots.at(e * each + k)
                };
                assert_eq!(Some(at(1, i, 3, 3)), pattern.slot(i, j));
                assert_eq!(Some(at(2, j, 3, 3)), pattern.slot(j, i));
                assert_eq!(Some(at(5, s, 1, 3)), border.point_slot(s, j));
                assert_eq!(Some(at(7, s, 1, 1)), border.scalar_slot(s, t));
                assert_eq!(Some(at(10, t, 1, 1)), border.scalar_slot(t, s));
            }
        }
    }
}
