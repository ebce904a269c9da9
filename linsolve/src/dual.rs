//! Static blocks plus weighted blocks.

use crate::bsr::rows_dot;
use crate::{BlockLayout, Bsr, ExplicitOperator, LinearOperator, Real, Sums, WeightedBlocks};

/// The sum of a matrix with a static pattern and one that changes.
///
/// ```text
/// A = A_stat + Σ_c (w_c w_cᵀ) ⊗ K_c            [Pizana2025, § 4.1]
/// ```
/// Deviation: the dynamic part is kept in factored form instead of a second
/// sparse matrix, so nothing is sorted when contacts change.
#[derive(Debug, Clone)]
pub struct DualMatrix<T: Real> {
    /// Energies on fixed stencils, masses, and contacts of single points.
    pub stat: Bsr<T>,
    /// Contacts that couple points.
    pub dynamic: WeightedBlocks<T>,
}

impl<T: Real> DualMatrix<T> {
    /// A static matrix without contacts.
    pub fn new(stat: Bsr<T>) -> Self {
        let dynamic = WeightedBlocks::new(stat.pattern().points());
        Self { stat, dynamic }
    }

    pub(crate) fn product<const K: usize>(
        &self,
        x: &[T],
        y: &mut [T],
        more: impl Fn(usize, &mut [[T; 3]]) -> [f64; K] + Sync,
    ) -> [f64; K] {
        if self.dynamic.is_empty() {
            return self.stat.product(x, y, &more);
        }
        assert_eq!(self.dynamic.points(), self.stat.pattern().points());
        let forces = self.dynamic.gather_forces(x);
        let sum = self.stat.product(x, y, &|first, y| {
            self.dynamic.add_rows(&forces, first, y);
            more(first, y)
        });
        self.dynamic.give_back(forces);
        sum
    }

    /// Heap memory in bytes.
    pub fn heap_bytes(&self) -> usize {
        self.stat.heap_bytes() + self.dynamic.heap_bytes()
    }
}

impl<T: Real> LinearOperator<T> for DualMatrix<T> {
    fn dim(&self) -> usize {
        self.stat.dim()
    }

    fn apply(&self, x: &[T], y: &mut [T]) {
        self.product(x, y, |_, _| []);
    }

    fn apply_dot(&self, x: &[T], y: &mut [T], sums: Sums) -> f64 {
        let points = x.as_chunks::<3>().0;
        let [dot] = match sums {
            Sums::Double => self.product(x, y, |first, y| [rows_dot::<f64, T>(points, first, y)]),
            Sums::OfVectors => self.product(x, y, |first, y| [rows_dot::<T, T>(points, first, y)]),
        };
        dot
    }
}

impl<T: Real> ExplicitOperator<T> for DualMatrix<T> {
    fn layout(&self) -> BlockLayout {
        BlockLayout::points(self.stat.pattern().points())
    }

    fn pattern_id(&self) -> u64 {
        // both counters start at 1 and stay far below 2^32
        self.stat.pattern().id() << 32 | (self.dynamic.structure_id() & 0xffff_ffff)
    }

    fn diagonal_blocks(&self, out: &mut [[f64; 9]]) {
        static_diagonal(&self.stat, out);
        self.dynamic.add_diagonal_blocks(out);
    }

    fn static_part(&self) -> &Bsr<T> {
        &self.stat
    }

    fn dynamic_part(&self) -> Option<&WeightedBlocks<T>> {
        Some(&self.dynamic)
    }

    fn visit_lower(&self, visit: &mut dyn FnMut(usize, usize, f64)) {
        visit_static(&self.stat, visit);
        self.dynamic.visit_blocks(&mut |i, j, k| {
            for r in 0..3 {
                for c in 0..if i == j { r + 1 } else { 3 } {
                    visit(3 * i + r, 3 * j + c, k[3 * r + c]);
                }
            }
        });
    }
}

pub(crate) fn static_diagonal<T: Real>(a: &Bsr<T>, out: &mut [[f64; 9]]) {
    for (i, out) in out.iter_mut().enumerate() {
        let block = a.block(a.pattern().diagonal_slot(i) as usize);
        for k in 0..9 {
            out[k] = block[k / 3][k % 3];
        }
    }
}

pub(crate) fn visit_static<T: Real>(a: &Bsr<T>, visit: &mut dyn FnMut(usize, usize, f64)) {
    let pattern = a.pattern();
    for i in 0..pattern.points() {
        for slot in pattern.row(i).start..=pattern.diagonal_slot(i) as usize {
            let j = pattern.all_columns()[slot] as usize;
            let block = a.block(slot);
            for r in 0..3 {
                for c in 0..if i == j { r + 1 } else { 3 } {
                    visit(3 * i + r, 3 * j + c, block[r][c]);
                }
            }
        }
    }
}

/// A static matrix is an explicit operator too.
impl<T: Real> ExplicitOperator<T> for Bsr<T> {
    fn layout(&self) -> BlockLayout {
        BlockLayout::points(self.pattern().points())
    }

    fn pattern_id(&self) -> u64 {
        self.pattern().id() << 32
    }

    fn diagonal_blocks(&self, out: &mut [[f64; 9]]) {
        static_diagonal(self, out);
    }

    fn static_part(&self) -> &Bsr<T> {
        self
    }

    fn visit_lower(&self, visit: &mut dyn FnMut(usize, usize, f64)) {
        visit_static(self, visit);
    }
}
