//! Incomplete Cholesky without fill, by 3×3 blocks.

use super::triangular::Triangular;
use super::{Preconditioner, diagonal::positive_inverse, filtered_diagonal};
use crate::small::{self, M3};
use crate::{Bsr, ExplicitOperator, Filter, LinearOperator, LinsolveError, Real};

/// First shift, relative to the diagonal, and the largest that is tried.
pub(super) const FIRST_SHIFT: f64 = 1e-3;
pub(super) const LAST_SHIFT: f64 = 1e6;

/// Block IC(0): name `"block-ic"`.
///
/// ```text
/// L_ij = (A_ij − Σ_{k<j} L_ik L_jkᵀ) L_jj⁻ᵀ ,    L_ii L_iiᵀ = A_ii − Σ_k L_ik L_ikᵀ
/// ```
/// on the lower pattern of the static part, with the complete diagonal; the
/// off-diagonal blocks of contacts are ignored. A pivot that is not above
/// `1e-12 max diag A_ii` restarts with the diagonal shift `s |diag A_ii|`,
/// `s = 1e-3` and doubling; while `s = 0`, `(L Lᵀ)_ij = A_ij` on the pattern.
/// The filter enters as `S_i A_ij S_j` and `m̄ (I − S_i)` on the diagonal.
///
/// The solve runs level by level in parallel where levels are wide; a sheet in
/// Cuthill–McKee order has narrow ones and is solved by one thread.
#[derive(Debug, Clone, Default)]
pub struct BlockIc<T> {
    factor: Triangular<T>,
    scalar_inverse: Vec<T>,
    shift: f64,
    work: Work,
}

/// Lower rows and factor in double precision, kept between updates.
#[derive(Debug, Clone, Default)]
struct Work {
    starts: Vec<usize>,
    columns: Vec<u32>,
    blocks: Vec<M3>,
    factor: Vec<M3>,
    diagonal: Vec<M3>,
    /// Packed `L_ii` and its inverse.
    pivots: Vec<[f64; 6]>,
    inverses: Vec<[f64; 6]>,
    scalars: Vec<f64>,
}

impl<T: Real> BlockIc<T> {
    /// Diagonal shift of the last update, relative; 0 when none was needed.
    pub fn shift(&self) -> f64 {
        self.shift
    }

    /// Blocks `(i, j, L_ij)` of the last factor, row-major, diagonal last in
    /// each row.
    pub fn factor_blocks(&self) -> Vec<(usize, usize, [f64; 9])> {
        let w = &self.work;
        let mut out = Vec::new();
        for i in 0..w.pivots.len() {
            for k in w.starts[i]..w.starts[i + 1] {
                out.push((i, w.columns[k] as usize, w.factor[k]));
            }
            let l = &w.pivots[i];
            let full = [l[0], 0.0, 0.0, l[1], l[2], 0.0, l[3], l[4], l[5]];
            out.push((i, i, full));
        }
        out
    }
}

impl<T: Real> Preconditioner<T> for BlockIc<T> {
    fn name(&self) -> &str {
        "block-ic"
    }

    fn update(
        &mut self,
        a: &dyn ExplicitOperator<T>,
        filter: &dyn Filter<T>,
    ) -> Result<(), LinsolveError> {
        let w = &mut self.work;
        let mean = filtered_diagonal(a, filter, &mut w.diagonal, &mut w.scalars)?;
        w.gather(a.static_part(), filter);
        self.shift = 0.0;
        while !w.factorise(self.shift) {
            self.shift = (2.0 * self.shift).max(FIRST_SHIFT);
            if self.shift > LAST_SHIFT {
                return Err(LinsolveError::ShiftExhausted {
                    method: "block-ic",
                    shift: LAST_SHIFT,
                });
            }
        }
        self.factor
            .set(&w.starts, &w.columns, &w.factor, &w.inverses);
        self.scalar_inverse.clear();
        let inverse = w.scalars.iter().map(|&d| positive_inverse(d, mean));
        self.scalar_inverse.extend(inverse.map(T::from_f64));
        Ok(())
    }

    fn apply(&mut self, _: &dyn LinearOperator<T>, r: &[T], z: &mut [T]) {
        let cut = 3 * self.work.pivots.len();
        self.factor.solve(&r[..cut], &mut z[..cut]);
        for (z, (&d, &r)) in z[cut..]
            .iter_mut()
            .zip(self.scalar_inverse.iter().zip(&r[cut..]))
        {
            *z = d * r;
        }
    }

