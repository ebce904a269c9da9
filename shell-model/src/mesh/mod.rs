//! Triangle meshes with material coordinates.

mod quality;
mod rest;
pub mod sheet;
mod topology;

pub use quality::HingeQuality;
pub use rest::RestTriangle;
pub use topology::{Edge, Hinge, NONE};

use crate::ModelError;

/// A triangle mesh of sewn pieces of cloth.
///
/// Every triangle has its own material coordinates `(u, v)` = (warp, weft) at
/// its corners, so that pieces cut on different grains can share points at a
/// seam. Positions live with the simulation, not here.
///
/// Refused, each with an error that names the culprit: indices out of range,
/// repeated points, coordinates that are not finite, triangles that are
/// degenerate or clockwise at rest, duplicate triangles, edges with more than
/// two triangles, neighbours that face opposite sides. Points of no triangle
/// are allowed, see [`isolated`](Self::isolated).
#[derive(Clone, Debug)]
pub struct ShellMesh {
    points: usize,
    triangles: Vec<[u32; 3]>,
    material: Vec<[[f64; 2]; 3]>,
    fabric: Vec<u16>,
    rest: Vec<RestTriangle>,
    edges: Vec<Edge>,
    hinges: Vec<Hinge>,
    neighbours: Vec<[u32; 3]>,
    isolated: Vec<u32>,
}

impl ShellMesh {
    /// Builds a mesh from the points of each triangle (counter-clockwise seen
    /// from outside), the material coordinates of its corners \[m\]
    /// (counter-clockwise too) and its fabric.
    ///
    /// # Errors
    /// Any of the mesh errors of [`ModelError`], see the type's description.
    pub fn new(
        points: usize,
        triangles: Vec<[u32; 3]>,
        material: Vec<[[f64; 2]; 3]>,
        fabric: Vec<u16>,
    ) -> Result<Self, ModelError> {
        Self::build(points, triangles, material, fabric, false)
    }

    /// As [`new`](Self::new), but accepts triangles thinner than 1:10⁴. Each
    /// makes the linear systems harder by the square of its aspect ratio.
    ///
    /// # Errors
    /// As [`new`](Self::new); triangles without any area are still refused.
    pub fn with_slivers(
        points: usize,
        triangles: Vec<[u32; 3]>,
        material: Vec<[[f64; 2]; 3]>,
        fabric: Vec<u16>,
    ) -> Result<Self, ModelError> {
        Self::build(points, triangles, material, fabric, true)
    }

    fn build(
        points: usize,
        triangles: Vec<[u32; 3]>,
        material: Vec<[[f64; 2]; 3]>,
        fabric: Vec<u16>,
        slivers: bool,
    ) -> Result<Self, ModelError> {
        let expected = triangles.len();
        for (what, found) in [("material", material.len()), ("fabric", fabric.len())] {
            if found != expected {
                return Err(ModelError::Length {
                    what,
                    expected,
                    found,
                });
            }
        }
        topology::check_points(points, &triangles)?;
        let rest = material
            .iter()
            .enumerate()
            .map(|(t, corners)| RestTriangle::new(corners, t, slivers))
            .collect::<Result<_, _>>()?;
        let topology::Topology {
            edges,
            hinges,
            neighbours,
        } = topology::build(&triangles)?;
        let mut used = vec![false; points];
        for p in triangles.iter().flatten() {
            used[*p as usize] = true;
        }
        let isolated = (0..points as u32).filter(|p| !used[*p as usize]).collect();
        Ok(Self {
            points,
            triangles,
            material,
            fabric,
            rest,
            edges,
            hinges,
            neighbours,
            isolated,
        })
    }

    /// The same mesh with point `i` renamed to `new_of_old[i]`. Triangles keep
    /// their order; edges and hinges are sorted by their new points.
    ///
    /// # Errors
    /// [`ModelError::Length`] or [`ModelError::NotAPermutation`].
    pub fn renumbered(&self, new_of_old: &[u32]) -> Result<Self, ModelError> {
        if new_of_old.len() != self.points {
            let (expected, found) = (self.points, new_of_old.len());
            return Err(ModelError::Length {
                what: "renumbering",
                expected,
                found,
            });
        }
        let mut taken = vec![false; self.points];
        for (index, &value) in new_of_old.iter().enumerate() {
            match taken.get_mut(value as usize) {
                Some(slot) if !*slot => *slot = true,
                _ => return Err(ModelError::NotAPermutation { index, value }),
            }
        }
        let triangles: Vec<[u32; 3]> = self
            .triangles
            .iter()
            .map(|t| t.map(|p| new_of_old[p as usize]))
            .collect();
        let topology::Topology {
            edges,
            hinges,
            neighbours,
        } = topology::build(&triangles)?;
        let mut isolated: Vec<u32> = self
            .isolated
            .iter()
            .map(|p| new_of_old[*p as usize])
            .collect();
        isolated.sort_unstable();
        Ok(Self {
            triangles,
            edges,
            hinges,
            neighbours,
            isolated,
            ..self.clone()
        })
    }

