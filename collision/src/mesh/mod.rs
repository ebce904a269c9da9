//! The surface that collides with itself.

mod areas;
mod exclusions;
mod neighbours;
mod patches;
mod segments;

pub(crate) use patches::{PATCH_EDGES, PATCH_POINTS, Patch, Patches};

pub use segments::{Joined, Segment};

use areas::{edge_areas, voronoi_area};

use crate::error::check_length;
use crate::narrow::PairKind;
use crate::vec3::{Vec3, cross, dot, norm, point, sub, unit};
use crate::{CollisionError, mesh::exclusions::Exclusions};

/// Points, triangles and edges of all cloth, with the pairs that never count
/// as a contact. [`from_segments`](Self::from_segments) makes one of edges alone.
///
/// With triangles, excluded are pairs of a vertex and a triangle, or of two edges, that
///
/// - share a point,
/// - are joined by a link (a seam spring, a button): a point of one is linked
///   to a point of the other,
/// - lie within 1.5 thicknesses of each other on the rest surface, where
///   keeping them apart would strain the cloth itself.
///
/// The distance on the rest surface is measured along mesh edges, and across
/// a triangle from a corner to the opposite edge; it crosses one link at most.
/// It never underestimates.
///
/// Edges are numbered by the mesh, in an order of its own: see
/// [`edges`](Self::edges).
#[derive(Clone, Debug)]
pub struct CollisionMesh {
    points: usize,
    triangles: Vec<[u32; 3]>,
    edges: Vec<[u32; 2]>,
    patches: Patches,
    exclusions: Exclusions,
    components: Vec<u32>,
    around_start: Vec<u32>,
    around: Vec<u32>,
    point_area: Vec<f32>,
    edge_area: Vec<f32>,
    /// Radii of segments [m]; empty where all edges keep the thickness.
    edge_radius: Vec<f32>,
    shortest_edge: f64,
    thickness: f64,
}

impl CollisionMesh {
    /// A mesh from the rest shape of every triangle, given as plane
    /// coordinates of its corners \[m\] in a frame of its own: the material
    /// coordinates of a cloth mesh. `links` are pairs of joined points,
    /// `thickness` is the distance at which contact begins \[m\].
    ///
    /// # Errors
    /// [`CollisionError::Length`] when `rest` and `triangles` differ in
    /// length, [`CollisionError::PointOutOfRange`] and
    /// [`CollisionError::RepeatedPoint`] for a bad index,
    /// [`CollisionError::Parameter`] when the thickness is not positive and
    /// finite, [`CollisionError::TooMany`] beyond 2³⁰ points or triangles.
    pub fn new(
        points: usize,
        triangles: Vec<[u32; 3]>,
        rest: &[[[f64; 2]; 3]],
        links: &[[u32; 2]],
        thickness: f64,
    ) -> Result<Self, CollisionError> {
        check_length("rest triangles", rest.len(), triangles.len())?;
        let lengths: Vec<[f64; 3]> = rest
            .iter()
            .map(|c| {
                std::array::from_fn(|i| {
                    let (a, b) = (c[i], c[(i + 1) % 3]);
                    (b[0] - a[0]).hypot(b[1] - a[1])
                })
            })
            .collect();
        Self::from_lengths(points, triangles, &lengths, links, thickness)
    }

    /// A mesh whose given positions (`x y z` of every point, \[m\]) are its rest
    /// shape.
    ///
    /// # Errors
    /// As [`new`](Self::new); [`CollisionError::Length`] when `positions` is
    /// not a multiple of three long.
    pub fn from_positions(
        positions: &[f64],
        triangles: Vec<[u32; 3]>,
        links: &[[u32; 2]],
        thickness: f64,
    ) -> Result<Self, CollisionError> {
        let points = positions.len() / 3;
        if !positions.len().is_multiple_of(3) {
            let (found, expected) = (positions.len(), 3 * points);
            return Err(CollisionError::Length {
                what: "positions",
                found,
                expected,
            });
        }
        check(points, &triangles)?;
        let lengths: Vec<[f64; 3]> = triangles
            .iter()
            .map(|t| {
                let x = t.map(|i| point(positions, i));
                std::array::from_fn(|i| norm(sub(x[(i + 1) % 3], x[i])))
            })
            .collect();
        Self::from_lengths(points, triangles, &lengths, links, thickness)
    }

