//! Placement against a body given as a signed distance field.

use crate::math::{add, dist, dot, norm, scale, sub};

/// A body as a function: signed distance [m] (negative inside) and its
/// gradient, pointing outwards, at a point [m].
pub type BodyField<'a> = &'a dyn Fn([f64; 3]) -> (f64, [f64; 3]);

/// What [`push_out`] did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PushReport {
    /// Points closer than the clearance before.
    pub close_before: usize,
    /// Points closer than the clearance (less a tenth) after.
    pub close_after: usize,
    /// Largest distance a point moved [m].
    pub moved_max: f64,
}

/// Moves points that are closer to the body than `clearance` [m] outwards
/// along the field, in at most `iterations` steps each.
///
/// ```text
/// x ← x + (clearance − φ(x)) ∇φ(x) / |∇φ(x)|
/// ```
/// Where the gradient vanishes (the middle of a limb) a point stays.
///
/// ```
/// use selvedge_garment::push_out;
/// let ball = |p: [f64; 3]| {
///     let r = p.iter().map(|x| x * x).sum::<f64>().sqrt();
///     (r - 0.1, p.map(|x| x / r.max(1e-12)))
/// };
/// let mut points = [[0.02, 0.0, 0.0], [0.5, 0.0, 0.0]];
/// let report = push_out(&mut points, &ball, 0.005, 5);
/// assert!((points[0][0] - 0.105).abs() < 1e-12 && points[1][0] == 0.5);
/// assert_eq!((report.close_before, report.close_after), (1, 0));
/// ```
pub fn push_out(
    points: &mut [[f64; 3]],
    body: BodyField<'_>,
    clearance: f64,
    iterations: usize,
) -> PushReport {
    let mut report = PushReport::default();
    for p in points {
        let start = *p;
        let (mut d, mut g) = body(*p);
        if d.is_nan() || d >= clearance {
            continue;
        }
        report.close_before += 1;
        for _ in 0..iterations {
            let Some(out) = outwards(d, g, clearance) else {
                break;
            };
            *p = add(*p, out);
            (d, g) = body(*p);
            if d.is_nan() || d >= clearance {
                break;
            }
        }
        if d < 0.9 * clearance {
            report.close_after += 1;
        }
        report.moved_max = report.moved_max.max(dist(start, *p));
    }
    report
}

/// The way out to `clearance`; `None` without a usable gradient.
fn outwards(d: f64, g: [f64; 3], clearance: f64) -> Option<[f64; 3]> {
    let length = norm(g);
    (d.is_finite() && length.is_finite() && length > 1e-9)
        .then(|| scale(g, (clearance - d) / length))
}

/// Share of the points that are inside the body [1].
pub fn inside_fraction(points: &[[f64; 3]], body: BodyField<'_>) -> f64 {
    let inside = points.iter().filter(|p| body(**p).0 < 0.0).count();
    inside as f64 / points.len().max(1) as f64
}

/// Keeps points out of a body over many small moves with few questions to its
/// field: a distance changes by no more than the way moved.
pub(crate) struct BodyGuard<'a> {
    /// The field, which may differ from point to point.
    body: &'a dyn Fn(usize, [f64; 3]) -> (f64, [f64; 3]),
    clearance: f64,
    /// Moves up to this are followed along the tangent plane [m].
    linear: f64,
    asked: Vec<([f64; 3], f64, [f64; 3])>,
}

impl<'a> BodyGuard<'a> {
    pub(crate) fn new(
        points: &[[f64; 3]],
        body: &'a dyn Fn(usize, [f64; 3]) -> (f64, [f64; 3]),
        clearance: f64,
    ) -> Self {
        let asked = points
            .iter()
            .enumerate()
            .map(|(i, &p)| {
                let (d, g) = body(i, p);
                (p, d, g)
            })
            .collect();
        Self {
            body,
            clearance,
            linear: 0.4 * clearance,
            asked,
        }
    }

    /// Moves point `i` out to the clearance when it is closer.
    pub(crate) fn keep_out(&mut self, i: usize, p: &mut [f64; 3]) {
        let entry = &mut self.asked[i];
        let moved = dist(*p, entry.0);
        if entry.1 - moved >= self.clearance {
            return;
        }
        let d = if moved <= self.linear {
            entry.1 + dot(entry.2, sub(*p, entry.0))
        } else {
            let (d, g) = (self.body)(i, *p);
            *entry = (*p, d, g);
            d
        };
        if d < self.clearance
            && let Some(out) = outwards(d, entry.2, self.clearance)
        {
            *p = add(*p, out);
        }
    }
}
