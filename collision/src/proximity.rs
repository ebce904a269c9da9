use rayon::prelude::*;

use crate::mesh::{PATCH_EDGES, PATCH_POINTS, PATCH_TRIANGLES, Patch};
use crate::narrow::{closest_edge_edge, closest_point_triangle};
use crate::vec3::{Vec3, norm, point, sub};
use crate::{Aabb, BroadPhase, Candidates, CollisionBackend, CollisionError, CollisionMesh};

/// Patch pairs searched by one task.
const CHUNK: usize = 512;
/// Tasks whose results are held at a time, which bounds their memory.
const WAVE: usize = 64;

/// Discrete detection: the broad phase pairs small patches of triangles, and
/// each pair of patches is searched for primitives.
///
/// A candidate passes three tests: its swept boxes, grown by the reach, meet;
/// the mesh does not exclude it; its distance at `q_start` is at most the reach
/// plus the way that both primitives may go. Candidates are sorted, so they do
/// not depend on the broad phase, on earlier calls or on the number of
/// threads.
#[derive(Clone, Debug, Default)]
pub struct ProximityBackend<B> {
    broad_phase: B,
    boxes: Vec<Aabb>,
    pairs: Vec<[u32; 2]>,
    found: Vec<Candidates>,
    sorter: RowSorter,
}

impl<B: BroadPhase> ProximityBackend<B> {
    /// Detection on top of a broad phase.
    pub fn new(broad_phase: B) -> Self {
        Self {
            broad_phase,
            boxes: Vec::new(),
            pairs: Vec::new(),
            found: Vec::new(),
            sorter: RowSorter::default(),
        }
    }

    /// The broad phase.
    pub fn broad_phase(&self) -> &B {
        &self.broad_phase
    }

    /// Pairs of patches that the last broad phase gave.
    pub fn patch_pair_count(&self) -> usize {
        self.pairs.len()
    }
}

impl<B: BroadPhase> CollisionBackend for ProximityBackend<B> {
    fn name(&self) -> &str {
        self.broad_phase.name()
    }

    fn detect(
        &mut self,
        mesh: &CollisionMesh,
        q_start: &[f64],
        q_end: &[f64],
        reach: f64,
        out: &mut Candidates,
    ) -> Result<(), CollisionError> {
        out.clear();
        check_positions(mesh.points(), q_start)?;
        check_positions(mesh.points(), q_end)?;
        if !(reach >= 0.0 && reach.is_finite()) {
            return Err(CollisionError::Parameter {
                name: "reach",
                value: reach,
                requirement: "finite and not negative",
            });
        }
        let patches = mesh.patches();
        let inflate = 0.5 * reach;
        (0..patches.len())
            .into_par_iter()
            .with_min_len(1024)
            .map(|i| {
                let mut b = Aabb::EMPTY;
                for p in patches.get(i).points {
                    b.include(point(q_start, *p));
                    b.include(point(q_end, *p));
                }
                b.inflate(inflate)
            })
            .collect_into_vec(&mut self.boxes);
        self.broad_phase.overlaps(&self.boxes, &mut self.pairs);
        self.sorter.sort(&mut self.pairs, patches.len());

        let search = Search {
            mesh,
            q_start,
            q_end,
            reach,
        };
        if self.found.is_empty() {
            self.found.resize_with(WAVE, Candidates::default);
        }
        // Patches against themselves first, then the pairs of patches.
        let selves = patches.len().div_ceil(CHUNK);
        let tasks = selves + self.pairs.len().div_ceil(CHUNK);
        for wave in (0..tasks).step_by(WAVE) {
            let count = WAVE.min(tasks - wave);
            let pairs = &self.pairs;
            self.found[..count]
                .par_iter_mut()
                .enumerate()
                .for_each(|(k, found)| {
                    found.clear();
                    let task = wave + k;
                    if task < selves {
                        let from = task * CHUNK;
                        for p in from..(from + CHUNK).min(patches.len()) {
                            search.within(&Swept::new(&search, p), found);
                        }
                    } else {
                        let from = (task - selves) * CHUNK;
                        search.between(&pairs[from..(from + CHUNK).min(pairs.len())], found);
                    }
                });
            for found in &self.found[..count] {
                out.vertex_triangle
                    .extend_from_slice(&found.vertex_triangle);
                out.edge_edge.extend_from_slice(&found.edge_edge);
            }
        }
        self.sorter.sort(&mut out.vertex_triangle, mesh.points());
        self.sorter.sort(&mut out.edge_edge, mesh.edges().len());
        Ok(())
    }