    fn heap_bytes(&self) -> usize {
        let w = &self.work;
        self.factor.heap_bytes()
            + size_of::<T>() * self.scalar_inverse.capacity()
            + 8 * (w.starts.capacity() + w.scalars.capacity())
            + 4 * w.columns.capacity()
            + 72 * (w.blocks.capacity() + w.factor.capacity() + w.diagonal.capacity())
            + 48 * (w.pivots.capacity() + w.inverses.capacity())
    }
}

impl Work {
    /// Strictly lower rows of `S A S`.
    fn gather<T: Real>(&mut self, a: &Bsr<T>, filter: &dyn Filter<T>) {
        let pattern = a.pattern();
        let n = pattern.points();
        let mut projectors: Vec<Option<&M3>> = Vec::new();
        if let Some(filter) = filter.as_blocks() {
            projectors.resize(n, None);
            for (i, s) in filter.iter() {
                projectors[i] = Some(s);
            }
        }
        let projector = |i: usize| projectors.get(i).copied().flatten();
        self.starts.clear();
        self.columns.clear();
        self.blocks.clear();
        self.starts.push(0);
        for i in 0..n {
            for slot in pattern.row(i).start..pattern.diagonal_slot(i) as usize {
                let j = pattern.all_columns()[slot];
                let rows = a.block(slot);
                let mut block: M3 = std::array::from_fn(|k| rows[k / 3][k % 3]);
                if let Some(s) = projector(i) {
                    block = small::product(s, &block);
                }
                if let Some(s) = projector(j as usize) {
                    block = small::product(&block, s);
                }
                self.columns.push(j);
                self.blocks.push(block);
            }
            self.starts.push(self.columns.len());
        }
    }

    /// False when a pivot is not positive.
    fn factorise(&mut self, shift: f64) -> bool {
        self.factor.clone_from(&self.blocks);
        self.pivots.clear();
        self.inverses.clear();
        for i in 0..self.diagonal.len() {
            let row = self.starts[i]..self.starts[i + 1];
            for at in row.clone() {
                let j = self.columns[at] as usize;
                let mut s = self.factor[at];
                self.subtract_common(row.start..at, j, &mut s);
                self.factor[at] = right_solve(&s, &self.inverses[j]);
            }
            let mut d = self.diagonal[i];
            let top = d[0].abs().max(d[4].abs()).max(d[8].abs());
            for k in [0, 4, 8] {
                d[k] += shift * d[k].abs();
            }
            for l in &self.factor[row] {
                subtract_product(&mut d, l, l);
            }
            match small::cholesky(&d, 1e-12 * top) {
                Some(l) => {
                    self.inverses.push(small::invert_lower(&l));
                    self.pivots.push(l);
                }
                None => return false,
            }
        }
        true
    }

    /// `s −= Σ_k L_ik L_jkᵀ` over the columns that rows i (in `head`) and j share.
    fn subtract_common(&self, head: std::ops::Range<usize>, j: usize, s: &mut M3) {
        let (mut p, mut q) = (head.start, self.starts[j]);
        while p < head.end && q < self.starts[j + 1] {
            match self.columns[p].cmp(&self.columns[q]) {
                std::cmp::Ordering::Less => p += 1,
                std::cmp::Ordering::Greater => q += 1,
                std::cmp::Ordering::Equal => {
                    subtract_product(s, &self.factor[p], &self.factor[q]);
                    p += 1;
                    q += 1;
                }
            }
        }
    }
}

/// `s −= a bᵀ`.
#[inline(always)]
fn subtract_product(s: &mut M3, a: &M3, b: &M3) {
    for r in 0..3 {
        for c in 0..3 {
            s[3 * r + c] -=
                a[3 * r] * b[3 * c] + a[3 * r + 1] * b[3 * c + 1] + a[3 * r + 2] * b[3 * c + 2];
        }
    }
}

/// `s L⁻ᵀ` from the packed inverse of `L`.
#[inline(always)]
fn right_solve(s: &M3, inverse: &[f64; 6]) -> M3 {
    let [a, b, c, d, e, f] = *inverse;
    std::array::from_fn(|k| {
        let row = &s[k / 3 * 3..][..3];
        match k % 3 {
            0 => a * row[0],
            1 => b * row[0] + c * row[1],
            _ => d * row[0] + e * row[1] + f * row[2],
        }
    })
}
