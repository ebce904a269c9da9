use super::super::vec3::{norm, scale};
use super::super::{Body, Pose, SurfaceSample};
use super::{at_most, positive};
use crate::{Aabb, CollisionError};

/// A box, its edges and corners rounded if wanted.
///
/// ```text
/// q = |p| − (half − r),   φ = |max(q, 0)| + min(max_i q_i, 0) − r
/// ```
/// in the frame of the box. Exact, of unit gradient; inside, the
/// gradient jumps where two faces are equally near.
#[derive(Clone, Copy, Debug)]
pub struct RoundBox {
    core: [f64; 3],
    rounding: f64,
    pose: Pose,
}

impl RoundBox {
    /// A box of half lengths `half` [m], rounding included, in the frame of `pose`.
    ///
    /// # Errors
    ///
    /// [`CollisionError::Parameter`] for half lengths that are not positive or
    /// a rounding larger than one of them.
    pub fn new(half: [f64; 3], rounding: f64, pose: Pose) -> Result<Self, CollisionError> {
        for h in half {
            positive("box half length", h)?;
            at_most("box rounding", rounding, h)?;
        }
        Ok(Self {
            core: half.map(|h| h - rounding),
            rounding,
            pose,
        })
    }
}

impl Body for RoundBox {
    fn name(&self) -> &str {
        "box"
    }
    fn sample(&self, p: [f64; 3], _time: f64) -> SurfaceSample {
        let local = self.pose.to_local(p);
        let q: [f64; 3] = std::array::from_fn(|i| local[i].abs() - self.core[i]);
        let mut k = 0;
        for i in 1..3 {
            if q[i] > q[k] {
                k = i;
            }
        }
        let (distance, normal) = if q[k] > 0.0 {
            let out = q.map(|x| if x < 0.0 { 0.0 } else { x }); // keeps NaN
            let d = norm(out);
            (d, scale(out, 1.0 / d))
        } else {
            let mut n = [0.0; 3];
            n[k] = 1.0;
            // The sum keeps a NaN of any coordinate.
            (q[k] + 0.0 * (q[0] + q[1] + q[2]), n)
        };
        let signed = std::array::from_fn(|i| normal[i] * 1.0_f64.copysign(local[i]));
        SurfaceSample {
            distance: distance - self.rounding,
            normal: self.pose.rotate(signed),
            velocity: [0.0; 3],
        }
    }
    fn is_convex(&self) -> bool {
        true
    }
    fn bounds(&self, _time: f64) -> Aabb {
        let half = self.core.map(|c| c + self.rounding);
        self.pose.bounds(&Aabb {
            min: half.map(|h| -h),
            max: half,
        })
    }
}
