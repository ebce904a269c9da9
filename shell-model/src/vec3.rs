//! The few 3-vector operations that the kernels need.

pub(crate) type V = [f64; 3];
pub(crate) type Block = [[f64; 3]; 3];

#[inline(always)]
pub(crate) fn node<const M: usize>(q: &[f64; M], i: usize) -> V {
    [q[3 * i], q[3 * i + 1], q[3 * i + 2]]
}

#[inline(always)]
pub(crate) fn set_node<const M: usize>(q: &mut [f64; M], i: usize, v: V) {
    q[3 * i] = v[0];
    q[3 * i + 1] = v[1];
    q[3 * i + 2] = v[2];
}

#[inline(always)]
pub(crate) fn add(a: V, b: V) -> V {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline(always)]
pub(crate) fn sub(a: V, b: V) -> V {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub(crate) fn scale(s: f64, a: V) -> V {
    [s * a[0], s * a[1], s * a[2]]
}

/// `s a + t b`
#[inline(always)]
pub(crate) fn blend(s: f64, a: V, t: f64, b: V) -> V {
    [
        s * a[0] + t * b[0],
        s * a[1] + t * b[1],
        s * a[2] + t * b[2],
    ]
}

#[inline(always)]
pub(crate) fn dot(a: V, b: V) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
pub(crate) fn cross(a: V, b: V) -> V {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[inline(always)]
pub(crate) fn norm(a: V) -> f64 {
    dot(a, a).sqrt()
}

/// `a bᵀ`
#[inline(always)]
pub(crate) fn outer(a: V, b: V) -> Block {
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
pub(crate) fn put<const M: usize>(h: &mut [[f64; M]; M], i: usize, j: usize, b: &Block) {
    for a in 0..3 {
        h[3 * i + a][3 * j] = b[a][0];
        h[3 * i + a][3 * j + 1] = b[a][1];
        h[3 * i + a][3 * j + 2] = b[a][2];
    }
}

/// Writes the transpose of `b` to block `(i, j)` of a local matrix.
#[inline(always)]
pub(crate) fn put_transposed<const M: usize>(h: &mut [[f64; M]; M], i: usize, j: usize, b: &Block) {
    for a in 0..3 {
        h[3 * i + a][3 * j] = b[0][a];
        h[3 * i + a][3 * j + 1] = b[1][a];
        h[3 * i + a][3 * j + 2] = b[2][a];
    }
}
