//! Approximate inverses.

mod block_ic;
mod block_jacobi;
mod chebyshev;
mod diagonal;
mod multigrid;
mod node_ic;
mod node_jacobi;
mod scalar_ic;
mod shift;
mod stiffness;
mod triangular;

pub use block_ic::BlockIc;
pub use block_jacobi::BlockJacobi;
pub use chebyshev::Chebyshev;
pub use diagonal::{Diagonal, NoPreconditioner};
pub use multigrid::Multigrid;
pub use node_ic::NodeIc;
pub use node_jacobi::NodeJacobi;
pub use scalar_ic::ScalarIc;
pub use stiffness::ByStiffness;

use crate::{ExplicitOperator, Filter, LinearOperator, LinsolveError, Real, small};

/// A symmetric positive definite approximation of `A⁻¹`.
///
/// With a filter it approximates the inverse of `S A S + m̄ (I − S)`, not of `A`
/// \[Boxerman2003\]; `m̄` is the mean diagonal, so that the added part has the
/// unit of `A`.
pub trait Preconditioner<T: Real>: Send {
    /// Name in scene files.
    fn name(&self) -> &str;

    /// Prepares for a matrix and a filter.
    ///
    /// # Errors
    /// A matrix that is not finite, or no factorisation with an admitted shift.
    fn update(
        &mut self,
        a: &dyn ExplicitOperator<T>,
        filter: &dyn Filter<T>,
    ) -> Result<(), LinsolveError>;

    /// `z = P⁻¹ r`; `a` is the matrix of the last update, for methods that
    /// multiply by it.
    fn apply(&mut self, a: &dyn LinearOperator<T>, r: &[T], z: &mut [T]);

    /// The inverse itself where it couples no two points: solvers then fuse it
    /// with their vector updates.
    fn pointwise(&self) -> Option<Pointwise<'_, T>> {
        None
    }

    /// Heap memory in bytes.
    fn heap_bytes(&self) -> usize;
}

/// An inverse that acts on each point alone.
#[derive(Debug, Clone, Copy)]
pub enum Pointwise<'a, T> {
    /// `z = r`.
    Identity,
    /// `z_k = d_k r_k`.
    Diagonal(&'a [T]),
    /// Symmetric blocks xx, xy, xz, yy, yz, zz on the points, factors on the scalars.
    Blocks(&'a [[T; 6]], &'a [T]),
}

/// Block times vector, symmetric packing.
#[inline(always)]
pub(crate) fn block_times<T: Real>(d: &[T; 6], r: &[T; 3]) -> [T; 3] {
    [
        d[2].fma(r[2], d[1].fma(r[1], d[0] * r[0])),
        d[4].fma(r[2], d[3].fma(r[1], d[1] * r[0])),
        d[5].fma(r[2], d[4].fma(r[1], d[2] * r[0])),
    ]
}

/// Complete diagonal blocks of `S A S + m̄ (I − S)`, and the scalars' diagonal;
/// returns `m̄`.
pub(crate) fn filtered_diagonal<T: Real>(
    a: &dyn ExplicitOperator<T>,
    filter: &dyn Filter<T>,
    blocks: &mut Vec<[f64; 9]>,
    scalars: &mut Vec<f64>,
) -> Result<f64, LinsolveError> {
    let mean = read_diagonal(a, blocks, scalars)?;
    filter_diagonal(filter, mean, blocks, scalars);
    Ok(mean)
}

/// Complete diagonal blocks of `A`, and the scalars' diagonal; returns their mean
/// `m̄`, 1 where that is not positive.
fn read_diagonal<T: Real>(
    a: &dyn ExplicitOperator<T>,
    blocks: &mut Vec<[f64; 9]>,
    scalars: &mut Vec<f64>,
) -> Result<f64, LinsolveError> {
    let layout = a.layout();
    blocks.clear();
    blocks.resize(layout.points, [0.0; 9]);
    scalars.clear();
    scalars.resize(layout.scalars, 0.0);
    a.diagonal_blocks(blocks);
    a.diagonal_scalars(scalars);
    crate::error::check_finite("matrix diagonal", blocks.as_flattened())?;
    crate::error::check_finite("matrix diagonal", scalars)?;
    let sum: f64 = blocks.iter().map(small::trace).sum::<f64>() + scalars.iter().sum::<f64>();
    Ok(match sum / layout.dim().max(1) as f64 {
        m if m > 0.0 => m,
        _ => 1.0,
    })
}

/// From the diagonal of `A` to that of `S A S + m̄ (I − S)`.
fn filter_diagonal<T: Real>(
    filter: &dyn Filter<T>,
    mean: f64,
    blocks: &mut [[f64; 9]],
    scalars: &mut [f64],
) {
    let Some(filter) = filter.as_blocks() else {
        return;
    };
    for (i, s) in filter.iter() {
        blocks[i] = small::filtered_diagonal(&blocks[i], s, mean);
    }
    for &k in filter.fixed_scalars() {
        scalars[k as usize - 3 * blocks.len()] = mean;
    }
}
