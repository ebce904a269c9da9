//! One of two preconditioners, by how stiff the matrix is for its masses.

use std::sync::Arc;

use super::Pointwise;
use crate::{
    BlockJacobi, ExplicitOperator, Filter, LinearOperator, LinsolveError, Preconditioner, Real,
    small,
};

/// Block Jacobi for matrices that are not stiff for their masses, a stronger
/// preconditioner for those that are.
///
/// ```text
/// Λ = mean of tr A_ii / (3 m_i)
/// ```
/// In `A = M + h² K` the mass bounds the spectrum of `M⁻¹ A` from below by 1, and
/// `Λ` is the mean of its parts: conjugate gradients with block Jacobi take some
/// `3 √Λ` iterations to a hundredth, whatever the mesh. What a stronger preconditioner
/// costs to prepare pays above a number of them. Nothing but the matrix decides, so
/// that a solve does not depend on those before it.
pub struct ByStiffness<T> {
    masses: Arc<[f64]>,
    limit: f64,
    weak: BlockJacobi<T>,
    strong: Box<dyn Preconditioner<T>>,
    stiff: bool,
}

impl<T: Real> ByStiffness<T> {
    /// With the mass of every point and the largest `√Λ` that block Jacobi is used for.
    pub fn new(masses: Arc<[f64]>, limit: f64, strong: Box<dyn Preconditioner<T>>) -> Self {
        Self {
            masses,
            limit,
            weak: BlockJacobi::default(),
            strong,
            stiff: false,
        }
    }
}

impl<T: Real> Preconditioner<T> for ByStiffness<T> {
    fn name(&self) -> &str {
        "auto"
    }

    fn update(
        &mut self,
        a: &dyn ExplicitOperator<T>,
        filter: &dyn Filter<T>,
    ) -> Result<(), LinsolveError> {
        let points = a.layout().points;
        crate::error::check_len("masses", points, self.masses.len())?;
        let (mean, blocks) = self.weak.read(a)?;
        let each = blocks.iter().zip(self.masses.iter());
        let sum: f64 = each.map(|(block, m)| small::trace(block) / m).sum();
        let root = (sum / (3 * points.max(1)) as f64).sqrt();
        self.stiff = root > self.limit;
        if self.stiff {
            return self.strong.update(a, filter);
        }
        self.weak.invert(filter, mean);
        Ok(())
    }

    fn apply(&mut self, a: &dyn LinearOperator<T>, r: &[T], z: &mut [T]) {
        match self.stiff {
            true => self.strong.apply(a, r, z),
            false => self.weak.apply(a, r, z),
        }
    }

    fn pointwise(&self) -> Option<Pointwise<'_, T>> {
        match self.stiff {
            true => self.strong.pointwise(),
            false => self.weak.pointwise(),
        }
    }

    fn heap_bytes(&self) -> usize {
        self.weak.heap_bytes() + self.strong.heap_bytes()
    }
}
