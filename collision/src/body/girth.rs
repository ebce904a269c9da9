use super::Body;
use super::vec3::{add_scaled, cross, is_finite, norm, perpendicular, scale};

/// Rays of one measurement.
const RAYS: usize = 720;
/// Furthest that a ray is followed [m].
const FURTHEST: f64 = 2.0;

/// Lengths around a body in one plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Girth {
    /// Length of the contour [m].
    pub contour: f64,
    /// Length of a taut tape around it, the convex hull [m].
    pub tape: f64,
}

/// Measures around `center` [m] in the plane at a right angle to `axis`.
///
/// The contour is followed by 720 rays from the centre; parts that a ray from
/// the centre meets only after leaving the body do not count. On a circle both
/// lengths are low by `3e-6`.
/// `None` when the centre is not inside, the axis has no length, or a ray does
/// not leave the body within 2 m.
pub fn girth(body: &dyn Body, time: f64, center: [f64; 3], axis: [f64; 3]) -> Option<Girth> {
    let length = norm(axis);
    if length == 0.0 || !is_finite(axis) {
        return None;
    }
    let axis = scale(axis, 1.0 / length);
    let u = perpendicular(axis);
    let v = cross(axis, u);
    let mut rim = Vec::with_capacity(RAYS);
    for i in 0..RAYS {
        let (sin, cos) = (std::f64::consts::TAU * i as f64 / RAYS as f64).sin_cos();
        let direction = add_scaled(scale(u, cos), v, sin);
        let r = leave(body, time, center, direction)?;
        rim.push([r * cos, r * sin]);
    }
    Some(Girth {
        contour: perimeter(&rim),
        tape: perimeter(&hull(rim)),
    })
}

/// Distance along a ray from inside to the surface.
fn leave(body: &dyn Body, time: f64, from: [f64; 3], direction: [f64; 3]) -> Option<f64> {
    let at = |r: f64| body.sample(add_scaled(from, direction, r), time).distance;
    let (mut inside, mut depth) = (0.0, at(0.0));
    if depth >= 0.0 || depth.is_nan() {
        return None;
    }
    // The depth is a safe step; half a millimetre bounds the number of steps.
    let mut outside = loop {
        let r = inside + (-0.7 * depth).max(5e-4);
        depth = at(r);
        if depth >= 0.0 {
            break r;
        }
        if r >= FURTHEST || depth.is_nan() {
            return None;
        }
        inside = r;
    };
    for _ in 0..40 {
        let middle = 0.5 * (inside + outside);
        if at(middle) < 0.0 {
            inside = middle
        } else {
            outside = middle
        }
    }
    Some(0.5 * (inside + outside))
}

fn perimeter(p: &[[f64; 2]]) -> f64 {
    (0..p.len())
        .map(|i| {
            let (a, b) = (p[i], p[(i + 1) % p.len()]);
            (b[0] - a[0]).hypot(b[1] - a[1])
        })
        .sum()
}

/// Convex hull, counter-clockwise [Andrew1979].
fn hull(mut p: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    p.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let mut out = chain(p.iter());
    out.extend(chain(p.iter().rev()));
    out
}

/// The points of a sorted list that turn left, but for the last.
fn chain<'a>(points: impl Iterator<Item = &'a [f64; 2]>) -> Vec<[f64; 2]> {
    let mut out: Vec<[f64; 2]> = Vec::new();
    for q in points {
        while let [.., a, b] = out[..] {
            if (b[0] - a[0]) * (q[1] - a[1]) - (b[1] - a[1]) * (q[0] - a[0]) > 0.0 {
                break;
            }
            out.pop();
        }
        out.push(*q);
    }
    out.pop();
    out
}
