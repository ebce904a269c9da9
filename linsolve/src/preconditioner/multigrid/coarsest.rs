//! Dense Cholesky on the coarsest level.

use super::level::Level;

/// Packed factor `L` by rows, in double precision, and the inverse of its diagonal.
#[derive(Debug, Clone, Default)]
pub(super) struct Coarsest {
    factor: Vec<f64>,
    inverse: Vec<f64>,
    x: Vec<f64>,
}

impl Coarsest {
    /// Room for `rows` points.
    pub fn new(rows: usize) -> Self {
        let n = 3 * rows;
        Self {
            factor: vec![0.0; n * (n + 1) / 2],
            inverse: vec![0.0; n],
            x: vec![0.0; n],
        }
    }

    /// False when a pivot is not positive.
    pub fn factorise(&mut self, level: &Level) -> bool {
        self.factor.fill(0.0);
        let at = |r: usize, c: usize| r * (r + 1) / 2 + c;
        for i in 0..level.rows() {
            let d = &level.diagonal[i];
            for r in 0..3 {
                for c in 0..=r {
                    self.factor[at(3 * i + r, 3 * i + c)] = f64::from(d[3 * c + r]);
                }
            }
            let l = &level.lower;
            for k in l.starts[i] as usize..l.starts[i + 1] as usize {
                let j = l.columns[k] as usize;
                for e in 0..9 {
                    self.factor[at(3 * i + e % 3, 3 * j + e / 3)] = f64::from(l.blocks[k][e]);
                }
            }
        }
        for i in 0..self.x.len() {
            let (above, row) = self.factor.split_at_mut(at(i, 0));
            for j in 0..i {
                let other = &above[at(j, 0)..at(j, j)];
                row[j] = (row[j] - dot(&row[..j], other)) * self.inverse[j];
            }
            let pivot = row[i] - dot(&row[..i], &row[..i]);
            if pivot.is_nan() || pivot <= 1e-9 * row[i].abs() {
                return false;
            }
            self.inverse[i] = 1.0 / pivot.sqrt();
        }
        true
    }

    /// `x = A⁻¹ b`.
    pub fn solve(&mut self, b: &[[f32; 3]], x: &mut [[f32; 3]]) {
        let n = self.x.len();
        let row = |i: usize| &self.factor[i * (i + 1) / 2..][..i];
        for (i, b) in b.as_flattened().iter().enumerate() {
            self.x[i] = (f64::from(*b) - dot(row(i), &self.x[..i])) * self.inverse[i];
        }
        for i in (0..n).rev() {
            let v = self.x[i] * self.inverse[i];
            self.x[i] = v;
            for (x, l) in self.x[..i].iter_mut().zip(row(i)) {
                *x -= v * l;
            }
        }
        for (x, v) in x.as_flattened_mut().iter_mut().zip(&self.x) {
            *x = *v as f32;
        }
    }

    pub fn heap_bytes(&self) -> usize {
        8 * (self.factor.capacity() + self.inverse.capacity() + self.x.capacity())
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    crate::vector::lanes(a.len().min(b.len()), |k| a[k] * b[k])
}
