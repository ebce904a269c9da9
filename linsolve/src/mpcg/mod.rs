//! Filtered conjugate gradients.

mod fused;
mod iterate;

use crate::error::{check_finite, check_len};
use crate::{
    BlockJacobi, ExplicitOperator, Filter, LinearOperator, LinearSolver, LinsolveError,
    Preconditioner, Real, SolveReport, SolveStatus, Sums, vector,
};
use std::sync::Arc;

/// Norm of the stop test. All compare with the same norm of the filtered
/// right-hand side `S (b − A z)`.
#[derive(Debug, Clone, Default, PartialEq)]
pub enum StopNorm {
    /// `‖r‖`, the relative residual of \[Pizana2025\].
    #[default]
    Euclidean,
    /// `(Σ w_k r_k²)^½` with one weight for each unknown; inverse masses make
    /// it a velocity norm independent of the mesh.
    Weighted(Arc<[f64]>),
    /// `(rᵀ P⁻¹ r)^½`, the norm of \[BaraffWitkin1998\] as corrected by
    /// \[AscherBoxerman2003\].
    Preconditioned,
}

/// Settings of [`Mpcg`].
#[derive(Debug, Clone, PartialEq)]
pub struct MpcgSettings {
    /// Relative tolerance \[1\].
    pub tolerance: f64,
    /// Largest number of iterations.
    pub max_iterations: usize,
    /// Norm of the stop test.
    pub norm: StopNorm,
    /// Iterations between two computations of the true residual.
    pub true_residual_interval: usize,
    /// Growth of `‖r‖` over its start that counts as divergence \[1\].
    pub divergence: f64,
    /// Precision of scalar products and norms.
    pub sums: Sums,
}

impl Default for MpcgSettings {
    fn default() -> Self {
        Self {
            tolerance: 1e-2,
            max_iterations: 500,
            norm: StopNorm::Euclidean,
            true_residual_interval: 50,
            divergence: 1e4,
            sums: Sums::Double,
        }
    }
}

/// Modified preconditioned conjugate gradients: name `"cg"`.
///
/// ```text
/// x ← x_0;  r ← S(b − A x);  c ← S P⁻¹ r;  ρ ← r·c
/// repeat:   q ← S A c;  a ← ρ/(c·q);  x += a c;  r −= a q
///           s ← P⁻¹ r;  ρ' ← r·s;  c ← S(s + (ρ'/ρ) c);  ρ ← ρ'
/// ```
/// \[BaraffWitkin1998, § 5.3\] started from the prescribed part as in
/// \[AscherBoxerman2003\]; with no filter it is plain preconditioned CG. The
/// residual is updated recursively, recomputed every
/// [`true_residual_interval`](MpcgSettings::true_residual_interval) iterations
/// and at the end; when the recomputed one misses the tolerance the iteration
/// restarts from it.
///
/// * `b = 0` with nothing prescribed returns 0.
/// * `cᵀAc ≤ 0` returns the iterate so far; in the first iteration
///   `P⁻¹r · (rᵀP⁻¹r)/|cᵀAc|`, a descent direction of the right size.
/// * Divergence returns `x` as it was on entry.
/// * Where the true and the recursive residual are apart by half of the true
///   one, rounding leads \[VanDerVorstYe2000\] and the iteration restarts. When
///   the true one has not halved over three such looks, or a restart no longer
///   helps, the best iterate seen comes back as [`Stagnated`](crate::SolveStatus::Stagnated); curvature and
///   growth are no longer believed then.
///
/// Vectors are in `T`, sums as [`sums`](MpcgSettings::sums) says, and the system
/// is scaled by a power of two so that `b` is of order 1: nothing underflows in `f32`.
pub struct Mpcg<T> {
    /// Settings.
    pub settings: MpcgSettings,
    preconditioner: Box<dyn Preconditioner<T>>,
    rescue: Option<Box<dyn Preconditioner<T>>>,
    work: Work<T>,
}

/// Vectors kept between solves.
#[derive(Debug, Default)]
struct Work<T> {
    x: Vec<T>,
    r: Vec<T>,
    c: Vec<T>,
    q: Vec<T>,
    z: Vec<T>,
    /// `S (b − A x_0)`
    start: Vec<T>,
    /// The best `x` once rounding leads.
    best: Vec<T>,
}

impl<T: Real> Mpcg<T> {
    /// With a preconditioner.
    pub fn new(preconditioner: Box<dyn Preconditioner<T>>, settings: MpcgSettings) -> Self {
        Self {
            settings,
            preconditioner,
            rescue: None,
            work: Work::default(),
        }
    }

    /// A stronger preconditioner for systems that the first one does not bring
    /// to the tolerance within half of the iterations: the second half goes on
    /// from the iterate with it. Every solve begins with the first one anew, so
    /// that it depends on nothing but its system.
    #[must_use]
    pub fn with_rescue(mut self, stronger: Box<dyn Preconditioner<T>>) -> Self {
        self.rescue = Some(stronger);
        self
    }

