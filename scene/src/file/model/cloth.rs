use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::Rotation;

/// A piece of cloth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cloth {
    /// Name.
    pub name: String,
    /// Name of its fabric.
    pub fabric: String,
    /// Where its middle or origin is \[m\].
    pub center: [f64; 3],
    /// Rotation about that point.
    pub rotation: Rotation,
    /// Initial size relative to rest.
    pub stretch: f64,
    /// Standard deviation of the initial displacement \[m\].
    pub noise: f64,
    /// Seed of the displacement.
    pub noise_seed: u64,
    /// Layer, from 0 at the body outwards.
    pub layer: u32,
    /// Where its geometry comes from.
    #[serde(flatten)]
    pub shape: ClothShape,
}

/// Where the geometry of a cloth comes from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum ClothShape {
    /// A rectangle in the x-z plane, warp along x.
    Sheet {
        /// Extent along warp and weft \[m\].
        size: [f64; 2],
        /// Points along warp and weft.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        points: Option<[usize; 2]>,
        /// Target edge length \[m\].
        #[serde(default, skip_serializing_if = "Option::is_none")]
        edge_length: Option<f64>,
        /// Arrangement of the points.
        lattice: Lattice,
    },
    /// A mesh from an OBJ file.
    Mesh {
        /// The file.
        file: PathBuf,
        /// Factor to metres.
        scale: f64,
        /// What is at rest.
        rest: MeshRest,
        /// At which angles its triangles are at rest.
        rest_angles: RestAngles,
    },
    /// A sewing pattern.
    Pattern {
        /// The file.
        file: PathBuf,
        /// Target edge length \[m\].
        #[serde(default, skip_serializing_if = "Option::is_none")]
        edge_length: Option<f64>,
        /// Fabric of single panels.
        panel_fabric: BTreeMap<String, String>,
        /// Layer of single panels.
        panel_layer: BTreeMap<String, u32>,
        /// Labels of edges attached to the body.
        hold: Vec<String>,
    },
    /// A knitted rectangle.
    Knit {
        /// Built-in chart or chart file.
        chart: String,
        /// Stitches in a row, and rows.
        stitches: [usize; 2],
        /// Name of its yarn.
        yarn: String,
        /// Distance of stitches in a row \[m\].
        #[serde(default, skip_serializing_if = "Option::is_none")]
        course_pitch: Option<f64>,
        /// Distance of rows \[m\].
        #[serde(default, skip_serializing_if = "Option::is_none")]
        wale_pitch: Option<f64>,
        /// Shape of the loops at the start.
        rest_shape: RestShape,
        /// Whether yarns slide.
        sliding: bool,
        /// Whether the loops of the last row are secured.
        bind_off: bool,
    },
    /// A woven rectangle.
    Woven {
        /// Built-in weave or draft file.
        draft: String,
        /// Warps and wefts.
        yarns: [usize; 2],
        /// Distance of neighbouring yarns \[m\].
        spacing: f64,
        /// Rest length of yarns over the length that they span.
        crimp: f64,
        /// Name of the warp's yarn.
        yarn: String,
        /// Name of the weft's yarn.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        weft_yarn: Option<String>,
        /// Whether yarns slide.
        sliding: bool,
    },
    /// A mesh file knitted panel by panel.
    KnitMesh {
        /// The file.
        file: PathBuf,
        /// Factor to metres.
        scale: f64,
        /// Texture coordinate along the wales.
        grain: Grain,
        /// How its panels are knitted.
        #[serde(flatten)]
        knit: PanelKnit,
    },
    /// A sewing pattern, draped as a shell and then knitted panel by panel.
    KnitPattern {
        /// The file.
        file: PathBuf,
        /// Target edge length of the shells \[m\].
        #[serde(default, skip_serializing_if = "Option::is_none")]
        edge_length: Option<f64>,
        /// Longest time for which the shells drape \[s\].
        drape_time: f64,
        /// How its panels are knitted.
        #[serde(flatten)]
        knit: PanelKnit,
    },
    /// A mesh file woven panel by panel.
    WovenMesh {
        /// The file.
        file: PathBuf,
        /// Factor to metres.
        scale: f64,
        /// Texture coordinate along the warps.
        grain: Grain,
        /// Built-in weave or draft file.
        draft: String,
        /// Distance of neighbouring yarns \[m\].
        spacing: f64,
        /// Rest length of yarns over the length that they span.
        crimp: f64,
        /// Name of the warp's yarn.
        yarn: String,
        /// Name of the weft's yarn.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        weft_yarn: Option<String>,
        /// Name of the seams' yarn.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        seam_yarn: Option<String>,
        /// Rest length of seams over that of the borders.
        seam_slack: f64,
        /// Whether yarns slide.
        sliding: bool,
    },
}

