use super::super::pose::finite;
use super::super::vec3::{dot, norm, scale};
use super::super::{Body, SurfaceSample};
use super::positive;
use crate::{Aabb, CollisionError};

/// The half-space below a plane: `φ = n · p − d`, exact.
///
/// [`Body::bounds`] is infinite, except above a plane along two axes.
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    normal: [f64; 3],
    offset: f64,
}

impl Plane {
    /// The plane through `point` [m]; `normal` points out of the body.
    ///
    /// # Errors
    ///
    /// [`CollisionError::Parameter`] for a normal of no length or numbers that
    /// are not finite.
    pub fn new(point: [f64; 3], normal: [f64; 3]) -> Result<Self, CollisionError> {
        finite("plane point", point)?;
        finite("plane normal", normal)?;
        let length = norm(normal);
        positive("plane normal length", length)?;
        let normal = scale(normal, 1.0 / length);
        Ok(Self {
            normal,
            offset: dot(normal, point),
        })
    }
}

impl Body for Plane {
    fn name(&self) -> &str {
        "plane"
    }
    fn sample(&self, p: [f64; 3], _time: f64) -> SurfaceSample {
        SurfaceSample {
            distance: dot(self.normal, p) - self.offset,
            normal: self.normal,
            velocity: [0.0; 3],
        }
    }
    fn is_convex(&self) -> bool {
        true
    }
    fn bounds(&self, _time: f64) -> Aabb {
        let mut b = Aabb {
            min: [f64::NEG_INFINITY; 3],
            max: [f64::INFINITY; 3],
        };
        for i in 0..3 {
            if self.normal[i] == 1.0 {
                b.max[i] = self.offset;
            } else if self.normal[i] == -1.0 {
                b.min[i] = -self.offset;
            }
        }
        b
    }
}
