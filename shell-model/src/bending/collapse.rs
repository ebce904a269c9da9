//! Hinges that collapse: how far they still count.

use super::frame::Floors;
use crate::vec3::{cross, dot, node, norm, sub};

/// Fraction of a rest size below which a hinge is ignored, and above which it
/// is whole.
const GONE: f64 = 0.02;
const WHOLE: f64 = 0.1;

/// Where a hinge of this rest length and these rest heights \[m\] is ignored.
pub(super) fn floors(length: f64, heights: [f64; 2]) -> Floors {
    [length, heights[0], heights[1]].map(|size| (GONE * size).powi(2).max(f64::MIN_POSITIVE))
}

/// `Π smoothstep(size/rest size)` over the edge and both wings.
pub(super) fn wholeness(q: &[f64; 12], floors: &Floors) -> f64 {
    let x0 = node(q, 0);
    let e = sub(node(q, 1), x0);
    let areas = [cross(e, sub(node(q, 2), x0)), cross(e, sub(node(q, 3), x0))];
    let l2 = dot(e, e);
    // Beyond rounding of what follows, which most hinges need not go through.
    let whole = 1.001 * (WHOLE / GONE) * (WHOLE / GONE);
    if l2 > whole * floors[0]
        && dot(areas[0], areas[0]) > whole * floors[1] * l2
        && dot(areas[1], areas[1]) > whole * floors[2] * l2
    {
        return 1.0;
    }
    let l = norm(e);
    let sizes = [l, norm(areas[0]) / l, norm(areas[1]) / l];
    let mut product = 1.0;
    for (size, floor) in sizes.into_iter().zip(floors) {
        if *floor > f64::MIN_POSITIVE {
            // `size` is NaN when the edge has no length.
            let z = (size / floor.sqrt() - 1.0) / (WHOLE / GONE - 1.0);
            let z = if z > 0.0 { z.min(1.0) } else { 0.0 };
            product *= z * z * (3.0 - 2.0 * z);
        }
    }
    product
}
