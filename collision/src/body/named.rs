use super::{Body, SurfaceSample};
use crate::{Aabb, CollisionError};

/// A body with a name of its own and, if wanted, its own friction.
///
/// ```
/// use selvedge_collision::body::{Body, Named, Shape};
///
/// let ball = Shape::Sphere { center: [0.0; 3], radius: 0.1 }.build()?;
/// let ball = Named::new("ball", ball).with_friction(0.3)?;
/// assert_eq!((ball.name(), ball.friction()), ("ball", Some(0.3)));
/// # Ok::<(), selvedge_collision::CollisionError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Named<B> {
    name: String,
    friction: Option<f64>,
    body: B,
}

impl<B: Body> Named<B> {
    /// Names a body; its friction stays what it was.
    pub fn new(name: impl Into<String>, body: B) -> Self {
        Self {
            name: name.into(),
            friction: body.friction(),
            body,
        }
    }

    /// Sets the Coulomb friction coefficient [1].
    ///
    /// # Errors
    ///
    /// [`CollisionError::Parameter`] when it is negative or not finite.
    pub fn with_friction(mut self, friction: f64) -> Result<Self, CollisionError> {
        if !(friction.is_finite() && friction >= 0.0) {
            return Err(CollisionError::Parameter {
                name: "body friction",
                value: friction,
                requirement: "finite and not negative",
            });
        }
        self.friction = Some(friction);
        Ok(self)
    }

    /// The body without its name.
    pub fn into_inner(self) -> B {
        self.body
    }
}

impl<B: Body> Body for Named<B> {
    fn name(&self) -> &str {
        &self.name
    }
    fn sample(&self, p: [f64; 3], time: f64) -> SurfaceSample {
        self.body.sample(p, time)
    }
    fn bounds(&self, time: f64) -> Aabb {
        self.body.bounds(time)
    }
    fn sample_many(&self, points: &[[f64; 3]], time: f64, out: &mut Vec<SurfaceSample>) {
        self.body.sample_many(points, time, out);
    }
    fn to_body(&self, p: [f64; 3], time: f64) -> [f64; 3] {
        self.body.to_body(p, time)
    }
    fn from_body(&self, p: [f64; 3], time: f64) -> [f64; 3] {
        self.body.from_body(p, time)
    }
    fn is_convex(&self) -> bool {
        self.body.is_convex()
    }
    fn friction(&self) -> Option<f64> {
        self.friction
    }
}
