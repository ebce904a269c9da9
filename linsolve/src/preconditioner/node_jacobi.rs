//! Inverted diagonal blocks of points with their scalars.

use super::{Preconditioner, filtered_diagonal};
use crate::{ExplicitOperator, Filter, LinearOperator, LinsolveError, Real};

/// `P = blockdiag(A_nn)` with a node's point and its `n` scalars in one block of
/// size `3 + n`, inverted by Cholesky: name `"node-jacobi"`.
///
/// ```text
/// A_nn = | P_ii   C_iᵀ |     shifted by ε I, ε from 1e-12 tr on, until it is
///        | C_i    S_ii |     positive definite
/// ```
/// Without scalars it is block Jacobi. Prescribed unknowns get the mean diagonal.
#[derive(Debug, Clone, Default)]
pub struct NodeJacobi<T> {
    /// First value of every point's inverse, lower triangle by rows.
    offsets: Vec<u32>,
    inverse: Vec<T>,
    /// First scalar of every point.
    owned: Vec<u32>,
    blocks: Vec<[f64; 9]>,
    scalars: Vec<f64>,
    shifted: usize,
}

impl<T: Real> NodeJacobi<T> {
    /// Blocks of the last update that needed a shift.
    pub fn shifted(&self) -> usize {
        self.shifted
    }
}

impl<T: Real> Preconditioner<T> for NodeJacobi<T> {
    fn name(&self) -> &str {
        "node-jacobi"
    }

    fn update(
        &mut self,
        a: &dyn ExplicitOperator<T>,
        filter: &dyn Filter<T>,
    ) -> Result<(), LinsolveError> {
        let mean = filtered_diagonal(a, filter, &mut self.blocks, &mut self.scalars)?;
        let points = a.layout().points;
        let border = a.border();
        let fixed = |s: usize| {
            let filter = filter.as_blocks();
            filter.is_some_and(|f| f.is_scalar_fixed((3 * points + s) as u32))
        };
        self.offsets.clear();
        self.owned.clear();
        self.inverse.clear();
        self.shifted = 0;
        let (mut block, mut row) = (Vec::new(), Vec::new());
        for p in 0..points {
            let owned = border.map_or(0..0, |b| b.owned(p));
            self.offsets.push(self.inverse.len() as u32);
            self.owned.push(owned.start as u32);
            let n = 3 + owned.len();
            block.clear();
            block.resize(n * n, 0.0);
            for k in 0..9 {
                block[k / 3 * n + k % 3] = self.blocks[p][k];
            }
            let projector = filter.as_blocks().and_then(|f| f.projector(p as u32));
            for (i, s) in owned.clone().enumerate() {
                if fixed(s) {
                    block[(3 + i) * n + 3 + i] = mean;
                    continue;
                }
                row.clear();
                row.resize(owned.len(), 0.0);
                let mut c = a.own_coupling(s, &mut row);
                if let Some(m) = projector {
                    c = std::array::from_fn(|k| {
                        m[3 * k] * c[0] + m[3 * k + 1] * c[1] + m[3 * k + 2] * c[2]
                    });
                }
                for k in 0..3 {
                    block[(3 + i) * n + k] = c[k];
                }
                for (j, t) in owned.clone().enumerate() {
                    if !fixed(t) {
                        block[(3 + i) * n + 3 + j] = row[j];
                    }
                }
            }
            self.shifted += usize::from(push_inverse(&mut block, n, mean, &mut self.inverse));
        }
        self.offsets.push(self.inverse.len() as u32);
        self.owned.push(a.layout().scalars as u32);
        Ok(())
    }

    fn apply(&mut self, _: &dyn LinearOperator<T>, r: &[T], z: &mut [T]) {
        let points = self.offsets.len() - 1;
        let (rp, rs) = r.split_at(3 * points);
        let (zp, zs) = z.split_at_mut(3 * points);
        let (rp, zp) = (rp.as_chunks().0, zp.as_chunks_mut().0);
        self.run(0, rp, rs, zp, zs);
    }

    fn heap_bytes(&self) -> usize {
        self.inverse.capacity() * size_of::<T>()
            + 4 * (self.offsets.capacity() + self.owned.capacity())
            + 72 * self.blocks.capacity()
            + 8 * self.scalars.capacity()
    }
}

/// Points of a leaf.
const LEAF: usize = 1024;

impl<T: Real> NodeJacobi<T> {
    /// Points from `first` on, their scalars in `rs`, `zs`.
    fn run(&self, first: usize, r: &[[T; 3]], rs: &[T], z: &mut [[T; 3]], zs: &mut [T]) {
        let n = r.len();
        if n <= LEAF {
            return self.leaf(first, r, rs, z, zs);
        }
        let half = n.div_ceil(LEAF).div_ceil(2) * LEAF;
        let cut = (self.owned[first + half] - self.owned[first]) as usize;
        let (r, r2) = r.split_at(half);
        let (rs, rs2) = rs.split_at(cut);
        let (z, z2) = z.split_at_mut(half);
        let (zs, zs2) = zs.split_at_mut(cut);
        if n <= 8 * LEAF {
            self.run(first, r, rs, z, zs);
            self.run(first + half, r2, rs2, z2, zs2);
        } else {
            rayon::join(
                || self.run(first, r, rs, z, zs),
                || self.run(first + half, r2, rs2, z2, zs2),
            );
        }
    }

