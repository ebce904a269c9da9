use super::{Closest, boundary, interior, plane_coordinates, to_segment};
use crate::vec3::{dot, sub};

/// Closest point of triangle `x₁ x₂ x₃` to vertex `x₀`.
///
/// ```text
/// w = (1, -b₀, -b₁, -b₂),   d = n · (x₀ - x₁),   n = (x₂-x₁) × (x₃-x₁) / |…|
/// ```
/// A triangle without area falls back to its edges, an edge without length to
/// its ends; nothing is ever divided by zero.
#[inline]
pub fn closest_point_triangle(x: &[[f64; 3]; 4]) -> Closest {
    let [p, x0, x1, x2] = *x;
    let (e1, e2, u) = (sub(x1, x0), sub(x2, x0), sub(p, x0));
    if let Some((b1, b2)) = plane_coordinates(e1, e2, u) {
        let b0 = 1.0 - b1 - b2;
        let inside = b0 >= 0.0 && b1 >= 0.0 && b2 >= 0.0;
        if inside && let Some(c) = interior([1.0, -b0, -b1, -b2], e1, e2, u) {
            return c;
        }
    }
    let corners = [x0, x1, x2];
    let mut best = (f64::INFINITY, [1.0, -1.0, 0.0, 0.0], u);
    for (i, j) in [(0, 1), (1, 2), (2, 0)] {
        let (s, gap) = to_segment(p, corners[i], corners[j]);
        let d2 = dot(gap, gap);
        if d2 < best.0 {
            let mut w = [1.0, 0.0, 0.0, 0.0];
            w[1 + i] = s - 1.0;
            w[1 + j] = -s;
            best = (d2, w, gap);
        }
    }
    boundary(best.1, best.2, dot(e1, e1).max(dot(e2, e2)).sqrt())
}
