//! Obstacles: signed distance, normal and surface velocity at a point.
//!
//! A [`Body`] is a signed distance function `φ(p, t)`, negative inside. The
//! bodies here are
//!
//! | body | distance |
//! |---|---|
//! | [`RoundCone`] (sphere, capsule), [`Ellipsoid`], [`RoundBox`], [`Cylinder`], [`Plane`] | exact |
//! | [`Union`] | exact outside, a bound inside |
//! | [`SmoothUnion`] | within `k ln n` below the union |
//! | [`MeshBody`], [`BakedBody`] | trilinear on a sparse grid, error bound at [`SparseField`] |
//! | [`Placed`], [`RigidMotion`], [`Named`] | that of the body they wrap |
//!
//! [`Shape`] describes the analytic ones as plain data, [`mannequin`] is a
//! person made of them, and [`surface_mesh`] turns any body into triangles.
//!
//! Points with a NaN coordinate give a NaN distance; nothing panics.

mod baked;
mod field;
mod girth;
mod mannequin;
mod mesh;
mod motion;
mod named;
mod pose;
mod shape;
mod surface;
mod union;
mod vec3;

pub use baked::BakedBody;
pub use field::{FieldSettings, SparseField};
pub use girth::{Girth, girth};
pub use mannequin::{Mannequin, mannequin};
pub use mesh::{CacheNote, MeshBody, MeshReport};
pub use motion::{Interpolation, Keyframe, RigidMotion};
pub use named::Named;
pub use pose::{Placed, Pose};
pub use shape::{Cylinder, Ellipsoid, Plane, RoundBox, RoundCone, Shape};
pub use surface::{SurfaceMesh, surface_mesh, surface_mesh_in};
pub use union::{SmoothUnion, Union};

use crate::Aabb;
use std::sync::Arc;

/// Signed distance of a body at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceSample {
    /// Signed distance `φ` [m], negative inside.
    pub distance: f64,
    /// Gradient `∇φ` of the distance as sampled [1]; of unit length where the
    /// distance is exact, near one on grids and in smooth unions.
    pub normal: [f64; 3],
    /// Velocity of the surface nearest to the point [m/s].
    pub velocity: [f64; 3],
}

impl SurfaceSample {
    pub(crate) fn is_finite(&self) -> bool {
        let vectors = self.normal.iter().chain(&self.velocity);
        self.distance.is_finite() && vectors.copied().all(f64::is_finite)
    }
}

/// An obstacle that cloth touches.
///
/// # Own bodies
///
/// `sample` must be continuous in `p`, defined everywhere, and its `normal`
/// the gradient of its `distance`; Newton's method on the contact energy
/// relies on both. Never panic on a point that is not finite.
pub trait Body: Send + Sync {
    /// Name in messages.
    fn name(&self) -> &str;
    /// Distance at a point [m] and a time [s].
    fn sample(&self, p: [f64; 3], time: f64) -> SurfaceSample;
    /// A box that contains the body, its inside too, at a time [s]; unbounded
    /// for a half-space.
    fn bounds(&self, time: f64) -> Aabb;
    /// [`sample`](Self::sample) of many points; `out` is replaced.
    fn sample_many(&self, points: &[[f64; 3]], time: f64, out: &mut Vec<SurfaceSample>) {
        out.clear();
        out.extend(points.iter().map(|p| self.sample(*p, time)));
    }
    /// A point of the world in the body's own frame, where friction anchors
    /// are kept.
    fn to_body(&self, p: [f64; 3], _time: f64) -> [f64; 3] {
        p
    }
    /// A point of the body's own frame in the world.
    #[allow(clippy::wrong_self_convention)] // the inverse of `to_body`
    fn from_body(&self, p: [f64; 3], _time: f64) -> [f64; 3] {
        p
    }
    /// Whether the body is convex and its distance exact, which is then a convex
    /// function: over a triangle it has one minimum.
    fn is_convex(&self) -> bool {
        false
    }
    /// Coulomb friction coefficient of this body's material [1], which contact
    /// pairs with the cloth's; `None` leaves the choice to the cloth.
    fn friction(&self) -> Option<f64> {
        None
    }
}

macro_rules! forward {
    ($pointer:ident) => {
        impl<B: Body + ?Sized> Body for $pointer<B> {
            fn name(&self) -> &str {
                (**self).name()
            }
            fn sample(&self, p: [f64; 3], time: f64) -> SurfaceSample {
                (**self).sample(p, time)
            }
            fn bounds(&self, time: f64) -> Aabb {
                (**self).bounds(time)
            }
            fn sample_many(&self, points: &[[f64; 3]], time: f64, out: &mut Vec<SurfaceSample>) {
                (**self).sample_many(points, time, out);
            }
            fn to_body(&self, p: [f64; 3], time: f64) -> [f64; 3] {
                (**self).to_body(p, time)
            }
            fn from_body(&self, p: [f64; 3], time: f64) -> [f64; 3] {
                (**self).from_body(p, time)
            }
            fn is_convex(&self) -> bool {
                (**self).is_convex()
            }
            fn friction(&self) -> Option<f64> {
                (**self).friction()
            }
        }
    };
}
forward!(Box);
forward!(Arc);
