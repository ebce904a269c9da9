mod deepest;
mod history;
mod pass;
mod search;

use std::ops::Range;
use std::sync::Arc;

use selvedge_energy::EvalPoint;

use super::body_contact::{
    DEEP, Guard, Impacts, bad_sample, body_coefficients, check_settings, run_over,
};
use super::envelope::Envelope;
use super::self_contact::inverse_masses;
use super::{BodyContactSettings, ContactSource, StepStart, check_point, check_step, in_order};
use crate::error::check_length;
use crate::friction::common_coefficient;
use crate::vec3::Vec3;
use crate::{Body, CollisionError, ContactPotential, ContactQuadratic, ContactResponse, Friction};
use pass::{Anchor, Pass, Task};

const NAME: &str = "body-faces";

/// Candidates handled by one task: a descent takes ten samples.
const CHUNK: usize = 64;

/// A triangle that may come near a body.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    /// Body and triangle.
    of: [u32; 2],
    /// Where the descent to its deepest point begins.
    weights: Vec3,
}

/// Edges and insides of triangles against bodies, between the points that
/// [`BodyContact`](super::BodyContact) takes care of.
///
/// ```text
/// φ* = min φ(Σ b_i x_i)   over the triangle
/// E = Σ max(0, E_f(φ*) − E_f(min φ(x_i)))
/// f_i = −E_f'(φ*) b_i ∇φ   and   +E_f' ∇φ at the lowest corner
/// K = b bᵀ ⊗ E_f'' ∇φ ∇φᵀ
/// ```
/// Every triangle has its deepest point and pays for what that is deeper than
/// its deepest corner: a body that meets the corner first is the point's own
/// affair, and on flat bodies nothing acts. The energy is continuous; the
/// forces are its derivatives, exact since `φ*` does not change with `b` at a
/// minimum. `K` is that of the deepest point, without the corner's, which is
/// negative. An edge has a contact for each of its triangles.
///
/// The thickness of the potential should be less than that of the points (half
/// of it in scenes): where the distance is nearly flat, the deepest point of a
/// triangle at the points' own distance would jump with round-off.
///
/// Friction and steps that come too fast are as with points; anchors sit at a
/// point of the triangle.
pub struct BodyFaces {
    bodies: Vec<Arc<dyn Body>>,
    triangles: Vec<[u32; 3]>,
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
    impacts: Impacts<[u32; 2]>,
    settings: BodyContactSettings,
    envelope: Envelope,
    /// What is known of the distance of every triangle's middle to every still
    /// body; empty for bodies that move.
    guards: Vec<Vec<Guard>>,
    time_end: f64,
    candidates: Vec<Candidate>,
    memory: Vec<Anchor>,
    spare: Vec<Anchor>,
    tasks: Vec<Task>,
    active: usize,
    deepest: f64,
}

impl BodyFaces {
    /// Contact of triangles of `points` points without friction, with the
    /// penalty of [`ContactQuadratic::body`] at half its thickness.
    ///
    /// # Errors
    /// [`CollisionError::PointOutOfRange`].
    pub fn new(
        points: usize,
        triangles: Vec<[u32; 3]>,
        bodies: Vec<Arc<dyn Body>>,
    ) -> Result<Self, CollisionError> {
        for (index, t) in triangles.iter().enumerate() {
            if let Some(&point) = t.iter().find(|p| **p as usize >= points) {
                return Err(CollisionError::PointOutOfRange {
                    what: "triangle",
                    index,
                    point,
                    points,
                });
            }
        }
        let whole = ContactQuadratic::body();
        let thickness = 0.5 * whole.thickness;
        Ok(Self {
            bodies,
            triangles,
            point_count: points,
            potential: Box::new(ContactQuadratic { thickness, ..whole }),
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
            memory: Vec::new(),
            spare: Vec::new(),
            tasks: Vec::new(),
            active: 0,
            deepest: 0.0,
        })
    }

    /// Another potential. One whose stiffness is per area needs
    /// [`with_areas`](Self::with_areas).
    #[must_use]
    pub fn with_potential(mut self, potential: Box<dyn ContactPotential>) -> Self {
        self.potential = potential;
        self
    }

    /// Rest areas of all triangles \[m²\], for a stiffness per area; without
    /// them every triangle counts as 1 cm².
    ///
    /// # Errors
    /// [`CollisionError::Length`].
    pub fn with_areas(mut self, areas: Vec<f64>) -> Result<Self, CollisionError> {
        check_length("areas", areas.len(), self.triangles.len())?;
        self.areas = areas;
        Ok(self)
    }

