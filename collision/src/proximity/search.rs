use wide::f32x8;

use super::swept::Swept;
use crate::CollisionMesh;
use crate::mesh::Patch;
use crate::narrow::{closest_edge_edge, closest_point_triangle};
use crate::vec3::Vec3;

/// Patches that a task keeps at hand.
const KEPT: usize = 128;

/// Rounding of distances in single precision, relative to the largest
/// coordinate: five times what three products, a root and a quotient can lose.
const ROUNDING: f64 = 1e-5;

/// What primitives are looked for.
pub(super) struct Search<'a> {
    pub mesh: &'a CollisionMesh,
    pub q_start: &'a [f64],
    pub q_end: &'a [f64],
    pub reach: f64,
    /// Where single precision has its zero [m].
    origin: Vec3,
    /// Bound on its rounding [m].
    slack: f32,
}

/// A pair, and at most its distance where the step starts [m].
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Found {
    pub pair: [u32; 2],
    pub least: f32,
}

/// Results and scratch of one task.
#[derive(Clone, Debug, Default)]
pub(super) struct Task {
    pub vertex_triangle: Vec<Found>,
    pub edge_edge: Vec<Found>,
    first: Swept,
    kept: Vec<Swept>,
}

impl Task {
    pub fn clear(&mut self) {
        self.vertex_triangle.clear();
        self.edge_edge.clear();
        // Another step may have moved them.
        self.first.index = u32::MAX;
        self.kept.iter_mut().for_each(|s| s.index = u32::MAX);
    }

    pub fn heap_bytes(&self) -> usize {
        size_of::<Found>() * (self.vertex_triangle.capacity() + self.edge_edge.capacity())
            + size_of::<Swept>() * self.kept.capacity()
    }
}

impl<'a> Search<'a> {
    /// Between positions that lie in `min` to `max` [m].
    pub fn new(
        mesh: &'a CollisionMesh,
        (q_start, q_end): (&'a [f64], &'a [f64]),
        reach: f64,
        [min, max]: [Vec3; 2],
    ) -> Self {
        let origin = [0, 1, 2].map(|k| 0.5 * (min[k] + max[k]));
        let extent = (0..3)
            .map(|k| 0.5 * (max[k] - min[k]))
            .fold(reach, f64::max);
        Self {
            mesh,
            q_start,
            q_end,
            reach,
            origin,
            slack: (ROUNDING * extent) as f32,
        }
    }

    #[inline]
    pub fn single(&self, p: Vec3) -> [f32; 3] {
        let c = |k: usize| (p[k] - self.origin[k]) as f32;
        [c(0), c(1), c(2)]
    }

    /// Pairs of two patches each; those with the same first one in a row.
    pub fn between(&self, pairs: &[[u32; 2]], task: &mut Task) {
        if task.kept.is_empty() {
            task.kept.resize_with(KEPT, Swept::default);
        }
        let Task {
            vertex_triangle,
            edge_edge,
            first,
            kept,
        } = task;
        for &[a, b] in pairs {
            first.fill(self, a);
            let second = &mut kept[b as usize % KEPT];
            second.fill(self, b);
            let patches = self.mesh.patches();
            let (a, b) = (patches.get(a as usize), patches.get(b as usize));
            self.vertices((&a, first), (&b, second), vertex_triangle);
            self.vertices((&b, second), (&a, first), vertex_triangle);
            self.edges((&a, first), (&b, second), false, edge_edge);
        }
    }

    /// Pairs within one patch.
    pub fn within(&self, index: u32, task: &mut Task) {
        task.first.fill(self, index);
        let patch = self.mesh.patches().get(index as usize);
        let a = (&patch, &task.first);
        self.vertices(a, a, &mut task.vertex_triangle);
        self.edges(a, a, true, &mut task.edge_edge);
    }

