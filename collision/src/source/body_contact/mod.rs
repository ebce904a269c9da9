mod guard;
mod history;
mod impact;
mod limits;
mod pass;
mod search;
mod source;

pub(in crate::source) use guard::Guard;
pub(in crate::source) use impact::{Answer, Arrival, Impacts};
pub use limits::BodyContactSettings;
pub(in crate::source) use limits::{
    DEEP, bad_sample, body_coefficients, check_settings, coefficient, foreseen_depth, run_over,
};

use std::ops::Range;
use std::sync::Arc;

use super::envelope::Envelope;
use super::self_contact::inverse_masses;
use crate::error::check_length;
use crate::friction::common_coefficient;
use crate::{Body, CollisionError, ContactPotential, ContactQuadratic, Friction};
use pass::{Anchor, Candidate, Task};

const NAME: &str = "body-contact";

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
/// stopped there, see [`with_masses`](Self::with_masses).
pub struct BodyContact {
    bodies: Vec<Arc<dyn Body>>,
    points: Vec<u32>,
    point_count: usize,
    potential: Box<dyn ContactPotential>,
    friction: Option<Friction>,
    /// Coefficient of each body with cloth of the common coefficient.
    body_coefficients: Vec<f64>,
    /// Coefficients of the points; empty where all are that of the friction.
    coefficients: Vec<f64>,
    inverse_masses: Vec<f64>,
    areas: Vec<f64>,
    /// Masses of the points; empty where fast arrivals are let pass.
    masses: Vec<f64>,
    impacts: Impacts<Candidate>,
    settings: BodyContactSettings,
    envelope: Envelope,
    /// What is known of the distance of every point to every still body;
    /// empty for bodies that move.
    guards: Vec<Vec<Guard>>,
    time_end: f64,
    candidates: Vec<Candidate>,
    /// Candidates of each task.
    ranges: Vec<Range<usize>>,
    memory: Vec<Anchor>,
    spare: Vec<Anchor>,
    tasks: Vec<Task>,
    active: usize,
    deep: usize,
    deepest: f64,
}

impl BodyContact {
    /// Contact of all of `points` points without friction, with the quadratic
    /// penalty of [`ContactQuadratic::body`].
    pub fn new(points: usize, bodies: Vec<Arc<dyn Body>>) -> Self {
        Self {
            bodies,
            points: (0..points as u32).collect(),
            point_count: points,
            potential: Box::new(ContactQuadratic::body()),
            friction: None,
            body_coefficients: Vec::new(),
            coefficients: Vec::new(),
            inverse_masses: Vec::new(),
            areas: Vec::new(),
            masses: Vec::new(),
            impacts: Impacts::default(),
            settings: BodyContactSettings::default(),
            envelope: Envelope::default(),
            guards: Vec::new(),
            time_end: 0.0,
            candidates: Vec::new(),
            ranges: Vec::new(),
            memory: Vec::new(),
            spare: Vec::new(),
            tasks: Vec::new(),
            active: 0,
            deep: 0,
            deepest: 0.0,
        }
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
        self.points = points;
        Ok(self)
    }

    /// Another potential. One whose stiffness is per area needs
    /// [`with_areas`](Self::with_areas).
    #[must_use]
    pub fn with_potential(mut self, potential: Box<dyn ContactPotential>) -> Self {
        self.potential = potential;
        self
    }

    /// Rest areas of all points \[m²\], for a stiffness per area; without them
    /// every point counts as 1 cm².
    ///
    /// # Errors
    /// [`CollisionError::Length`].
    pub fn with_areas(mut self, areas: Vec<f64>) -> Result<Self, CollisionError> {
        check_length("areas", areas.len(), self.point_count)?;
        self.areas = areas;
        Ok(self)
    }

    /// Masses of all points \[kg\]: with them, points that arrive so fast that
    /// the penalty cannot stop them are stopped all the same.
    ///
    /// Fast is what has more kinetic energy towards the body, `½ m u²`, than
    /// the penalty takes up until the point is three thicknesses inside. Such
    /// a point may move no farther than the surface, or a thickness, in one
    /// step; where it touches, the stiffness is that of a stop within two
    /// thicknesses, without a rebound. Nothing changes for points that are
    /// not fast.
    ///
    /// # Errors
    /// [`CollisionError::Length`].
    pub fn with_masses(mut self, masses: &[f64]) -> Result<Self, CollisionError> {
        check_length("masses", masses.len(), self.point_count)?;
        self.masses = masses.to_vec();
        Ok(self)
    }

    /// Adds friction. `masses` of all points \[kg\] set the damping of anchors.
    ///
    /// # Errors
    /// [`CollisionError::Parameter`] for a bad parameter,
    /// [`CollisionError::Length`] for too few masses.
    pub fn with_friction(
        mut self,
        friction: Friction,
        masses: &[f64],
    ) -> Result<Self, CollisionError> {
        friction.validate()?;
        check_length("masses", masses.len(), self.point_count)?;
        self.inverse_masses = inverse_masses(masses);
        self.friction = Some(friction);
        self.pair(friction.coefficient());
        Ok(self)
    }

    /// Coefficients of all points \[1\], each of the cloth there on itself, in
    /// place of the one of [`with_friction`](Self::with_friction), which has
    /// to come first. Equal coefficients cost nothing.
    ///
    /// # Errors
    /// [`CollisionError::Length`], and [`CollisionError::Parameter`] for one
    /// that is negative or not finite.
    pub fn with_coefficients(mut self, coefficients: Vec<f64>) -> Result<Self, CollisionError> {
        let common = common_coefficient(&coefficients, self.point_count)?;
        match (self.friction, common) {
            (None, _) => {}
            (Some(f), Some(common)) => {
                self.friction = Some(f.with_coefficient(common));
                self.pair(common);
            }
            (Some(_), None) => self.coefficients = coefficients,
        }
        Ok(self)
    }

    /// Coefficients of the bodies with cloth of one coefficient.
    fn pair(&mut self, of_cloth: f64) {
        self.body_coefficients = body_coefficients(&self.bodies, of_cloth);
    }

    /// Says which bodies never move. Distances to them are remembered, so that
    /// points far away are not asked for in every step; results do not change.
    ///
    /// # Errors
    /// [`CollisionError::Length`] when there is not one value a body.
    pub fn with_still(mut self, still: &[bool]) -> Result<Self, CollisionError> {
        check_length("still bodies", still.len(), self.bodies.len())?;
        let guard = |still: &bool| vec![Guard::UNKNOWN; if *still { self.point_count } else { 0 }];
        self.guards = still.iter().map(guard).collect();
        Ok(self)
    }

    /// Other settings.
    ///
    /// # Errors
    /// [`CollisionError::Parameter`] for a negative or infinite value, or a
    /// steepness below one.
    pub fn with_settings(mut self, settings: BodyContactSettings) -> Result<Self, CollisionError> {
        check_settings(&settings)?;
        self.settings = settings;
        Ok(self)
    }

    /// The bodies.
    pub fn bodies(&self) -> &[Arc<dyn Body>] {
        &self.bodies
    }

    /// Points deeper than three thicknesses inside a body in the last
    /// evaluation. There the nearest surface may be the wrong one.
    pub fn deep_points(&self) -> usize {
        self.deep
    }
}