    /// `lengths[t][i]`: rest length from corner `i` to the next.
    fn from_lengths(
        points: usize,
        triangles: Vec<[u32; 3]>,
        lengths: &[[f64; 3]],
        links: &[[u32; 2]],
        thickness: f64,
    ) -> Result<Self, CollisionError> {
        check(points, &triangles)?;
        check_positive("thickness", thickness)?;
        for (index, pair) in links.iter().enumerate() {
            if let Some(&point) = pair.iter().find(|p| **p as usize >= points) {
                let what = "link";
                return Err(CollisionError::PointOutOfRange {
                    what,
                    index,
                    point,
                    points,
                });
            }
        }
        let (around_start, around) = incidence(points, &triangles);
        let (edges, patches) = Patches::new(points, &triangles);
        let exclusions =
            Exclusions::new(points, &triangles, &edges, lengths, links, 1.5 * thickness);
        let components = components(points, &edges);
        let mut point_area = vec![0.0; points];
        for (t, l) in triangles.iter().zip(lengths) {
            for i in 0..3 {
                point_area[t[i] as usize] += voronoi_area(l, i) as f32;
            }
        }
        let edge_area = edge_areas(&edges, &triangles, lengths);
        let shortest_edge = lengths
            .iter()
            .flatten()
            .copied()
            .fold(f64::INFINITY, f64::min);
        Ok(Self {
            points,
            triangles,
            edges,
            patches,
            exclusions,
            components,
            around_start,
            around,
            point_area,
            edge_area,
            edge_radius: Vec::new(),
            shortest_edge,
            thickness,
        })
    }

    /// Number of points, those in no triangle included.
    pub fn points(&self) -> usize {
        self.points
    }

    /// Triangles as given.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Edges, each once; those of triangles with the lower point first.
    pub fn edges(&self) -> &[[u32; 2]] {
        &self.edges
    }

    /// Distance at which contact begins, the largest of any pair \[m\].
    pub fn thickness(&self) -> f64 {
        self.thickness
    }

    /// Shortest rest edge \[m\]; infinite without triangles.
    pub fn shortest_edge(&self) -> f64 {
        self.shortest_edge
    }

    /// How far points may drift before a search is worth repeating \[m\]: a quarter
    /// of the shortest edge of triangles, of the thickness of segments, which
    /// may be as short as they like.
    pub(crate) fn longest_drift(&self) -> f64 {
        match self.triangles.is_empty() {
            true => 0.25 * self.thickness,
            false => 0.25 * self.shortest_edge,
        }
    }

    /// By how much less than the thickness a pair keeps \[m\]: two segments keep
    /// the sum of their radii.
    #[inline]
    pub(crate) fn spare(&self, kind: PairKind, pair: [u32; 2]) -> f64 {
        if self.edge_radius.is_empty() || kind == PairKind::VertexTriangle {
            return 0.0;
        }
        let [a, b] = pair.map(|e| f64::from(self.edge_radius[e as usize]));
        (self.thickness - a - b).max(0.0)
    }

    /// Largest thickness that does not let neighbours interfere: a quarter of
    /// the shortest rest edge \[m\]. Warn when [`thickness`](Self::thickness) is
    /// above.
    pub fn recommended_thickness(&self) -> f64 {
        0.25 * self.shortest_edge
    }

    /// Rest area that belongs to a point \[m²\]: its (mixed) Voronoi region.
    pub fn point_area(&self, point: u32) -> f64 {
        self.point_area[point as usize].into()
    }

    /// Rest area that belongs to an edge \[m²\]: a third of its triangles.
    pub fn edge_area(&self, edge: u32) -> f64 {
        self.edge_area[edge as usize].into()
    }

    /// Whether a vertex and a triangle never make a contact.
    pub fn excludes_vertex_triangle(&self, vertex: u32, triangle: u32) -> bool {
        let t = self.triangles[triangle as usize];
        t.contains(&vertex) || self.exclusions.vertex_triangle(vertex, triangle, t)
    }

    /// Whether two edges never make a contact.
    pub fn excludes_edge_edge(&self, a: u32, b: u32) -> bool {
        let (ea, eb) = (self.edges[a as usize], self.edges[b as usize]);
        eb.contains(&ea[0]) || eb.contains(&ea[1]) || self.exclusions.edge_edge(a, b, ea, eb)
    }

    /// Heap memory held \[bytes\].
    pub fn heap_bytes(&self) -> usize {
        size_of_val(&self.triangles[..])
            + size_of_val(&self.edges[..])
            + 4 * (self.components.len() + self.around_start.len() + self.around.len())
            + 4 * (self.point_area.len() + self.edge_area.len() + self.edge_radius.len())
            + self.patches.heap_bytes()
            + self.exclusions.heap_bytes()
    }

    pub(crate) fn patches(&self) -> &Patches {
        &self.patches
    }

    /// Nodes of a vertex-triangle pair, in the order of its weights.
    #[inline]
    pub(crate) fn vertex_triangle_nodes(&self, pair: [u32; 2]) -> [u32; 4] {
        let t = self.triangles[pair[1] as usize];
        [pair[0], t[0], t[1], t[2]]
    }

    /// Nodes of an edge-edge pair, in the order of its weights.
    #[inline]
    pub(crate) fn edge_edge_nodes(&self, pair: [u32; 2]) -> [u32; 4] {
        let (a, b) = (self.edges[pair[0] as usize], self.edges[pair[1] as usize]);
        [a[0], a[1], b[0], b[1]]
    }

