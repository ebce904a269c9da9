use crate::ModelError;

/// Marks an absent triangle.
pub const NONE: u32 = u32::MAX;

/// An edge of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Edge {
    /// End points, smaller index first.
    pub points: [u32; 2],
    /// The triangles on it; the second is [`NONE`] on the boundary.
    pub triangles: [u32; 2],
}

impl Edge {
    /// Whether only one triangle is on it.
    pub fn is_boundary(&self) -> bool {
        self.triangles[1] == NONE
    }
}

/// Two triangles that share an edge.
///
/// ```text
///        x2            edge x0 → x1, triangle 1 = (x0, x1, x2),
///       /  \                         triangle 2 = (x1, x0, x3)
///     x0 → x1
///       \  /
///        x3
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Hinge {
    /// `x0, x1, x2, x3`.
    pub points: [u32; 4],
    /// Triangles 1 and 2.
    pub triangles: [u32; 2],
    /// Corner of triangle 1 that is `x2`, and of triangle 2 that is `x3`.
    pub corners: [u8; 2],
}

/// Edges, hinges and the hinge over every triangle side.
pub(super) struct Topology {
    pub edges: Vec<Edge>,
    pub hinges: Vec<Hinge>,
    /// Neighbour across the side opposite each corner, or [`NONE`].
    pub neighbours: Vec<[u32; 3]>,
}

/// One side of one triangle.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Side {
    low: u32,
    high: u32,
    triangle: u32,
    corner: u8,
    /// Whether the triangle runs from `low` to `high`.
    upward: bool,
}

pub(super) fn check_points(points: usize, triangles: &[[u32; 3]]) -> Result<(), ModelError> {
    for (triangle, t) in triangles.iter().enumerate() {
        if let Some(&point) = t.iter().find(|p| **p as usize >= points) {
            return Err(ModelError::PointOutOfRange {
                triangle,
                point,
                points,
            });
        }
        for (a, b) in [(0, 1), (0, 2), (1, 2)] {
            if t[a] == t[b] {
                return Err(ModelError::RepeatedPoint {
                    triangle,
                    point: t[a],
                });
            }
        }
    }
    let mut sorted: Vec<([u32; 3], usize)> = triangles
        .iter()
        .enumerate()
        .map(|(i, t)| {
            let mut key = *t;
            key.sort_unstable();
            (key, i)
        })
        .collect();
    sorted.sort_unstable();
    match sorted.windows(2).find(|w| w[0].0 == w[1].0) {
        Some(w) => Err(ModelError::DuplicateTriangle {
            first: w[0].1,
            second: w[1].1,
        }),
        None => Ok(()),
    }
}

pub(super) fn build(triangles: &[[u32; 3]]) -> Result<Topology, ModelError> {
    let mut sides = Vec::with_capacity(3 * triangles.len());
    for (triangle, t) in triangles.iter().enumerate() {
        for corner in 0..3 {
            let (a, b) = (t[(corner + 1) % 3], t[(corner + 2) % 3]);
            sides.push(Side {
                low: a.min(b),
                high: a.max(b),
                triangle: triangle as u32,
                corner: corner as u8,
                upward: a < b,
            });
        }
    }
    sides.sort_unstable();
    let mut edges = Vec::new();
    let mut hinges = Vec::new();
    let mut neighbours = vec![[NONE; 3]; triangles.len()];
    for group in sides.chunk_by(|a, b| (a.low, a.high) == (b.low, b.high)) {
        let points = [group[0].low, group[0].high];
        match group {
            [one] => edges.push(Edge {
                points,
                triangles: [one.triangle, NONE],
            }),
            [one, two] => {
                if one.upward == two.upward {
                    return Err(ModelError::InconsistentWinding {
                        edge: points,
                        triangles: [one.triangle as usize, two.triangle as usize],
                    });
                }
                edges.push(Edge {
                    points,
                    triangles: [one.triangle, two.triangle],
                });
                neighbours[one.triangle as usize][one.corner as usize] = two.triangle;
                neighbours[two.triangle as usize][two.corner as usize] = one.triangle;
                // The edge runs along triangle 1.
                let [x0, x1] = if one.upward {
                    points
                } else {
                    [points[1], points[0]]
                };
                let opposite = |s: &Side| triangles[s.triangle as usize][s.corner as usize];
                hinges.push(Hinge {
                    points: [x0, x1, opposite(one), opposite(two)],
                    triangles: [one.triangle, two.triangle],
                    corners: [one.corner, two.corner],
                });
            }
            many => {
                return Err(ModelError::NonManifoldEdge {
                    edge: points,
                    triangles: many.iter().map(|s| s.triangle as usize).collect(),
                });
            }
        }
    }
    Ok(Topology {
        edges,
        hinges,
        neighbours,
    })
}
