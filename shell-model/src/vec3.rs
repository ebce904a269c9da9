//! The few 3-vector operations that the kernels need, for one stencil or for
//! four at a time.

use crate::lanes::Lanes;

pub(crate) type V<S = f64> = [S; 3];
pub(crate) type Block<S = f64> = [[S; 3]; 3];

#[inline(always)]
pub(crate) fn node<S: Lanes, const M: usize>(q: &[S; M], i: usize) -> V<S> {
    [q[3 * i], q[3 * i + 1], q[3 * i + 2]]
}

#[inline(always)]
pub(crate) fn set_node<S: Lanes, const M: usize>(q: &mut [S; M], i: usize, v: V<S>) {
    q[3 * i] = v[0];
    q[3 * i + 1] = v[1];
    q[3 * i + 2] = v[2];
}

#[inline(always)]
pub(crate) fn add<S: Lanes>(a: V<S>, b: V<S>) -> V<S> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline(always)]
pub(crate) fn sub<S: Lanes>(a: V<S>, b: V<S>) -> V<S> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub(crate) fn scale<S: Lanes>(s: S, a: V<S>) -> V<S> {
    [s * a[0], s * a[1], s * a[2]]
}

#[inline(always)]
pub(crate) fn minus<S: Lanes>(a: V<S>) -> V<S> {
    [-a[0], -a[1], -a[2]]
}

/// `s a + t b`
#[inline(always)]
pub(crate) fn blend<S: Lanes>(s: S, a: V<S>, t: S, b: V<S>) -> V<S> {
    [
        s * a[0] + t * b[0],
        s * a[1] + t * b[1],
        s * a[2] + t * b[2],
    ]
}

#[inline(always)]
pub(crate) fn dot<S: Lanes>(a: V<S>, b: V<S>) -> S {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
pub(crate) fn cross<S: Lanes>(a: V<S>, b: V<S>) -> V<S> {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[inline(always)]
pub(crate) fn norm<S: Lanes>(a: V<S>) -> S {
    dot(a, a).sqrt()
}

/// `a bᵀ`
#[inline(always)]
pub(crate) fn outer<S: Lanes>(a: V<S>, b: V<S>) -> Block<S> {
    [scale(a[0], b), scale(a[1], b), scale(a[2], b)]
}

/// The matrix of `b ↦ a × b`.
#[inline(always)]
pub(crate) fn skew(a: V) -> Block {
    [[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]]
}

#[inline(always)]
pub(crate) fn apply(a: &Block, b: V) -> V {
    [dot(a[0], b), dot(a[1], b), dot(a[2], b)]
}

/// Writes block `(i, j)` of a local matrix.
#[inline(always)]
pub(crate) fn put<S: Lanes, const M: usize>(h: &mut [[S; M]; M], i: usize, j: usize, b: &Block<S>) {
    for a in 0..3 {
        h[3 * i + a][3 * j] = b[a][0];
        h[3 * i + a][3 * j + 1] = b[a][1];
        h[3 * i + a][3 * j + 2] = b[a][2];
    }
}

/// Writes the transpose of `b` to block `(i, j)` of a local matrix.
#[inline(always)]
pub(crate) fn put_transposed<S: Lanes, const M: usize>(
    h: &mut [[S; M]; M],
    i: usize,
    j: usize,
    b: &Block<S>,
) {
    for a in 0..3 {
        h[3 * i + a][3 * j] = b[0][a];
        h[3 * i + a][3 * j + 1] = b[1][a];
        h[3 * i + a][3 * j + 2] = b[2][a];
    }
}
