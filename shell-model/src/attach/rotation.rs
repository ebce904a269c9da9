//! Unit quaternions `(w, x, y, z)`.

use crate::vec3::{V, add, cross, dot, scale};

pub(super) type Quaternion = [f64; 4];

/// The rotation by `|v|` about `v`.
#[inline]
pub(super) fn from_vector(v: V) -> Quaternion {
    let angle2 = dot(v, v);
    let (w, f) = if angle2 < 1e-8 {
        (1.0 - angle2 / 8.0, 0.5 - angle2 / 48.0)
    } else {
        let angle = angle2.sqrt();
        let (s, c) = (0.5 * angle).sin_cos();
        (c, s / angle)
    };
    [w, f * v[0], f * v[1], f * v[2]]
}

/// First `b`, then `a`.
#[inline]
pub(super) fn multiply(a: Quaternion, b: Quaternion) -> Quaternion {
    let (av, bv) = ([a[1], a[2], a[3]], [b[1], b[2], b[3]]);
    let v = add(add(scale(a[0], bv), scale(b[0], av)), cross(av, bv));
    [a[0] * b[0] - dot(av, bv), v[0], v[1], v[2]]
}

#[inline]
pub(super) fn rotate(q: Quaternion, p: V) -> V {
    let v = [q[1], q[2], q[3]];
    let twice = scale(2.0, cross(v, p));
    add(p, add(scale(q[0], twice), cross(v, twice)))
}

/// The unit quaternion along `q`; no rotation for zero.
pub(super) fn normalised(q: Quaternion) -> Quaternion {
    let length = q.iter().map(|x| x * x).sum::<f64>().sqrt();
    if length > 0.0 {
        q.map(|x| x / length)
    } else {
        [1.0, 0.0, 0.0, 0.0]
    }
}