    /// Masses of all points \[kg\]: with them, triangles that arrive so fast that
    /// the penalty cannot stop them are stopped all the same, as points are by
    /// [`BodyContact::with_masses`](super::BodyContact::with_masses).
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
        self.body_coefficients = body_coefficients(&self.bodies, friction.coefficient());
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
                self.body_coefficients = body_coefficients(&self.bodies, common);
            }
            (Some(_), None) => self.coefficients = coefficients,
        }
        Ok(self)
    }

    /// Says which bodies never move, so that triangles far from them are not
    /// asked for in every step; results do not change.
    ///
    /// # Errors
    /// [`CollisionError::Length`] when there is not one value a body.
    pub fn with_still(mut self, still: &[bool]) -> Result<Self, CollisionError> {
        check_length("still bodies", still.len(), self.bodies.len())?;
        let count = self.triangles.len();
        let guards = |still: &bool| vec![Guard::UNKNOWN; if *still { count } else { 0 }];
        self.guards = still.iter().map(guards).collect();
        Ok(self)
    }

    /// Other settings.
    ///
    /// # Errors
    /// As [`BodyContact::with_settings`](super::BodyContact::with_settings).
    pub fn with_settings(mut self, settings: BodyContactSettings) -> Result<Self, CollisionError> {
        check_settings(&settings)?;
        self.settings = settings;
        Ok(self)
    }

    fn bad_sample(&self, [body, triangle]: [u32; 2]) -> CollisionError {
        let point = self.triangles[triangle as usize][0];
        bad_sample(&*self.bodies[body as usize], point)
    }
}

/// Candidates of task `i`.
fn chunk(i: usize, count: usize) -> Range<usize> {
    i * CHUNK..((i + 1) * CHUNK).min(count)
}

impl ContactSource for BodyFaces {
    fn name(&self) -> &str {
        NAME
    }

    fn detect(&mut self, step: &StepStart<'_>) -> Result<(), CollisionError> {
        check_step(step.dt)?;
        let BodyContactSettings {
            margin, overshoot, ..
        } = self.settings;
        self.envelope
            .set(self.point_count, step, overshoot, margin)?;
        self.time_end = step.time + step.dt;
        self.candidates.clear();
        let mut impacts = Vec::new();
        let mut overrun = None;
        for body in 0..self.bodies.len() {
            overrun = overrun.or(self.search(body, step, &mut impacts));
        }
        self.impacts.update(step.time, step.dt, &mut impacts);
        match overrun {
            Some(([body, triangle], depth, limit)) => {
                let point = self.triangles[triangle as usize][0];
                let body = &*self.bodies[body as usize];
                Err(run_over(body, point, depth, limit))
            }
            None => Ok(()),
        }
    }

    fn evaluate(
        &mut self,
        at: &EvalPoint<'_>,
        curvature: bool,
        out: &mut ContactResponse,
    ) -> Result<f64, CollisionError> {
        check_point(at, self.point_count)?;
        let mut tasks = std::mem::take(&mut self.tasks);
        let (mut energy, mut deepest, mut active, mut bad) = (0.0, 0.0_f64, 0, None);
        let count = self.candidates.len();
        let pass = Pass {
            source: self,
            at,
            curvature,
        };
        in_order(
            count.div_ceil(CHUNK),
            &mut tasks,
            |i, task: &mut Task| pass.evaluate(chunk(i, count), task),
            |task| {
                out.extend(&task.response);
                energy += task.energy;
                deepest = deepest.max(task.deepest);
                active += task.active;
                bad = bad.or(task.bad);
            },
        );
        self.tasks = tasks;
        (self.active, self.deepest) = (active, deepest);
        match bad {
            Some(of) => Err(self.bad_sample(of)),
            None => Ok(energy),
        }
    }

    fn covers(&self, at: &EvalPoint<'_>) -> bool {
        self.envelope.contains(at, 0..self.point_count as u32)
    }

    fn commit(&mut self, at: &EvalPoint<'_>) {
        if self.friction.is_none() || check_point(at, self.point_count).is_err() {
            return;
        }
        let mut tasks = std::mem::take(&mut self.tasks);
        let mut memory = std::mem::take(&mut self.spare);
        memory.clear();
        let count = self.candidates.len();
        let pass = Pass {
            source: self,
            at,
            curvature: false,
        };
        in_order(
            count.div_ceil(CHUNK),
            &mut tasks,
            |i, task: &mut Task| pass.remember(chunk(i, count), task),
            |task| memory.append(&mut task.memory),
        );
        self.spare = std::mem::replace(&mut self.memory, memory);
        self.tasks = tasks;
    }

    fn active(&self) -> usize {
        self.active
    }

    fn max_penetration(&self) -> f64 {
        self.deepest
    }

    fn candidates(&self) -> usize {
        self.candidates.len()
    }

    fn history(&self) -> Vec<f64> {
        history::to_numbers(&self.memory)
    }

    fn restore_history(&mut self, history: &[f64]) -> Result<(), CollisionError> {
        let limits = [self.bodies.len(), self.triangles.len()];
        self.memory = history::from_numbers(history, limits)?;
        Ok(())
    }

    fn heap_bytes(&self) -> usize {
        let guards = self.guards.iter().map(|g| g.capacity()).sum::<usize>();
        12 * self.triangles.capacity()
            + 8 * (self.inverse_masses.capacity() + self.areas.capacity() + self.masses.capacity())
            + 8 * (self.coefficients.capacity() + self.body_coefficients.capacity())
            + self.impacts.heap_bytes()
            + self.envelope.heap_bytes()
            + size_of::<Guard>() * guards
            + size_of::<Candidate>() * self.candidates.capacity()
            + size_of::<Anchor>() * (self.memory.capacity() + self.spare.capacity())
            + self.tasks.iter().map(Task::heap_bytes).sum::<usize>()
    }
}
