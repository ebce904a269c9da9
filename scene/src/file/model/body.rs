use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::{Interpolation, Keyframe, Rotation};

/// An obstacle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Body {
    /// Name.
    pub name: String,
    /// Friction coefficient of its material \[1\].
    pub friction: f64,
    /// Keyframes.
    pub motion: Vec<Keyframe>,
    /// Point that the motion rotates about \[m\]; the origin if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pivot: Option<[f64; 3]>,
    /// How the motion passes between keyframes.
    pub interpolation: Interpolation,
    /// Its shape.
    #[serde(flatten)]
    pub shape: BodyShape,
}

/// Shape of an obstacle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum BodyShape {
    /// A ball.
    Sphere {
        /// Centre \[m\].
        center: [f64; 3],
        /// Radius \[m\].
        radius: f64,
    },
    /// The hull of two balls.
    Capsule {
        /// Centre of the first ball \[m\].
        from: [f64; 3],
        /// Centre of the second ball \[m\].
        to: [f64; 3],
        /// Radius of the first ball \[m\].
        radius: f64,
        /// Radius of the second ball \[m\]; as the first if absent.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        radius_to: Option<f64>,
    },
    /// An ellipsoid.
    Ellipsoid {
        /// Centre \[m\].
        center: [f64; 3],
        /// Half lengths of the axes \[m\].
        radii: [f64; 3],
        /// Rotation about the centre.
        rotation: Rotation,
    },
    /// A box.
    Box {
        /// Centre \[m\].
        center: [f64; 3],
        /// Side lengths \[m\].
        size: [f64; 3],
        /// Rotation about the centre.
        rotation: Rotation,
        /// Radius of the edges \[m\].
        rounding: f64,
    },
    /// A half space.
    Plane {
        /// A point of the surface \[m\].
        point: [f64; 3],
        /// Direction out of the solid.
        normal: [f64; 3],
    },
    /// Several shapes as one.
    Union {
        /// The shapes.
        shapes: Vec<Part>,
        /// Blending radius \[m\].
        smooth: f64,
    },
    /// A closed mesh from an OBJ file.
    Mesh {
        /// The file.
        file: PathBuf,
        /// Factor to metres.
        scale: f64,
        /// Spacing of the distance field \[m\].
        voxel: f64,
        /// Where its origin is put \[m\].
        center: [f64; 3],
        /// Rotation about its origin.
        rotation: Rotation,
    },
    /// A standing figure.
    Mannequin {},
}

/// A shape of a union.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Part {
    /// The shape: one of the analytic ones.
    #[serde(flatten)]
    pub shape: BodyShape,
}