    fn heap_bytes(&self) -> usize {
        let found: usize = self
            .found
            .iter()
            .map(|f| 8 * (f.vertex_triangle.capacity() + f.edge_edge.capacity()))
            .sum();
        self.broad_phase.heap_bytes()
            + self.boxes.capacity() * size_of::<Aabb>()
            + self.pairs.capacity() * 8
            + found
            + self.sorter.heap_bytes()
    }
}

/// Checks length and finiteness of the positions of `points` points.
pub(crate) fn check_positions(points: usize, q: &[f64]) -> Result<(), CollisionError> {
    if q.len() < 3 * points {
        let (found, expected) = (q.len(), 3 * points);
        return Err(CollisionError::Length {
            what: "positions",
            found,
            expected,
        });
    }
    match q[..3 * points].iter().position(|c| !c.is_finite()) {
        Some(i) => Err(CollisionError::NotFinitePosition { point: i / 3 }),
        None => Ok(()),
    }
}

struct Search<'a> {
    mesh: &'a CollisionMesh,
    q_start: &'a [f64],
    q_end: &'a [f64],
    reach: f64,
}

/// Swept primitives of one patch, on the stack.
struct Swept<'a> {
    patch: Patch<'a>,
    start: [Vec3; PATCH_POINTS],
    travel: [f64; PATCH_POINTS],
    points: [Aabb; PATCH_POINTS],
    triangles: [Aabb; PATCH_TRIANGLES],
    edges: [Aabb; PATCH_EDGES],
    all: Aabb,
}

impl<'a> Swept<'a> {
    fn new(search: &Search<'a>, index: usize) -> Self {
        let patch = search.mesh.patches().get(index);
        let mut s = Self {
            patch,
            start: [[0.0; 3]; PATCH_POINTS],
            travel: [0.0; PATCH_POINTS],
            points: [Aabb::EMPTY; PATCH_POINTS],
            triangles: [Aabb::EMPTY; PATCH_TRIANGLES],
            edges: [Aabb::EMPTY; PATCH_EDGES],
            all: Aabb::EMPTY,
        };
        for (k, p) in s.patch.points.iter().enumerate() {
            let (a, b) = (point(search.q_start, *p), point(search.q_end, *p));
            s.start[k] = a;
            s.travel[k] = norm(sub(b, a));
            s.points[k] = Aabb::of_points(&[a, b]);
            s.all = s.all.merge(&s.points[k]);
        }
        for (k, c) in s.patch.corners.iter().enumerate() {
            let [a, b, c] = c.map(|c| s.points[c as usize]);
            s.triangles[k] = a.merge(&b).merge(&c);
        }
        for (k, e) in s.patch.ends.iter().enumerate() {
            let [a, b] = e.map(|c| s.points[c as usize]);
            s.edges[k] = a.merge(&b);
        }
        s
    }
}

