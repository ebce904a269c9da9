use super::field::{NodeSource, SparseField};
use super::{Body, FieldSettings, SurfaceSample};
use crate::{Aabb, CollisionError};

/// A still body sampled on a [`SparseField`]: a cost per sample that does not
/// depend on the number of shapes it is made of.
///
/// The errors of the grid come on top of those of the body; the refinement
/// assumes that its distance is 1-Lipschitz, as all bodies here are.
#[derive(Clone, Debug)]
pub struct BakedBody {
    name: String,
    friction: Option<f64>,
    bounds: Aabb,
    field: SparseField,
}

struct AtTime<'a> {
    body: &'a dyn Body,
    time: f64,
}

impl NodeSource for AtTime<'_> {
    fn fill(&self, origin: [f64; 3], spacing: f64, counts: [usize; 3], out: &mut [f64]) {
        let [nx, ny, _] = counts;
        for (n, value) in out.iter_mut().enumerate() {
            let node = [n % nx, n / nx % ny, n / (nx * ny)];
            let p = std::array::from_fn(|a| origin[a] + spacing * node[a] as f64);
            *value = self.body.sample(p, self.time).distance;
        }
    }
}

impl BakedBody {
    /// Samples `body` as it is at `time` [s].
    ///
    /// # Errors
    ///
    /// [`CollisionError::Body`] when the bounds of the body are not finite,
    /// [`CollisionError::Parameter`] for settings out of range.
    pub fn new(
        body: &dyn Body,
        time: f64,
        settings: &FieldSettings,
    ) -> Result<Self, CollisionError> {
        let bounds = body.bounds(time);
        if !bounds.is_finite() || bounds.is_empty() {
            return Err(CollisionError::Body {
                body: body.name().to_owned(),
                reason: "its bounds are not finite".to_owned(),
            });
        }
        let field = SparseField::build(&AtTime { body, time }, &bounds, settings)?;
        let (name, friction) = (body.name().to_owned(), body.friction());
        Ok(Self {
            name,
            friction,
            bounds,
            field,
        })
    }

    /// The sampled distance.
    pub const fn field(&self) -> &SparseField {
        &self.field
    }
}

impl Body for BakedBody {
    fn name(&self) -> &str {
        &self.name
    }
    fn sample(&self, p: [f64; 3], _time: f64) -> SurfaceSample {
        let (distance, normal) = self.field.sample(p);
        SurfaceSample {
            distance,
            normal,
            velocity: [0.0; 3],
        }
    }
    fn bounds(&self, _time: f64) -> Aabb {
        self.bounds
    }
    fn friction(&self) -> Option<f64> {
        self.friction
    }
}
