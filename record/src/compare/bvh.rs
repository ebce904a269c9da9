//! Nearest triangle of a static mesh.

use super::{cross, distance_squared, dot, sub};

const LEAF: usize = 4;

#[derive(Clone, Copy)]
struct Node {
    min: [f64; 3],
    max: [f64; 3],
    /// First triangle of a leaf, or the second child; the first child follows
    /// its parent.
    start: u32,
    /// Triangles of a leaf; 0 for an inner node.
    count: u32,
}

/// Box hierarchy split at the median of the longest axis.
pub(super) struct Bvh {
    nodes: Vec<Node>,
    /// Triangles in tree order.
    corners: Vec<[[f64; 3]; 3]>,
}

impl Bvh {
    /// `triangles` must not be empty.
    pub fn new(mut corners: Vec<[[f64; 3]; 3]>) -> Self {
        let mut nodes = Vec::with_capacity(corners.len());
        build(&mut nodes, &mut corners, 0);
        Self { nodes, corners }
    }

    /// Corners of a triangle, by the index that [`nearest`](Self::nearest)
    /// gives.
    pub fn triangle(&self, index: u32) -> &[[f64; 3]; 3] {
        &self.corners[index as usize]
    }

    /// Distance to the surface \[m\] and the nearest triangle. `hint` is a
    /// triangle that is probably close.
    pub fn nearest(&self, p: [f64; 3], hint: u32) -> (f64, u32) {
        let mut best = (triangle_distance_squared(p, self.triangle(hint)), hint);
        let mut stack = [0_u32; 64];
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let index = stack[depth] as usize;
            let node = &self.nodes[index];
            if box_distance_squared(p, node) >= best.0 {
                continue;
            }
            if node.count > 0 {
                for t in node.start..node.start + node.count {
                    let d = triangle_distance_squared(p, self.triangle(t));
                    if d < best.0 {
                        best = (d, t);
                    }
                }
                continue;
            }
            // The nearer child is looked at first.
            let (a, b) = (index as u32 + 1, node.start);
            let d = |child: u32| box_distance_squared(p, &self.nodes[child as usize]);
            let (near, far) = if d(a) <= d(b) { (a, b) } else { (b, a) };
            stack[depth] = far;
            stack[depth + 1] = near;
            depth += 2;
        }
        (best.0.sqrt(), best.1)
    }
}

/// The depth is the logarithm of the number of triangles: halves are equal.
fn build(nodes: &mut Vec<Node>, corners: &mut [[[f64; 3]; 3]], first: u32) {
    let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for p in corners.as_flattened() {
        for i in 0..3 {
            min[i] = min[i].min(p[i]);
            max[i] = max[i].max(p[i]);
        }
    }
    let index = nodes.len();
    let count = corners.len();
    nodes.push(Node {
        min,
        max,
        start: first,
        count: count as u32,
    });
    if count <= LEAF {
        return;
    }
    let size = sub(max, min);
    let axis = (0..3)
        .max_by(|a, b| size[*a].total_cmp(&size[*b]))
        .unwrap_or(0);
    let centre = |t: &[[f64; 3]; 3]| t[0][axis] + t[1][axis] + t[2][axis];
    let middle = count / 2;
    corners.select_nth_unstable_by(middle, |a, b| centre(a).total_cmp(&centre(b)));
    let (left, right) = corners.split_at_mut(middle);
    build(nodes, left, first);
    nodes[index].start = nodes.len() as u32;
    nodes[index].count = 0;
    build(nodes, right, first + middle as u32);
}

fn box_distance_squared(p: [f64; 3], node: &Node) -> f64 {
    let mut sum = 0.0;
    for i in 0..3 {
        let d = (node.min[i] - p[i]).max(p[i] - node.max[i]).max(0.0);
        sum += d * d;
    }
    sum
}

/// Triangles thinner than this, relative to their longest edge, are their
/// edges: the normal of a sliver is rounding, and with it what is inside.
const SLIVER: f64 = 1e-8;

/// Squared distance of a point to a triangle, degenerate ones included.
pub(super) fn triangle_distance_squared(p: [f64; 3], t: &[[f64; 3]; 3]) -> f64 {
    let [a, b, c] = *t;
    let (ab, bc, ca) = (sub(b, a), sub(c, b), sub(a, c));
    let normal = cross(ca, ab);
    let length = dot(normal, normal);
    let longest = dot(ab, ab).max(dot(bc, bc)).max(dot(ca, ca));
    let inside = |a, edge| dot(cross(edge, sub(p, a)), normal) >= 0.0;
    if length > (SLIVER * longest).powi(2) && inside(a, ab) && inside(b, bc) && inside(c, ca) {
        let height = dot(sub(p, a), normal);
        return height * height / length;
    }
    segment(p, a, b).min(segment(p, b, c)).min(segment(p, c, a))
}

fn segment(p: [f64; 3], a: [f64; 3], b: [f64; 3]) -> f64 {
    let (along, offset) = (sub(b, a), sub(p, a));
    let length = dot(along, along);
    let s = if length > 0.0 {
        (dot(offset, along) / length).clamp(0.0, 1.0)
    } else {
        0.0
    };
    distance_squared(p, std::array::from_fn(|i| a[i] + s * along[i]))
}
