//! Orthographic cameras: a metre is the same number of pixels everywhere, so a
//! scale bar is exact.

use super::data::Point;

/// Where a picture is taken from (y up; the front looks along −z).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum View {
    /// From +z.
    Front,
    /// From +x.
    Side,
    /// From −z.
    Back,
    /// From +y.
    Top,
    /// From any direction.
    Custom {
        /// Angle around the vertical axis, 0 at the front, 90 at the side \[degrees\].
        azimuth: f32,
        /// Angle above the horizontal plane \[degrees\].
        elevation: f32,
    },
}

impl View {
    /// The view shown largest in a report.
    pub const THREE_QUARTER: Self = Self::Custom {
        azimuth: 32.0,
        elevation: 22.0,
    };

    /// A word for captions.
    pub fn label(self) -> &'static str {
        match self {
            Self::Front => "front",
            Self::Side => "side",
            Self::Back => "back",
            Self::Top => "top",
            Self::Custom { .. } => "three-quarter",
        }
    }

    pub(super) fn basis(self) -> Basis {
        let (azimuth, elevation) = match self {
            Self::Front => (0.0, 0.0),
            Self::Side => (90.0, 0.0),
            Self::Back => (180.0, 0.0),
            Self::Top => (0.0, 90.0),
            Self::Custom { azimuth, elevation } => (f64::from(azimuth), f64::from(elevation)),
        };
        Basis::looking(azimuth, elevation)
    }
}

/// Right, up and towards-the-viewer: a right-handed frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Basis {
    pub right: [f64; 3],
    pub up: [f64; 3],
    pub toward: [f64; 3],
}

impl Basis {
    pub fn looking(azimuth_deg: f64, elevation_deg: f64) -> Self {
        let (sa, ca) = exact_sin_cos(azimuth_deg);
        let (se, ce) = exact_sin_cos(elevation_deg);
        Self {
            right: [ca, 0.0, -sa],
            up: [-sa * se, ce, -ca * se],
            toward: [sa * ce, se, ca * ce],
        }
    }

    /// `(right, up, toward)` coordinates of a point or a direction.
    pub fn project(&self, p: Point) -> [f64; 3] {
        let p = p.map(f64::from);
        [dot(self.right, p), dot(self.up, p), dot(self.toward, p)]
    }
}

