mod search;

use std::ops::Range;
use std::sync::Arc;

use super::CHUNK;
use super::against_bodies::{
    AgainstBodies, Candidate, Element, NotFinite, Pass, Search, Task, Touch,
};
use crate::vec3::{Mat3, Vec3, add, axpy, norm, point, scale, unit};
use crate::{
    Body, CollisionError, ContactQuadratic, ContactResponse, LaggedResponse, SurfaceSample,
};

/// Points of cloth against bodies.
///
/// ```text
/// E = Σ E_c(φ(x)),   f = -E_c'(φ) ∇φ,   K = E_c'' ∇φ ∇φᵀ
/// ```
/// `φ` is the distance in the pose at the end of the step. The curvature is
/// the Gauss-Newton part, without `∇²φ`. Friction acts in the plane across
/// `∇φ`, on the velocity relative to the surface; its anchors are kept in the
/// body's own frame and move with it. A body that brings its own friction
/// coefficient rubs with the [geometric mean](crate::pair_friction) of its
/// and the cloth's, another one with the cloth's.
///
/// A step in which a point and a body approach so fast that the point would end
/// [too deep](CollisionError::Overrun) is refused, for a shorter one. A point
/// faster than the penalty can stop is led to the surface in shorter steps and
/// stopped there, see [`with_masses`](AgainstBodies::with_masses).
pub type BodyContact = AgainstBodies<Points>;

/// Single points of cloth.
pub struct Points {
    /// Those that touch bodies, in order.
    of: Vec<u32>,
    total: usize,
}

/// What a body says of the points of a task.
#[derive(Clone, Debug, Default)]
pub struct Samples {
    places: Vec<Vec3>,
    samples: Vec<SurfaceSample>,
}

impl AgainstBodies<Points> {
    /// Contact of all of `points` points without friction, with the quadratic
    /// penalty of [`ContactQuadratic::body`].
    pub fn new(points: usize, bodies: Vec<Arc<dyn Body>>) -> Self {
        let all = Points {
            of: (0..points as u32).collect(),
            total: points,
        };
        Self::of(all, points, bodies, Box::new(ContactQuadratic::body()))
    }

    /// Only some points touch bodies: leave out those pinned to one.
    ///
    /// # Errors
    /// [`CollisionError::PointOutOfRange`].
    pub fn with_points(mut self, mut points: Vec<u32>) -> Result<Self, CollisionError> {
        points.sort_unstable();
        points.dedup();
        let count = self.point_count;
        if let Some(index) = points.iter().position(|p| *p as usize >= count) {
            let (what, point) = ("body contact", points[index]);
            return Err(CollisionError::PointOutOfRange {
                what,
                index,
                point,
                points: count,
            });
        }
        self.element.of = points;
        Ok(self)
    }

    /// Points deeper than three thicknesses inside a body in the last
    /// evaluation. There the nearest surface may be the wrong one.
    pub fn deep_points(&self) -> usize {
        self.deep
    }
}

/// Weights of the corners of a point: none.
type Alone = [f64; 0];

impl Element for Points {
    const NAME: &'static str = "body-contact";
    const CHUNK: usize = CHUNK;
    // Sampled all at once.
    const ONE_BODY: bool = true;

    type Weights = Alone;
    type Scratch = Samples;

    fn searched(&self) -> usize {
        self.of.len()
    }

    fn total(&self) -> usize {
        self.total
    }

    fn first_point(&self, point: u32) -> u32 {
        point
    }

    fn points(&self) -> impl Iterator<Item = u32> {
        self.of.iter().copied()
    }

    fn search(look: &Search<'_, Self>, range: Range<usize>, task: &mut Task<Alone, Samples>) {
        search::search(look, range, task);
    }

    fn prepare(pass: &Pass<'_, Self>, all: &[Candidate<Alone>], scratch: &mut Samples) {
        let Some(first) = all.first() else { return };
        let places = all.iter().map(|c| point(pass.at.q, c.of.element));
        scratch.places.clear();
        scratch.places.extend(places);
        let body = &pass.source.bodies[first.of.body as usize];
        body.sample_many(&scratch.places, pass.source.time_end, &mut scratch.samples);
    }

    #[inline]
    fn touch(
        pass: &Pass<'_, Self>,
        c: &Candidate<Alone>,
        i: usize,
        scratch: &Samples,
    ) -> Result<Option<Touch<Alone>>, NotFinite> {
        // A body of the user's own may return too few.
        let s = scratch.samples.get(i).ok_or(NotFinite)?;
        if !s.is_finite() {
            return Err(NotFinite);
        }
        if s.distance >= pass.source.potential.thickness() {
            return Ok(None);
        }
        // A field without a slope gives no direction: no force.
        let Some(normal) = unit(s.normal) else {
            return Ok(None);
        };
        let repulsion = pass.repel(c.of, s.distance);
        let pressing = scale(repulsion.force, s.normal);
        Ok(Some(Touch {
            of: c.of,
            weights: [],
            distance: s.distance,
            slope: s.normal,
            velocity: s.velocity,
            repulsion,
            normal,
            normal_force: norm(pressing),
            pressing,
            corner: None,
        }))
    }

    #[inline]
    fn position(&self, p: u32, _: &Alone, q: &[f64]) -> Vec3 {
        point(q, p)
    }

    #[inline]
    fn mean(&self, p: u32, _: &Alone, values: &[f64]) -> f64 {
        values[p as usize]
    }

    #[inline]
    fn inverse_mass(&self, p: u32, _: &Alone, inverse_masses: &[f64]) -> f64 {
        inverse_masses[p as usize]
    }

    #[inline]
    fn push(
        &self,
        touch: &Touch<Alone>,
        mut force: Vec3,
        mut curvature: Option<Mat3>,
        lagged: Option<(Alone, LaggedResponse)>,
        out: &mut ContactResponse,
    ) {
        if let Some((_, answer)) = lagged {
            force = axpy(force, 1.0, answer.force);
            if let Some(k) = &mut curvature {
                *k = std::array::from_fn(|i| add(k[i], answer.curvature[i]));
            }
        }
        out.body_nodes.push(touch.of.element);
        out.body_force.push(force);
        out.body_curvature.extend(curvature);
    }

    fn heap_bytes(&self) -> usize {
        4 * self.of.capacity()
    }

    fn scratch_bytes(scratch: &Samples) -> usize {
        size_of::<Vec3>() * scratch.places.capacity()
            + size_of::<SurfaceSample>() * scratch.samples.capacity()
    }
}
