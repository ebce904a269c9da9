use super::super::pose::finite;
use super::super::vec3::{add_scaled, dot, norm, perpendicular, scale, sub};
use super::super::{Body, SurfaceSample};
use super::positive;
use crate::{Aabb, CollisionError};

/// The convex hull of two balls: sphere, capsule or rounded cone.
///
/// ```text
/// φ(p) = min_s |p − c(s)| − r(s),    c(s) = a + s u,  r(s) = r_a − k s,  s ∈ [0, l]
/// s* = x − y k / √(1 − k²)           x, y: coordinates of p along and off the axis
/// ```
/// Exact inside and outside, of unit gradient: the balls along the axis have
/// the hull as envelope, and the function of `s` is convex, so that clamping
/// `s*` gives its minimum. Where one ball holds the other, the larger is the
/// body. On the axis, where the gradient jumps, any right angle is taken.
#[derive(Clone, Copy, Debug)]
pub struct RoundCone {
    name: &'static str,
    a: [f64; 3],
    axis: [f64; 3],
    length: f64,
    radius: f64, // at `a`
    taper: f64,  // k: loss of radius per length
    slope: f64,  // k / √(1 − k²)
}

impl RoundCone {
    /// The hull of balls around `a` and `b` [m].
    ///
    /// # Errors
    ///
    /// [`CollisionError::Parameter`] for centres that are not finite or radii
    /// that are not positive.
    pub fn new(a: [f64; 3], b: [f64; 3], radius: [f64; 2]) -> Result<Self, CollisionError> {
        finite("capsule end", a)?;
        finite("capsule end", b)?;
        positive("capsule radius", radius[0])?;
        positive("capsule radius", radius[1])?;
        let span = sub(b, a);
        let length = norm(span);
        if !length.is_finite() {
            return Err(CollisionError::Parameter {
                name: "capsule length",
                value: length,
                requirement: "finite",
            });
        }
        let drop = radius[0] - radius[1];
        if length <= drop.abs() || length < 1e-12 {
            let (center, radius) = if drop >= 0.0 {
                (a, radius[0])
            } else {
                (b, radius[1])
            };
            return Ok(Self {
                name: "capsule",
                ..Self::sphere(center, radius)?
            });
        }
        let taper = drop / length;
        Ok(Self {
            name: "capsule",
            a,
            axis: scale(span, 1.0 / length),
            length,
            radius: radius[0],
            taper,
            slope: taper / (1.0 - taper * taper).sqrt(),
        })
    }

    /// A ball [m].
    ///
    /// # Errors
    ///
    /// As [`RoundCone::new`].
    pub fn sphere(center: [f64; 3], radius: f64) -> Result<Self, CollisionError> {
        finite("sphere center", center)?;
        positive("sphere radius", radius)?;
        let axis = [0.0, 1.0, 0.0];
        Ok(Self {
            name: "sphere",
            a: center,
            axis,
            length: 0.0,
            radius,
            taper: 0.0,
            slope: 0.0,
        })
    }
}

impl Body for RoundCone {
    fn name(&self) -> &str {
        self.name
    }
    fn sample(&self, p: [f64; 3], _time: f64) -> SurfaceSample {
        let d = sub(p, self.a);
        let x = dot(d, self.axis);
        let y = norm(add_scaled(d, self.axis, -x));
        let s = (x - y * self.slope).clamp(0.0, self.length);
        let arm = add_scaled(d, self.axis, -s);
        let reach = norm(arm);
        let normal = if reach == 0.0 {
            perpendicular(self.axis)
        } else {
            scale(arm, 1.0 / reach)
        };
        let distance = reach - (self.radius - self.taper * s);
        SurfaceSample {
            distance,
            normal,
            velocity: [0.0; 3],
        }
    }
    fn is_convex(&self) -> bool {
        true
    }
    fn bounds(&self, _time: f64) -> Aabb {
        let end = self.radius - self.taper * self.length;
        let b = add_scaled(self.a, self.axis, self.length);
        Aabb::of_point(self.a)
            .inflate(self.radius)
            .merge(&Aabb::of_point(b).inflate(end))
    }
}
