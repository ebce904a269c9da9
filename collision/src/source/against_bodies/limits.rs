//! How far detection looks, and how deep cloth may come.

use crate::source::check_margin;
use crate::vec3::{Vec3, dot};
use crate::{CollisionError, SurfaceSample};

/// How far detection looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyContactSettings {
    /// Room beyond the predicted motion of a point \[m\].
    pub margin: f64,
    /// Fraction by which the predicted motion is overshot \[1\].
    pub overshoot: f64,
    /// Largest slope of a body's distance field \[1\]. Points whose distance
    /// exceeds their possible way times this are left out of a step; 1 for
    /// exact distances, more for interpolated ones.
    pub steepness: f64,
}

impl Default for BodyContactSettings {
    fn default() -> Self {
        Self {
            margin: 1e-3,
            overshoot: 0.25,
            steepness: 1.5,
        }
    }
}

impl BodyContactSettings {
    pub(super) fn check(&self) -> Result<(), CollisionError> {
        check_margin(self.margin, self.overshoot)?;
        if !(self.steepness >= 1.0 && self.steepness.is_finite()) {
            return Err(CollisionError::Parameter {
                name: "steepness",
                value: self.steepness,
                requirement: "finite and at least 1",
            });
        }
        Ok(())
    }
}

/// Depth in thicknesses beyond which the nearest surface may be the wrong one.
pub(super) const DEEP: f64 = 3.0;

/// Depth [m] at the end of the step of a point that moves by `way` [m] in a
/// step of `dt` [s], where that is beyond the limit and comes from this step's
/// approach. `s` is the sample where the point begins, of the body's last pose.
pub(super) fn foreseen_depth(s: &SurfaceSample, way: Vec3, dt: f64, limit: f64) -> Option<f64> {
    let closing = dt * dot(s.velocity, s.normal) - dot(way, s.normal);
    let depth = -(s.distance + dot(way, s.normal));
    // What begins deeper is past help: it must not hold up the run.
    (closing > limit && depth > limit && depth - closing < limit).then_some(depth)
}
