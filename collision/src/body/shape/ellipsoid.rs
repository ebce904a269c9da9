use super::super::vec3::{dot, norm, scale, sub};
use super::super::{Body, Pose, SurfaceSample};
use super::positive;
use crate::{Aabb, CollisionError};

/// An ellipsoid with its exact Euclidean distance.
///
/// ```text
/// nearest point x_i = a_i² y_i / (t + a_i²),   t the largest root of
/// |w(t)| = 1,   w_i = a_i y_i / (t + a_i²),     t > −min a_i²
/// ```
/// for the query `y` in the principal frame. Newton's method runs on
/// `1/|w| − 1`, which is concave and increasing, from the left of the root:
/// every step stays left of it, and convergence is quadratic from the start
/// (the secular equation of trust regions [MoreSorensen1983]).
/// Four to six steps reach rounding: the distance is
/// exact to `1e-12` of the largest axis, the gradient is of unit length.
/// On the medial disk the gradient jumps and one side is taken.
/// Axes of ratios up to 1000 are accepted.
#[derive(Clone, Copy, Debug)]
pub struct Ellipsoid {
    axes: [f64; 3],
    squares: [f64; 3],
    excess: [f64; 3], // a_i² − min a²
    smallest: usize,
    pose: Pose,
}

impl Ellipsoid {
    /// An ellipsoid of half axes `axes` [m] in the frame of `pose`.
    ///
    /// # Errors
    ///
    /// [`CollisionError::Parameter`] for axes that are not positive, or a ratio
    /// above 1000.
    pub fn new(axes: [f64; 3], pose: Pose) -> Result<Self, CollisionError> {
        let mut smallest = 0;
        let mut largest = 0.0_f64;
        for i in 0..3 {
            positive("ellipsoid axis", axes[i])?;
            if axes[i] < axes[smallest] {
                smallest = i;
            }
            largest = largest.max(axes[i]);
        }
        let ratio = largest / axes[smallest];
        if ratio > 1000.0 {
            return Err(CollisionError::Parameter {
                name: "ellipsoid axis ratio",
                value: ratio,
                requirement: "at most 1000",
            });
        }
        let excess = axes.map(|a| (a - axes[smallest]) * (a + axes[smallest]));
        Ok(Self {
            axes,
            squares: axes.map(|a| a * a),
            excess,
            smallest,
            pose,
        })
    }

    /// `s = t + min a²` at the nearest point; `y` has no negative coordinate.
    fn root(&self, y: [f64; 3]) -> f64 {
        let m = self.smallest;
        // |w| ≥ w_m = 1 here: left of the root, right of the pole.
        let mut s = self.axes[m] * y[m];
        for _ in 0..40 {
            let (mut w2, mut slope) = (0.0, 0.0);
            for i in 0..3 {
                let g = s + self.excess[i];
                let w = self.axes[i] * y[i] / g;
                w2 += w * w;
                slope += w * w / g;
            }
            let w = w2.sqrt();
            let step = (w - 1.0) * w2 / slope;
            s += step;
            // Also ends when rounding turns the step negative.
            if step <= 1e-15 * s || step.is_nan() {
                break;
            }
        }
        s
    }
}

impl Body for Ellipsoid {
    fn name(&self) -> &str {
        "ellipsoid"
    }
    fn sample(&self, p: [f64; 3], _time: f64) -> SurfaceSample {
        let local = self.pose.to_local(p);
        let mut y = local.map(f64::abs);
        // Off the symmetry plane by a trace: the root is then never at the pole.
        let m = self.smallest;
        y[m] = if y[m].is_nan() {
            y[m]
        } else {
            y[m].max(1e-14 * self.axes[m])
        };
        let s = self.root(y);
        let foot: [f64; 3] = std::array::from_fn(|i| {
            (self.squares[i] * y[i] / (s + self.excess[i])).copysign(local[i])
        });
        let raw: [f64; 3] = std::array::from_fn(|i| foot[i] / self.squares[i]);
        let normal = scale(raw, 1.0 / norm(raw));
        let distance = dot(sub(local, foot), normal);
        SurfaceSample {
            distance,
            normal: self.pose.rotate(normal),
            velocity: [0.0; 3],
        }
    }
    fn is_convex(&self) -> bool {
        true
    }
    fn bounds(&self, _time: f64) -> Aabb {
        // Support of a rotated ellipsoid along axis i: √Σ_j (R_ij a_j)².
        let c = self.pose.to_world([0.0; 3]);
        let columns: [[f64; 3]; 3] = std::array::from_fn(|j| {
            let mut e = [0.0; 3];
            e[j] = self.axes[j];
            self.pose.rotate(e)
        });
        let h: [f64; 3] = std::array::from_fn(|i| {
            columns
                .iter()
                .map(|col| col[i] * col[i])
                .sum::<f64>()
                .sqrt()
        });
        Aabb {
            min: std::array::from_fn(|i| c[i] - h[i]),
            max: std::array::from_fn(|i| c[i] + h[i]),
        }
    }
}
