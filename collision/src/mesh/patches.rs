/// Triangles of a patch at most. Four keep the tree at a quarter of its size
/// and are still compact.
pub(crate) const PATCH_TRIANGLES: usize = 4;
/// Points of a patch at most: it grows across edges.
pub(crate) const PATCH_POINTS: usize = PATCH_TRIANGLES + 2;
/// Edges of a patch at most.
pub(crate) const PATCH_EDGES: usize = 2 * PATCH_TRIANGLES + 1;

/// Small groups of adjacent triangles, or of consecutive edges: the leaves of the
/// broad phase.
///
/// With triangles every point and every edge is owned by one patch, so that a pair of
/// primitives is met in one pair of patches. Points of a patch are listed with
/// the owned ones first; triangles and owned edges refer to that list by
/// position.
#[derive(Clone, Debug, Default)]
pub(crate) struct Patches {
    triangle_start: Vec<u32>,
    point_start: Vec<u32>,
    edge_start: Vec<u32>,
    owned: Vec<u8>,
    triangles: Vec<u32>,
    corners: Vec<[u8; 3]>,
    points: Vec<u32>,
    ends: Vec<[u8; 2]>,
}

/// One patch.
pub(crate) struct Patch<'a> {
    pub triangles: &'a [u32],
    /// Positions in `points`, per triangle.
    pub corners: &'a [[u8; 3]],
    pub points: &'a [u32],
    /// How many of `points` are owned.
    pub owned: usize,
    /// Number of the first owned edge; the others follow.
    pub first_edge: u32,
    /// Positions in `points`, per owned edge, in the order of the edge.
    pub ends: &'a [[u8; 2]],
}

impl Patches {
    /// Groups triangles in their order and numbers the edges by patch.
    pub(crate) fn new(points: usize, triangles: &[[u32; 3]]) -> (Vec<[u32; 2]>, Self) {
        let sides = Sides::new(triangles);
        let mut edges = Vec::with_capacity(3 * triangles.len() / 2);
        let mut out = Self::default();
        out.close(0);
        let mut taken = vec![false; triangles.len()];
        let mut point_owned = vec![false; points];
        let mut edge_owned = vec![false; sides.edges.len()];
        let mut group: Vec<u32> = Vec::with_capacity(PATCH_TRIANGLES);
        for seed in 0..triangles.len() {
            if taken[seed] {
                continue;
            }
            group.clear();
            group.push(seed as u32);
            taken[seed] = true;
            while group.len() < PATCH_TRIANGLES {
                let Some(next) = sides.best_neighbour(&group, triangles, &taken) else {
                    break;
                };
                taken[next as usize] = true;
                group.push(next);
            }
            out.add(
                &group,
                triangles,
                &sides,
                &mut point_owned,
                &mut edge_owned,
                &mut edges,
            );
        }
        (edges, out)
    }

    /// Groups of consecutive edges that share points, in their order. Without
    /// triangles nobody looks for points: none is owned.
    pub(crate) fn of_edges(edges: &[[u32; 2]]) -> Self {
        let mut out = Self::default();
        out.close(0);
        let mut first = 0;
        for (e, ends) in edges.iter().enumerate() {
            let before = out.edge_start[out.edge_start.len() - 1] as usize;
            let fresh = |out: &Self| {
                let known = |p: &&u32| out.points[first..].contains(*p);
                2 - ends.iter().filter(known).count()
            };
            let full = |out: &Self| {
                e - before == PATCH_EDGES || out.points.len() - first + fresh(out) > PATCH_POINTS
            };
            if e > before && (fresh(&out) == 2 || full(&out)) {
                out.close_group(e);
                first = out.points.len();
            }
            let local = ends.map(|p| {
                let found = out.points[first..].iter().position(|x| *x == p);
                found.unwrap_or_else(|| {
                    out.points.push(p);
                    out.points.len() - 1 - first
                }) as u8
            });
            out.ends.push(local);
        }
        if !edges.is_empty() {
            out.close_group(edges.len());
        }
        out
    }

    fn close_group(&mut self, edges: usize) {
        self.owned.push(0);
        self.close(edges);
    }

