//! Block sparse matrix with a static pattern.

use crate::pattern::ROW_CHUNK;
use crate::vector::{From, tree};
use crate::{LinearOperator, Mirror, Pattern, Real, Sums, vector};
use std::sync::Arc;

/// Symmetric matrix of 3×3 blocks on a [`Pattern`], both triangles stored.
///
/// A block is nine consecutive values, column by column: entry (r, c) of the
/// block in `slot` is `values()[Bsr::<T>::index(slot, r, c)]`. Columns are
/// contiguous so that a block times a vector is three vector instructions.
#[derive(Debug, Clone)]
pub struct Bsr<T> {
    pattern: Arc<Pattern>,
    values: Vec<T>,
}

impl<T: Real> Bsr<T> {
    /// The zero matrix on a pattern.
    pub fn zeros(pattern: Arc<Pattern>) -> Self {
        let values = vec![T::ZERO; 9 * pattern.block_count()];
        Self { pattern, values }
    }

    /// Position in [`values`](Self::values) of entry (r, c) of a block.
    #[inline]
    pub const fn index(slot: usize, r: usize, c: usize) -> usize {
        9 * slot + 3 * c + r
    }

    /// The pattern.
    pub fn pattern(&self) -> &Arc<Pattern> {
        &self.pattern
    }

    /// All values, nine for each slot.
    pub fn values(&self) -> &[T] {
        &self.values
    }

    /// All values, for assembly.
    pub fn values_mut(&mut self) -> &mut [T] {
        &mut self.values
    }

    /// Sets every value to zero.
    pub fn fill_zero(&mut self) {
        tree(
            self.values.as_mut_slice(),
            1 << 16,
            1 << 18,
            &|v: &mut [T]| {
                v.fill(T::ZERO);
                []
            },
        );
    }

    /// The block in a slot, as rows.
    pub fn block(&self, slot: usize) -> [[f64; 3]; 3] {
        std::array::from_fn(|r| {
            std::array::from_fn(|c| self.values[Self::index(slot, r, c)].to_f64())
        })
    }

    /// Adds `scale · block` (given as rows) to a slot.
    #[inline]
    pub fn add_block(&mut self, slot: usize, block: &[[f64; 3]; 3], scale: f64) {
        let values = &mut self.values[9 * slot..9 * slot + 9];
        for c in 0..3 {
            for r in 0..3 {
                values[3 * c + r] += T::from_f64(scale * block[r][c]);
            }
        }
    }

    /// Adds `v` to the three diagonal entries of point `i`.
    #[inline]
    pub fn add_diagonal(&mut self, i: usize, v: f64) {
        let slot = self.pattern.diagonal_slot(i) as usize;
        for k in 0..3 {
            self.values[Self::index(slot, k, k)] += T::from_f64(v);
        }
    }

    /// Makes every block above the diagonal the transpose of the one below it.
    ///
    /// # Panics
    /// If `mirror` is of another pattern.
    pub fn mirror(&mut self, mirror: &Mirror) {
        let pattern = &self.pattern;
        assert_eq!(mirror.pattern, pattern.id(), "patterns differ");
        // rows write above the diagonal and read below it: no value is both
        let values = T::as_atomics(&mut self.values);
        let n = pattern.points();
        tree(From(0, n), ROW_CHUNK, 2 * ROW_CHUNK, &|rows: From| {
            for i in rows.0..rows.0 + rows.1 {
                let own = pattern.diagonal_slot(i) as usize + 1..pattern.row(i).end;
                for (to, &from) in own.zip(mirror.of_row(i)) {
                    let (to, from) = (9 * to, 9 * from as usize);
                    let (to, from) = (&values[to..to + 9], &values[from..from + 9]);
                    for c in 0..3 {
                        for r in 0..3 {
                            T::copy_exclusive(&from[3 * r + c], &to[3 * c + r]);
                        }
                    }
                }
            }
            []
        });
    }

    /// Values as blocks.
    #[inline]
    pub(crate) fn blocks(&self) -> &[[T; 9]] {
        self.values.as_chunks().0
    }

    /// Copies the values of a matrix on the same pattern in another precision.
    ///
    /// # Panics
    /// If the patterns differ in size.
    pub fn copy_from<U: Real>(&mut self, other: &Bsr<U>) {
        assert_eq!(self.values.len(), other.values.len(), "patterns differ");
        crate::vector::convert(1.0, &other.values, &mut self.values);
    }

    /// Row chunks of `y = A x`, with `more(first row, piece of y)` called on
    /// each while it is in cache; returns the sum of what `more` returns.
    #[inline(always)]
    pub(crate) fn product<const K: usize>(
        &self,
        x: &[T],
        y: &mut [T],
        more: &(impl Fn(usize, &mut [[T; 3]]) -> [f64; K] + Sync),
    ) -> [f64; K] {
        let x = x.as_chunks::<3>().0;
        let y = y.as_chunks_mut::<3>().0;
        let rows = y.len();
        assert!(x.len() == rows && rows == self.pattern.points());
        tree(
            (From(0, rows), y),
            ROW_CHUNK,
            2 * ROW_CHUNK,
            &|(from, y): (From, &mut [[T; 3]])| {
                self.rows(from.0, x, y);
                more(from.0, y)
            },
        )
    }

    /// `y[k] = (A x)[first + k]`.
    fn rows(&self, first: usize, x: &[[T; 3]], y: &mut [[T; 3]]) {
        let offsets = &self.pattern.offsets()[first..first + y.len() + 1];
        let (columns, blocks) = (self.pattern.all_columns(), self.blocks());
        for (y, ends) in y.iter_mut().zip(offsets.windows(2)) {
            let row = ends[0] as usize..ends[1] as usize;
            *y = row_product(&columns[row.clone()], &blocks[row], x);
        }
    }

    /// Heap memory in bytes, the shared pattern included.
    pub fn heap_bytes(&self) -> usize {
        self.values.capacity() * size_of::<T>() + self.pattern.heap_bytes()
    }
}

/// One block row times `x`.
#[inline(always)]
pub(crate) fn row_product<T: Real>(columns: &[u32], blocks: &[[T; 9]], x: &[[T; 3]]) -> [T; 3] {
    T::row_product(columns, blocks, x)
}

impl<T: Real> LinearOperator<T> for Bsr<T> {
    fn dim(&self) -> usize {
        3 * self.pattern.points()
    }

    fn apply(&self, x: &[T], y: &mut [T]) {
        self.product(x, y, &|_, _| []);
    }

    fn apply_dot(&self, x: &[T], y: &mut [T], sums: Sums) -> f64 {
        let points = x.as_chunks::<3>().0;
        let [dot] = match sums {
            Sums::Double => self.product(x, y, &|first, y| [rows_dot::<f64, T>(points, first, y)]),
            Sums::OfVectors => self.product(x, y, &|first, y| [rows_dot::<T, T>(points, first, y)]),
        };
        dot
    }
}

/// `x · y` of the rows from `first` that `y` holds.
#[inline(always)]
pub(crate) fn rows_dot<A: Real, T: Real>(x: &[[T; 3]], first: usize, y: &[[T; 3]]) -> f64 {
    let x = &x[first..first + y.len()];
    vector::piece_dot::<A, T>(x.as_flattened(), y.as_flattened())
}
