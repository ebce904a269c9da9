use super::super::pose::finite;
use super::super::vec3::{add_scaled, dot, norm, perpendicular, scale, sub};
use super::super::{Body, SurfaceSample};
use super::{at_most, positive};
use crate::{Aabb, CollisionError};

/// A cylinder with flat ends, its rims rounded if wanted.
///
/// The distance is that of a rounded rectangle in the half-plane
/// `(radius, axis)`: exact, of unit gradient. On the axis, inside, any right
/// angle to it is taken when the mantle is nearest.
#[derive(Clone, Copy, Debug)]
pub struct Cylinder {
    center: [f64; 3],
    axis: [f64; 3],
    core: [f64; 2], // radius and half length without the rounding
    rounding: f64,
}

impl Cylinder {
    /// A cylinder between the centres `a` and `b` of its end faces [m].
    ///
    /// # Errors
    ///
    /// [`CollisionError::Parameter`] for a radius or length that is not
    /// positive, or a rounding above either half length.
    pub fn new(
        a: [f64; 3],
        b: [f64; 3],
        radius: f64,
        rounding: f64,
    ) -> Result<Self, CollisionError> {
        finite("cylinder end", a)?;
        finite("cylinder end", b)?;
        positive("cylinder radius", radius)?;
        let span = sub(b, a);
        let length = norm(span);
        positive("cylinder length", length)?;
        at_most("cylinder rounding", rounding, radius.min(0.5 * length))?;
        Ok(Self {
            center: add_scaled(a, span, 0.5),
            axis: scale(span, 1.0 / length),
            core: [radius - rounding, 0.5 * length - rounding],
            rounding,
        })
    }
}

impl Body for Cylinder {
    fn name(&self) -> &str {
        "cylinder"
    }
    fn sample(&self, p: [f64; 3], _time: f64) -> SurfaceSample {
        let d = sub(p, self.center);
        let x = dot(d, self.axis);
        let off = add_scaled(d, self.axis, -x);
        let y = norm(off);
        let out = if y == 0.0 {
            perpendicular(self.axis)
        } else {
            scale(off, 1.0 / y)
        };
        let q = [y - self.core[0], x.abs() - self.core[1]];
        let (distance, [ny, nx]) = if q[0] > 0.0 && q[1] > 0.0 {
            let r = q[0].hypot(q[1]);
            (r, [q[0] / r, q[1] / r])
        } else if q[0] >= q[1] {
            (q[0], [1.0, 0.0])
        } else {
            (q[1], [0.0, 1.0])
        };
        SurfaceSample {
            distance: distance - self.rounding,
            normal: add_scaled(scale(out, ny), self.axis, nx.copysign(x)),
            velocity: [0.0; 3],
        }
    }
    fn is_convex(&self) -> bool {
        true
    }
    fn bounds(&self, _time: f64) -> Aabb {
        let radius = self.core[0] + self.rounding;
        let half = self.core[1] + self.rounding;
        // A disk of normal u reaches √(1 − u_i²) r along axis i.
        let h = self
            .axis
            .map(|u| half * u.abs() + radius * (1.0 - u * u).max(0.0).sqrt());
        Aabb {
            min: std::array::from_fn(|i| self.center[i] - h[i]),
            max: std::array::from_fn(|i| self.center[i] + h[i]),
        }
    }
}
