//! What a solver needs to know about a matrix.

use crate::{BlockLayout, BorderPattern, Bsr, Real, Sums, WeightedBlocks, vector};

/// A linear map `y = A x`.
///
/// Krylov solvers assume that it is symmetric. Implement this alone for a
/// matrix-free operator and hand it to [`Mpcg::solve_operator`](crate::Mpcg::solve_operator).
pub trait LinearOperator<T: Real>: Sync {
    /// Number of unknowns.
    fn dim(&self) -> usize;

    /// `y = A x`; every entry of `y` is written.
    fn apply(&self, x: &[T], y: &mut [T]);

    /// `y = A x` and returns `x · y`.
    ///
    /// Override it where both can be had in one pass over memory.
    fn apply_dot(&self, x: &[T], y: &mut [T], sums: Sums) -> f64 {
        self.apply(x, y);
        match sums {
            Sums::Double => vector::dot_in::<f64, T>(x, y),
            Sums::OfVectors => vector::dot_in::<T, T>(x, y),
        }
    }
}

/// A symmetric matrix whose entries can be read.
pub trait ExplicitOperator<T: Real>: LinearOperator<T> {
    /// Points and scalars.
    fn layout(&self) -> BlockLayout;

    /// Identity of the complete pattern: as long as it is the same, symbolic
    /// factorisations may be reused.
    fn pattern_id(&self) -> u64;

    /// Diagonal 3×3 blocks of the points, row-major, dynamic part included.
    fn diagonal_blocks(&self, out: &mut [[f64; 9]]);

    /// The part with a fixed pattern. Incomplete factorisations use its
    /// off-diagonal blocks (and the complete diagonal).
    fn static_part(&self) -> &Bsr<T>;

    /// The part that changes its pattern, if any.
    fn dynamic_part(&self) -> Option<&WeightedBlocks<T>> {
        None
    }

    /// Calls `visit(row, column, value)` for the complete lower triangle,
    /// `row ≥ column`, in an order that depends on the pattern alone. An entry
    /// may come in several parts, to be added.
    fn visit_lower(&self, visit: &mut dyn FnMut(usize, usize, f64));

    /// Where scalar unknowns couple, if there are any.
    fn border(&self) -> Option<&BorderPattern> {
        None
    }

    /// Coupling of a scalar with its owner; `row` receives its entries with the
    /// scalars of the owner. Zero without a [`border`](Self::border).
    fn own_coupling(&self, _scalar: usize, row: &mut [f64]) -> [f64; 3] {
        row.fill(0.0);
        [0.0; 3]
    }

    /// Values of the [`border`](Self::border) by its slots: couplings of scalars
    /// with points, and entries among the scalars. Empty without a border.
    fn border_values(&self) -> (&[[T; 3]], &[T]) {
        (&[], &[])
    }

    /// Diagonal of the scalar unknowns.
    fn diagonal_scalars(&self, out: &mut [f64]) {
        if out.is_empty() {
            return;
        }
        out.fill(0.0);
        let first = 3 * self.layout().points;
        self.visit_lower(&mut |i, j, v| {
            if i == j && i >= first {
                out[i - first] += v;
            }
        });
    }
}
