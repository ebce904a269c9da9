//! The few operations on points and 3×3 blocks that the kernels need.

use nalgebra::{Matrix3, Vector3};

pub(crate) type V = Vector3<f64>;
pub(crate) type Block = Matrix3<f64>;

/// Three unknowns from place `at` on.
#[inline(always)]
pub(crate) fn get<const M: usize>(q: &[f64; M], at: usize) -> V {
    V::new(q[at], q[at + 1], q[at + 2])
}

/// Writes three entries from place `at` on.
#[inline(always)]
pub(crate) fn set<const M: usize>(q: &mut [f64; M], at: usize, v: V) {
    q[at] = v.x;
    q[at + 1] = v.y;
    q[at + 2] = v.z;
}

/// `a bᵀ`
#[inline(always)]
pub(crate) fn outer(a: V, b: V) -> Block {
    a * b.transpose()
}

/// `s (a bᵀ + b aᵀ)`, symmetric to the last bit.
#[inline(always)]
pub(crate) fn symmetric(s: f64, a: V, b: V) -> Block {
    Block::from_fn(|i, j| s * (a[i] * b[j] + b[i] * a[j]))
}

/// `s a aᵀ`, symmetric to the last bit.
#[inline(always)]
pub(crate) fn square(s: f64, a: V) -> Block {
    Block::from_fn(|i, j| s * (a[i] * a[j]))
}

/// Any unit vector perpendicular to a unit vector.
#[inline(always)]
pub(crate) fn perpendicular(t: V) -> V {
    let other = if t.x.abs() < 0.7 { V::x() } else { V::y() };
    t.cross(&other).normalize()
}

/// Writes the 3×3 block whose corner is at `(row, column)`.
#[inline(always)]
pub(crate) fn put<const M: usize>(h: &mut [[f64; M]; M], row: usize, column: usize, b: &Block) {
    for i in 0..3 {
        for j in 0..3 {
            h[row + i][column + j] = b[(i, j)];
        }
    }
}

/// Writes a block and its transpose on the other side of the diagonal.
#[inline(always)]
pub(crate) fn put_both<const M: usize>(
    h: &mut [[f64; M]; M],
    row: usize,
    column: usize,
    b: &Block,
) {
    for i in 0..3 {
        for j in 0..3 {
            h[row + i][column + j] = b[(i, j)];
            h[column + j][row + i] = b[(i, j)];
        }
    }
}

/// Writes a column of three entries and its mirror image.
#[inline(always)]
pub(crate) fn put_column<const M: usize>(h: &mut [[f64; M]; M], row: usize, column: usize, v: V) {
    for i in 0..3 {
        h[row + i][column] = v[i];
        h[column][row + i] = v[i];
    }
}
