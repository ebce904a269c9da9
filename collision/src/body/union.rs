use super::vec3::add_scaled;
use super::{Body, SurfaceSample};
use crate::{Aabb, CollisionError};

fn merged(parts: &[Box<dyn Body>], time: f64) -> Aabb {
    parts
        .iter()
        .fold(Aabb::EMPTY, |b, p| b.merge(&p.bounds(time)))
}

fn not_empty(parts: &[Box<dyn Body>]) -> Result<(), CollisionError> {
    if parts.is_empty() {
        return Err(CollisionError::Parameter {
            name: "union parts",
            value: 0.0,
            requirement: "at least one",
        });
    }
    Ok(())
}

/// Several bodies as one: `φ = min φ_i`.
///
/// Exact outside; inside, the distance to the nearest part's surface, which
/// may lie within another part, so the depth is a lower bound. The gradient
/// jumps where two parts are equally near; [`SmoothUnion`] avoids that.
///
/// Friction anchors live in the world: parts that move relative to each other
/// belong in the scene as bodies of their own.
pub struct Union {
    parts: Vec<Box<dyn Body>>,
}

impl Union {
    /// Joins bodies.
    ///
    /// # Errors
    ///
    /// [`CollisionError::Parameter`] when there are none.
    pub fn new(parts: Vec<Box<dyn Body>>) -> Result<Self, CollisionError> {
        not_empty(&parts)?;
        Ok(Self { parts })
    }
}

impl Body for Union {
    fn name(&self) -> &str {
        "union"
    }
    fn sample(&self, p: [f64; 3], time: f64) -> SurfaceSample {
        let mut best = self.parts[0].sample(p, time);
        for part in &self.parts[1..] {
            let s = part.sample(p, time);
            if s.distance < best.distance {
                best = s;
            }
        }
        best
    }
    fn bounds(&self, time: f64) -> Aabb {
        merged(&self.parts, time)
    }
}

/// Several bodies joined with rounded creases.
///
/// ```text
/// φ = −k ln Σ exp(−φ_i / k),   ∇φ = Σ w_i ∇φ_i,   w_i = exp((φ − φ_i) / k),  Σ w_i = 1
/// min φ_i − k ln n  ≤  φ  ≤  min φ_i
/// ```
/// `k` [m] is the blend radius. The union is symmetric in its parts, as smooth
/// as they are, and 1-Lipschitz when they are. The surface lies outside
/// the plain union by at most `k ln n`; `k ln 2` where two parts are equally
/// near, and less than `k exp(−g / k)` where the next part is `g` further away.
/// `|∇φ| ≤ 1`, less where parts with different normals blend.
/// The velocity is the mean of the parts' with the same weights. Anchors as
/// in [`Union`].
pub struct SmoothUnion {
    parts: Vec<Box<dyn Body>>,
    radius: f64,
}

impl SmoothUnion {
    /// Joins bodies with blend radius `radius` [m].
    ///
    /// # Errors
    ///
    /// [`CollisionError::Parameter`] when there are no parts, or the radius is
    /// not positive and finite.
    pub fn new(parts: Vec<Box<dyn Body>>, radius: f64) -> Result<Self, CollisionError> {
        not_empty(&parts)?;
        if !(radius.is_finite() && radius > 0.0) {
            return Err(CollisionError::Parameter {
                name: "union radius",
                value: radius,
                requirement: "positive and finite",
            });
        }
        Ok(Self { parts, radius })
    }
}

impl Body for SmoothUnion {
    fn name(&self) -> &str {
        "smooth union"
    }
    fn sample(&self, p: [f64; 3], time: f64) -> SurfaceSample {
        // One pass: the sums are relative to the smallest distance so far and
        // rescaled when a smaller one appears, so that nothing overflows.
        let first = self.parts[0].sample(p, time);
        let (mut low, mut sum) = (first.distance, 1.0);
        let (mut normal, mut velocity) = (first.normal, first.velocity);
        for part in &self.parts[1..] {
            let s = part.sample(p, time);
            let weight = if s.distance < low {
                let shrink = ((s.distance - low) / self.radius).exp();
                sum *= shrink;
                normal = normal.map(|x| x * shrink);
                velocity = velocity.map(|x| x * shrink);
                low = s.distance;
                1.0
            } else {
                ((low - s.distance) / self.radius).exp()
            };
            sum += weight;
            normal = add_scaled(normal, s.normal, weight);
            velocity = add_scaled(velocity, s.velocity, weight);
        }
        SurfaceSample {
            distance: low - self.radius * sum.ln(),
            normal: normal.map(|x| x / sum),
            velocity: velocity.map(|x| x / sum),
        }
    }
    fn bounds(&self, time: f64) -> Aabb {
        let most = self.radius * (self.parts.len() as f64).ln();
        merged(&self.parts, time).inflate(most)
    }
}
