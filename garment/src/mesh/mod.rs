//! Panels to one welded triangle mesh.
//!
//! Edges that are sewn together get the same number of equal pieces, panels
//! are filled with nearly equilateral Delaunay triangles, and matched points
//! become one point of the mesh. Every triangle keeps the material
//! coordinates of its own panel, so a gathered seam needs no special care.

mod boundary;
mod close;
mod fill;
mod orient;
mod quality;
mod segments;
mod weld;

pub use quality::MeshStats;

use crate::pattern::{Finding, Frame, Pattern};
use crate::{GarmentError, math};
use std::collections::BTreeMap;

/// How a pattern is meshed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshSettings {
    /// Length of the triangles' edges [m].
    pub edge_length: f64,
    /// What a stitch becomes.
    pub seams: SeamMode,
}

impl Default for MeshSettings {
    fn default() -> Self {
        Self {
            edge_length: 0.01,
            seams: SeamMode::Weld,
        }
    }
}

/// What a stitch becomes in the mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SeamMode {
    /// Matched points are one point.
    Weld,
    /// Points stay apart; [`GarmentMesh::spring_seams`] lists the pairs.
    Springs,
}

/// A point tied to a point of an edge, at rest length zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpringSeam {
    /// The tied point.
    pub point: u32,
    /// Ends of the edge it is tied to (equal for a single point).
    pub edge: [u32; 2],
    /// Weights of the ends, summing to 1.
    pub weights: [f64; 2],
    /// Stitch of the pattern it comes from.
    pub stitch: u32,
}

/// A panel of the mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshPanel {
    /// Name in the pattern.
    pub name: String,
    /// Label in the pattern.
    pub label: Option<String>,
    /// Its placement.
    pub frame: Frame,
    /// +1 when panel coordinates are right-handed seen from the side that
    /// triangles face, −1 when they are mirrored (drawn clockwise, or turned
    /// over by a seam).
    pub side: f64,
    /// Area of the triangles [m²].
    pub area: f64,
}

/// The points of a seam in order, for reports and drawings.
#[derive(Clone, Debug, PartialEq)]
pub struct SeamLine {
    /// Stitch of the pattern.
    pub stitch: u32,
    /// Points along the first edge's outline direction.
    pub points: Vec<u32>,
}

/// A garment as a triangle mesh, placed around the body and not yet in
/// equilibrium.
#[derive(Clone, Debug)]
pub struct GarmentMesh {
    /// Initial positions: placed panels, the mean of all parts where panels
    /// are welded [m].
    pub points_initial: Vec<[f64; 3]>,
    /// Corners of the triangles, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Material coordinates (warp, weft) of each corner [m]: warp is the
    /// panel's +y, weft its −x for panels seen from outside (mirrored panels:
    /// +x), so that material triangles are counter-clockwise.
    pub material: Vec<[[f64; 2]; 3]>,
    /// Panel of each triangle.
    pub panel_of_triangle: Vec<u32>,
    /// The panels.
    pub panels: Vec<MeshPanel>,
    /// Welded points of each seam.
    pub seam_lines: Vec<SeamLine>,
    /// Points of the edges with each label, ascending.
    pub labels: BTreeMap<String, Vec<u32>>,
    /// Ties that are not welded.
    pub spring_seams: Vec<SpringSeam>,
    /// Counts, angles, lengths, gaps.
    pub stats: MeshStats,
    /// What the mesher noticed.
    pub findings: Vec<Finding>,
    /// The pattern it was made from.
    pub pattern: Pattern,
    /// The settings it was made with.
    pub settings: MeshSettings,
}

impl GarmentMesh {
    /// Meshes a pattern.
    ///
    /// # Errors
    /// [`GarmentError`] for an unusable edge length, open, crossing or empty
    /// outlines, stitches that name missing edges, and sizes beyond reason.
    ///
    /// ```
    /// use selvedge_garment::{GarmentMesh, MeshSettings, Pattern};
    /// let square = r#"{"pattern": {"panels": {"square": {
    ///     "vertices": [[0, 0], [30, 0], [30, 30], [0, 30]],
    ///     "edges": [{"endpoints": [0, 1]}, {"endpoints": [1, 2]},
    ///               {"endpoints": [2, 3]}, {"endpoints": [3, 0]}]}}}}"#;
    /// let pattern = Pattern::from_json(square.as_bytes())?;
    /// let mesh = GarmentMesh::build(&pattern, &MeshSettings::default())?;
    /// assert!((mesh.stats.area - 0.09).abs() < 1e-12);
    /// assert!(mesh.stats.min_angle_degrees > 25.0);
    /// # Ok::<(), selvedge_garment::GarmentError>(())
    /// ```
    pub fn build(pattern: &Pattern, settings: &MeshSettings) -> Result<Self, GarmentError> {
        let h = settings.edge_length;
        if !(5e-4..=1.0).contains(&h) {
            return Err(GarmentError::EdgeLength { value: h });
        }
        if pattern.panels.is_empty() {
            return Err(GarmentError::NoPanels);
        }
        let sewing = segments::Sewing::new(pattern, h)?;
        let mut panels = Vec::with_capacity(pattern.panels.len());
        for index in 0..pattern.panels.len() {
            let outline = boundary::sample(pattern, index, &sewing, h)?;
            let filled = fill::fill(&pattern.panels[index].name, &outline, h)?;
            panels.push((outline, filled));
        }
        Ok(weld::weld(pattern, settings, &sewing, &panels))
    }

    /// Placed position of a triangle's corner before welding [m].
    pub fn corner_placed(&self, triangle: usize, corner: usize) -> [f64; 3] {
        let panel = &self.panels[self.panel_of_triangle[triangle] as usize];
        panel
            .frame
            .place(panel.from_material(self.material[triangle][corner]))
    }

    /// Rest area of a triangle [m²].
    pub fn rest_area(&self, triangle: usize) -> f64 {
        let [a, b, c] = self.material[triangle];
        0.5 * math::double_area(a, b, c)
    }
}

impl MeshPanel {
    /// Material coordinates (warp, weft) of a point of the panel's plane [m].
    pub fn to_material(&self, p: [f64; 2]) -> [f64; 2] {
        [p[1], -self.side * p[0]]
    }

    /// Point of the panel's plane with these material coordinates [m].
    pub fn from_material(&self, m: [f64; 2]) -> [f64; 2] {
        [-self.side * m[1], m[0]]
    }
}
