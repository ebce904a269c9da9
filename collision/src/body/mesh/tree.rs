//! Bounding-volume tree of triangles: nearest point and winding number.

use super::super::vec3::{add, add_scaled, cross, dot, norm, scale, sub};
use crate::Aabb;

const LEAF: usize = 4;
/// A group of triangles further away than this many radii counts as one dipole.
const OPENING: f64 = 2.3;

/// Triangles in the order of the tree's leaves.
pub(crate) struct TriangleTree {
    corners: Vec<[[f64; 3]; 3]>,
    nodes: Vec<Node>,
}

struct Node {
    bounds: Aabb,
    /// Area-weighted centroid, and the largest distance of a corner from it.
    center: [f64; 3],
    radius: f64,
    /// Sum of area vectors [m²].
    dipole: [f64; 3],
    /// Leaf: first triangle. Inner: right child; the left one follows.
    first: u32,
    /// Number of triangles of a leaf, 0 for inner nodes.
    count: u32,
}

impl TriangleTree {
    pub(crate) fn new(points: &[[f64; 3]], triangles: impl Iterator<Item = [u32; 3]>) -> Self {
        let mut corners: Vec<[[f64; 3]; 3]> =
            triangles.map(|t| t.map(|p| points[p as usize])).collect();
        let mut nodes = Vec::with_capacity(corners.len());
        if !corners.is_empty() {
            split(&mut corners, 0, &mut nodes);
        }
        Self { corners, nodes }
    }

    /// Squared distance to the nearest triangle, and that triangle. `hint` is
    /// any triangle; the nearer it is, the faster the search.
    pub(crate) fn nearest(&self, p: [f64; 3], hint: u32) -> (f64, u32) {
        let Some(start) = self.corners.get(hint as usize) else {
            return (f64::INFINITY, 0);
        };
        let mut best = (squared_distance(p, start), hint);
        let mut stack = [(0.0, 0_u32); 64];
        stack[0] = (0.0, 0);
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let (bound, mut at) = stack[top];
            if bound >= best.0 {
                continue;
            }
            loop {
                let node = &self.nodes[at as usize];
                if node.count > 0 {
                    for t in node.first..node.first + node.count {
                        let d = squared_distance(p, &self.corners[t as usize]);
                        if d < best.0 {
                            best = (d, t);
                        }
                    }
                    break;
                }
                let (a, b) = (at + 1, node.first);
                let da = box_distance(p, &self.nodes[a as usize].bounds);
                let db = box_distance(p, &self.nodes[b as usize].bounds);
                let (near, far) = if da <= db {
                    ((da, a), (db, b))
                } else {
                    ((db, b), (da, a))
                };
                if far.0 < best.0 && top < stack.len() {
                    stack[top] = far;
                    top += 1;
                }
                if near.0 >= best.0 {
                    break;
                }
                at = near.1;
            }
        }
        best
    }

    /// Writes the unsigned distance [m] at `origin + spacing (i, j, k)`, `i` fastest.
    pub(crate) fn distances(
        &self,
        origin: [f64; 3],
        spacing: f64,
        counts: [usize; 3],
        out: &mut [f64],
    ) {
        let [nx, ny, _] = counts;
        // The nearest triangle of the node before, of the row and the plane before.
        let mut hints = [0_u32; 3];
        for (n, out) in out.iter_mut().enumerate() {
            let node = [n % nx, n / nx % ny, n / (nx * ny)];
            let p = std::array::from_fn(|a| origin[a] + spacing * node[a] as f64);
            let level = node.iter().position(|i| *i > 0).unwrap_or(2);
            let (d2, triangle) = self.nearest(p, hints[level]);
            hints[..=level].fill(triangle);
            *out = d2.sqrt();
        }
    }

    /// Generalised winding number [1]: 1 inside a closed surface, 0 outside,
    /// between in gaps [Jacobson2013]; far groups as dipoles [Barill2018].
    pub(crate) fn winding(&self, p: [f64; 3]) -> f64 {
        let mut solid = 0.0;
        let mut stack = [0_u32; 64];
        let mut top = usize::from(!self.nodes.is_empty());
        while top > 0 {
            top -= 1;
            let at = stack[top];
            let node = &self.nodes[at as usize];
            let d = sub(node.center, p);
            let r2 = dot(d, d);
            let reach = OPENING * node.radius;
            if r2 > reach * reach {
                solid += dot(node.dipole, d) / (r2 * r2.sqrt());
            } else if node.count > 0 {
                for t in node.first..node.first + node.count {
                    solid += solid_angle(p, &self.corners[t as usize]);
                }
            } else if top + 2 <= stack.len() {
                stack[top] = at + 1;
                stack[top + 1] = node.first;
                top += 2;
            }
        }
        solid / (4.0 * std::f64::consts::PI)
    }
}

