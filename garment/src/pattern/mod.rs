//! Sewing patterns as plain data: panels, edges, stitches, placements.
//!
//! Lengths are metres and angles degrees. A panel lives in its own plane; its
//! placement puts it near the body: rotation first, then translation. A
//! panel's *outside* is the side from which its outline runs
//! counter-clockwise, so back panels drawn clockwise face away from the body
//! without being rotated.

pub mod curve;
pub mod doctor;
mod json;
mod on_body;
mod outline;
mod read;
mod seam;
mod write;

pub use curve::{ArcTable, Curve};
pub use doctor::{Finding, Place, Severity, examine};
pub use on_body::examine_on_body;
pub use seam::{Pairing, PlacedStitch, placed_stitch};

pub(crate) use outline::polygon_crossing;

/// A sewing pattern.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pattern {
    /// Flat pieces of cloth.
    pub panels: Vec<Panel>,
    /// Which edges are sewn together.
    pub stitches: Vec<Stitch>,
}

/// One flat piece of cloth with its placement.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Panel {
    /// Unique name.
    pub name: String,
    /// What the panel covers (`body`, `arm`, `leg`, …), if known.
    pub label: Option<String>,
    /// Corners in the panel's plane [m].
    pub vertices: Vec<[f64; 2]>,
    /// Edges between corners; together one closed loop.
    pub edges: Vec<PanelEdge>,
    /// Placement, applied after the rotation [m].
    pub translation: [f64; 3],
    /// Placement: intrinsic X, Y, Z Euler angles [degree].
    pub rotation_degrees: [f64; 3],
}

/// One edge of a panel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PanelEdge {
    /// Start and end corner.
    pub ends: [u32; 2],
    /// Shape between the corners.
    pub curve: Curve,
    /// Where the garment meets the body (`lower_interface`, `left_collar`, …).
    pub label: Option<String>,
}

/// An edge of a panel, by index.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct EdgeId {
    /// Index into [`Pattern::panels`].
    pub panel: u32,
    /// Index into [`Panel::edges`].
    pub edge: u32,
}

/// Two edges sewn together along their whole length.
///
/// Both outlines run counter-clockwise seen from outside, so a seam that
/// continues the outside joins the start of one edge to the end of the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stitch {
    /// One edge.
    pub a: EdgeId,
    /// The other edge.
    pub b: EdgeId,
    /// Right side to wrong side: start joins start, the outside flips over
    /// the seam (a folded collar, for example).
    pub right_wrong: bool,
}

/// One edge of the loop of a panel, in walking order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LoopEdge {
    /// Index into [`Panel::edges`].
    pub edge: usize,
    /// Walked from its second end to its first.
    pub reversed: bool,
}

impl Pattern {
    /// The edge, if it exists.
    pub fn edge(&self, id: EdgeId) -> Option<&PanelEdge> {
        self.panels
            .get(id.panel as usize)?
            .edges
            .get(id.edge as usize)
    }

    /// Index of the panel with this name.
    pub fn panel_index(&self, name: &str) -> Option<usize> {
        self.panels.iter().position(|p| p.name == name)
    }

    /// Smallest and largest placed corner coordinates [m]; `None` without
    /// corners.
    pub fn bounds(&self) -> Option<([f64; 3], [f64; 3])> {
        let mut range: Option<([f64; 3], [f64; 3])> = None;
        for panel in &self.panels {
            let frame = panel.frame();
            for &v in &panel.vertices {
                let p = frame.place(v);
                let (low, high) = range.get_or_insert((p, p));
                for k in 0..3 {
                    low[k] = low[k].min(p[k]);
                    high[k] = high[k].max(p[k]);
                }
            }
        }
        range
    }
}

/// The placement of a panel: an orthonormal frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Rotation matrix, rows first [1].
    pub rotation: [[f64; 3]; 3],
    /// Where the panel's origin goes [m].
    pub translation: [f64; 3],
}

impl Frame {
    /// Position of a point of the panel's plane [m].
    pub fn place(&self, p: [f64; 2]) -> [f64; 3] {
        let mut out = self.translation;
        for k in 0..3 {
            out[k] += self.rotation[k][0] * p[0] + self.rotation[k][1] * p[1];
        }
        out
    }
}

impl Panel {
    /// The placement as a rotation matrix and a translation.
    ///
    /// ```text
    /// R = Rx(α) Ry(β) Rz(γ)        intrinsic X, Y, Z
    /// ```
    pub fn frame(&self) -> Frame {
        let [(sx, cx), (sy, cy), (sz, cz)] =
            self.rotation_degrees.map(|a| a.to_radians().sin_cos());
        Frame {
            rotation: [
                [cy * cz, -cy * sz, sy],
                [sx * sy * cz + cx * sz, cx * cz - sx * sy * sz, -sx * cy],
                [sx * sz - cx * sy * cz, cx * sy * sz + sx * cz, cx * cy],
            ],
            translation: self.translation,
        }
    }

    /// End points of an edge [m]; `None` when a corner does not exist.
    pub fn edge_ends(&self, edge: usize) -> Option<[[f64; 2]; 2]> {
        let [a, b] = self.edges.get(edge)?.ends;
        Some([
            *self.vertices.get(a as usize)?,
            *self.vertices.get(b as usize)?,
        ])
    }

    /// Arc-length table of an edge; `None` when a corner does not exist.
    pub fn edge_table(&self, edge: usize) -> Option<ArcTable> {
        let [a, b] = self.edge_ends(edge)?;
        Some(ArcTable::new(&self.edges[edge].curve, a, b))
    }

    /// The edges in walking order, from edge 0 in its own direction.
    ///
    /// # Errors
    /// [`GarmentError::OpenOutline`] when they are not one closed loop.
    ///
    /// [`GarmentError::OpenOutline`]: crate::GarmentError::OpenOutline
    pub fn outline(&self) -> Result<Vec<LoopEdge>, crate::GarmentError> {
        outline::walk(self)
    }
}
