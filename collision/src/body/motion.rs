use super::pose::finite;
use super::vec3::{add, add_scaled, cross, sub};
use super::{Body, Pose, SurfaceSample};
use crate::{Aabb, CollisionError};
use nalgebra::{UnitQuaternion, Vector3};

/// Where a moving body is at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Keyframe {
    /// Time [s].
    pub time: f64,
    /// Translation [m].
    pub translation: [f64; 3],
    /// Rotation about the pivot, axis times angle [rad].
    pub rotation: [f64; 3],
}

/// How a motion passes between keyframes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interpolation {
    /// Constant linear and angular velocity between keys; the velocity jumps
    /// at them.
    #[default]
    Linear,
    /// As `Linear`, reparametrised by `3u² − 2u³`: the motion comes to rest
    /// at every key, so that the velocity is continuous.
    Eased,
}

/// A rigidly moving body.
///
/// ```text
/// p_world = R(t) (p − c) + c + d(t)            c pivot
/// d(t) = d_i + s (d_{i+1} − d_i)               s = u or 3u² − 2u³
/// R(t) = R_i exp(s θ_i),  exp θ_i = R_iᵀ R_{i+1},  |θ_i| ≤ π     (slerp)
/// v(p) = ḋ + R_i θ_i ṡ × (p − c − d)
/// ```
/// The velocity is the exact derivative of the interpolation; at a key of a
/// linear motion it is the one of the segment that begins there. Before the
/// first and after the last key the body rests. Between two keys the rotation
/// takes the shorter way: give keys less than half a turn apart.
#[derive(Clone, Debug)]
pub struct RigidMotion<B> {
    body: B,
    pivot: [f64; 3],
    interpolation: Interpolation,
    times: Vec<f64>,
    translations: Vec<[f64; 3]>,
    rotations: Vec<UnitQuaternion<f64>>,
    turns: Vec<Vector3<f64>>, // θ_i in the frame of key i, one per segment
}

/// Pose and velocity at one time.
struct State {
    pose: Pose,
    centre: [f64; 3], // pivot + d(t)
    linear: [f64; 3],
    angular: [f64; 3],
}

impl<B: Body> RigidMotion<B> {
    /// A body that follows keyframes, rotating about `pivot` (in its own frame [m]).
    ///
    /// # Errors
    ///
    /// [`CollisionError::Parameter`] when there is no key, the times do not
    /// increase, or a number is not finite.
    pub fn new(
        body: B,
        keys: &[Keyframe],
        pivot: [f64; 3],
        interpolation: Interpolation,
    ) -> Result<Self, CollisionError> {
        if keys.is_empty() {
            return Err(CollisionError::Parameter {
                name: "keyframes",
                value: 0.0,
                requirement: "at least one",
            });
        }
        finite("pivot", pivot)?;
        let mut last = f64::NEG_INFINITY;
        for k in keys {
            finite("keyframe translation", k.translation)?;
            finite("keyframe rotation", k.rotation)?;
            if !(k.time.is_finite() && k.time > last) {
                return Err(CollisionError::Parameter {
                    name: "keyframe time",
                    value: k.time,
                    requirement: "finite and later than the one before",
                });
            }
            last = k.time;
        }
        let rotations: Vec<_> = keys
            .iter()
            .map(|k| UnitQuaternion::from_scaled_axis(Vector3::from(k.rotation)))
            .collect();
        let turns = rotations
            .windows(2)
            .map(|r| (r[0].inverse() * r[1]).scaled_axis())
            .collect();
        Ok(Self {
            body,
            pivot,
            interpolation,
            times: keys.iter().map(|k| k.time).collect(),
            translations: keys.iter().map(|k| k.translation).collect(),
            rotations,
            turns,
        })
    }

    /// The pose at a time [s].
    pub fn pose(&self, time: f64) -> Pose {
        self.state(time).pose
    }

    fn state(&self, time: f64) -> State {
        // Number of keys at or before `time`; NaN counts as before all.
        let after = self.times.partition_point(|t| *t <= time);
        let last = self.times.len() - 1;
        if after == 0 || after > last {
            return self.at(
                &self.rotations[after.min(last)],
                self.translations[after.min(last)],
            );
        }
        let i = after - 1;
        let span = self.times[i + 1] - self.times[i];
        let u = (time - self.times[i]) / span;
        let (s, rate) = match self.interpolation {
            Interpolation::Linear => (u, 1.0 / span),
            Interpolation::Eased => (u * u * (3.0 - 2.0 * u), 6.0 * u * (1.0 - u) / span),
        };
        let shift = sub(self.translations[i + 1], self.translations[i]);
        let turn = self.turns[i];
        let rotation = self.rotations[i] * UnitQuaternion::from_scaled_axis(turn * s);
        let mut state = self.at(&rotation, add_scaled(self.translations[i], shift, s));
        state.linear = shift.map(|x| x * rate);
        state.angular = (self.rotations[i] * (turn * rate)).into();
        state
    }

    fn at(&self, rotation: &UnitQuaternion<f64>, shift: [f64; 3]) -> State {
        let centre = add(self.pivot, shift);
        let turned: [f64; 3] = (rotation * Vector3::from(self.pivot)).into();
        State {
            pose: Pose::of_quaternion(rotation, sub(centre, turned)),
            centre,
            linear: [0.0; 3],
            angular: [0.0; 3],
        }
    }
}

impl<B: Body> RigidMotion<B> {
    fn sample_at(&self, state: &State, p: [f64; 3], time: f64) -> SurfaceSample {
        let s = self.body.sample(state.pose.to_local(p), time);
        let normal = state.pose.rotate(s.normal);
        // The velocity is that of the surface point under `p`.
        let foot = add_scaled(p, normal, -s.distance);
        let rigid = add(state.linear, cross(state.angular, sub(foot, state.centre)));
        SurfaceSample {
            distance: s.distance,
            normal,
            velocity: add(rigid, state.pose.rotate(s.velocity)),
        }
    }
}

impl<B: Body> Body for RigidMotion<B> {
    fn name(&self) -> &str {
        self.body.name()
    }
    fn sample(&self, p: [f64; 3], time: f64) -> SurfaceSample {
        self.sample_at(&self.state(time), p, time)
    }
    fn sample_many(&self, points: &[[f64; 3]], time: f64, out: &mut Vec<SurfaceSample>) {
        let state = self.state(time);
        out.clear();
        out.extend(points.iter().map(|p| self.sample_at(&state, *p, time)));
    }
    fn bounds(&self, time: f64) -> Aabb {
        self.pose(time).bounds(&self.body.bounds(time))
    }
    fn to_body(&self, p: [f64; 3], time: f64) -> [f64; 3] {
        self.body.to_body(self.pose(time).to_local(p), time)
    }
    fn from_body(&self, p: [f64; 3], time: f64) -> [f64; 3] {
        self.pose(time).to_world(self.body.from_body(p, time))
    }
    fn is_convex(&self) -> bool {
        self.body.is_convex()
    }
    fn friction(&self) -> Option<f64> {
        self.body.friction()
    }
}
