//! Analytic shapes, and their description as plain data.

mod boxed;
mod cylinder;
mod ellipsoid;
mod plane;
mod round_cone;

pub use boxed::RoundBox;
pub use cylinder::Cylinder;
pub use ellipsoid::Ellipsoid;
pub use plane::Plane;
pub use round_cone::RoundCone;

use super::{Body, Pose, pose::finite};
use crate::CollisionError;

/// An analytic body as plain data, as a scene file lists it.
///
/// Lengths in metres, rotations as axis times angle in radians.
///
/// ```
/// use selvedge_collision::body::{Body, Shape};
///
/// let arm = Shape::Capsule { a: [0.0; 3], b: [0.3, 0.0, 0.0], radius: [0.05, 0.04] };
/// let sample = arm.build()?.sample([-0.15, 0.0, 0.0], 0.0);
/// assert!((sample.distance - 0.10).abs() < 1e-15);
///
/// let error = Shape::Sphere { center: [0.0; 3], radius: -1.0 }.build().err();
/// assert_eq!(error.unwrap().to_string(), "sphere radius = -1: must be positive and finite");
/// # Ok::<(), selvedge_collision::CollisionError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Shape {
    /// A ball.
    Sphere {
        /// Centre [m].
        center: [f64; 3],
        /// Radius [m].
        radius: f64,
    },
    /// The convex hull of two balls.
    Capsule {
        /// Centre of the first ball [m].
        a: [f64; 3],
        /// Centre of the second ball [m].
        b: [f64; 3],
        /// Radii of the two balls [m].
        radius: [f64; 2],
    },
    /// An ellipsoid.
    Ellipsoid {
        /// Centre [m].
        center: [f64; 3],
        /// Half lengths of the principal axes [m].
        axes: [f64; 3],
        /// Rotation, axis times angle [rad].
        rotation: [f64; 3],
    },
    /// A box with rounded edges.
    Box {
        /// Centre [m].
        center: [f64; 3],
        /// Half edge lengths, rounding included [m].
        half: [f64; 3],
        /// Radius of edges and corners [m]; 0 for sharp ones.
        rounding: f64,
        /// Rotation, axis times angle [rad].
        rotation: [f64; 3],
    },
    /// A cylinder between two points, with rounded rims.
    Cylinder {
        /// Centre of one end face [m].
        a: [f64; 3],
        /// Centre of the other end face [m].
        b: [f64; 3],
        /// Radius [m].
        radius: f64,
        /// Radius of the rims [m]; 0 for sharp ones.
        rounding: f64,
    },
    /// The half-space below a plane.
    Plane {
        /// A point of the plane [m].
        point: [f64; 3],
        /// Direction out of the body, of any length [1].
        normal: [f64; 3],
    },
}

impl Shape {
    /// The body this describes.
    ///
    /// # Errors
    ///
    /// [`CollisionError::Parameter`], naming the number that cannot be.
    pub fn build(&self) -> Result<Box<dyn Body>, CollisionError> {
        Ok(match *self {
            Self::Sphere { center, radius } => {
                finite("sphere center", center)?;
                positive("sphere radius", radius)?;
                Box::new(RoundCone::sphere(center, radius)?)
            }
            Self::Capsule { a, b, radius } => Box::new(RoundCone::new(a, b, radius)?),
            Self::Ellipsoid {
                center,
                axes,
                rotation,
            } => {
                finite("ellipsoid center", center)?;
                finite("ellipsoid rotation", rotation)?;
                Box::new(Ellipsoid::new(axes, Pose::new(center, rotation)?)?)
            }
            Self::Box {
                center,
                half,
                rounding,
                rotation,
            } => {
                finite("box center", center)?;
                finite("box rotation", rotation)?;
                Box::new(RoundBox::new(half, rounding, Pose::new(center, rotation)?)?)
            }
            Self::Cylinder {
                a,
                b,
                radius,
                rounding,
            } => Box::new(Cylinder::new(a, b, radius, rounding)?),
            Self::Plane { point, normal } => Box::new(Plane::new(point, normal)?),
        })
    }
}

/// Largest length a shape may have [m]: squares must not overflow, and beyond
/// it the distance loses its millimetres to rounding.
const LARGEST: f64 = 1e9;
/// Smallest length a shape may have [m].
const SMALLEST: f64 = 1e-9;

fn positive(name: &'static str, value: f64) -> Result<(), CollisionError> {
    if !(value.is_finite() && value > 0.0) {
        return Err(CollisionError::Parameter {
            name,
            value,
            requirement: "positive and finite",
        });
    }
    if !(SMALLEST..=LARGEST).contains(&value) {
        let requirement = "between 1e-9 and 1e9 m";
        return Err(CollisionError::Parameter {
            name,
            value,
            requirement,
        });
    }
    Ok(())
}

fn at_most(name: &'static str, value: f64, limit: f64) -> Result<(), CollisionError> {
    if !(value >= 0.0 && value <= limit) {
        let requirement = "from 0 to the smallest half length";
        return Err(CollisionError::Parameter {
            name,
            value,
            requirement,
        });
    }
    Ok(())
}
