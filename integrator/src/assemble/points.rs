//! Blocks of stencils of points alone.

use std::ops::Range;

use selvedge_energy::EnergyBatch;
use selvedge_linsolve::{Pattern, Real};

use super::work::{LocalMatrices, Stencils};
use crate::sink::Sink;

/// Slots below the diagonal of the pairs `a < b` of each stencil, row by row;
/// the diagonal's are found from the pattern.
pub(super) fn slots(batch: &dyn EnergyBatch, pattern: &Pattern) -> Vec<u32> {
    let n = batch.node_dims().len();
    let mut all = Vec::with_capacity(batch.len() * n * (n - 1) / 2);
    for e in 0..batch.len() {
        let nodes = batch.nodes(e);
        for a in 0..n {
            for b in a + 1..n {
                let (row, column) = (nodes[a].max(nodes[b]), nodes[a].min(nodes[b]));
                let slot = pattern.slot(row, column);
                // The pattern is built from these very stencils.
                all.push(slot.expect("every pair of a stencil is in the pattern"));
            }
        }
    }
    all
}

/// Blocks on and below the diagonal of a symmetric matrix, with the slots of the
/// stencils in it.
#[derive(Clone)]
pub(super) struct PointBlocks<'a, S> {
    pub(super) pattern: &'a Pattern,
    pub(super) slots: &'a [u32],
    pub(super) values: S,
}

impl<T: Real, S: Sink<T>> LocalMatrices<T> for PointBlocks<'_, S> {
    #[inline(always)]
    fn add(&mut self, stencils: &impl Stencils, range: Range<usize>, local: &[f64], scale: f64) {
        let n = stencils.dims().len();
        match n {
            1 => self.scatter(stencils, range, local, (1, 3), scale),
            2 => self.scatter(stencils, range, local, (2, 6), scale),
            3 => self.scatter(stencils, range, local, (3, 9), scale),
            4 => self.scatter(stencils, range, local, (4, 12), scale),
            _ => self.scatter(stencils, range, local, (n, 3 * n), scale),
        }
    }
}

impl<S> PointBlocks<'_, S> {
    /// The lower half of the local matrices of `n` nodes, `m = 3 n`: constants
    /// where it is called, so that the loops are unrolled.
    #[inline(always)]
    fn scatter<T: Real>(
        &mut self,
        stencils: &impl Stencils,
        range: Range<usize>,
        local: &[f64],
        (n, m): (usize, usize),
        scale: f64,
    ) where
        S: Sink<T>,
    {
        let out = &mut self.values;
        let pairs = n * (n - 1) / 2;
        for (e, h) in range.zip(local.chunks_exact(m * m)) {
            let nodes = stencils.stencil(e);
            let mut slots = self.slots[e * pairs..(e + 1) * pairs].iter();
            // Symmetric: a column of a block is a row of its transpose.
            let columns = |row: usize, column: usize| {
                let at = |c: usize| (3 * column + c) * m + 3 * row;
                let [a, b, c] = [at(0), at(1), at(2)].map(|k| &h[k..k + 3]);
                [a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]]
            };
            for a in 0..n {
                let diagonal = self.pattern.diagonal_slot(nodes[a] as usize) as usize;
                out.add_columns(diagonal, &columns(a, a), scale);
                for b in a + 1..n {
                    let slot = slots.next().copied().unwrap_or_default() as usize;
                    let (low, high) = if nodes[a] < nodes[b] { (a, b) } else { (b, a) };
                    out.add_columns(slot, &columns(high, low), scale);
                    if nodes[a] == nodes[b] {
                        out.add_columns(slot, &columns(low, high), scale);
                    }
                }
            }
        }
    }
}
