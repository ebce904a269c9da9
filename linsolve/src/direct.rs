//! Sparse Cholesky.

mod columns;

use crate::error::{check_finite, check_len};
use crate::{
    ExplicitOperator, Filter, LinearSolver, LinsolveError, Real, SolveReport, SolveStatus, vector,
};
use columns::Columns;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltError as Pivot;
use faer::sparse::linalg::cholesky::{LltRef, SymbolicCholesky};
use faer::{Conj, MatMut, Par};

/// Passes of refinement before the residual counts as final.
const PASSES: usize = 3;

/// Sparse `L Lᵀ` through faer, in double precision whatever the matrix: name
/// `"direct"`.
///
/// The points are ordered by approximate minimum degree on the graph of nodes;
/// order and symbolic factor are kept while
/// [`pattern_id`](ExplicitOperator::pattern_id) stays the same. A filter
/// replaces the matrix by `S A S + m̄ (I − S)` on the same pattern. One thread,
/// so that the bits do not depend on how many there are.
///
/// A matrix that is not positive definite is the error
/// [`LinsolveError::Indefinite`]: this solver doubles as the test for it.
pub struct Direct {
    tolerance: f64,
    columns: Option<Columns>,
    factor: Vec<f64>,
    buffer: Option<MemBuffer>,
    rhs: Vec<f64>,
    y: Vec<f64>,
    r: Vec<f64>,
}

impl Default for Direct {
    fn default() -> Self {
        Self::new(1e-10)
    }
}

impl Direct {
    /// With the relative residual that counts as solved.
    pub fn new(tolerance: f64) -> Self {
        Self {
            tolerance,
            columns: None,
            factor: Vec::new(),
            buffer: None,
            rhs: Vec::new(),
            y: Vec::new(),
            r: Vec::new(),
        }
    }

    /// Numbers in the factor; 0 before the first solve.
    pub fn factor_len(&self) -> usize {
        self.factor.len()
    }

    fn factorise(&mut self) -> Result<(), LinsolveError> {
        let Some(columns) = &self.columns else {
            return Ok(());
        };
        let symbolic = &columns.symbolic;
        self.factor.resize(symbolic.len_val(), 0.0);
        let buffer = workspace(&mut self.buffer, symbolic)?;
        symbolic
            .factorize_numeric_llt(
                &mut self.factor,
                columns.matrix(),
                faer::Side::Lower,
                Default::default(),
                Par::Seq,
                MemStack::new(buffer),
                Default::default(),
            )
            .map_err(
                |Pivot::NonPositivePivot { index }| LinsolveError::Indefinite {
                    method: "direct",
                    pivot: index,
                },
            )?;
        Ok(())
    }

    /// `r ← A⁻¹ r`.
    fn back_substitute(&mut self) {
        if let (Some(columns), Some(buffer)) = (&self.columns, &mut self.buffer) {
            let n = self.r.len();
            LltRef::new(&columns.symbolic, &self.factor).solve_in_place_with_conj(
                Conj::No,
                MatMut::from_column_major_slice_mut(&mut self.r, n, 1),
                Par::Seq,
                MemStack::new(buffer),
            );
        }
    }
}

/// Scratch large enough for factor and solve, allocated once per pattern.
fn workspace<'a>(
    buffer: &'a mut Option<MemBuffer>,
    symbolic: &SymbolicCholesky<u32>,
) -> Result<&'a mut MemBuffer, LinsolveError> {
    if buffer.is_none() {
        let need = symbolic
            .factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default())
            .or(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq));
        *buffer = MemBuffer::try_new(need).ok();
    }
    buffer.as_mut().ok_or_else(|| LinsolveError::Factorisation {
        method: "direct",
        reason: "out of memory".into(),
    })
}

impl<T: Real> LinearSolver<T> for Direct {
    fn name(&self) -> &str {
        "direct"
    }

    fn solve(
        &mut self,
        a: &dyn ExplicitOperator<T>,
        b: &[f64],
        filter: &dyn Filter<T>,
        x: &mut [f64],
    ) -> Result<SolveReport, LinsolveError> {
        let n = a.dim();
        check_len("right-hand side", n, b.len())?;
        check_len("starting vector", n, x.len())?;
        check_finite("right-hand side", b)?;
        check_finite("starting vector", x)?;
        let blocks = filter.as_blocks();
        if blocks.is_none() && !filter.is_identity() {
            return Err(LinsolveError::FilterNotBlocks { method: "direct" });
        }
        if self
            .columns
            .as_ref()
            .is_none_or(|c| c.pattern_id != a.pattern_id() || c.layout != a.layout())
        {
            self.buffer = None;
            self.columns = None;
            self.columns = Some(Columns::analyse(a)?);
        }
        let Some(columns) = &mut self.columns else {
            return Err(LinsolveError::Factorisation {
                method: "direct",
                reason: "no symbolic factor".into(),
            });
        };
        columns.fill(a)?;
        self.rhs.clear();
        self.rhs.extend_from_slice(b);
        self.y.clear();
        self.y.resize(n, 0.0);
        self.r.resize(n, 0.0);
        // x ← z = (I − S) x, rhs ← S (b − A z)
        if let Some(filter) = blocks {
            self.y.copy_from_slice(x);
            Filter::<f64>::project(filter, &mut self.y);
            for (x, s) in x.iter_mut().zip(&self.y) {
                *x -= s;
            }
            if x.iter().any(|v| *v != 0.0) {
                columns.product(x, &mut self.r);
                vector::axpy(-1.0, &self.r, &mut self.rhs);
            }
            Filter::<f64>::project(filter, &mut self.rhs);
            columns.filter(filter);
            self.y.fill(0.0);
        } else {
            x.fill(0.0);
        }
        self.factorise()?;
        let size = vector::norm(&self.rhs);
        let (mut residual, mut passes) = (size, 0);
        self.r.copy_from_slice(&self.rhs);
        while residual > 0.0
            && passes <= PASSES
            && (passes == 0 || residual > self.tolerance * size)
        {
            self.back_substitute();
            vector::axpy(1.0, &self.r, &mut self.y);
            if let Some(filter) = blocks {
                Filter::<f64>::project(filter, &mut self.y);
            }
            if let Some(columns) = &self.columns {
                columns.product(&self.y, &mut self.r);
            }
            vector::xpay(&self.rhs, -1.0, &mut self.r);
            let next = vector::norm(&self.r);
            if passes > 0 && next > 0.5 * residual {
                residual = residual.min(next);
                break;
            }
            residual = next;
            passes += 1;
        }
        if !residual.is_finite() {
            return Err(LinsolveError::NotFinite {
                what: "solution",
                index: 0,
            });
        }
        vector::axpy(1.0, &self.y, x);
        let relative = if size > 0.0 { residual / size } else { 0.0 };
        Ok(SolveReport {
            solver: "direct",
            iterations: passes,
            relative_residual: relative,
            residual,
            stop_ratio: relative / self.tolerance.max(f64::MIN_POSITIVE),
            status: if relative <= self.tolerance {
                SolveStatus::Converged
            } else {
                SolveStatus::Stagnated
            },
        })
    }

    fn set_tolerance(&mut self, relative: f64) {
        self.tolerance = relative;
    }

    fn heap_bytes(&self) -> usize {
        let vectors = [&self.factor, &self.rhs, &self.y, &self.r];
        8 * vectors.iter().map(|v| v.capacity()).sum::<usize>()
            + self.columns.as_ref().map_or(0, Columns::heap_bytes)
            + self.buffer.as_ref().map_or(0, |b| b.len())
    }
}
