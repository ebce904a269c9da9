use std::sync::Arc;

use crate::friction::inverse_masses;
use crate::friction::pair_friction;
use crate::{Body, Friction};

/// Friction of cloth with bodies: the model and the coefficients of pairs.
pub(super) struct BodyFriction {
    pub model: Friction,
    pub inverse_masses: Vec<f64>,
    /// Coefficient of each body with cloth of the common coefficient.
    of_bodies: Vec<f64>,
    /// Coefficients of the points; empty where all have the common one.
    pub of_points: Vec<f64>,
}

impl BodyFriction {
    pub fn new(model: Friction, masses: &[f64], bodies: &[Arc<dyn Body>]) -> Self {
        let mut friction = Self {
            model,
            inverse_masses: inverse_masses(masses),
            of_bodies: Vec::new(),
            of_points: Vec::new(),
        };
        friction.set_common(model.coefficient(), bodies);
        friction
    }

    /// One coefficient for all of the cloth.
    pub fn set_common(&mut self, of_cloth: f64, bodies: &[Arc<dyn Body>]) {
        self.model = self.model.with_coefficient(of_cloth);
        self.of_bodies = bodies.iter().map(|b| coefficient(&**b, of_cloth)).collect();
        self.of_points.clear();
    }

    /// Coefficient of a body with a place of the cloth; `of_cloth` gives the one
    /// there from those of the points.
    pub fn coefficient(
        &self,
        bodies: &[Arc<dyn Body>],
        body: u32,
        of_cloth: impl FnOnce(&[f64]) -> f64,
    ) -> f64 {
        if self.of_points.is_empty() {
            return self.of_bodies[body as usize];
        }
        coefficient(&*bodies[body as usize], of_cloth(&self.of_points))
    }

    pub fn heap_bytes(&self) -> usize {
        let arrays = [&self.inverse_masses, &self.of_bodies, &self.of_points];
        arrays.iter().map(|a| 8 * a.capacity()).sum()
    }
}

/// Coefficient of a body with cloth \[1\].
fn coefficient(body: &dyn Body, of_cloth: f64) -> f64 {
    match body.friction() {
        Some(of_body) => pair_friction(of_body, of_cloth),
        None => of_cloth,
    }
}
