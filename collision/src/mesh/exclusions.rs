use std::collections::BTreeMap;

use super::incidence;
use super::neighbours::Neighbours;

/// Pairs that never make a contact although they share no point.
///
/// Nearly always almost empty: a mesh whose thickness is below a quarter of
/// its shortest edge has only the surroundings of its links in here.
#[derive(Clone, Debug)]
pub(crate) struct Exclusions {
    /// Sorted, both directions of every link.
    links: Vec<[u32; 2]>,
    linked: Bits,
    /// Sorted `(vertex, triangle)` pairs close on the rest surface.
    vertex_triangle: Vec<[u32; 2]>,
    close_vertices: Bits,
    /// Sorted `(lower edge, higher edge)` pairs close on the rest surface.
    edge_edge: Vec<[u32; 2]>,
    close_edges: Bits,
    /// Points joined by a short way along segments.
    pub near: Neighbours,
}

impl Exclusions {
    pub(crate) fn new(
        points: usize,
        triangles: &[[u32; 3]],
        edges: &[[u32; 2]],
        lengths: &[[f64; 3]],
        links: &[[u32; 2]],
        radius: f64,
    ) -> Self {
        let mut both: Vec<[u32; 2]> = links
            .iter()
            .filter(|l| l[0] != l[1])
            .flat_map(|l| [*l, [l[1], l[0]]])
            .collect();
        both.sort_unstable();
        both.dedup();
        let mut linked = Bits::new(points);
        both.iter().for_each(|l| linked.set(l[0]));
        let mut out = Self {
            links: both,
            linked,
            vertex_triangle: Vec::new(),
            close_vertices: Bits::new(points),
            edge_edge: Vec::new(),
            close_edges: Bits::new(edges.len()),
            near: Neighbours::default(),
        };
        out.add_close(points, triangles, edges, lengths, radius);
        out
    }

    /// Whether a point is linked to another.
    #[inline]
    fn joins(&self, a: u32, b: u32) -> bool {
        self.linked.get(a) && self.links.binary_search(&[a, b]).is_ok()
    }

    #[inline]
    pub(crate) fn vertex_triangle(&self, v: u32, t: u32, corners: [u32; 3]) -> bool {
        (self.linked.get(v) && corners.iter().any(|c| self.joins(v, *c)))
            || (self.close_vertices.get(v) && self.vertex_triangle.binary_search(&[v, t]).is_ok())
    }

    #[inline]
    pub(crate) fn edge_edge(&self, a: u32, b: u32, ea: [u32; 2], eb: [u32; 2]) -> bool {
        ea.iter()
            .any(|p| self.linked.get(*p) && eb.iter().any(|r| self.joins(*p, *r)))
            || (self.close_edges.get(a)
                && self.edge_edge.binary_search(&[a.min(b), a.max(b)]).is_ok())
            || self.near.join(ea, eb)
    }

    pub(crate) fn heap_bytes(&self) -> usize {
        8 * (self.links.len() + self.vertex_triangle.len() + self.edge_edge.len())
            + self.linked.heap_bytes()
            + self.close_vertices.heap_bytes()
            + self.close_edges.heap_bytes()
            + self.near.heap_bytes()
    }

    /// Adds pairs of edges.
    pub(crate) fn add_edges(&mut self, pairs: impl Iterator<Item = [u32; 2]>) {
        for [a, b] in pairs {
            self.close_edges.set(a);
            self.close_edges.set(b);
            self.edge_edge.push([a.min(b), a.max(b)]);
        }
        self.edge_edge.sort_unstable();
        self.edge_edge.dedup();
        self.edge_edge.shrink_to_fit();
    }