/// Quarter turns without rounding, so that a front view is exactly a front view.
fn exact_sin_cos(degrees: f64) -> (f64, f64) {
    match degrees.rem_euclid(360.0) {
        0.0 => (0.0, 1.0),
        90.0 => (1.0, 0.0),
        180.0 => (0.0, -1.0),
        270.0 => (-1.0, 0.0),
        d => d.to_radians().sin_cos(),
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// What a picture has to contain, in the view's plane \[m\].
#[derive(Debug, Clone, Copy)]
pub(super) struct Extent {
    pub centre: [f64; 2],
    pub half: [f64; 2],
}

/// Coordinates beyond this are treated as absent \[m\].
pub(super) const FAR: f32 = 1e6;

/// Whether a point can be drawn.
pub(super) fn drawable(p: &Point) -> bool {
    p.iter().all(|c| c.is_finite() && c.abs() <= FAR)
}

/// The cloth's extent, enlarged towards the bodies by at most 30 % of its size,
/// so that a ground plane does not shrink the cloth to a dot.
///
/// Points far away from nearly all others (a failed run) do not count.
pub(super) fn extent<'a>(
    basis: &Basis,
    cloth: &[Point],
    bodies: impl Iterator<Item = &'a [Point]>,
) -> Option<Extent> {
    let bodies: Vec<[(f64, f64); 2]> = bodies.filter_map(|b| bounds(basis, b)).collect();
    let union = bodies
        .iter()
        .copied()
        .reduce(|a, b| [0, 1].map(|k| (a[k].0.min(b[k].0), a[k].1.max(b[k].1))));
    let (mut frame, limit) = match (bounds(basis, cloth), union) {
        (Some(cloth), _) => (cloth, 0.3),
        (None, Some(body)) => (body, 0.0),
        (None, None) => return None,
    };
    let size = (frame[0].1 - frame[0].0).max(frame[1].1 - frame[1].0);
    if let Some(body) = union {
        for k in 0..2 {
            let margin = limit * size;
            frame[k].0 = frame[k].0.min(body[k].0.max(frame[k].0 - margin));
            frame[k].1 = frame[k].1.max(body[k].1.min(frame[k].1 + margin));
        }
    }
    let floor = (size * 0.02).max(1e-4);
    Some(Extent {
        centre: frame.map(|(lo, hi)| 0.5 * (lo + hi)),
        half: frame.map(|(lo, hi)| (0.5 * (hi - lo)).max(floor)),
    })
}

fn bounds(basis: &Basis, points: &[Point]) -> Option<[(f64, f64); 2]> {
    let limits = stray_limits(points, 1.5)?;
    let mut range = [(f64::INFINITY, f64::NEG_INFINITY); 2];
    for p in points.iter().filter(|p| drawable(p) && within(&limits, p)) {
        let c = basis.project(*p);
        for k in 0..2 {
            range[k] = (range[k].0.min(c[k]), range[k].1.max(c[k]));
        }
    }
    (range[0].0 <= range[0].1).then_some(range)
}

/// Limits of each axis beyond which a point is a stray: outside the middle 98 % of
/// the points by more than `reach` times their largest range. `None` without any
/// drawable point.
///
/// A failed run throws a few points far away; they must decide neither the scale
/// of a picture nor the resolution of stored positions.
pub(super) fn stray_limits(points: &[Point], reach: f32) -> Option<[(f32, f32); 3]> {
    let mut middle = [(0.0, 0.0); 3];
    for (k, middle) in middle.iter_mut().enumerate() {
        let mut axis: Vec<f32> = points
            .iter()
            .filter(|p| drawable(p))
            .map(|p| p[k])
            .collect();
        let last = axis.len().checked_sub(1)?;
        let cut = last / 100;
        let mut at = |i: usize| *axis.select_nth_unstable_by(i, f32::total_cmp).1;
        *middle = (at(cut), at(last - cut));
    }
    let range = middle.iter().map(|(a, b)| b - a).fold(0.0, f32::max);
    // All of the middle in one place: no notion of a stray.
    let reach = if range > 0.0 { reach * range } else { FAR };
    Some(middle.map(|(a, b)| (a - reach, b + reach)))
}

fn within(limits: &[(f32, f32); 3], p: &Point) -> bool {
    (0..3).all(|k| (limits[k].0..=limits[k].1).contains(&p[k]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every view is a right-handed orthonormal frame.
    #[test]
    fn frames_are_right_handed() {
        for view in [
            View::Front,
            View::Side,
            View::Back,
            View::Top,
            View::THREE_QUARTER,
        ] {
            let b = view.basis();
            let cross = [
                b.right[1] * b.up[2] - b.right[2] * b.up[1],
                b.right[2] * b.up[0] - b.right[0] * b.up[2],
                b.right[0] * b.up[1] - b.right[1] * b.up[0],
            ];
            for k in 0..3 {
                assert!((cross[k] - b.toward[k]).abs() < 1e-12, "{view:?}");
            }
        }
        assert_eq!(View::Front.basis().toward, [0.0, 0.0, 1.0]);
        assert_eq!(View::Side.basis().toward, [1.0, 0.0, 0.0]);
    }

    /// A huge ground and a lost point leave the cloth filling the picture.
    #[test]
    fn the_cloth_decides_the_extent() {
        let mut cloth: Vec<Point> = (0..1000).map(|i| [i as f32 * 1e-3, 0.5, 0.0]).collect();
        cloth.push([9e4, f32::NAN, 0.0]);
        cloth.push([9e4, 0.0, 0.0]);
        cloth.push([0.5, 3.0, -9e4]);
        let ground: Vec<Point> = vec![[-50.0, 0.0, -50.0], [50.0, 0.0, 50.0]];
        let e = extent(
            &View::Front.basis(),
            &cloth,
            [ground.as_slice()].into_iter(),
        );
        let e = e.expect("finite points");
        assert!(e.half[0] < 0.9 && e.half[1] < 0.5, "{e:?}");
        assert!(extent(&View::Front.basis(), &[], std::iter::empty()).is_none());
    }
}