impl<'a> Search<'a> {
    fn between(&self, pairs: &[[u32; 2]], found: &mut Candidates) {
        let mut held: Option<(u32, Swept<'a>)> = None;
        for &[a, b] in pairs {
            let first = match held.take() {
                Some((i, swept)) if i == a => swept,
                _ => Swept::new(self, a as usize),
            };
            let second = Swept::new(self, b as usize);
            self.vertices(&first, &second, found);
            self.vertices(&second, &first, found);
            self.edges(&first, &second, found);
            held = Some((a, first));
        }
    }

    fn within(&self, a: &Swept<'_>, found: &mut Candidates) {
        self.vertices(a, a, found);
        for i in 0..a.patch.ends.len() {
            let b = a.edges[i].inflate(self.reach);
            for j in 0..i {
                if b.overlaps(&a.edges[j]) {
                    self.edge_edge(a, i, a, j, found);
                }
            }
        }
    }

    /// Vertices owned by `a` against triangles of `b`.
    fn vertices(&self, a: &Swept<'_>, b: &Swept<'_>, found: &mut Candidates) {
        for i in 0..a.patch.owned {
            let reach = a.points[i].inflate(self.reach);
            if !reach.overlaps(&b.all) {
                continue;
            }
            let v = a.patch.points[i];
            for (k, c) in b.patch.corners.iter().enumerate() {
                if !reach.overlaps(&b.triangles[k]) {
                    continue;
                }
                let t = b.patch.triangles[k];
                if self.mesh.excludes_vertex_triangle(v, t) {
                    continue;
                }
                let [x, y, z] = c.map(|c| c as usize);
                let closest =
                    closest_point_triangle(&[a.start[i], b.start[x], b.start[y], b.start[z]]);
                let way = a.travel[i] + b.travel[x].max(b.travel[y]).max(b.travel[z]);
                if self.near(closest.distance, way) {
                    found.vertex_triangle.push([v, t]);
                }
            }
        }
    }

    /// Edges owned by `a` against those owned by `b`.
    fn edges(&self, a: &Swept<'_>, b: &Swept<'_>, found: &mut Candidates) {
        for i in 0..a.patch.ends.len() {
            let reach = a.edges[i].inflate(self.reach);
            if !reach.overlaps(&b.all) {
                continue;
            }
            for j in 0..b.patch.ends.len() {
                if reach.overlaps(&b.edges[j]) {
                    self.edge_edge(a, i, b, j, found);
                }
            }
        }
    }

    #[inline]
    fn edge_edge(&self, a: &Swept<'_>, i: usize, b: &Swept<'_>, j: usize, found: &mut Candidates) {
        let (ea, eb) = (a.patch.first_edge + i as u32, b.patch.first_edge + j as u32);
        if self.mesh.excludes_edge_edge(ea, eb) {
            return;
        }
        let [a0, a1] = a.patch.ends[i].map(|k| k as usize);
        let [b0, b1] = b.patch.ends[j].map(|k| k as usize);
        // The order of the pair decides its orientation.
        let (low, high) = (ea.min(eb), ea.max(eb));
        let closest = closest_edge_edge(&[a.start[a0], a.start[a1], b.start[b0], b.start[b1]]);
        let way = a.travel[a0].max(a.travel[a1]) + b.travel[b0].max(b.travel[b1]);
        if self.near(closest.distance, way) {
            found.edge_edge.push([low, high]);
        }
    }

    /// The last test, with room for rounding.
    #[inline]
    fn near(&self, distance: f64, way: f64) -> bool {
        distance.abs() <= (self.reach + way) * (1.0 + 1e-9)
    }
}

/// Sorts pairs by counting their first index, then row by row: linear time for
/// the short rows that meshes give.
#[derive(Clone, Debug, Default)]
struct RowSorter {
    next: Vec<u32>,
    sorted: Vec<[u32; 2]>,
}

impl RowSorter {
    fn sort(&mut self, pairs: &mut Vec<[u32; 2]>, rows: usize) {
        if pairs.len() > u32::MAX as usize {
            pairs.sort_unstable();
            return;
        }
        self.next.clear();
        self.next.resize(rows + 1, 0);
        for p in pairs.iter() {
            self.next[p[0] as usize + 1] += 1;
        }
        for i in 0..rows {
            self.next[i + 1] += self.next[i];
        }
        self.sorted.clear();
        self.sorted.resize(pairs.len(), [0; 2]);
        for p in pairs.iter() {
            let slot = &mut self.next[p[0] as usize];
            self.sorted[*slot as usize] = *p;
            *slot += 1;
        }
        let mut from = 0;
        for end in &self.next[..rows] {
            let end = *end as usize;
            self.sorted[from..end].sort_unstable();
            from = end;
        }
        std::mem::swap(pairs, &mut self.sorted);
    }

    fn heap_bytes(&self) -> usize {
        4 * self.next.capacity() + 8 * self.sorted.capacity()
    }
}
