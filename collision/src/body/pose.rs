use super::vec3::{add, sub};
use super::{Body, SurfaceSample};
use crate::{Aabb, CollisionError};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// A rigid placement: `p_world = R p_local + t`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    rows: [[f64; 3]; 3],
    translation: [f64; 3],
}

impl Pose {
    /// No rotation, no translation.
    pub const IDENTITY: Self = Self {
        rows: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        translation: [0.0; 3],
    };

    /// A translation [m] after a rotation, given as axis times angle [rad].
    ///
    /// # Errors
    ///
    /// [`CollisionError::Parameter`] when a number is not finite.
    pub fn new(translation: [f64; 3], rotation: [f64; 3]) -> Result<Self, CollisionError> {
        finite("translation", translation)?;
        finite("rotation", rotation)?;
        Ok(Self::of_quaternion(
            &UnitQuaternion::from_scaled_axis(Vector3::from(rotation)),
            translation,
        ))
    }

    pub(crate) fn of_quaternion(rotation: &UnitQuaternion<f64>, translation: [f64; 3]) -> Self {
        let m: Matrix3<f64> = rotation.to_rotation_matrix().into_inner();
        Self {
            rows: std::array::from_fn(|i| std::array::from_fn(|j| m[(i, j)])),
            translation,
        }
    }

    /// `R v`: a direction of the local frame in the world.
    #[inline]
    pub fn rotate(&self, v: [f64; 3]) -> [f64; 3] {
        self.rows.map(|r| r[0] * v[0] + r[1] * v[1] + r[2] * v[2])
    }

    /// `Rᵀ v`: a direction of the world in the local frame.
    #[inline]
    pub fn rotate_back(&self, v: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|j| {
            self.rows[0][j] * v[0] + self.rows[1][j] * v[1] + self.rows[2][j] * v[2]
        })
    }

    /// A local point in the world.
    #[inline]
    pub fn to_world(&self, p: [f64; 3]) -> [f64; 3] {
        add(self.rotate(p), self.translation)
    }

    /// A point of the world in the local frame.
    #[inline]
    pub fn to_local(&self, p: [f64; 3]) -> [f64; 3] {
        self.rotate_back(sub(p, self.translation))
    }

    /// The smallest box of the world around a box of the local frame.
    pub fn bounds(&self, local: &Aabb) -> Aabb {
        let mut out = Aabb {
            min: self.translation,
            max: self.translation,
        };
        for i in 0..3 {
            for j in 0..3 {
                let r = self.rows[i][j];
                if r == 0.0 {
                    continue; // 0 · ∞ of a half-space
                }
                let (a, b) = (r * local.min[j], r * local.max[j]);
                out.min[i] += a.min(b);
                out.max[i] += a.max(b);
            }
        }
        out
    }
}

/// Largest coordinate [m] or angle [rad] accepted: beyond it squares may
/// overflow, and millimetres are lost to rounding long before.
const LARGEST: f64 = 1e9;

pub(crate) fn finite(name: &'static str, v: [f64; 3]) -> Result<(), CollisionError> {
    let outside = |x: &f64| x.is_nan() || x.abs() > LARGEST;
    match v.into_iter().find(outside) {
        None => Ok(()),
        Some(value) => Err(CollisionError::Parameter {
            name,
            value,
            requirement: "finite and at most 1e9",
        }),
    }
}

/// A body at a fixed place.
#[derive(Clone, Debug)]
pub struct Placed<B> {
    pose: Pose,
    body: B,
}

impl<B: Body> Placed<B> {
    /// Places a body; `pose` maps the body's frame to the world.
    pub const fn new(body: B, pose: Pose) -> Self {
        Self { pose, body }
    }
}

impl<B: Body> Body for Placed<B> {
    fn name(&self) -> &str {
        self.body.name()
    }
    fn sample(&self, p: [f64; 3], time: f64) -> SurfaceSample {
        let s = self.body.sample(self.pose.to_local(p), time);
        SurfaceSample {
            distance: s.distance,
            normal: self.pose.rotate(s.normal),
            velocity: self.pose.rotate(s.velocity),
        }
    }
    fn bounds(&self, time: f64) -> Aabb {
        self.pose.bounds(&self.body.bounds(time))
    }
    fn to_body(&self, p: [f64; 3], time: f64) -> [f64; 3] {
        self.body.to_body(self.pose.to_local(p), time)
    }
    fn from_body(&self, p: [f64; 3], time: f64) -> [f64; 3] {
        self.pose.to_world(self.body.from_body(p, time))
    }
    fn is_convex(&self) -> bool {
        self.body.is_convex()
    }
    fn friction(&self) -> Option<f64> {
        self.body.friction()
    }
}
