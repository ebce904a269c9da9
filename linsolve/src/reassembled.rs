//! The baseline that rebuilds everything.

use crate::dual::{static_diagonal, visit_static};
use crate::{BlockLayout, Bsr, ExplicitOperator, LinearOperator, Pattern, Real, Sums};
use sprs::TriMatI;
use std::ops::Add;
use std::sync::Arc;

/// Matrix collected from block triplets and compressed from scratch each time.
///
/// The straightforward way to assemble, kept to measure what
/// [`DualMatrix`](crate::DualMatrix) saves: every block of every stencil and
/// contact is pushed, `compress` sorts and adds them through `sprs`, and the
/// product is that of the compressed blocks.
#[derive(Debug)]
pub struct ReassembledMatrix<T> {
    points: usize,
    triplets: TriMatI<Block<T>, u32>,
    matrix: Bsr<T>,
}

#[derive(Debug, Clone, Copy)]
struct Block<T>([T; 9]);

impl<T: Real> Add for Block<T> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(std::array::from_fn(|k| self.0[k] + other.0[k]))
    }
}

impl<T: Real> ReassembledMatrix<T> {
    /// The zero matrix.
    pub fn new(points: usize) -> Self {
        let none: [&[u32]; 0] = [];
        Self {
            points,
            triplets: TriMatI::new((points, points)),
            matrix: Bsr::zeros(Arc::new(Pattern::from_groups(points, none))),
        }
    }

    /// Forgets the triplets; the compressed matrix stays until the next
    /// [`compress`](Self::compress).
    pub fn clear(&mut self) {
        let capacity = self.triplets.nnz();
        self.triplets = TriMatI::with_capacity((self.points, self.points), capacity);
    }

    /// Adds a block, given as rows, at point row `i` and point column `j`.
    ///
    /// Both triangles must be pushed.
    ///
    /// # Panics
    /// If `i` or `j` is not a point.
    pub fn push_block(&mut self, i: usize, j: usize, block: &[[f64; 3]; 3]) {
        let values = std::array::from_fn(|k| T::from_f64(block[k % 3][k / 3]));
        self.triplets.add_triplet(i, j, Block(values));
    }

    /// Sorts the triplets, adds what falls on the same block and replaces the
    /// matrix.
    pub fn compress(&mut self) {
        for i in 0..self.points {
            self.triplets.add_triplet(i, i, Block([T::ZERO; 9]));
        }
        let rows = self.triplets.to_csr::<u32>();
        let (offsets, columns, blocks) = rows.into_raw_storage();
        let old = self.matrix.pattern();
        let pattern = if old.offsets() == offsets && old.all_columns() == columns {
            Arc::clone(old)
        } else {
            Arc::new(Pattern::from_rows(offsets, columns))
        };
        self.matrix = Bsr::zeros(pattern);
        for (to, from) in self.matrix.values_mut().chunks_exact_mut(9).zip(&blocks) {
            to.copy_from_slice(&from.0);
        }
    }

    /// The compressed matrix.
    pub fn matrix(&self) -> &Bsr<T> {
        &self.matrix
    }

    /// Heap memory in bytes, triplets included.
    pub fn heap_bytes(&self) -> usize {
        self.matrix.heap_bytes() + self.triplets.nnz() * (8 + size_of::<Block<T>>())
    }
}

impl<T: Real> LinearOperator<T> for ReassembledMatrix<T> {
    fn dim(&self) -> usize {
        self.matrix.dim()
    }

    fn apply(&self, x: &[T], y: &mut [T]) {
        self.matrix.apply(x, y);
    }

    fn apply_dot(&self, x: &[T], y: &mut [T], sums: Sums) -> f64 {
        self.matrix.apply_dot(x, y, sums)
    }
}

impl<T: Real> ExplicitOperator<T> for ReassembledMatrix<T> {
    fn layout(&self) -> BlockLayout {
        BlockLayout::points(self.points)
    }

    fn pattern_id(&self) -> u64 {
        self.matrix.pattern_id()
    }

    fn diagonal_blocks(&self, out: &mut [[f64; 9]]) {
        static_diagonal(&self.matrix, out);
    }

    fn static_part(&self) -> &Bsr<T> {
        &self.matrix
    }

    fn visit_lower(&self, visit: &mut dyn FnMut(usize, usize, f64)) {
        visit_static(&self.matrix, visit);
    }
}
