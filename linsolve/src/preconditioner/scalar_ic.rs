//! Incomplete Cholesky without fill, by scalars.

use super::{Preconditioner, filtered_diagonal, shift};
use crate::{ExplicitOperator, Filter, LinearOperator, LinsolveError, Real, small};

/// Scalar IC(0) on the entries that are not exactly zero: name `"ic"`.
///
/// ```text
/// l_ij = (a_ij − Σ_{k<j} l_ik l_jk) / l_jj ,    l_ii² = a_ii − Σ_k l_ik²
/// ```
/// \[MeijerinkVanDerVorst1977\]. Where every block is full it is the same factor
/// as [`BlockIc`](super::BlockIc), computed and applied entry by entry: it is
/// the reference for what blocks gain. Off-diagonal entries come from the
/// static part, the diagonal blocks are complete; shifts and filter as there.
#[derive(Debug, Clone, Default)]
pub struct ScalarIc<T> {
    /// Strictly lower entries by rows.
    starts: Vec<usize>,
    columns: Vec<u32>,
    entries: Vec<f64>,
    factor: Vec<f64>,
    diagonal: Vec<f64>,
    values: Vec<T>,
    inverse: Vec<T>,
    shift: f64,
    blocks: Vec<[f64; 9]>,
    scalars: Vec<f64>,
}

impl<T: Real> ScalarIc<T> {
    /// Diagonal shift of the last update, relative; 0 when none was needed.
    pub fn shift(&self) -> f64 {
        self.shift
    }

    fn gather(&mut self, a: &dyn ExplicitOperator<T>, filter: &dyn Filter<T>) {
        let (matrix, pattern) = (a.static_part(), a.static_part().pattern());
        let mut projectors = vec![None; pattern.points()];
        if let Some(filter) = filter.as_blocks() {
            for (i, s) in filter.iter() {
                projectors[i] = Some(s);
            }
        }
        self.starts.clear();
        self.columns.clear();
        self.entries.clear();
        self.diagonal.clear();
        self.starts.push(0);
        let mut row = Vec::new();
        for i in 0..pattern.points() {
            row.clear();
            for slot in pattern.row(i).start..pattern.diagonal_slot(i) as usize {
                let j = pattern.all_columns()[slot] as usize;
                let rows = matrix.block(slot);
                let mut block = std::array::from_fn(|k| rows[k / 3][k % 3]);
                if let Some(s) = projectors[i] {
                    block = small::product(s, &block);
                }
                if let Some(s) = projectors[j] {
                    block = small::product(&block, s);
                }
                row.push((j, block));
            }
            row.push((i, self.blocks[i]));
            for r in 0..3 {
                for (j, block) in &row {
                    for c in 0..3 {
                        let (column, v) = (3 * j + c, block[3 * r + c]);
                        if column < 3 * i + r && v != 0.0 {
                            self.columns.push(column as u32);
                            self.entries.push(v);
                        }
                    }
                }
                self.starts.push(self.columns.len());
                self.diagonal.push(self.blocks[i][4 * r]);
            }
        }
        for &d in &self.scalars {
            self.starts.push(self.columns.len());
            self.diagonal.push(d);
        }
    }

    /// False when a pivot is not positive; else `inverse` holds `1/l_ii`.
    fn factorise(&mut self) -> bool {
        self.factor.clone_from(&self.entries);
        let mut inverse = Vec::with_capacity(self.diagonal.len());
        for i in 0..self.diagonal.len() {
            let row = self.starts[i]..self.starts[i + 1];
            let mut pivot = self.diagonal[i] + self.shift * self.diagonal[i].abs();
            for at in row.clone() {
                let j = self.columns[at] as usize;
                let mut s = self.factor[at];
                let (mut p, mut q) = (row.start, self.starts[j]);
                while p < at && q < self.starts[j + 1] {
                    let (a, b) = (self.columns[p], self.columns[q]);
                    if a == b {
                        s -= self.factor[p] * self.factor[q];
                    }
                    p += usize::from(a <= b);
                    q += usize::from(b <= a);
                }
                s *= inverse[j];
                self.factor[at] = s;
                pivot -= s * s;
            }
            if !(pivot > 1e-12 * self.diagonal[i].abs() && pivot.is_finite()) {
                return false;
            }
            inverse.push(1.0 / pivot.sqrt());
        }
        self.inverse.clear();
        self.inverse.extend(inverse.into_iter().map(T::from_f64));
        self.values.clear();
        self.values
            .extend(self.factor.iter().map(|&v| T::from_f64(v)));
        true
    }
}

impl<T: Real> Preconditioner<T> for ScalarIc<T> {
    fn name(&self) -> &str {
        "ic"
    }

    fn update(
        &mut self,
        a: &dyn ExplicitOperator<T>,
        filter: &dyn Filter<T>,
    ) -> Result<(), LinsolveError> {
        filtered_diagonal(a, filter, &mut self.blocks, &mut self.scalars)?;
        self.gather(a, filter);
        self.shift = 0.0;
        while !self.factorise() {
            self.shift = shift::larger(self.shift, shift::FIRST, "ic")?;
        }
        Ok(())
    }

    fn apply(&mut self, _: &dyn LinearOperator<T>, r: &[T], z: &mut [T]) {
        let n = self.inverse.len();
        for i in 0..n {
            let mut s = r[i];
            for k in self.starts[i]..self.starts[i + 1] {
                s -= self.values[k] * z[self.columns[k] as usize];
            }
            z[i] = s * self.inverse[i];
        }
        for i in (0..n).rev() {
            let s = z[i] * self.inverse[i];
            z[i] = s;
            for k in self.starts[i]..self.starts[i + 1] {
                z[self.columns[k] as usize] -= self.values[k] * s;
            }
        }
    }

    fn heap_bytes(&self) -> usize {
        8 * (self.starts.capacity()
            + self.entries.capacity()
            + self.factor.capacity()
            + self.diagonal.capacity()
            + self.scalars.capacity())
            + 4 * self.columns.capacity()
            + 72 * self.blocks.capacity()
            + size_of::<T>() * (self.values.capacity() + self.inverse.capacity())
    }
}
