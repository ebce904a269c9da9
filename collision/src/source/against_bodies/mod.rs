//! Cloth against bodies: all that does not depend on what of the cloth meets
//! them, its points or its triangles.

mod anchor;
mod element;
mod friction;
mod guard;
mod impact;
mod limits;
mod pass;
mod search;
mod source;

pub use element::BodyElement;
pub(in crate::source) use element::{BodyPair, Candidate, Element, NotFinite, Task, Touch};
pub(in crate::source) use guard::Guard;
pub use limits::BodyContactSettings;
pub(in crate::source) use pass::Pass;
pub(in crate::source) use search::Search;

use std::ops::Range;
use std::sync::Arc;

use super::envelope::Envelope;
use crate::error::check_length;
use crate::friction::common_coefficient;
use crate::{Body, CollisionError, ContactPotential, Friction};
use element::{AnchorOf, CandidateOf, TaskOf};
use friction::BodyFriction;
use impact::Impacts;

/// Cloth against bodies: [`BodyContact`](crate::BodyContact) for its points,
/// [`BodyFaces`](crate::BodyFaces) for its triangles.
pub struct AgainstBodies<E: BodyElement> {
    pub(in crate::source) element: E,
    pub(in crate::source) bodies: Vec<Arc<dyn Body>>,
    pub(in crate::source) point_count: usize,
    pub(in crate::source) potential: Box<dyn ContactPotential>,
    friction: Option<BodyFriction>,
    areas: Vec<f64>,
    /// Masses of the points; empty where fast arrivals are let pass.
    pub(in crate::source) masses: Vec<f64>,
    impacts: Impacts<BodyPair>,
    pub(in crate::source) settings: BodyContactSettings,
    pub(in crate::source) envelope: Envelope,
    /// What is known of the distance of every element to every still body;
    /// empty for bodies that move.
    guards: Vec<Vec<Guard>>,
    pub(in crate::source) time_end: f64,
    candidates: Vec<CandidateOf<E>>,
    /// Candidates of each task.
    ranges: Vec<Range<usize>>,
    memory: Vec<AnchorOf<E>>,
    spare: Vec<AnchorOf<E>>,
    tasks: Vec<TaskOf<E>>,
    active: usize,
    pub(in crate::source) deep: usize,
    deepest: f64,
}

impl<E: BodyElement> AgainstBodies<E> {
    /// Elements of `points` points without friction.
    pub(in crate::source) fn of(
        element: E,
        points: usize,
        bodies: Vec<Arc<dyn Body>>,
        potential: Box<dyn ContactPotential>,
    ) -> Self {
        Self {
            element,
            bodies,
            point_count: points,
            potential,
            friction: None,
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

    /// Another potential. One whose stiffness is per area needs
    /// [`with_areas`](Self::with_areas).
    #[must_use]
    pub fn with_potential(mut self, potential: Box<dyn ContactPotential>) -> Self {
        self.potential = potential;
        self
    }

    /// Rest areas of all points, or of all triangles where those meet the
    /// bodies \[m²\], for a stiffness per area; without them each counts as
    /// 1 cm².
    ///
    /// # Errors
    /// [`CollisionError::Length`].
    pub fn with_areas(mut self, areas: Vec<f64>) -> Result<Self, CollisionError> {
        check_length("areas", areas.len(), self.element.total())?;
        self.areas = areas;
        Ok(self)
    }

    /// Masses of all points \[kg\]: with them, cloth that arrives so fast that
    /// the penalty cannot stop it is stopped all the same.
    ///
    /// Fast is what has more kinetic energy towards the body, `½ m u²`, than
    /// the penalty takes up until it is three thicknesses inside. Such a point
    /// (or deepest point of a triangle) may move no farther than the surface,
    /// or a thickness, in one step; where it touches, the stiffness is that of
    /// a stop within two thicknesses, without a rebound. Nothing changes for
    /// what is not fast.
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
        self.friction = Some(BodyFriction::new(friction, masses, &self.bodies));
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
        if let Some(friction) = &mut self.friction {
            match common {
                Some(common) => friction.set_common(common, &self.bodies),
                None => friction.of_points = coefficients,
            }
        }
        Ok(self)
    }

    /// Says which bodies never move. Distances to them are remembered, so that
    /// cloth far away is not asked for in every step; results do not change.
    ///
    /// # Errors
    /// [`CollisionError::Length`] when there is not one value a body.
    pub fn with_still(mut self, still: &[bool]) -> Result<Self, CollisionError> {
        check_length("still bodies", still.len(), self.bodies.len())?;
        let count = self.element.total();
        let guards = |still: &bool| vec![Guard::UNKNOWN; if *still { count } else { 0 }];
        self.guards = still.iter().map(guards).collect();
        Ok(self)
    }

    /// Other settings.
    ///
    /// # Errors
    /// [`CollisionError::Parameter`] for a negative or infinite value, or a
    /// steepness below one.
    pub fn with_settings(mut self, settings: BodyContactSettings) -> Result<Self, CollisionError> {
        settings.check()?;
        self.settings = settings;
        Ok(self)
    }

    /// The bodies.
    pub fn bodies(&self) -> &[Arc<dyn Body>] {
        &self.bodies
    }

    /// Rest area that an element stands for \[m²\].
    pub(in crate::source) fn area(&self, element: u32) -> f64 {
        self.areas.get(element as usize).copied().unwrap_or(1e-4)
    }
}