    /// Number of points.
    pub fn points(&self) -> usize {
        self.points
    }

    /// Points of every triangle.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Material coordinates `(u, v)` of the corners of every triangle \[m\].
    pub fn material(&self) -> &[[[f64; 2]; 3]] {
        &self.material
    }

    /// Fabric of every triangle.
    pub fn fabric(&self) -> &[u16] {
        &self.fabric
    }

    /// Rest shape of every triangle.
    pub fn rest(&self) -> &[RestTriangle] {
        &self.rest
    }

    /// Rest area of triangle `t` \[m²\].
    pub fn rest_area(&self, t: usize) -> f64 {
        self.rest[t].area
    }

    /// Sum of all rest areas \[m²\].
    pub fn total_area(&self) -> f64 {
        self.rest.iter().map(|r| r.area).sum()
    }

    /// Edges, sorted by their points.
    pub fn edges(&self) -> &[Edge] {
        &self.edges
    }

    /// Pairs of triangles that share an edge, sorted by the edge.
    pub fn hinges(&self) -> &[Hinge] {
        &self.hinges
    }

    /// Neighbour of triangle `t` across the side opposite each corner, or
    /// [`NONE`].
    pub fn neighbours(&self, t: usize) -> [u32; 3] {
        self.neighbours[t]
    }

    /// Points of no triangle, in rising order. They have no mass.
    pub fn isolated(&self) -> &[u32] {
        &self.isolated
    }

    /// Points on the boundary, in rising order.
    pub fn boundary_points(&self) -> Vec<u32> {
        let mut points: Vec<u32> = self
            .edges
            .iter()
            .filter(|e| e.is_boundary())
            .flat_map(|e| e.points)
            .collect();
        points.sort_unstable();
        points.dedup();
        points
    }

    /// Rest length of an edge \[m\]: the mean of its triangles' material
    /// lengths, which differ where a seam eases one piece into another.
    pub fn rest_length(&self, edge: &Edge) -> f64 {
        let mut sum = 0.0;
        let mut count = 0.0;
        for &t in edge.triangles.iter().filter(|t| **t != NONE) {
            let t = t as usize;
            let corner = |p: u32| self.triangles[t].iter().position(|q| *q == p);
            if let (Some(a), Some(b)) = (corner(edge.points[0]), corner(edge.points[1])) {
                let (a, b) = (self.material[t][a], self.material[t][b]);
                sum += (b[0] - a[0]).hypot(b[1] - a[1]);
                count += 1.0;
            }
        }
        sum / count
    }

    /// Rest shapes of the two wings of a hinge.
    pub fn wings(&self, hinge: &Hinge) -> [Wing; 2] {
        std::array::from_fn(|w| {
            let t = hinge.triangles[w] as usize;
            let o = hinge.corners[w] as usize;
            let [a, b, c] = [0, 1, 2].map(|i| self.material[t][(o + 1 + i) % 3]);
            Wing::new(a, b, c, self.rest[t].area)
        })
    }

    /// Heap memory held \[bytes\].
    pub fn heap_bytes(&self) -> usize {
        size_of_val(&self.triangles[..])
            + size_of_val(&self.material[..])
            + size_of_val(&self.fabric[..])
            + size_of_val(&self.rest[..])
            + size_of_val(&self.edges[..])
            + size_of_val(&self.hinges[..])
            + size_of_val(&self.neighbours[..])
            + size_of_val(&self.isolated[..])
    }
}

/// One wing of a hinge in the material plane of its triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wing {
    /// Length of the edge \[m\].
    pub length: f64,
    /// Height of the opposite corner over the edge \[m\].
    pub height: f64,
    /// Foot of that height along the edge as the triangle runs, 0..1 inside \[1\].
    pub foot: f64,
    /// Unit direction of the edge in `(u, v)`, as the triangle runs.
    pub direction: [f64; 2],
    /// Area of the triangle \[m²\].
    pub area: f64,
}

impl Wing {
    fn new(a: [f64; 2], b: [f64; 2], c: [f64; 2], area: f64) -> Self {
        let e = [b[0] - a[0], b[1] - a[1]];
        let length = e[0].hypot(e[1]);
        let along = (c[0] - a[0]) * e[0] + (c[1] - a[1]) * e[1];
        Self {
            length,
            height: 2.0 * area / length,
            foot: along / (length * length),
            direction: [e[0] / length, e[1] / length],
            area,
        }
    }
}