/// Shape of the loops of a knit at the start.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RestShape {
    /// Flat, from the gauge alone.
    Laid,
    /// That of fabric at rest.
    Relaxed,
}

/// Texture coordinate along warps and wales.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Grain {
    /// The first.
    U,
    /// The second.
    V,
}

/// What of a mesh file is at rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MeshRest {
    /// Texture coordinates that can be lengths of the cloth, else the shape.
    Auto,
    /// The shape.
    Shape,
    /// Texture coordinates.
    Texture,
}

/// Angles between the triangles of a mesh file at rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RestAngles {
    /// None: the cloth is flat.
    Flat,
    /// Those of the shape.
    Shape,
}

/// How the panels of a mesh or a pattern are knitted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PanelKnit {
    /// Built-in chart or chart file.
    pub chart: String,
    /// Name of its yarn.
    pub yarn: String,
    /// Name of the seams' yarn.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seam_yarn: Option<String>,
    /// Rest length of seams over that of the borders.
    pub seam_slack: f64,
    /// Distance of stitches in a row \[m\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub course_pitch: Option<f64>,
    /// Distance of rows \[m\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wale_pitch: Option<f64>,
    /// Shape of the loops at the start.
    pub rest_shape: RestShape,
    /// Whether yarns slide.
    pub sliding: bool,
}

/// Arrangement of a sheet's points.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Lattice {
    /// Rows of near-equilateral triangles.
    Equilateral,
    /// Right triangles with alternating diagonals.
    Alternating,
}

impl Cloth {
    /// Whether it is a garment, sewn from a pattern.
    pub fn is_sewn(&self) -> bool {
        matches!(self.shape, ClothShape::Pattern { .. })
    }

    /// Whether it is made of yarns.
    pub fn is_of_yarns(&self) -> bool {
        self.slides().is_some()
    }

    /// Whether its yarns slide, for cloth of yarns.
    pub fn slides(&self) -> Option<bool> {
        match &self.shape {
            ClothShape::Knit { sliding, .. }
            | ClothShape::Woven { sliding, .. }
            | ClothShape::WovenMesh { sliding, .. } => Some(*sliding),
            ClothShape::KnitMesh { knit, .. } | ClothShape::KnitPattern { knit, .. } => {
                Some(knit.sliding)
            }
            _ => None,
        }
    }

    /// Layer of a panel, from 0 at the body outwards.
    pub fn layer_of(&self, panel: &str) -> u32 {
        match &self.shape {
            ClothShape::Pattern { panel_layer, .. } => panel_layer.get(panel),
            _ => None,
        }
        .copied()
        .unwrap_or(self.layer)
    }

    /// Whether it or a panel of it lies over another layer.
    pub fn is_layered(&self) -> bool {
        let panels = match &self.shape {
            ClothShape::Pattern { panel_layer, .. } => panel_layer.values().any(|l| *l > 0),
            _ => false,
        };
        self.layer > 0 || panels
    }

    /// Edge length that the cloth asks for itself \[m\].
    pub fn edge_length(&self) -> Option<f64> {
        match &self.shape {
            ClothShape::Sheet {
                size,
                points: Some(points),
                ..
            } => {
                let spacing = |i: usize| size[i] / (points[i].max(2) - 1) as f64;
                Some(spacing(0).min(spacing(1)))
            }
            ClothShape::Sheet { edge_length, .. } | ClothShape::Pattern { edge_length, .. } => {
                *edge_length
            }
            ClothShape::Mesh { .. }
            | ClothShape::Knit { .. }
            | ClothShape::Woven { .. }
            | ClothShape::KnitMesh { .. }
            | ClothShape::KnitPattern { .. }
            | ClothShape::WovenMesh { .. } => None,
        }
    }
}
