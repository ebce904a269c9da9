//! Arithmetic on `[f64; 3]`, private to the crate.

pub(crate) type Vec3 = [f64; 3];
pub(crate) type Mat3 = [[f64; 3]; 3];

#[inline]
pub(crate) fn add(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline]
pub(crate) fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline]
pub(crate) fn scale(s: f64, a: Vec3) -> Vec3 {
    [s * a[0], s * a[1], s * a[2]]
}

/// `a + s b`
#[inline]
pub(crate) fn axpy(a: Vec3, s: f64, b: Vec3) -> Vec3 {
    [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]]
}

#[inline]
pub(crate) fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline]
pub(crate) fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[inline]
pub(crate) fn norm(a: Vec3) -> f64 {
    dot(a, a).sqrt()
}

/// The unit vector along `a`, unless `a` is zero, subnormal or not finite.
#[inline]
pub(crate) fn unit(a: Vec3) -> Option<Vec3> {
    let l = norm(a);
    (l.is_normal() && l < f64::INFINITY).then(|| scale(1.0 / l, a))
}

/// `a - (a · n) n` for a unit `n`.
#[inline]
pub(crate) fn tangential(a: Vec3, n: Vec3) -> Vec3 {
    axpy(a, -dot(a, n), n)
}

/// `Σ w_i x_i`
#[inline]
pub(crate) fn combine(w: &[f64; 4], x: &[Vec3; 4]) -> Vec3 {
    let mut r = scale(w[0], x[0]);
    for i in 1..4 {
        r = axpy(r, w[i], x[i]);
    }
    r
}

/// `m + s a aᵀ`, symmetric to the last bit.
#[inline]
pub(crate) fn add_outer(m: &mut Mat3, s: f64, a: Vec3) {
    for i in 0..3 {
        for j in 0..3 {
            m[i][j] += s * (a[i] * a[j]);
        }
    }
}

/// `m + s (I - n nᵀ - t tᵀ)`, the last term only where `t` is given.
#[inline]
pub(crate) fn add_tangent(m: &mut Mat3, s: f64, n: Vec3, t: Option<Vec3>) {
    for i in 0..3 {
        m[i][i] += s;
    }
    add_outer(m, -s, n);
    if let Some(t) = t {
        add_outer(m, -s, t);
    }
}

#[inline]
pub(crate) fn point(q: &[f64], i: u32) -> Vec3 {
    let o = 3 * i as usize;
    [q[o], q[o + 1], q[o + 2]]
}
