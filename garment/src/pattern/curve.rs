//! Shapes of panel edges and their parametrisation by arc length.

use crate::math::{cross2, dist2, dot2, mix2, sub2};

/// Shape of an edge from its start `a` to its end `b`.
///
/// Control points are relative to the edge, as in GarmentCode: a control
/// `(s, t)` stands for
///
/// ```text
/// a + s (b − a) + t (b − a)⊥        (x, y)⊥ = (−y, x): to the left
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Curve {
    /// Straight.
    #[default]
    Line,
    /// Quadratic Bézier curve.
    Quadratic {
        /// Control point, relative [1].
        control: [f64; 2],
    },
    /// Cubic Bézier curve.
    Cubic {
        /// Control points, relative [1].
        controls: [[f64; 2]; 2],
    },
    /// Circular arc with SVG's flags: of the four arcs with this radius
    /// through both ends, the longer or shorter one, left or right of the
    /// chord. A radius below half the chord stands for half the chord.
    Circle {
        /// Radius [m].
        radius: f64,
        /// More than half a circle.
        large: bool,
        /// The arc lies to the right of the chord.
        right: bool,
    },
}

/// A control point relative to the edge in panel coordinates.
fn control_point(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> [f64; 2] {
    let d = sub2(b, a);
    [
        a[0] + c[0] * d[0] - c[1] * d[1],
        a[1] + c[0] * d[1] + c[1] * d[0],
    ]
}

/// Panel coordinates of a control point relative to the edge; `None` for an
/// edge without length.
pub(crate) fn relative_control(a: [f64; 2], b: [f64; 2], p: [f64; 2]) -> Option<[f64; 2]> {
    let (d, r) = (sub2(b, a), sub2(p, a));
    let l2 = dot2(d, d);
    (l2 > 0.0).then(|| [dot2(r, d) / l2, cross2(d, r) / l2])
}

impl Curve {
    /// Point at parameter `t` in 0..=1 (not arc length).
    pub fn point(&self, a: [f64; 2], b: [f64; 2], t: f64) -> [f64; 2] {
        match *self {
            Curve::Line => mix2(a, b, t),
            Curve::Quadratic { control } => {
                let c = control_point(a, b, control);
                mix2(mix2(a, c, t), mix2(c, b, t), t)
            }
            Curve::Cubic { controls } => {
                let [c, d] = controls.map(|c| control_point(a, b, c));
                let (p, q, r) = (mix2(a, c, t), mix2(c, d, t), mix2(d, b, t));
                mix2(mix2(p, q, t), mix2(q, r, t), t)
            }
            Curve::Circle {
                radius,
                large,
                right,
            } => {
                let turn = circle_turn(dist2(a, b), radius, large);
                if turn < 1e-7 {
                    return mix2(a, b, t);
                }
                // Along the chord frame: x from a to b, y to the left; the arc
                // starts at −turn/2 off the chord direction.
                let half = 0.5 * turn;
                let phi = half - turn * t;
                let s = 0.5 - 0.5 * phi.sin() / half.sin();
                let bulge = 0.5 * (phi.cos() - half.cos()) / half.sin();
                control_point(a, b, [s, if right { -bulge } else { bulge }])
            }
        }
    }

    /// Absolute change of direction from start to end, roughly [rad]: used to
    /// give strongly curved edges enough points.
    pub fn turning(&self, a: [f64; 2], b: [f64; 2]) -> f64 {
        match *self {
            Curve::Line => 0.0,
            Curve::Circle { radius, large, .. } => circle_turn(dist2(a, b), radius, large),
            Curve::Quadratic { .. } | Curve::Cubic { .. } => {
                const STEPS: usize = 32;
                let mut sum = 0.0;
                let mut last: Option<[f64; 2]> = None;
                let mut p = a;
                for i in 1..=STEPS {
                    let q = self.point(a, b, i as f64 / STEPS as f64);
                    let d = sub2(q, p);
                    if let Some(l) = last {
                        sum += cross2(l, d).atan2(dot2(l, d)).abs();
                    }
                    if d != [0.0, 0.0] {
                        last = Some(d);
                    }
                    p = q;
                }
                sum
            }
        }
    }
}

/// Angle of an arc over a chord [rad].
fn circle_turn(chord: f64, radius: f64, large: bool) -> f64 {
    let half = if radius.abs() > 0.0 {
        (0.5 * chord / radius.abs()).min(1.0).asin()
    } else {
        std::f64::consts::FRAC_PI_2
    };
    2.0 * if large {
        std::f64::consts::PI - half
    } else {
        half
    }
}

/// Arc length of an edge as a function of its parameter.
///
/// The table holds chords of 256 equal parameter steps; lengths are accurate
/// to about `1e-5` relative for the curves of garments.
#[derive(Clone, Debug)]
pub struct ArcTable {
    curve: Curve,
    a: [f64; 2],
    b: [f64; 2],
    /// Length up to each step [m]; two entries for straight edges.
    cumulative: Vec<f64>,
}

const TABLE_STEPS: usize = 256;

impl ArcTable {
    /// Builds the table of `curve` from `a` to `b` [m].
    pub fn new(curve: &Curve, a: [f64; 2], b: [f64; 2]) -> Self {
        let steps = if matches!(curve, Curve::Line) {
            1
        } else {
            TABLE_STEPS
        };
        let mut cumulative = Vec::with_capacity(steps + 1);
        cumulative.push(0.0);
        let (mut sum, mut p) = (0.0, a);
        for i in 1..=steps {
            let q = curve.point(a, b, i as f64 / steps as f64);
            sum += dist2(p, q);
            cumulative.push(sum);
            p = q;
        }
        Self {
            curve: *curve,
            a,
            b,
            cumulative,
        }
    }

    /// Length of the edge [m].
    pub fn length(&self) -> f64 {
        self.cumulative[self.cumulative.len() - 1]
    }

    /// Point at a fraction in 0..=1 of the length. The ends are exact.
    pub fn at(&self, fraction: f64) -> [f64; 2] {
        if fraction <= 0.0 {
            return self.a;
        }
        if fraction >= 1.0 {
            return self.b;
        }
        let steps = self.cumulative.len() - 1;
        let target = fraction * self.length();
        let upper = self
            .cumulative
            .partition_point(|&s| s < target)
            .clamp(1, steps);
        let (low, high) = (self.cumulative[upper - 1], self.cumulative[upper]);
        let within = if high > low {
            (target - low) / (high - low)
        } else {
            0.0
        };
        let t = (upper as f64 - 1.0 + within) / steps as f64;
        self.curve.point(self.a, self.b, t)
    }

    /// Absolute change of direction, see [`Curve::turning`] [rad].
    pub fn turning(&self) -> f64 {
        self.curve.turning(self.a, self.b)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The four SVG arcs: every point has the radius' distance from one
    /// centre, on the side and with the length the flags ask for.
    #[test]
    fn circle_flags() {
        let (a, b) = ([0.2, -0.1], [0.5, 0.3]); // chord 0.5
        for (large, right) in [(false, false), (false, true), (true, false), (true, true)] {
            let curve = Curve::Circle {
                radius: 0.3,
                large,
                right,
            };
            let mid = curve.point(a, b, 0.5);
            let side = cross2(sub2(b, a), sub2(mid, a));
            assert_eq!(side < 0.0, right, "large {large}, right {right}");
            // Centre from three points of the arc, radius checked at others.
            let height = (0.3f64 * 0.3 - 0.25 * 0.25).sqrt();
            let left = if right == large { -1.0 } else { 1.0 };
            let centre = control_point(a, b, [0.5, left * height / 0.5]);
            for i in 0..=10 {
                let p = curve.point(a, b, f64::from(i) / 10.0);
                assert!((dist2(p, centre) - 0.3).abs() < 1e-12);
            }
            let angle = 2.0 * (0.25f64 / 0.3).asin();
            let expected = if large {
                0.3 * (std::f64::consts::TAU - angle)
            } else {
                0.3 * angle
            };
            let length = ArcTable::new(&curve, a, b).length();
            assert!((length / expected - 1.0).abs() < 1e-4);
        }
    }

    /// Sampling by arc length gives equal steps on a lopsided cubic.
    #[test]
    fn equal_steps() {
        let curve = Curve::Cubic {
            controls: [[0.05, 0.4], [0.2, 0.5]],
        };
        let table = ArcTable::new(&curve, [0.0, 0.0], [0.4, 0.1]);
        let n = 40;
        let points: Vec<_> = (0..=n)
            .map(|i| table.at(f64::from(i) / f64::from(n)))
            .collect();
        let steps: Vec<f64> = points.windows(2).map(|w| dist2(w[0], w[1])).collect();
        let mean = table.length() / f64::from(n);
        for s in steps {
            assert!((s / mean - 1.0).abs() < 0.02, "{s} against {mean}");
        }
        assert_eq!(points[0], [0.0, 0.0]);
        assert_eq!(points[n as usize], [0.4, 0.1]);
    }
}
