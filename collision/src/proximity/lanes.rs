//! Eight distances at a time, bounded from both sides in single precision.
//!
//! A gap vector `g` between any points of two features bounds their distance:
//! from above by its length, from below by how far apart the features are along
//! it, the least of `g·(x_a − x_b)/|g|` over their ends. Both meet where the
//! points are closest. What finds the points need therefore not be exact.

use wide::f32x8;

pub(super) type Lanes3 = [f32x8; 3];

/// Stands for zero in a divisor.
const TINY: f32 = f32::MIN_POSITIVE;

/// Boxes of eight primitives.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Boxes {
    pub min: Lanes3,
    pub max: Lanes3,
}

impl Boxes {
    /// Lanes that may come within `pad` of these boxes in every direction:
    /// those where comparisons with NaN fail are among them.
    #[inline]
    pub fn near(&self, other: &Self, pad: f32) -> u32 {
        let pad = f32x8::splat(pad);
        let mut apart = f32x8::splat(0.0);
        for k in 0..3 {
            apart |= (self.min[k] - pad).simd_gt(other.max[k]);
            apart |= (other.min[k] - pad).simd_gt(self.max[k]);
        }
        !apart.to_bitmask() & 0xff
    }
}

/// Bounds of eight distances.
#[derive(Clone, Copy, Debug)]
pub(super) struct Range {
    pub least: f32x8,
    pub most: f32x8,
}

impl Range {
    /// Lanes surely above a limit, and lanes surely not.
    #[inline]
    pub fn compare(&self, limit: f32x8, slack: f32) -> (u32, u32) {
        let slack = f32x8::splat(slack);
        let above = self.least.simd_gt(limit + slack);
        let below = self.most.simd_lt(limit - slack);
        (above.to_bitmask(), below.to_bitmask())
    }
}

/// Eight segments from `from` along `way`.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Segments {
    pub from: Lanes3,
    pub way: Lanes3,
}

impl Segments {
    /// Distances lane by lane. The closest points are those of [Ericson2005,
    /// § 5.1.9], poor for parallel segments.
    #[inline]
    pub fn distances(&self, other: &Self) -> Range {
        let (u, v) = (self.way, other.way);
        let r = sub(self.from, other.from);
        let (uu, uv, vv) = (dot(u, u), dot(u, v), dot(v, v));
        let (ur, vr) = (dot(u, r), dot(v, r));
        let s = unit_range((uv * vr - ur * vv) / above_zero(uu * vv - uv * uv));
        let t = unit_range((uv * s + vr) / above_zero(vv));
        let s = unit_range((uv * t - ur) / above_zero(uu));
        let gap = sub(along(r, s, u), scale(t, v));
        let most = dot(gap, gap).sqrt();
        let zero = f32x8::splat(0.0);
        let apart = dot(r, gap) + dot(u, gap).fast_min(zero) - dot(v, gap).fast_max(zero);
        let least = apart / above_zero(most);
        Range { least, most }
    }
}

/// Eight triangles.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Triangles {
    pub corners: [Lanes3; 3],
}

impl Triangles {
    /// Distances to eight points, lane by lane.
    #[inline]
    pub fn distances(&self, p: Lanes3) -> Range {
        let x = self.corners;
        let r = [sub(p, x[0]), sub(p, x[1]), sub(p, x[2])];
        let mut gap = r[0];
        let mut best = f32x8::splat(f32::INFINITY);
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            let e = sub(x[j], x[i]);
            let s = unit_range(dot(r[i], e) / above_zero(dot(e, e)));
            let to = sub(r[i], scale(s, e));
            let square = dot(to, to);
            let closer = square.simd_lt(best);
            gap = select(closer, to, gap);
            best = closer.bitselect(square, best);
        }
        let (e1, e2) = (sub(x[1], x[0]), sub(x[2], x[0]));
        let (a, b, c) = (dot(e1, e1), dot(e1, e2), dot(e2, e2));
        let (d1, d2) = (dot(e1, r[0]), dot(e2, r[0]));
        let det = above_zero(a * c - b * b);
        let (b1, b2) = ((c * d1 - b * d2) / det, (a * d2 - b * d1) / det);
        let zero = f32x8::splat(0.0);
        let inside = b1.simd_ge(zero) & b2.simd_ge(zero) & (b1 + b2).simd_le(f32x8::splat(1.0));
        let across = sub(sub(r[0], scale(b1, e1)), scale(b2, e2));
        gap = select(inside, across, gap);
        let most = dot(gap, gap).sqrt();
        let apart = dot(r[0], gap).fast_min(dot(r[1], gap));
        let apart = apart.fast_min(dot(r[2], gap));
        let least = apart / above_zero(most);
        Range { least, most }
    }
}

