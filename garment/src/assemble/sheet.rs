//! What the relaxation knows about a garment: unique edges with rest lengths
//! and, across each inner edge, the distance of the opposite corners.

use crate::GarmentMesh;
use crate::math::{dist2, sub2};

/// A pair of points with a wanted distance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Link {
    pub ends: [u32; 2],
    pub rest: f64,
}

/// The links of a garment.
pub(super) struct Sheet {
    /// Edges. Over a gathered seam the shorter panel decides: the longer one
    /// folds.
    pub edges: Vec<Link>,
    /// Opposite corners over inner edges, at their distance when flat.
    pub across: Vec<Link>,
    /// Tied points (spring seams).
    pub ties: Vec<Link>,
    pub edge_length: f64,
}

/// One side of an edge: its ends in ascending order, rest length, the corner
/// opposite, and where that lies in the edge's own frame.
struct Side {
    ends: [u32; 2],
    rest: f64,
    opposite: u32,
    local: [f64; 2],
}

impl Sheet {
    pub(super) fn new(mesh: &GarmentMesh) -> Self {
        let mut sides: Vec<Side> = Vec::with_capacity(3 * mesh.triangles.len());
        for (t, m) in mesh.triangles.iter().zip(&mesh.material) {
            for k in 0..3 {
                let (mut i, mut j) = (k, (k + 1) % 3);
                if t[i] > t[j] {
                    std::mem::swap(&mut i, &mut j);
                }
                let o = (k + 2) % 3;
                let (d, r) = (sub2(m[j], m[i]), sub2(m[o], m[i]));
                let rest = dist2(m[i], m[j]);
                sides.push(Side {
                    ends: [t[i], t[j]],
                    rest,
                    opposite: t[o],
                    local: [
                        (d[0] * r[0] + d[1] * r[1]) / rest,
                        (d[0] * r[1] - d[1] * r[0]).abs() / rest,
                    ],
                });
            }
        }
        sides.sort_by_key(|s| (s.ends, s.opposite));
        let mut edges = Vec::with_capacity(sides.len() / 2);
        let mut across = Vec::with_capacity(sides.len() / 2);
        for group in sides.chunk_by(|x, y| x.ends == y.ends) {
            let rest = group.iter().map(|s| s.rest).fold(f64::MAX, f64::min);
            edges.push(Link {
                ends: group[0].ends,
                rest,
            });
            if let [a, b] = group
                && a.opposite != b.opposite
            {
                let along = a.local[0] - b.local[0];
                across.push(Link {
                    ends: [a.opposite, b.opposite],
                    rest: along.hypot(a.local[1] + b.local[1]),
                });
            }
        }
        let ties = mesh
            .spring_seams
            .iter()
            .flat_map(|s| {
                let end = if s.weights[0] >= 0.5 {
                    s.edge[0]
                } else {
                    s.edge[1]
                };
                (end != s.point).then_some(Link {
                    ends: [s.point, end],
                    rest: 0.0,
                })
            })
            .collect();
        Self {
            edges,
            across,
            ties,
            edge_length: mesh.settings.edge_length,
        }
    }

    /// These points (ascending) and their neighbours, ascending.
    pub(super) fn grown(&self, points: &[u32]) -> Vec<u32> {
        let mut grown = points.to_vec();
        for Link { ends: [i, j], .. } in &self.edges {
            for (one, other) in [(i, j), (j, i)] {
                if points.binary_search(one).is_ok() {
                    grown.push(*other);
                }
            }
        }
        grown.sort_unstable();
        grown.dedup();
        grown
    }
}