    /// A direction along which to part two features whose closest points
    /// coincide: from the second towards the first.
    ///
    /// It is the mean surface normal at the nodes, wound as on the feature of
    /// the lower component, which goes against it: all pairs of two sheets that
    /// lie in each other agree on who goes where. Segments go across both.
    pub(crate) fn separating_direction(
        &self,
        nodes: [u32; 4],
        first: [bool; 4],
        q: &[f64],
    ) -> Vec3 {
        if self.triangles.is_empty() {
            let x = nodes.map(|n| point(q, n));
            return segments::across(sub(x[1], x[0]), sub(x[3], x[2]));
        }
        let side = |want: bool| (0..4).filter(move |i| first[*i] == want).map(|i| nodes[i]);
        let rank = |want| side(want).map(|n| (self.components[n as usize], n)).min();
        let first_is_lower = rank(true) < rank(false);
        let mut mean = [0.0; 3];
        for n in side(first_is_lower).chain(side(!first_is_lower)) {
            if let Some(n) = self.point_normal(n, q) {
                let s = if dot(mean, n) < 0.0 { -1.0 } else { 1.0 };
                mean = std::array::from_fn(|i| mean[i] + s * n[i]);
            }
        }
        let n = unit(mean).unwrap_or([0.0, 0.0, 1.0]);
        if first_is_lower { n.map(|c| -c) } else { n }
    }

    fn point_normal(&self, i: u32, q: &[f64]) -> Option<Vec3> {
        let range = self.around_start[i as usize]..self.around_start[i as usize + 1];
        let mut sum = [0.0; 3];
        for &t in &self.around[range.start as usize..range.end as usize] {
            let x = self.triangles[t as usize].map(|i| point(q, i));
            let n = cross(sub(x[1], x[0]), sub(x[2], x[0]));
            sum = std::array::from_fn(|i| sum[i] + n[i]);
        }
        unit(sum)
    }
}

/// Pair keys keep one bit of each index for themselves.
fn check_count(what: &'static str, count: usize) -> Result<(), CollisionError> {
    if count > 1 << 30 {
        return Err(CollisionError::TooMany { what, count });
    }
    Ok(())
}

fn check_positive(name: &'static str, value: f64) -> Result<(), CollisionError> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(CollisionError::Parameter {
        name,
        value,
        requirement: "positive and finite",
    })
}

/// Points of an element exist, and none is named twice.
pub(crate) fn check_element(
    what: &'static str,
    index: usize,
    named: &[u32],
    points: usize,
) -> Result<(), CollisionError> {
    if let Some(&point) = named.iter().find(|p| **p as usize >= points) {
        return Err(CollisionError::PointOutOfRange {
            what,
            index,
            point,
            points,
        });
    }
    let again = |(i, p): &(usize, &u32)| named[i + 1..].contains(*p);
    match named.iter().enumerate().find(again) {
        Some((_, &point)) => Err(CollisionError::RepeatedPoint { what, index, point }),
        None => Ok(()),
    }
}

fn check(points: usize, triangles: &[[u32; 3]]) -> Result<(), CollisionError> {
    check_count("points", points)?;
    check_count("triangles", triangles.len())?;
    for (index, t) in triangles.iter().enumerate() {
        check_element("triangle", index, t, points)?;
    }
    Ok(())
}

/// Triangles around each point, in compressed rows.
pub(crate) fn incidence(points: usize, triangles: &[[u32; 3]]) -> (Vec<u32>, Vec<u32>) {
    let mut start = vec![0u32; points + 1];
    for p in triangles.iter().flatten() {
        start[*p as usize + 1] += 1;
    }
    for i in 0..points {
        start[i + 1] += start[i];
    }
    let mut next = start.clone();
    let mut items = vec![0; 3 * triangles.len()];
    for (t, corners) in triangles.iter().enumerate() {
        for p in corners {
            let slot = &mut next[*p as usize];
            items[*slot as usize] = t as u32;
            *slot += 1;
        }
    }
    (start, items)
}

/// Connected component of every point, numbered by its lowest point.
fn components(points: usize, edges: &[[u32; 2]]) -> Vec<u32> {
    let mut root: Vec<u32> = (0..points as u32).collect();
    fn find(root: &mut [u32], mut i: u32) -> u32 {
        while root[i as usize] != i {
            root[i as usize] = root[root[i as usize] as usize];
            i = root[i as usize];
        }
        i
    }
    for [a, b] in edges {
        let (a, b) = (find(&mut root, *a), find(&mut root, *b));
        root[a.max(b) as usize] = a.min(b);
    }
    for i in 0..points as u32 {
        root[i as usize] = find(&mut root, i);
    }
    root
}

#[cfg(test)]
mod tests;