#[inline]
fn sub(a: Lanes3, b: Lanes3) -> Lanes3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline]
fn dot(a: Lanes3, b: Lanes3) -> f32x8 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline]
fn scale(s: f32x8, a: Lanes3) -> Lanes3 {
    [s * a[0], s * a[1], s * a[2]]
}

/// `a + s b`
#[inline]
fn along(a: Lanes3, s: f32x8, b: Lanes3) -> Lanes3 {
    [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]]
}

#[inline]
fn select(mask: f32x8, a: Lanes3, b: Lanes3) -> Lanes3 {
    let each = |k: usize| mask.bitselect(a[k], b[k]);
    [each(0), each(1), each(2)]
}

#[inline]
fn above_zero(x: f32x8) -> f32x8 {
    x.fast_max(f32x8::splat(TINY))
}

#[inline]
fn unit_range(x: f32x8) -> f32x8 {
    x.fast_max(f32x8::splat(0.0)).fast_min(f32x8::splat(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::narrow::{closest_edge_edge, closest_point_triangle};

    struct Random(u64);

    impl Random {
        fn next(&mut self) -> f64 {
            self.0 = self
                .0
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (self.0 >> 11) as f64 / (1_u64 << 53) as f64
        }

        /// Points whose coordinates are often equal, so that features meet,
        /// are parallel or have no extent.
        fn point(&mut self) -> [f64; 3] {
            [0; 3].map(|_| match self.next() {
                x if x < 0.3 => (4.0 * self.next()).floor() / 4.0,
                _ => self.next(),
            })
        }
    }

    fn lanes(x: [f64; 3]) -> Lanes3 {
        x.map(|x| f32x8::splat(x as f32))
    }

    /// The bounds hold, and are close together for nearly all pairs.
    #[test]
    fn bounds_hold() {
        let mut random = Random(5);
        let mut loose = [0; 2];
        for _ in 0..200_000 {
            let x = [0; 4].map(|_| random.point());
            let segment = |a: [f64; 3], b: [f64; 3]| Segments {
                from: lanes(a),
                way: sub(lanes(b), lanes(a)),
            };
            let edges = segment(x[0], x[1]).distances(&segment(x[2], x[3]));
            let corners = [x[1], x[2], x[3]].map(lanes);
            let triangle = Triangles { corners }.distances(lanes(x[0]));
            let exact = [closest_edge_edge(&x), closest_point_triangle(&x)];
            for (k, (range, exact)) in [edges, triangle].iter().zip(exact).enumerate() {
                let exact = exact.distance.abs();
                let [least, most] = [range.least, range.most].map(|l| f64::from(l.to_array()[3]));
                assert!(least < exact + 4e-6, "{least} above {exact}: {x:?}");
                assert!(most > exact - 4e-6, "{most} below {exact}: {x:?}");
                loose[k] += usize::from(most - least > 1e-5);
            }
        }
        println!("loose: {loose:?} of 200000");
        assert!(loose.iter().all(|l| *l < 4000), "{loose:?}");
    }

    /// Boxes are apart when they are so in one direction by more than the pad.
    #[test]
    fn boxes() {
        let of = |min: [f32; 3], max: [f32; 3]| Boxes {
            min: min.map(f32x8::splat),
            max: max.map(f32x8::splat),
        };
        let unit = of([0.0; 3], [1.0; 3]);
        assert_eq!(unit.near(&of([1.5, 0.0, 0.0], [2.0; 3]), 0.6), 0xff);
        assert_eq!(unit.near(&of([1.5, 0.0, 0.0], [2.0; 3]), 0.4), 0);
        assert_eq!(unit.near(&of([-2.0; 3], [0.5, -0.5, 0.5]), 0.4), 0);
        assert_eq!(unit.near(&of([f32::NAN; 3], [f32::NAN; 3]), 0.4), 0xff);
    }
}
