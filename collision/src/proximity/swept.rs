use wide::f32x8;

use super::lanes::{Boxes, Lanes3, Segments, Triangles};
use super::search::Search;
use crate::Aabb;
use crate::mesh::{PATCH_EDGES, PATCH_POINTS};
use crate::vec3::{Vec3, norm, point, sub};

/// Edges of a patch in groups of eight.
const GROUPS: usize = PATCH_EDGES.div_ceil(8);

/// One patch on its way, and what single precision knows of its primitives
/// relative to the origin of the search.
#[derive(Clone, Debug)]
pub(super) struct Swept {
    /// Number of the patch.
    pub index: u32,
    pub start: [Vec3; PATCH_POINTS],
    pub travel: [f64; PATCH_POINTS],
    pub points: [Aabb; PATCH_POINTS],
    single: [Single; PATCH_POINTS],
    pub edges: [Edges; GROUPS],
    pub triangles: Corners,
}

/// Eight edges of a patch.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Edges {
    pub boxes: Boxes,
    pub segments: Segments,
    pub travel: f32x8,
    /// Lanes in use.
    pub used: u32,
}

/// The triangles of a patch, twice.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Corners {
    pub boxes: Boxes,
    pub triangles: Triangles,
    pub travel: f32x8,
    /// Lanes in use.
    pub used: u32,
}

/// A point in single precision.
#[derive(Clone, Copy, Debug, Default)]
struct Single {
    min: [f32; 3],
    max: [f32; 3],
    start: [f32; 3],
    travel: f32,
}

impl Default for Swept {
    fn default() -> Self {
        Self {
            index: u32::MAX,
            start: [[0.0; 3]; PATCH_POINTS],
            travel: [0.0; PATCH_POINTS],
            points: [Aabb::EMPTY; PATCH_POINTS],
            single: [Single::default(); PATCH_POINTS],
            edges: [Edges::default(); GROUPS],
            triangles: Corners::default(),
        }
    }
}

impl Swept {
    /// Takes over another patch.
    pub fn fill(&mut self, search: &Search<'_>, index: u32) {
        if self.index == index {
            return;
        }
        self.index = index;
        let patch = search.mesh.patches().get(index as usize);
        for (k, p) in patch.points.iter().enumerate() {
            let (a, b) = (point(search.q_start, *p), point(search.q_end, *p));
            self.start[k] = a;
            self.travel[k] = norm(sub(b, a));
            self.points[k] = Aabb::of_points(&[a, b]);
            self.single[k] = Single {
                min: search.single(self.points[k].min),
                max: search.single(self.points[k].max),
                start: search.single(a),
                travel: self.travel[k] as f32,
            };
        }
        for (group, ends) in self.edges.iter_mut().zip(patch.ends.chunks(8)) {
            group.set(ends, &self.single);
        }
        let filled = patch.ends.len().div_ceil(8);
        self.edges[filled..].iter_mut().for_each(|g| g.used = 0);
        self.triangles.set(patch.corners, &self.single);
    }

    /// Two points, each in four lanes: boxes, places, lengths of their ways.
    #[inline]
    pub fn two_points(&self, i: usize, j: usize) -> (Boxes, Lanes3, f32x8) {
        let [a, b] = [i, j].map(|i| &self.single[i]);
        let two = |a: f32, b: f32| f32x8::from([a, a, a, a, b, b, b, b]);
        let each = |a: [f32; 3], b: [f32; 3]| [two(a[0], b[0]), two(a[1], b[1]), two(a[2], b[2])];
        let boxes = Boxes {
            min: each(a.min, b.min),
            max: each(a.max, b.max),
        };
        (boxes, each(a.start, b.start), two(a.travel, b.travel))
    }

    /// Box of the way of edge `ends`.
    pub fn edge_box(&self, ends: [u8; 2]) -> Aabb {
        let [a, b] = ends.map(|k| &self.points[k as usize]);
        a.merge(b)
    }

    /// Box of the way of triangle `corners`.
    pub fn triangle_box(&self, corners: [u8; 3]) -> Aabb {
        let [a, b, c] = corners.map(|k| &self.points[k as usize]);
        a.merge(b).merge(c)
    }
}

impl Edges {
    fn set(&mut self, ends: &[[u8; 2]], points: &[Single; PATCH_POINTS]) {
        let [mut min, mut max, mut from, mut way] = [[[0.0_f32; 8]; 3]; 4];
        let mut travel = [0.0; 8];
        for (lane, end) in ends.iter().enumerate() {
            let [a, b] = end.map(|k| &points[k as usize]);
            for k in 0..3 {
                min[k][lane] = a.min[k].min(b.min[k]);
                max[k][lane] = a.max[k].max(b.max[k]);
                from[k][lane] = a.start[k];
                way[k][lane] = b.start[k] - a.start[k];
            }
            travel[lane] = a.travel.max(b.travel);
        }
        self.boxes = Boxes {
            min: min.map(f32x8::from),
            max: max.map(f32x8::from),
        };
        self.segments = Segments {
            from: from.map(f32x8::from),
            way: way.map(f32x8::from),
        };
        self.travel = f32x8::from(travel);
        self.used = (1 << ends.len()) - 1;
    }

    /// The box of one lane in all.
    #[inline]
    pub fn box_of(&self, lane: usize) -> Boxes {
        Boxes {
            min: splat(&self.boxes.min, lane),
            max: splat(&self.boxes.max, lane),
        }
    }

    /// The segment of one lane in all, and its travel.
    #[inline]
    pub fn segment(&self, lane: usize) -> (Segments, f32x8) {
        let segments = Segments {
            from: splat(&self.segments.from, lane),
            way: splat(&self.segments.way, lane),
        };
        (segments, f32x8::splat(self.travel.as_array()[lane]))
    }
}

#[inline]
fn splat(x: &Lanes3, lane: usize) -> Lanes3 {
    let one = |x: &f32x8| f32x8::splat(x.as_array()[lane]);
    [one(&x[0]), one(&x[1]), one(&x[2])]
}

impl Corners {
    fn set(&mut self, corners: &[[u8; 3]], points: &[Single; PATCH_POINTS]) {
        let [mut min, mut max] = [[[0.0_f32; 8]; 3]; 2];
        let mut x = [[[0.0_f32; 8]; 3]; 3];
        let mut travel = [0.0_f32; 8];
        self.used = 0;
        for (lane, c) in corners.iter().enumerate() {
            let c = c.map(|k| &points[k as usize]);
            for lane in [lane, lane + 4] {
                for k in 0..3 {
                    min[k][lane] = c[0].min[k].min(c[1].min[k]).min(c[2].min[k]);
                    max[k][lane] = c[0].max[k].max(c[1].max[k]).max(c[2].max[k]);
                    for (x, c) in x.iter_mut().zip(&c) {
                        x[k][lane] = c.start[k];
                    }
                }
                travel[lane] = c[0].travel.max(c[1].travel).max(c[2].travel);
                self.used |= 1 << lane;
            }
        }
        self.boxes = Boxes {
            min: min.map(f32x8::from),
            max: max.map(f32x8::from),
        };
        self.triangles.corners = x.map(|x| x.map(f32x8::from));
        self.travel = f32x8::from(travel);
    }
}
