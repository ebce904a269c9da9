//! Intersections of a triangle mesh with itself.

use rayon::prelude::*;
use robust::{Coord3D, orient3d};

use crate::{Aabb, BroadPhase};

/// An edge that passes through a triangle it shares no point with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intersection {
    /// Ends of the edge.
    pub edge: [u32; 2],
    /// The triangle.
    pub triangle: u32,
    /// Where they meet [m].
    pub place: [f64; 3],
}

/// All proper intersections between edges and triangles of one mesh, with
/// exact orientation predicates; touching is not an intersection. Sorted by
/// edge and triangle, each once.
///
/// `positions` holds three coordinates a point. Points that are not finite
/// take part in nothing.
pub fn self_intersections(
    positions: &[f64],
    triangles: &[[u32; 3]],
    broad_phase: &mut dyn BroadPhase,
) -> Vec<Intersection> {
    let (points, _) = positions.as_chunks::<3>();
    let boxes: Vec<Aabb> = triangles
        .iter()
        .map(|t| {
            let p = t.map(|i| points[i as usize]);
            Aabb {
                min: std::array::from_fn(|k| p[0][k].min(p[1][k]).min(p[2][k])),
                max: std::array::from_fn(|k| p[0][k].max(p[1][k]).max(p[2][k])),
            }
        })
        .collect();
    let mut pairs = Vec::new();
    broad_phase.overlaps(&boxes, &mut pairs);
    let mut found: Vec<Intersection> = pairs
        .par_chunks(1024)
        .flat_map_iter(|pairs| {
            let mut found = Vec::new();
            for &[s, t] in pairs {
                for (from, into) in [(s, t), (t, s)] {
                    let corners = triangles[from as usize];
                    for k in 0..3 {
                        let (a, b) = (corners[k], corners[(k + 1) % 3]);
                        let edge = [a.min(b), a.max(b)];
                        if let Some(place) = pierces(points, edge, triangles[into as usize]) {
                            found.push(Intersection {
                                edge,
                                triangle: into,
                                place,
                            });
                        }
                    }
                }
            }
            found
        })
        .collect();
    // An interior edge was met from both of its triangles.
    found.sort_unstable_by_key(|i| (i.edge, i.triangle));
    found.dedup_by_key(|i| (i.edge, i.triangle));
    found
}

fn pierces(points: &[[f64; 3]], edge: [u32; 2], triangle: [u32; 3]) -> Option<[f64; 3]> {
    if triangle.contains(&edge[0]) || triangle.contains(&edge[1]) {
        return None;
    }
    let [a, b] = edge.map(|i| points[i as usize]);
    let c = triangle.map(|i| points[i as usize]);
    let side = |p, q, r, s| orient3d(coord(p), coord(q), coord(r), coord(s));
    let (da, db) = (side(c[0], c[1], c[2], a), side(c[0], c[1], c[2], b));
    if da * db >= 0.0 || !(da.is_finite() && db.is_finite()) {
        return None;
    }
    let signs = [
        side(a, b, c[0], c[1]),
        side(a, b, c[1], c[2]),
        side(a, b, c[2], c[0]),
    ];
    if !(signs.iter().all(|s| *s > 0.0) || signs.iter().all(|s| *s < 0.0)) {
        return None;
    }
    let t = da / (da - db);
    Some(std::array::from_fn(|k| a[k] + t * (b[k] - a[k])))
}

fn coord(p: [f64; 3]) -> Coord3D<f64> {
    Coord3D {
        x: p[0],
        y: p[1],
        z: p[2],
    }
}