    /// Vertices owned by `a` against triangles of `b`.
    fn vertices(
        &self,
        (pa, a): (&Patch<'_>, &Swept),
        (pb, b): (&Patch<'_>, &Swept),
        found: &mut Vec<Found>,
    ) {
        let pad = self.reach as f32 + self.slack;
        for i in (0..pa.owned).step_by(2) {
            let last = i + 1 == pa.owned;
            let (boxes, points, travel) = a.two_points(i, if last { i } else { i + 1 });
            let used = b.triangles.used & if last { 0xf } else { 0xff };
            let near = boxes.near(&b.triangles.boxes, pad) & used;
            if near == 0 {
                continue;
            }
            let range = b.triangles.triangles.distances(points);
            let limit = f32x8::splat(self.reach as f32) + travel + b.triangles.travel;
            let (above, below) = range.compare(limit, self.slack);
            let least = range.least.to_array();
            for lane in lanes(near & !above) {
                let (i, k) = (i + lane / 4, lane % 4);
                let pair = [pa.points[i], pb.triangles[k]];
                if self.mesh.excludes_vertex_triangle(pair[0], pair[1]) {
                    continue;
                }
                let corners = pb.corners[k];
                if !a.points[i]
                    .inflate(self.reach)
                    .overlaps(&b.triangle_box(corners))
                {
                    continue;
                }
                let sure = below >> lane & 1 == 1;
                let [x, y, z] = corners.map(|c| c as usize);
                let distance = || {
                    let x = [a.start[i], b.start[x], b.start[y], b.start[z]];
                    closest_point_triangle(&x).distance
                };
                let way = a.travel[i] + b.travel[x].max(b.travel[y]).max(b.travel[z]);
                if sure || self.near(distance(), way) {
                    let least = self.least(least[lane]);
                    found.push(Found { pair, least });
                }
            }
        }
    }

    /// Edges owned by `a` against those owned by `b`, or by `a` before them.
    fn edges(
        &self,
        (pa, a): (&Patch<'_>, &Swept),
        (pb, b): (&Patch<'_>, &Swept),
        same: bool,
        found: &mut Vec<Found>,
    ) {
        let pad = self.reach as f32 + self.slack;
        for i in 0..pa.ends.len() {
            let own = &a.edges[i / 8];
            let boxes = own.box_of(i % 8);
            for (g, group) in b.edges.iter().enumerate() {
                let before = if same {
                    i.saturating_sub(8 * g).min(8)
                } else {
                    8
                };
                let used = group.used & ((1 << before) - 1);
                if used == 0 {
                    continue;
                }
                let near = boxes.near(&group.boxes, pad) & used;
                if near == 0 {
                    continue;
                }
                let (segment, travel) = own.segment(i % 8);
                let range = segment.distances(&group.segments);
                let limit = f32x8::splat(self.reach as f32) + travel + group.travel;
                let (above, below) = range.compare(limit, self.slack);
                let least = range.least.to_array();
                for lane in lanes(near & !above) {
                    let j = 8 * g + lane;
                    let (ea, eb) = (pa.first_edge + i as u32, pb.first_edge + j as u32);
                    if self.mesh.excludes_edge_edge(ea, eb) {
                        continue;
                    }
                    let boxes = [a.edge_box(pa.ends[i]), b.edge_box(pb.ends[j])];
                    if !boxes[0].inflate(self.reach).overlaps(&boxes[1]) {
                        continue;
                    }
                    let sure = below >> lane & 1 == 1;
                    let [a0, a1] = pa.ends[i].map(|k| k as usize);
                    let [b0, b1] = pb.ends[j].map(|k| k as usize);
                    let distance = || {
                        let x = [a.start[a0], a.start[a1], b.start[b0], b.start[b1]];
                        closest_edge_edge(&x).distance
                    };
                    let way = a.travel[a0].max(a.travel[a1]) + b.travel[b0].max(b.travel[b1]);
                    if sure || self.near(distance(), way) {
                        // The order of the pair decides its orientation.
                        let pair = [ea.min(eb), ea.max(eb)];
                        let least = self.least(least[lane]);
                        found.push(Found { pair, least });
                    }
                }
            }
        }
    }

    /// The last test, with room for rounding.
    #[inline]
    fn near(&self, distance: f64, way: f64) -> bool {
        distance.abs() <= (self.reach + way) * (1.0 + 1e-9)
    }

    /// A bound without rounding; zero where there is none.
    #[inline]
    fn least(&self, bound: f32) -> f32 {
        (bound - self.slack).max(0.0)
    }
}

/// Bits that are set, in order.
fn lanes(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = bits.trailing_zeros();
        bits &= bits.wrapping_sub(1);
        (lane < 32).then_some(lane as usize)
    })
}