    /// Goes on from `x` with the stronger preconditioner.
    fn rescue(
        &mut self,
        a: &dyn ExplicitOperator<T>,
        b: &[f64],
        filter: &dyn Filter<T>,
        x: &mut [f64],
        first: SolveReport,
    ) -> Result<SolveReport, LinsolveError> {
        let Some(mut stronger) = self.rescue.take() else {
            return Ok(first);
        };
        let limit = self.settings.max_iterations;
        let mut report = Ok(first);
        // A factorisation that fails leaves the iterate of the first half.
        if stronger.update(a, filter).is_ok() {
            std::mem::swap(&mut self.preconditioner, &mut stronger);
            self.settings.max_iterations = limit - first.iterations.min(limit);
            report = self.solve_operator(a, b, filter, x);
            self.settings.max_iterations = limit;
            std::mem::swap(&mut self.preconditioner, &mut stronger);
        }
        self.rescue = Some(stronger);
        report.map(|second| SolveReport {
            solver: "cg, rescued",
            iterations: first.iterations + second.iterations,
            ..second
        })
    }

    /// With block Jacobi and a tolerance.
    pub fn with_tolerance(relative: f64) -> Self {
        Self::new(
            Box::new(BlockJacobi::default()),
            MpcgSettings {
                tolerance: relative,
                ..MpcgSettings::default()
            },
        )
    }

    /// The preconditioner.
    pub fn preconditioner(&self) -> &dyn Preconditioner<T> {
        &*self.preconditioner
    }

    /// Replaces the preconditioner.
    pub fn set_preconditioner(&mut self, preconditioner: Box<dyn Preconditioner<T>>) {
        self.preconditioner = preconditioner;
    }

    /// Solves with an operator that cannot be read (matrix-free). The
    /// preconditioner is used as it is: prepare it before, or use
    /// [`NoPreconditioner`](crate::NoPreconditioner).
    ///
    /// # Errors
    /// As [`LinearSolver::solve`].
    pub fn solve_operator(
        &mut self,
        a: &dyn LinearOperator<T>,
        b: &[f64],
        filter: &dyn Filter<T>,
        x: &mut [f64],
    ) -> Result<SolveReport, LinsolveError> {
        check_len("right-hand side", a.dim(), b.len())?;
        check_len("starting vector", a.dim(), x.len())?;
        if let StopNorm::Weighted(w) = &self.settings.norm {
            check_len("weights of the stop norm", a.dim(), w.len())?;
            check_finite("weights of the stop norm", w)?;
        }
        check_finite("right-hand side", b)?;
        check_finite("starting vector", x)?;
        if self.settings.tolerance.is_nan() || self.settings.tolerance < 0.0 {
            return Err(LinsolveError::BadSetting {
                name: "tolerance",
                value: self.settings.tolerance,
                range: "[0, ∞)",
            });
        }
        Ok(if a.dim() <= vector::SERIAL {
            self.run(a, b, filter, x)
        } else {
            // one hand-over to the thread pool instead of one for each kernel
            rayon::scope(|_| self.run(a, b, filter, x))
        })
    }
}

impl<T: Real> LinearSolver<T> for Mpcg<T> {
    fn name(&self) -> &str {
        match self.settings.sums {
            Sums::Double => "cg",
            Sums::OfVectors => "cg with sums as vectors",
        }
    }

    fn solve(
        &mut self,
        a: &dyn ExplicitOperator<T>,
        b: &[f64],
        filter: &dyn Filter<T>,
        x: &mut [f64],
    ) -> Result<SolveReport, LinsolveError> {
        check_len("right-hand side", a.dim(), b.len())?;
        self.preconditioner.update(a, filter)?;
        if self.rescue.is_none() {
            return self.solve_operator(a, b, filter, x);
        }
        let limit = self.settings.max_iterations;
        self.settings.max_iterations = limit.div_ceil(2);
        let first = self.solve_operator(a, b, filter, x);
        self.settings.max_iterations = limit;
        let first = first?;
        match first.status {
            SolveStatus::IterationLimit => self.rescue(a, b, filter, x, first),
            _ => Ok(first),
        }
    }

    fn set_tolerance(&mut self, relative: f64) {
        self.settings.tolerance = relative;
    }

    fn heap_bytes(&self) -> usize {
        let w = &self.work;
        let vectors = [&w.x, &w.r, &w.c, &w.q, &w.z, &w.start, &w.best];
        vectors.iter().map(|v| v.capacity()).sum::<usize>() * size_of::<T>()
            + self.preconditioner.heap_bytes()
            + self.rescue.as_ref().map_or(0, |p| p.heap_bytes())
    }
}
