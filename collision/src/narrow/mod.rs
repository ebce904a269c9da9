//! Closest points of two features, and how their distance changes.
//!
//! Every pair has four nodes and four weights `w` that sum to zero; its gap
//! vector is `Σ wᵢ xᵢ`. A vertex and a triangle, an edge and an edge are thus
//! alike, and a closest point on a boundary is a weight of zero.

mod edge_edge;
pub mod hessian;
mod point_triangle;

pub use edge_edge::closest_edge_edge;
pub use point_triangle::closest_point_triangle;

use crate::vec3::{Vec3, cross, dot, norm, scale, sub, unit};

/// Two features are parallel, or a triangle has no area, when the squared sine
/// of their angle is at most this.
const PARALLEL: f64 = 1e-14;

/// Points closer than this, relative to the size of the pair, coincide.
const COINCIDENT: f64 = 1e-12;

/// Closest points of a pair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest {
    /// Weights of the four nodes; the gap vector is `Σ wᵢ xᵢ`.
    pub weights: [f64; 4],
    /// Whether the closest points are inside both features: inside the
    /// triangle, inside both edges.
    pub interior: bool,
    /// Distance \[m\]. Interior pairs: signed, along [`normal`](Self::normal).
    /// Others: not negative.
    pub distance: f64,
    /// Interior pairs: the unit normal `e₁ × e₂` of the plane of both
    /// features. Others: direction of the gap vector, zero when
    /// [`coincident`](Self::coincident).
    pub normal: [f64; 3],
    /// Whether the closest points coincide, so that the gap vector has no
    /// direction.
    pub coincident: bool,
}

/// Which features a pair has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum PairKind {
    /// A vertex `x₀` and a triangle `x₁ x₂ x₃`.
    VertexTriangle,
    /// An edge `x₀ x₁` and an edge `x₂ x₃`.
    EdgeEdge,
}

impl PairKind {
    /// Closest points of a pair of this kind.
    #[inline]
    pub fn closest(self, x: &[[f64; 3]; 4]) -> Closest {
        match self {
            Self::VertexTriangle => closest_point_triangle(x),
            Self::EdgeEdge => closest_edge_edge(x),
        }
    }

    /// Which nodes belong to the first feature.
    pub(crate) fn first_feature(self) -> [bool; 4] {
        match self {
            Self::VertexTriangle => [true, false, false, false],
            Self::EdgeEdge => [true, true, false, false],
        }
    }

    /// The two edges that span the plane of an interior pair.
    #[inline]
    fn plane_edges(self, x: &[Vec3; 4]) -> (Vec3, Vec3) {
        match self {
            Self::VertexTriangle => (sub(x[2], x[1]), sub(x[3], x[1])),
            Self::EdgeEdge => (sub(x[1], x[0]), sub(x[3], x[2])),
        }
    }

    /// Whether the features pass through each other on the straight way from
    /// `start` to `end`, judged at the time when their planes meet if the
    /// signed volume changed linearly.
    pub(crate) fn crossed(self, start: &[Vec3; 4], end: &[Vec3; 4]) -> bool {
        let volume = |x: &[Vec3; 4]| {
            let (e1, e2) = self.plane_edges(x);
            let apart = match self {
                Self::VertexTriangle => sub(x[0], x[1]),
                Self::EdgeEdge => sub(x[0], x[2]),
            };
            dot(cross(e1, e2), apart)
        };
        let (a, b) = (volume(start), volume(end));
        if a * b >= 0.0 {
            return false;
        }
        let t = a / (a - b);
        let x: [Vec3; 4] = std::array::from_fn(|i| {
            std::array::from_fn(|k| start[i][k] + t * (end[i][k] - start[i][k]))
        });
        self.closest(&x).interior
    }

    /// A unit tangent that moves with the first edge of the pair's plane, or
    /// with the second where the first is nearly along `normal`.
    pub(crate) fn tangent(self, x: &[Vec3; 4], normal: Vec3) -> Option<Vec3> {
        let (e1, e2) = self.plane_edges(x);
        let along = |e: Vec3| {
            let t = crate::vec3::tangential(e, normal);
            if norm(t) > 0.1 * norm(e) {
                unit(t)
            } else {
                None
            }
        };
        along(e1).or_else(|| along(e2))
    }
}

/// Coordinates of `u` in the plane of two edges.
///
/// ```text
/// c₁ = (c e₁ - b e₂)/Δ,  c₂ = (a e₂ - b e₁)/Δ,   a = e₁·e₁, b = e₁·e₂, c = e₂·e₂, Δ = ac - b²
/// ```
/// `None` where `Δ ≤ 1e-14 ac`.
#[inline]
fn plane_coordinates(e1: Vec3, e2: Vec3, u: Vec3) -> Option<(f64, f64)> {
    let (a, b, c) = (dot(e1, e1), dot(e1, e2), dot(e2, e2));
    let delta = a * c - b * b;
    if !(delta > PARALLEL * a * c) {
        return None;
    }
    let (d1, d2) = (dot(e1, u), dot(e2, u));
    Some(((c * d1 - b * d2) / delta, (a * d2 - b * d1) / delta))
}

/// An interior pair: `apart` runs from the second feature's plane to the first.
#[inline]
fn interior(weights: [f64; 4], e1: Vec3, e2: Vec3, apart: Vec3) -> Option<Closest> {
    let normal = unit(cross(e1, e2))?;
    let distance = dot(normal, apart);
    let size = dot(e1, e1).max(dot(e2, e2)).sqrt();
    let coincident = distance.abs() <= COINCIDENT * size;
    Some(Closest {
        weights,
        interior: true,
        distance,
        normal,
        coincident,
    })
}

/// A pair whose closest points are on a boundary.
#[inline]
fn boundary(weights: [f64; 4], gap: Vec3, size: f64) -> Closest {
    let distance = norm(gap);
    let coincident = !(distance > COINCIDENT * size && distance.is_normal());
    let normal = if coincident {
        [0.0; 3]
    } else {
        scale(1.0 / distance, gap)
    };
    Closest {
        weights,
        interior: false,
        distance,
        normal,
        coincident,
    }
}

/// Closest point of `a + s (b - a)`, `0 ≤ s ≤ 1`, to `p`: `s` and the vector
/// from it to `p`.
#[inline]
fn to_segment(p: Vec3, a: Vec3, b: Vec3) -> (f64, Vec3) {
    let (e, u) = (sub(b, a), sub(p, a));
    let l2 = dot(e, e);
    let s = if l2 > 0.0 {
        (dot(u, e) / l2).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (s, crate::vec3::axpy(u, -s, e))
}
