//! No preconditioner, and the diagonal.

use super::{Pointwise, Preconditioner, filtered_diagonal};
use crate::{ExplicitOperator, Filter, LinearOperator, LinsolveError, Real};

/// `P = I`: name `"none"`.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoPreconditioner;

impl<T: Real> Preconditioner<T> for NoPreconditioner {
    fn name(&self) -> &str {
        "none"
    }

    fn update(
        &mut self,
        _: &dyn ExplicitOperator<T>,
        _: &dyn Filter<T>,
    ) -> Result<(), LinsolveError> {
        Ok(())
    }

    fn apply(&mut self, _: &dyn LinearOperator<T>, r: &[T], z: &mut [T]) {
        z.copy_from_slice(r);
    }

    fn pointwise(&self) -> Option<Pointwise<'_, T>> {
        Some(Pointwise::Identity)
    }

    fn heap_bytes(&self) -> usize {
        0
    }
}

/// `P = diag(A)`: name `"diagonal"`.
///
/// An entry that is not positive is replaced by its absolute value, a zero by
/// the mean diagonal, so that `P` is positive definite whatever `A` is.
#[derive(Debug, Clone, Default)]
pub struct Diagonal<T> {
    inverse: Vec<T>,
    blocks: Vec<[f64; 9]>,
    scalars: Vec<f64>,
}

impl<T: Real> Preconditioner<T> for Diagonal<T> {
    fn name(&self) -> &str {
        "diagonal"
    }

    fn update(
        &mut self,
        a: &dyn ExplicitOperator<T>,
        filter: &dyn Filter<T>,
    ) -> Result<(), LinsolveError> {
        let mean = filtered_diagonal(a, filter, &mut self.blocks, &mut self.scalars)?;
        self.inverse.clear();
        self.inverse.extend(
            self.blocks
                .iter()
                .flat_map(|b| [b[0], b[4], b[8]])
                .chain(self.scalars.iter().copied())
                .map(|d| T::from_f64(positive_inverse(d, mean))),
        );
        Ok(())
    }

    fn apply(&mut self, _: &dyn LinearOperator<T>, r: &[T], z: &mut [T]) {
        for (z, (&r, &d)) in z.iter_mut().zip(r.iter().zip(&self.inverse)) {
            *z = d * r;
        }
    }

    fn pointwise(&self) -> Option<Pointwise<'_, T>> {
        Some(Pointwise::Diagonal(&self.inverse))
    }

    fn heap_bytes(&self) -> usize {
        self.inverse.capacity() * size_of::<T>()
            + 72 * self.blocks.capacity()
            + 8 * self.scalars.capacity()
    }
}

/// `1/|d|`, or `1/mean` where that overflows the range of the mean.
pub(crate) fn positive_inverse(d: f64, mean: f64) -> f64 {
    let d = d.abs();
    1.0 / if d > 1e-12 * mean { d } else { mean }
}
