use std::fmt;

/// What a body's triangle mesh was like, and what was done about it.
///
/// The defects are counted on the mesh as given; the `filled_*`, `flipped_*`
/// and `hidden_*` numbers say what was repaired.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshReport {
    /// Points given.
    pub points: usize,
    /// Triangles given.
    pub triangles: usize,
    /// Points merged into another at the same place.
    pub welded_points: usize,
    /// Triangles dropped because they name a point twice, after welding.
    pub degenerate_triangles: usize,
    /// Triangles lower than `1e-6` of their longest edge. They stay: they
    /// close the mesh, and distances to them are well defined.
    pub needles: usize,
    /// Triangles dropped because another has the same three points.
    pub duplicate_triangles: usize,
    /// Ends [m] of the edges that belong to one triangle only.
    pub boundary_edges: Vec<[[f64; 3]; 2]>,
    /// Ends [m] of the edges that belong to more than two triangles.
    pub non_manifold_edges: Vec<[[f64; 3]; 2]>,
    /// Edges whose two triangles disagree about the outside.
    pub inconsistent_edges: usize,
    /// Connected pieces.
    pub components: usize,
    /// Whether the mesh as given, once consistent, was inside out.
    pub inverted: bool,
    /// Triangles whose order was reversed.
    pub flipped_triangles: usize,
    /// Closed loops of boundary edges that were filled with triangles.
    pub filled_holes: usize,
    /// Length of the longest loop filled [m].
    pub largest_hole: f64,
    /// Triangles inside another part of the mesh, not part of the surface.
    pub hidden_triangles: usize,
    /// Cavities behind openings too narrow for cloth that were filled.
    pub filled_cavities: usize,
    /// Whether the repaired mesh is closed, each edge between two triangles.
    pub watertight: bool,
    /// Volume of the repaired mesh [m³].
    pub volume: f64,
    /// Surface area of the repaired mesh [m²].
    pub area: f64,
}

impl MeshReport {
    /// Whether the mesh needed no repair.
    pub fn is_clean(&self) -> bool {
        self.degenerate_triangles == 0
            && self.duplicate_triangles == 0
            && self.boundary_edges.is_empty()
            && self.non_manifold_edges.is_empty()
            && self.inconsistent_edges == 0
            && !self.inverted
            && self.hidden_triangles == 0
            && self.filled_cavities == 0
    }
}

impl fmt::Display for MeshReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} points, {} triangles, {} components, {:.4} m², {:.5} m³",
            self.points, self.triangles, self.components, self.area, self.volume
        )?;
        if self.is_clean() {
            return write!(f, ", no defects");
        }
        let counts = [
            (self.degenerate_triangles, "degenerate triangles dropped"),
            (self.needles, "triangles of no area"),
            (self.duplicate_triangles, "duplicate triangles dropped"),
            (self.boundary_edges.len(), "boundary edges"),
            (self.filled_holes, "holes filled"),
            (
                self.non_manifold_edges.len(),
                "edges of more than two triangles",
            ),
            (self.inconsistent_edges, "edges of inconsistent orientation"),
            (self.flipped_triangles, "triangles reversed"),
            (self.hidden_triangles, "triangles inside another part"),
            (self.filled_cavities, "cavities filled"),
        ];
        for (count, what) in counts {
            if count > 0 {
                write!(f, ", {count} {what}")?;
            }
        }
        if let Some([a, _]) = self.boundary_edges.first() {
            write!(
                f,
                ", first boundary at ({:.4}, {:.4}, {:.4}) m",
                a[0], a[1], a[2]
            )?;
        }
        if let Some([a, _]) = self.non_manifold_edges.first() {
            write!(
                f,
                ", first non-manifold edge at ({:.4}, {:.4}, {:.4}) m",
                a[0], a[1], a[2]
            )?;
        }
        Ok(())
    }
}
