//! Obstacles: signed distance, normal and surface velocity at a point.

use crate::Aabb;

/// Signed distance of a body at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceSample {
    /// Signed distance [m], negative inside.
    pub distance: f64,
    /// Gradient of the distance [1].
    pub normal: [f64; 3],
    /// Velocity of the surface nearest to the point [m/s].
    pub velocity: [f64; 3],
}

/// An obstacle that cloth touches.
pub trait Body: Send + Sync {
    /// Name in messages.
    fn name(&self) -> &str;
    /// Distance at a point [m] and a time [s].
    fn sample(&self, p: [f64; 3], time: f64) -> SurfaceSample;
    /// A box that contains the body at a time [s].
    fn bounds(&self, time: f64) -> Aabb;
    /// [`sample`](Self::sample) of many points.
    fn sample_many(&self, points: &[[f64; 3]], time: f64, out: &mut Vec<SurfaceSample>) {
        out.clear();
        out.extend(points.iter().map(|p| self.sample(*p, time)));
    }
    /// A point of the world in the body's own frame.
    fn to_body(&self, p: [f64; 3], _time: f64) -> [f64; 3] {
        p
    }
    /// A point of the body's own frame in the world.
    fn from_body(&self, p: [f64; 3], _time: f64) -> [f64; 3] {
        p
    }
}