    /// Finds the pairs within `radius` on the rest surface, point by point.
    fn add_close(
        &mut self,
        points: usize,
        triangles: &[[u32; 3]],
        edges: &[[u32; 2]],
        lengths: &[[f64; 3]],
        radius: f64,
    ) {
        let (start, around) = incidence(points, triangles);
        let around = |p: u32| &around[start[p as usize] as usize..start[p as usize + 1] as usize];
        let mut edges_at: Vec<[u32; 2]> = Vec::with_capacity(2 * edges.len());
        for (e, ends) in edges.iter().enumerate() {
            edges_at.extend(ends.map(|p| [p, e as u32]));
        }
        edges_at.sort_unstable();
        let edges_of = |p: u32| {
            let from = edges_at.partition_point(|x| x[0] < p);
            edges_at[from..]
                .iter()
                .take_while(move |x| x[0] == p)
                .map(|x| x[1])
        };

        // Sparse: nearly every point reaches nothing but itself.
        let reaches_out = |p: u32| {
            self.linked.get(p)
                || around(p).iter().any(|t| {
                    let (i, l) = (corner(&triangles[*t as usize], p), &lengths[*t as usize]);
                    l[i] < radius || l[(i + 2) % 3] < radius || height(l, i) < radius
                })
        };
        let seeds: Vec<u32> = (0..points as u32).filter(|p| reaches_out(*p)).collect();
        for p in seeds {
            let near = self.neighbourhood(p, triangles, lengths, &around, radius);
            let mut close_triangles = Vec::new();
            let mut close_edges = Vec::new();
            for (&(x, _), &d) in &near {
                close_triangles.extend_from_slice(around(x));
                close_edges.extend(edges_of(x));
                // Across a triangle to its far edge, and what lies behind it.
                for &t in around(x) {
                    let c = &triangles[t as usize];
                    let i = corner(c, x);
                    if d + height(&lengths[t as usize], i) >= radius {
                        continue;
                    }
                    let far = [c[(i + 1) % 3], c[(i + 2) % 3]];
                    let behind = around(far[0])
                        .iter()
                        .filter(|t| triangles[**t as usize].contains(&far[1]));
                    close_triangles.extend(behind);
                    close_edges
                        .extend(edges_of(far[0]).filter(|e| edges[*e as usize].contains(&far[1])));
                }
            }
            for t in close_triangles {
                if !triangles[t as usize].contains(&p) {
                    self.close_vertices.set(p);
                    self.vertex_triangle.push([p, t]);
                }
            }
            for a in edges_of(p) {
                for &b in &close_edges {
                    let (ea, eb) = (edges[a as usize], edges[b as usize]);
                    if !ea.contains(&eb[0]) && !ea.contains(&eb[1]) {
                        self.close_edges.set(a);
                        self.close_edges.set(b);
                        self.edge_edge.push([a.min(b), a.max(b)]);
                    }
                }
            }
        }
        self.vertex_triangle.sort_unstable();
        self.vertex_triangle.dedup();
        self.edge_edge.sort_unstable();
        self.edge_edge.dedup();
        self.vertex_triangle.shrink_to_fit();
        self.edge_edge.shrink_to_fit();
    }

    /// Points within `radius` of `p` along edges, and whether a link was
    /// crossed: a second one is not, or a seam with several links to a point
    /// would shrink to nothing.
    fn neighbourhood<'a>(
        &self,
        p: u32,
        triangles: &[[u32; 3]],
        lengths: &[[f64; 3]],
        around: &impl Fn(u32) -> &'a [u32],
        radius: f64,
    ) -> BTreeMap<(u32, bool), f64> {
        let mut found = BTreeMap::from([((p, false), 0.0)]);
        let mut open = vec![(p, false)];
        // Label correcting: the set is tiny.
        while let Some((x, crossed)) = open.pop() {
            let d = found[&(x, crossed)];
            let mut relax = |key: (u32, bool), to: f64| {
                if to < radius && found.get(&key).is_none_or(|old| to < *old) {
                    found.insert(key, to);
                    open.push(key);
                }
            };
            for &t in around(x) {
                let (c, l) = (&triangles[t as usize], &lengths[t as usize]);
                let i = corner(c, x);
                relax((c[(i + 1) % 3], crossed), d + l[i]);
                relax((c[(i + 2) % 3], crossed), d + l[(i + 2) % 3]);
            }
            if !crossed && self.linked.get(x) {
                let from = self.links.partition_point(|l| l[0] < x);
                for l in self.links[from..].iter().take_while(|l| l[0] == x) {
                    relax((l[1], true), d);
                }
            }
        }
        found
    }
}

fn corner(triangle: &[u32; 3], p: u32) -> usize {
    triangle.iter().position(|c| *c == p).unwrap_or(0)
}

/// Distance from corner `i` to the opposite side, within the triangle.
fn height(l: &[f64; 3], i: usize) -> f64 {
    let (next, opposite, last) = (l[i], l[(i + 1) % 3], l[(i + 2) % 3]);
    // An obtuse foot lies outside the side: then a corner is nearest.
    let beyond = |a: f64, b: f64| a * a > b * b + opposite * opposite;
    if opposite <= 0.0 || beyond(next, last) || beyond(last, next) {
        return next.min(last);
    }
    2.0 * super::areas::heron(l) / opposite
}

/// A set of small integers.
#[derive(Clone, Debug)]
struct Bits(Vec<u64>);

impl Bits {
    fn new(len: usize) -> Self {
        Self(vec![0; len.div_ceil(64)])
    }

    fn set(&mut self, i: u32) {
        self.0[i as usize / 64] |= 1 << (i % 64);
    }

    #[inline]
    fn get(&self, i: u32) -> bool {
        self.0[i as usize / 64] >> (i % 64) & 1 == 1
    }

    fn heap_bytes(&self) -> usize {
        8 * self.0.len()
    }
}
