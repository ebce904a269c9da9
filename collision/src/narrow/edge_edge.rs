use super::{Closest, boundary, interior, plane_coordinates, to_segment};
use crate::vec3::{dot, scale, sub};

/// Closest points of edges `x₀ x₁` and `x₂ x₃`.
///
/// ```text
/// w = (1-s, s, -(1-t), -t),   d = n · (x_a - x_b),   n = (x₁-x₀) × (x₃-x₂) / |…|
/// ```
/// Where the lines are parallel, or come closest beyond an end, the closest of
/// the four pairs of an end and the other edge counts, the first of equals.
#[inline]
pub fn closest_edge_edge(x: &[[f64; 3]; 4]) -> Closest {
    let [a0, a1, b0, b1] = *x;
    let (e1, e2, u) = (sub(a1, a0), sub(b1, b0), sub(b0, a0));
    if let Some((s, minus_t)) = plane_coordinates(e1, e2, u) {
        let t = -minus_t;
        let inside = (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t);
        let weights = [1.0 - s, s, t - 1.0, -t];
        if inside && let Some(c) = interior(weights, e1, e2, scale(-1.0, u)) {
            return c;
        }
    }
    let mut best = (f64::INFINITY, [1.0, 0.0, -1.0, 0.0], sub(a0, b0));
    for (i, p) in [a0, a1].into_iter().enumerate() {
        let (t, gap) = to_segment(p, b0, b1);
        let d2 = dot(gap, gap);
        if d2 < best.0 {
            let mut w = [0.0, 0.0, t - 1.0, -t];
            w[i] = 1.0;
            best = (d2, w, gap);
        }
    }
    for (i, p) in [b0, b1].into_iter().enumerate() {
        let (s, gap) = to_segment(p, a0, a1);
        let d2 = dot(gap, gap);
        if d2 < best.0 {
            let mut w = [1.0 - s, s, 0.0, 0.0];
            w[2 + i] = -1.0;
            best = (d2, w, scale(-1.0, gap));
        }
    }
    boundary(best.1, best.2, dot(e1, e1).max(dot(e2, e2)).sqrt())
}
