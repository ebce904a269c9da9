use std::cmp::Ordering;
use std::collections::BinaryHeap;

use serde::Serialize;

use super::bvh::{Bvh, triangle_distance_squared};
use super::{Distances, distance_squared};
use crate::{RecordError, Surface};

/// How exactly the largest distance is looked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceOptions {
    /// Allowed gap between both bounds of the largest distance, relative to
    /// the mean edge.
    pub tolerance: f64,
    /// Subdivisions after which the bounds are given as they are.
    pub max_subdivisions: usize,
}

impl Default for SurfaceOptions {
    fn default() -> Self {
        Self {
            tolerance: 1e-3,
            max_subdivisions: 200_000,
        }
    }
}

/// Distance of every point of one surface to another surface \[m\].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct DirectedDistance {
    /// Statistics over the vertices.
    pub vertices: Distances,
    /// Largest distance met on the surface, insides of triangles included.
    pub max: f64,
    /// No point of the surface is farther than this.
    pub max_bound: f64,
}

/// Distance between two surfaces \[m\].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct SurfaceDistance {
    /// From the first to the second.
    pub a_to_b: DirectedDistance,
    /// From the second to the first.
    pub b_to_a: DirectedDistance,
    /// Hausdorff distance: the larger of both directions.
    pub hausdorff: f64,
    /// The true Hausdorff distance lies between `hausdorff` and this.
    pub hausdorff_bound: f64,
}

/// Hausdorff and mean distance of two surfaces, which may have different
/// meshes.
///
/// The largest distance is enclosed by branch and bound. The distance to one
/// triangle of the other surface is convex, so that over a triangle it is
/// largest at a corner; the smallest such value over nearby triangles bounds
/// the distance of all points in between.
///
/// # Errors
/// [`RecordError::Surface`] for a surface without triangles or one that is not
/// finite.
pub fn compare_surfaces(
    a: &Surface<'_>,
    b: &Surface<'_>,
    options: &SurfaceOptions,
) -> Result<SurfaceDistance, RecordError> {
    for surface in [a, b] {
        surface.validate()?;
        if surface.triangles.is_empty() {
            return Err(RecordError::Surface {
                reason: "there are no triangles".into(),
            });
        }
    }
    let a_to_b = directed(a, b, options);
    let b_to_a = directed(b, a, options);
    Ok(SurfaceDistance {
        a_to_b,
        b_to_a,
        hausdorff: a_to_b.max.max(b_to_a.max),
        hausdorff_bound: a_to_b.max_bound.max(b_to_a.max_bound),
    })
}

/// A point of the first surface and its distance from the second.
#[derive(Clone, Copy)]
struct Sample {
    at: [f64; 3],
    distance: f64,
    nearest: u32,
}

/// A part of a triangle; no point of it is farther than `bound`.
struct Piece {
    bound: f64,
    /// Breaks ties, so that results do not depend on the heap.
    order: usize,
    corners: [Sample; 3],
}

impl PartialEq for Piece {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Piece {}

impl PartialOrd for Piece {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Piece {
    fn cmp(&self, other: &Self) -> Ordering {
        self.bound
            .total_cmp(&other.bound)
            .then(other.order.cmp(&self.order))
    }
}

fn directed(from: &Surface<'_>, to: &Surface<'_>, options: &SurfaceOptions) -> DirectedDistance {
    let bvh = Bvh::new(
        to.triangles
            .iter()
            .map(|t| t.map(|p| to.point(p)))
            .collect(),
    );
    let sample = |at, hint| {
        let (distance, nearest) = bvh.nearest(at, hint);
        Sample {
            at,
            distance,
            nearest,
        }
    };

    // Points that no triangle uses are no part of the surface.
    let mut samples: Vec<Option<Sample>> = vec![None; from.points];
    let (mut hint, mut edges) = (0, 0.0);
    for triangle in from.triangles {
        for &p in triangle {
            let slot = &mut samples[p as usize];
            hint = slot
                .get_or_insert_with(|| sample(from.point(p), hint))
                .nearest;
        }
        let [a, b, c] = triangle.map(|p| from.point(p));
        for (a, b) in [(a, b), (b, c), (c, a)] {
            edges += distance_squared(a, b).sqrt();
        }
    }
    let used: Vec<usize> = (0..from.points).filter(|p| samples[*p].is_some()).collect();
    let distances: Vec<f64> = samples.iter().flatten().map(|s| s.distance).collect();
    let mut vertices = Distances::of(&distances);
    vertices.max_point = used.get(vertices.max_point).copied().unwrap_or(0);

    let mut max = vertices.max;
    let gap = options.tolerance.max(0.0) * edges / (3 * from.triangles.len()) as f64;
    let mut pieces = BinaryHeap::new();
    let mut order = 0;
    let mut push = |corners: [Sample; 3], max: &mut f64, pieces: &mut BinaryHeap<Piece>| {
        let mut bound = bound(&bvh, &corners, &corners);
        if bound > *max + gap {
            // The triangle below the middle often covers the whole piece.
            let [a, b, c] = &corners;
            let at = std::array::from_fn(|i| (a.at[i] + b.at[i] + c.at[i]) / 3.0);
            let middle = sample(at, a.nearest);
            *max = max.max(middle.distance);
            bound = bound.min(self::bound(&bvh, &corners, &[middle]));
        }
        if bound > *max {
            pieces.push(Piece {
                bound,
                order,
                corners,
            });
            order += 1;
        }
    };
    for triangle in from.triangles {
        if let [Some(a), Some(b), Some(c)] = triangle.map(|p| samples[p as usize]) {
            push([a, b, c], &mut max, &mut pieces);
        }
    }
    let mut left = options.max_subdivisions;
    while let Some(piece) = pieces.peek() {
        if piece.bound <= max + gap || left == 0 {
            break;
        }
        let Some(Piece {
            corners: [a, b, c], ..
        }) = pieces.pop()
        else {
            break;
        };
        left -= 1;
        let middle = |a: &Sample, b: &Sample| {
            sample(
                std::array::from_fn(|i| 0.5 * (a.at[i] + b.at[i])),
                a.nearest,
            )
        };
        let (ab, bc, ca) = (middle(&a, &b), middle(&b, &c), middle(&c, &a));
        max = max.max(ab.distance).max(bc.distance).max(ca.distance);
        for corners in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
            push(corners, &mut max, &mut pieces);
        }
    }
    let max_bound = pieces.peek().map_or(max, |piece| piece.bound.max(max));
    DirectedDistance {
        vertices,
        max,
        max_bound,
    }
}

/// Upper bound of the distance over a piece, from samples on it: the convex
/// one, and that the distance changes no faster than one goes.
fn bound(bvh: &Bvh, corners: &[Sample; 3], from: &[Sample]) -> f64 {
    let mut bound = f64::INFINITY;
    for sample in from {
        let nearest = bvh.triangle(sample.nearest);
        let (mut convex, mut reach) = (0.0_f64, 0.0_f64);
        for corner in corners {
            convex = convex.max(triangle_distance_squared(corner.at, nearest));
            reach = reach.max(distance_squared(corner.at, sample.at));
        }
        bound = bound.min(convex.sqrt()).min(sample.distance + reach.sqrt());
    }
    bound
}