/// Appends the subtree of a slice of triangles that begins at `offset`.
/// Halves at the median, so that the depth is the logarithm of the count.
fn split(corners: &mut [[[f64; 3]; 3]], offset: usize, nodes: &mut Vec<Node>) {
    let mut centroids = Aabb::EMPTY;
    for t in corners.iter() {
        centroids.include(centroid(t));
    }
    let at = nodes.len();
    nodes.push(summary(corners, offset));
    if corners.len() <= LEAF {
        return;
    }
    let e = centroids.extents();
    let axis = (0..3).fold(0, |k, i| if e[i] > e[k] { i } else { k });
    let middle = corners.len() / 2;
    corners.select_nth_unstable_by(middle, |a, b| {
        centroid(a)[axis].total_cmp(&centroid(b)[axis])
    });
    let (left, right) = corners.split_at_mut(middle);
    split(left, offset, nodes);
    nodes[at].first = nodes.len() as u32;
    nodes[at].count = 0;
    split(right, offset + middle, nodes);
}

fn summary(corners: &[[[f64; 3]; 3]], offset: usize) -> Node {
    let mut bounds = Aabb::EMPTY;
    let (mut dipole, mut moment, mut total) = ([0.0; 3], [0.0; 3], 0.0);
    for t in corners {
        t.iter().for_each(|p| bounds.include(*p));
        let a = area_vector(t);
        let area = norm(a);
        dipole = add(dipole, a);
        moment = add_scaled(moment, centroid(t), area);
        total += area;
    }
    let center = if total > 0.0 {
        scale(moment, 1.0 / total)
    } else {
        bounds.center()
    };
    let radius2 = corners
        .iter()
        .flatten()
        .map(|p| dot(sub(*p, center), sub(*p, center)))
        .fold(0.0, f64::max);
    Node {
        bounds,
        center,
        radius: radius2.sqrt(),
        dipole,
        first: offset as u32,
        count: corners.len() as u32,
    }
}

pub(crate) fn area_vector([a, b, c]: &[[f64; 3]; 3]) -> [f64; 3] {
    scale(cross(sub(*b, *a), sub(*c, *a)), 0.5)
}

pub(crate) fn centroid([a, b, c]: &[[f64; 3]; 3]) -> [f64; 3] {
    scale(add(add(*a, *b), *c), 1.0 / 3.0)
}

fn box_distance(p: [f64; 3], b: &Aabb) -> f64 {
    let mut sum = 0.0;
    for i in 0..3 {
        let out = (b.min[i] - p[i]).max(p[i] - b.max[i]).max(0.0);
        sum += out * out;
    }
    sum
}

/// Signed solid angle of a triangle [sr], positive seen from behind
/// [VanOosteromStrackee1983].
fn solid_angle(p: [f64; 3], t: &[[f64; 3]; 3]) -> f64 {
    let [a, b, c] = t.map(|x| sub(x, p));
    let (la, lb, lc) = (norm(a), norm(b), norm(c));
    let numerator = dot(a, cross(b, c));
    let denominator = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
    2.0 * numerator.atan2(denominator)
}

/// Squared distance of a point to a triangle: inside the prism of the face
/// the height, else the nearest of the three edges.
fn squared_distance(p: [f64; 3], &[a, b, c]: &[[f64; 3]; 3]) -> f64 {
    let (ab, bc, ca) = (sub(b, a), sub(c, b), sub(a, c));
    let (pa, pb, pc) = (sub(p, a), sub(p, b), sub(p, c));
    let n = cross(ab, sub(c, a));
    let inside = dot(cross(n, ab), pa) >= 0.0
        && dot(cross(n, bc), pb) >= 0.0
        && dot(cross(n, ca), pc) >= 0.0;
    let n2 = dot(n, n);
    if inside && n2 > 0.0 {
        let height = dot(n, pa);
        return height * height / n2;
    }
    let to_edge = |e: [f64; 3], q: [f64; 3]| {
        let l2 = dot(e, e);
        let s = if l2 > 0.0 {
            (dot(q, e) / l2).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let r = add_scaled(q, e, -s);
        dot(r, r)
    };
    to_edge(ab, pa).min(to_edge(bc, pb)).min(to_edge(ca, pc))
}
