use serde::{Deserialize, Serialize};

use super::{Interpolation, Keyframe};

/// Points of a piece of cloth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Select {
    /// Corners of a sheet.
    Corner(Corner),
    /// Points of an edge of a sheet.
    Edge(Edge),
    /// Points inside a box at the start.
    Box {
        /// Least corner \[m\].
        min: [f64; 3],
        /// Greatest corner \[m\].
        max: [f64; 3],
    },
    /// Points by number.
    Points(Vec<u32>),
    /// Points of the pattern's edges with this label.
    Label(String),
    /// The points nearest to a place.
    Nearest {
        /// The place \[m\].
        to: [f64; 3],
        /// Distance \[m\]; 0 takes the nearest point alone.
        within: f64,
    },
    /// An end of a yarn.
    Yarn {
        /// The yarn, from 0, or from −1 backwards.
        index: i64,
        /// Which end.
        end: YarnEnd,
    },
}

/// Ends of a yarn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum YarnEnd {
    /// Where it begins.
    First,
    /// Where it ends.
    Last,
    /// Both.
    Both,
}

/// Corners of a sheet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Corner {
    /// All four.
    All,
    /// Least warp, greatest weft coordinate.
    TopLeft,
    /// Greatest warp and weft coordinate.
    TopRight,
    /// Least warp and weft coordinate.
    BottomLeft,
    /// Greatest warp, least weft coordinate.
    BottomRight,
}

/// Edges of a sheet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Edge {
    /// Least warp coordinate.
    Left,
    /// Greatest warp coordinate.
    Right,
    /// Least weft coordinate.
    Bottom,
    /// Greatest weft coordinate.
    Top,
    /// The whole boundary.
    All,
}

/// Points held exactly.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pin {
    /// Name of the cloth.
    pub cloth: String,
    /// Which points.
    pub select: Select,
    /// Motion of what they are held to.
    pub motion: Vec<Keyframe>,
    /// Point that the motion rotates about \[m\]; their middle if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pivot: Option<[f64; 3]>,
    /// How the motion passes between keyframes.
    pub interpolation: Interpolation,
    /// What is held.
    #[serde(flatten)]
    pub kind: PinKind,
}

/// What of a pinned point is held.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum PinKind {
    /// Everything.
    Fixed {},
    /// The displacement along a normal.
    Plane {
        /// Normal of the plane, of any length.
        normal: [f64; 3],
    },
    /// The displacement across a direction.
    Line {
        /// Direction of the line, of any length.
        direction: [f64; 3],
    },
}

/// Points held by springs to where they start.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Attachment {
    /// Name of the cloth.
    pub cloth: String,
    /// Which points.
    pub select: Select,
    /// Stiffness of each spring [N/m].
    pub stiffness: f64,
    /// Body whose motion the other ends follow.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body: Option<String>,
    /// Motion of the other ends.
    pub motion: Vec<Keyframe>,
    /// Point that the motion rotates about \[m\]; their middle if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pivot: Option<[f64; 3]>,
    /// How the motion passes between keyframes.
    pub interpolation: Interpolation,
}