    fn leaf(&self, first: usize, r: &[[T; 3]], rs: &[T], z: &mut [[T; 3]], zs: &mut [T]) {
        let base = self.owned[first];
        for k in 0..r.len() {
            let from = (self.owned[first + k] - base) as usize;
            let to = (self.owned[first + k + 1] - base) as usize;
            let at = self.offsets[first + k] as usize;
            match to - from {
                0 => self.node::<3>(at, &r[k], &[], &mut z[k], &mut []),
                1 => self.node::<4>(at, &r[k], &rs[from..to], &mut z[k], &mut zs[from..to]),
                2 => self.node::<5>(at, &r[k], &rs[from..to], &mut z[k], &mut zs[from..to]),
                3 => self.node::<6>(at, &r[k], &rs[from..to], &mut z[k], &mut zs[from..to]),
                _ => self.large(at, &r[k], &rs[from..to], &mut z[k], &mut zs[from..to]),
            }
        }
    }

    #[inline(always)]
    fn node<const N: usize>(&self, at: usize, r: &[T; 3], rs: &[T], z: &mut [T; 3], zs: &mut [T]) {
        let inverse = &self.inverse[at..at + N * (N + 1) / 2];
        let mut x = [T::ZERO; N];
        x[..3].copy_from_slice(r);
        x[3..].copy_from_slice(rs);
        let mut y = [T::ZERO; N];
        let mut k = 0;
        for i in 0..N {
            for j in 0..i {
                y[i] = inverse[k].fma(x[j], y[i]);
                y[j] = inverse[k].fma(x[i], y[j]);
                k += 1;
            }
            y[i] = inverse[k].fma(x[i], y[i]);
            k += 1;
        }
        z.copy_from_slice(&y[..3]);
        zs.copy_from_slice(&y[3..]);
    }

    /// A node of more than three scalars.
    fn large(&self, at: usize, r: &[T; 3], rs: &[T], z: &mut [T; 3], zs: &mut [T]) {
        let n = 3 + rs.len();
        let x = |i: usize| if i < 3 { r[i] } else { rs[i - 3] };
        let entry = |i: usize, j: usize| {
            let (i, j) = (i.max(j), i.min(j));
            self.inverse[at + i * (i + 1) / 2 + j]
        };
        for i in 0..n {
            let mut sum = T::ZERO;
            for j in 0..n {
                sum = entry(i, j).fma(x(j), sum);
            }
            if i < 3 {
                z[i] = sum;
            } else {
                zs[i - 3] = sum;
            }
        }
    }
}

/// Appends the lower triangle of the inverse of a symmetric block given by its
/// lower triangle; returns whether it had to be shifted.
fn push_inverse<T: Real>(block: &mut [f64], n: usize, mean: f64, out: &mut Vec<T>) -> bool {
    let trace: f64 = (0..n).map(|i| block[i * n + i].abs()).sum();
    let original = block.to_vec();
    let mut shift = 0.0;
    loop {
        if trace > 0.0 && cholesky(block, n, 1e-14 * trace) {
            break;
        }
        shift = if shift == 0.0 {
            1e-12 * trace
        } else {
            10.0 * shift
        };
        block.copy_from_slice(&original);
        if !(shift.is_finite() && shift > 0.0 && shift <= 1e3 * trace) {
            block.fill(0.0);
            for i in 0..n {
                block[i * n + i] = mean.sqrt();
            }
            break;
        }
        for i in 0..n {
            block[i * n + i] += shift;
        }
    }
    // L⁻¹ in place of L, then A⁻¹ = L⁻ᵀ L⁻¹.
    for i in 0..n {
        block[i * n + i] = 1.0 / block[i * n + i];
        for j in 0..i {
            let sum: f64 = (j..i).map(|k| block[i * n + k] * block[k * n + j]).sum();
            block[i * n + j] = -sum * block[i * n + i];
        }
    }
    for i in 0..n {
        for j in 0..=i {
            let sum: f64 = (i..n).map(|k| block[k * n + i] * block[k * n + j]).sum();
            out.push(T::from_f64(sum));
        }
    }
    shift > 0.0
}

/// Cholesky factor in place of the lower triangle; false when a pivot is not
/// above `floor`.
fn cholesky(a: &mut [f64], n: usize, floor: f64) -> bool {
    for i in 0..n {
        for j in 0..=i {
            let sum: f64 = (0..j).map(|k| a[i * n + k] * a[j * n + k]).sum();
            let rest = a[i * n + j] - sum;
            if i > j {
                a[i * n + j] = rest / a[j * n + j];
            } else if rest > floor && rest.is_finite() {
                a[i * n + i] = rest.sqrt();
            } else {
                return false;
            }
        }
    }
    true
}
