//! Single-precision solves, double-precision residuals.

use crate::error::{check_finite, check_len};
use crate::{
    BlockFilter, Bsr, DualMatrix, ExplicitOperator, Filter, LinearSolver, LinsolveError, Mpcg,
    SolveReport, SolveStatus, vector,
};
use std::sync::Arc;

/// Mixed-precision iterative refinement: name `"refined"`.
///
/// ```text
/// repeat:  r = S (b − A x)  in f64;   A d = r  by CG in f32, to a loose tolerance;   x += d
/// ```
/// \[Moler1967\]. The matrix is rounded to `f32` once per solve; a pass contracts
/// the residual by about the inner tolerance plus `κ(A) 6e-8`, so tolerances
/// down to 1e-12 are within reach at the memory traffic of single precision.
pub struct Refined {
    /// Relative tolerance \[1\].
    pub tolerance: f64,
    /// Passes before giving up.
    pub max_passes: usize,
    inner: Mpcg<f32>,
    inner_tolerance: f64,
    matrix: Option<DualMatrix<f32>>,
    r: Vec<f64>,
    d: Vec<f64>,
    passes: usize,
}

impl Refined {
    /// Around an inner solver, whose tolerance is kept within [1e-3, 1e-2]:
    /// at a condition of 1e6 single precision offers no more, and iterations
    /// below its floor are lost.
    pub fn new(inner: Mpcg<f32>, tolerance: f64) -> Self {
        let inner_tolerance = inner.settings.tolerance.clamp(1e-3, 1e-2);
        Self {
            tolerance,
            max_passes: 30,
            inner,
            inner_tolerance,
            matrix: None,
            r: Vec::new(),
            d: Vec::new(),
            passes: 0,
        }
    }

    /// Passes of the last solve.
    pub fn passes(&self) -> usize {
        self.passes
    }

    fn round(&mut self, a: &dyn ExplicitOperator<f64>) {
        let (from, pattern) = (a.static_part(), a.static_part().pattern());
        let matrix = match self.matrix.take() {
            Some(m) if Arc::ptr_eq(m.stat.pattern(), pattern) => m,
            _ => DualMatrix::new(Bsr::zeros(Arc::clone(pattern))),
        };
        let matrix = self.matrix.insert(matrix);
        matrix.stat.copy_from(from);
        match a.dynamic_part() {
            Some(dynamic) => matrix.dynamic.copy_from(dynamic),
            None => matrix.dynamic.clear(),
        }
    }

    fn run(
        &mut self,
        a: &dyn ExplicitOperator<f64>,
        b: &[f64],
        filter: &BlockFilter,
        x: &mut [f64],
    ) -> Result<SolveReport, LinsolveError> {
        let n = a.dim();
        self.r.resize(n, 0.0);
        self.d.resize(n, 0.0);
        let residual = |x: &[f64], r: &mut [f64]| {
            a.apply(x, r);
            vector::xpay(b, -1.0, r);
            Filter::<f64>::project(filter, r);
            vector::norm(r)
        };
        // the reference: what the prescribed part leaves
        self.d.copy_from_slice(x);
        Filter::<f64>::project(filter, &mut self.d);
        for (d, x) in self.d.iter_mut().zip(x.iter()) {
            *d = x - *d;
        }
        let size = residual(&self.d, &mut self.r);
        if size == 0.0 {
            x.copy_from_slice(&self.d);
        }
        let mut now = residual(x, &mut self.r);
        let mut iterations = 0;
        self.passes = 0;
        let mut status = SolveStatus::Converged;
        let Some(matrix) = &self.matrix else {
            return Ok(self.report(0, size, now, SolveStatus::Diverged));
        };
        self.inner.settings.tolerance = self.inner_tolerance;
        // NaN passes the first test and is caught by the inner solver
        while now.is_nan() || now > self.tolerance * size {
            if self.passes == self.max_passes {
                status = SolveStatus::IterationLimit;
                break;
            }
            self.d.fill(0.0);
            let inner = self.inner.solve(matrix, &self.r, filter, &mut self.d)?;
            // The filter of single precision leaves 6e-8 of what is prescribed.
            Filter::<f64>::project(filter, &mut self.d);
            iterations += inner.iterations;
            self.passes += 1;
            if !matches!(
                inner.status,
                SolveStatus::Converged | SolveStatus::Stagnated | SolveStatus::IterationLimit
            ) {
                if self.passes == 1 {
                    vector::axpy(1.0, &self.d, x);
                    now = residual(x, &mut self.r);
                }
                status = inner.status;
                break;
            }
            vector::axpy(1.0, &self.d, x);
            let next = residual(x, &mut self.r);
            if next.is_nan() || next >= 0.5 * now {
                if next.is_nan() || next >= now {
                    vector::axpy(-1.0, &self.d, x);
                } else {
                    now = next;
                }
                status = SolveStatus::Stagnated;
                break;
            }
            now = next;
        }
        Ok(self.report(iterations, size, now, status))
    }

    fn report(&self, iterations: usize, size: f64, now: f64, status: SolveStatus) -> SolveReport {
        let relative = if now == 0.0 { 0.0 } else { now / size };
        SolveReport {
            solver: "refined",
            iterations,
            relative_residual: relative,
            residual: now,
            stop_ratio: relative / self.tolerance.max(f64::MIN_POSITIVE),
            status,
        }
    }
}

impl LinearSolver<f64> for Refined {
    fn name(&self) -> &str {
        "refined"
    }

    fn solve(
        &mut self,
        a: &dyn ExplicitOperator<f64>,
        b: &[f64],
        filter: &dyn Filter<f64>,
        x: &mut [f64],
    ) -> Result<SolveReport, LinsolveError> {
        check_len("right-hand side", a.dim(), b.len())?;
        check_len("starting vector", a.dim(), x.len())?;
        check_finite("right-hand side", b)?;
        check_finite("starting vector", x)?;
        if a.layout().scalars > 0 {
            return Err(LinsolveError::ScalarsUnsupported { method: "refined" });
        }
        self.round(a);
        match filter.as_blocks() {
            Some(blocks) => self.run(a, b, blocks, x),
            None if filter.is_identity() => self.run(a, b, &BlockFilter::new(), x),
            None => Err(LinsolveError::FilterNotBlocks { method: "refined" }),
        }
    }

    fn set_tolerance(&mut self, relative: f64) {
        self.tolerance = relative;
    }

    fn heap_bytes(&self) -> usize {
        LinearSolver::<f32>::heap_bytes(&self.inner)
            + self.matrix.as_ref().map_or(0, DualMatrix::heap_bytes)
            + 8 * (self.r.capacity() + self.d.capacity())
    }
}
