//! Inverted 3×3 diagonal blocks.

use super::diagonal::positive_inverse;
use super::{Pointwise, Preconditioner, block_times, filter_diagonal, read_diagonal};
use crate::{ExplicitOperator, Filter, LinearOperator, LinsolveError, Real, small};

/// `P = blockdiag(A_ii)`, inverted by Cholesky: name `"block-jacobi"`.
///
/// ```text
/// D_i = S_i A_ii S_i + m̄ (I − S_i),    D_i + ε I when a pivot is ≤ 1e-12 tr D_i
/// ```
/// `ε` starts at `1e-12 tr D_i` and grows tenfold until the pivots are positive.
#[derive(Debug, Clone, Default)]
pub struct BlockJacobi<T> {
    inverse: Vec<[T; 6]>,
    scalar_inverse: Vec<T>,
    blocks: Vec<[f64; 9]>,
    scalars: Vec<f64>,
    shifted: usize,
}

impl<T: Real> BlockJacobi<T> {
    /// Blocks of the last update that needed a shift.
    pub fn shifted(&self) -> usize {
        self.shifted
    }

    /// Reads the diagonal of a matrix, for [`invert`](Self::invert); returns its
    /// mean and its blocks.
    pub(super) fn read(
        &mut self,
        a: &dyn ExplicitOperator<T>,
    ) -> Result<(f64, &[[f64; 9]]), LinsolveError> {
        let mean = read_diagonal(a, &mut self.blocks, &mut self.scalars)?;
        Ok((mean, &self.blocks))
    }

    /// Inverts the diagonal read last.
    pub(super) fn invert(&mut self, filter: &dyn Filter<T>, mean: f64) {
        filter_diagonal(filter, mean, &mut self.blocks, &mut self.scalars);
        self.shifted = 0;
        self.inverse.clear();
        for block in &self.blocks {
            let (inverse, shifted) = invert(block, mean);
            self.shifted += usize::from(shifted);
            self.inverse.push(inverse.map(T::from_f64));
        }
        self.scalar_inverse.clear();
        self.scalar_inverse.extend(
            self.scalars
                .iter()
                .map(|&d| T::from_f64(positive_inverse(d, mean))),
        );
    }

    pub(crate) fn times(&self, r: &[T], z: &mut [T]) {
        let points = self.inverse.len();
        let (rp, rs) = r.split_at(3 * points);
        let (zp, zs) = z.split_at_mut(3 * points);
        let data = (
            self.inverse.as_slice(),
            rp.as_chunks().0,
            zp.as_chunks_mut().0,
        );
        type Piece<'a, T> = (&'a [[T; 6]], &'a [[T; 3]], &'a mut [[T; 3]]);
        crate::vector::tree(data, 1024, 8192, &|(d, r, z): Piece<'_, T>| {
            for (z, (d, r)) in z.iter_mut().zip(d.iter().zip(r)) {
                *z = block_times(d, r);
            }
            []
        });
        for (z, (&d, &r)) in zs.iter_mut().zip(self.scalar_inverse.iter().zip(rs)) {
            *z = d * r;
        }
    }
}

impl<T: Real> Preconditioner<T> for BlockJacobi<T> {
    fn name(&self) -> &str {
        "block-jacobi"
    }

    fn update(
        &mut self,
        a: &dyn ExplicitOperator<T>,
        filter: &dyn Filter<T>,
    ) -> Result<(), LinsolveError> {
        let (mean, _) = self.read(a)?;
        self.invert(filter, mean);
        Ok(())
    }

    fn apply(&mut self, _: &dyn LinearOperator<T>, r: &[T], z: &mut [T]) {
        self.times(r, z);
    }

    fn pointwise(&self) -> Option<Pointwise<'_, T>> {
        Some(Pointwise::Blocks(&self.inverse, &self.scalar_inverse))
    }

    fn heap_bytes(&self) -> usize {
        self.inverse.capacity() * size_of::<[T; 6]>()
            + self.scalar_inverse.capacity() * size_of::<T>()
            + 72 * self.blocks.capacity()
            + 8 * self.scalars.capacity()
    }
}

/// Positive definite inverse of any finite block, and whether it was shifted.
pub(crate) fn invert(block: &[f64; 9], mean: f64) -> ([f64; 6], bool) {
    let trace = small::trace(block);
    let floor = 1e-12 * trace.abs();
    if trace > 0.0
        && let Some(l) = small::cholesky(block, floor)
    {
        return (small::inverse(&l), false);
    }
    // bound on the size of any eigenvalue: the loop ends at the latest there
    let size = block.iter().map(|v| v.abs()).sum::<f64>();
    let mut shift = 1e-12 * size;
    while shift.is_finite() && shift > 0.0 && shift < 1e3 * size {
        let mut b = *block;
        for k in [0, 4, 8] {
            b[k] += shift;
        }
        if let Some(l) = small::cholesky(&b, 0.1 * shift) {
            return (small::inverse(&l), true);
        }
        shift *= 10.0;
    }
    let d = 1.0 / mean;
    ([d, 0.0, 0.0, d, 0.0, d], true)
}