    fn add(
        &mut self,
        group: &[u32],
        triangles: &[[u32; 3]],
        sides: &Sides,
        point_owned: &mut [bool],
        edge_owned: &mut [bool],
        edges: &mut Vec<[u32; 2]>,
    ) {
        let first = self.points.len();
        for owned in [true, false] {
            for p in group.iter().flat_map(|t| triangles[*t as usize]) {
                if self.points[first..].contains(&p) {
                    continue;
                }
                if !owned || !std::mem::replace(&mut point_owned[p as usize], true) {
                    self.points.push(p);
                }
            }
            if owned {
                self.owned.push((self.points.len() - first) as u8);
            }
        }
        let list = &self.points[first..];
        let local = |p: u32| list.iter().position(|q| *q == p).unwrap_or(0) as u8;
        for &t in group {
            self.triangles.push(t);
            self.corners.push(triangles[t as usize].map(local));
            for e in sides.of[t as usize] {
                if !std::mem::replace(&mut edge_owned[e as usize], true) {
                    let ends = sides.edges[e as usize];
                    self.ends.push(ends.map(local));
                    edges.push(ends);
                }
            }
        }
        self.close(edges.len());
    }

    fn close(&mut self, edges: usize) {
        self.triangle_start.push(self.triangles.len() as u32);
        self.point_start.push(self.points.len() as u32);
        self.edge_start.push(edges as u32);
    }

    pub(crate) fn len(&self) -> usize {
        self.owned.len()
    }

    #[inline]
    pub(crate) fn get(&self, i: usize) -> Patch<'_> {
        let range = |s: &[u32]| s[i] as usize..s[i + 1] as usize;
        let triangles = range(&self.triangle_start);
        Patch {
            corners: &self.corners[triangles.clone()],
            triangles: &self.triangles[triangles],
            points: &self.points[range(&self.point_start)],
            owned: self.owned[i] as usize,
            first_edge: self.edge_start[i],
            ends: &self.ends[range(&self.edge_start)],
        }
    }

    pub(crate) fn heap_bytes(&self) -> usize {
        4 * (self.triangle_start.len() + self.point_start.len() + self.edge_start.len())
            + self.owned.len()
            + 7 * self.triangles.len()
            + 4 * self.points.len()
            + 2 * self.ends.len()
    }
}

/// Edges, and which triangles meet at them.
struct Sides {
    /// Edge of each side of each triangle.
    of: Vec<[u32; 3]>,
    edges: Vec<[u32; 2]>,
    /// Triangles at each edge, in compressed rows: more than two are allowed.
    start: Vec<u32>,
    at: Vec<u32>,
}

impl Sides {
    fn new(triangles: &[[u32; 3]]) -> Self {
        let mut all: Vec<([u32; 2], u32)> = Vec::with_capacity(3 * triangles.len());
        for (t, c) in triangles.iter().enumerate() {
            for i in 0..3 {
                let (a, b) = (c[i], c[(i + 1) % 3]);
                all.push(([a.min(b), a.max(b)], (3 * t + i) as u32));
            }
        }
        all.sort_unstable();
        let mut of = vec![[0; 3]; triangles.len()];
        let (mut edges, mut start, mut at) = (Vec::new(), vec![0], Vec::new());
        for run in all.chunk_by(|a, b| a.0 == b.0) {
            for (_, side) in run {
                of[*side as usize / 3][*side as usize % 3] = edges.len() as u32;
                at.push(side / 3);
            }
            edges.push(run[0].0);
            start.push(at.len() as u32);
        }
        Self {
            of,
            edges,
            start,
            at,
        }
    }

    /// The free triangle across an edge of the group with the most corners in
    /// it; the lowest of equals.
    fn best_neighbour(&self, group: &[u32], tri: &[[u32; 3]], taken: &[bool]) -> Option<u32> {
        let shared = |t: u32| {
            let held = |p: &u32| group.iter().any(|g| tri[*g as usize].contains(p));
            tri[t as usize].iter().filter(|p| held(p)).count()
        };
        group
            .iter()
            .flat_map(|g| self.of[*g as usize])
            .flat_map(|e| {
                let e = e as usize;
                &self.at[self.start[e] as usize..self.start[e + 1] as usize]
            })
            .copied()
            .filter(|t| !taken[*t as usize])
            .max_by_key(|t| (shared(*t), std::cmp::Reverse(*t)))
    }
}
