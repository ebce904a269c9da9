//! What an integrator sees of contact.

mod against_bodies;
mod body_contact;
mod body_faces;
mod envelope;
mod self_contact;
mod side;

pub use against_bodies::{AgainstBodies, BodyContactSettings, BodyElement};
pub use body_contact::BodyContact;
pub use body_faces::BodyFaces;
pub use self_contact::{SelfContact, SelfContactSettings};

use selvedge_energy::EvalPoint;

use crate::error::check_length;
use crate::{CollisionError, ContactResponse};

/// Where detection happens: the start of a step and a guess of its end.
#[derive(Clone, Copy, Debug)]
pub struct StepStart<'a> {
    /// Unknowns at the start of the step \[m\].
    pub q_start: &'a [f64],
    /// Best guess of the unknowns at its end \[m\]. Detection looks ahead as far
    /// as this, plus a margin.
    pub q_predicted: &'a [f64],
    /// Length of the step \[s\].
    pub dt: f64,
    /// Time at the start of the step \[s\].
    pub time: f64,
}

/// A source of contact forces: cloth against itself, cloth against bodies.
///
/// A step calls [`detect`](Self::detect) once, [`evaluate`](Self::evaluate) as
/// often as it likes, and [`commit`](Self::commit) when it is accepted. A step
/// that is given up needs no call: only `commit` changes history.
pub trait ContactSource: Send {
    /// Name in reports and in the cost ledger.
    fn name(&self) -> &str;

    /// Finds the pairs of this step. What surviving pairs remember (their side,
    /// their anchor) is kept.
    ///
    /// # Errors
    /// [`CollisionError::NotFinitePosition`], [`CollisionError::Length`],
    /// [`CollisionError::Parameter`] for a step length that is not positive.
    fn detect(&mut self, step: &StepStart<'_>) -> Result<(), CollisionError>;

    /// Appends forces and, when asked for, curvatures of the active contacts,
    /// friction included; returns the energy \[J\], that of the step's friction
    /// potential included. History stays as it is, and the result depends on
    /// history, pairs and `at` alone, not on the number of threads.
    ///
    /// # Errors
    /// [`CollisionError::Length`] when `at` has too few points,
    /// [`CollisionError::NotFiniteSample`] for a body without a distance.
    fn evaluate(
        &mut self,
        at: &EvalPoint<'_>,
        curvature: bool,
        out: &mut ContactResponse,
    ) -> Result<f64, CollisionError>;

    /// Whether all points are where detection looked. If not, pairs may be
    /// missing: detect again with a better prediction.
    fn covers(&self, at: &EvalPoint<'_>) -> bool;

    /// Takes over sides and anchors at the end of an accepted step.
    fn commit(&mut self, at: &EvalPoint<'_>);

    /// Active pairs of the last evaluation; the response may have fewer entries,
    /// since pairs with the same closest features are added up.
    fn active(&self) -> usize;

    /// Largest depth below the contact thickness in the last evaluation \[m\].
    fn max_penetration(&self) -> f64;

    /// Pairs of the last detection.
    fn candidates(&self) -> usize;

    /// State that later steps depend on, for checkpoints.
    fn history(&self) -> Vec<f64>;

    /// Takes back what [`history`](Self::history) gave.
    ///
    /// # Errors
    /// [`CollisionError::History`] when the array does not fit.
    fn restore_history(&mut self, history: &[f64]) -> Result<(), CollisionError>;

    /// Heap memory held \[bytes\].
    fn heap_bytes(&self) -> usize;
}

/// Candidates handled by one task.
const CHUNK: usize = 512;
/// Tasks whose results are held at a time, which bounds their memory.
const WAVE: usize = 64;

/// Runs `task(i, buffer)` for `i < tasks` in parallel, and `collect(buffer)`
/// for the same in order.
fn in_order<T: Default + Send>(
    tasks: usize,
    buffers: &mut Vec<T>,
    task: impl Fn(usize, &mut T) + Sync,
    mut collect: impl FnMut(&mut T),
) {
    use rayon::prelude::*;
    if buffers.len() < WAVE.min(tasks) {
        buffers.resize_with(WAVE.min(tasks), T::default);
    }
    for wave in (0..tasks).step_by(WAVE) {
        let count = WAVE.min(tasks - wave);
        if count == 1 {
            task(wave, &mut buffers[0]);
        } else {
            buffers[..count]
                .par_iter_mut()
                .enumerate()
                .for_each(|(k, b)| task(wave + k, b));
        }
        buffers[..count].iter_mut().for_each(&mut collect);
    }
}

fn check_step(dt: f64) -> Result<(), CollisionError> {
    if dt > 0.0 && dt.is_finite() {
        return Ok(());
    }
    let requirement = "positive and finite";
    Err(CollisionError::Parameter {
        name: "step length",
        value: dt,
        requirement,
    })
}

/// Refuses positions of fewer than `points` points.
fn check_point(at: &EvalPoint<'_>, points: usize) -> Result<(), CollisionError> {
    let (found, expected) = (at.q.len().min(at.q_start.len()), 3 * points);
    check_length("positions", found.min(expected), expected)
}

fn check_margin(margin: f64, overshoot: f64) -> Result<(), CollisionError> {
    let requirement = "finite and not negative";
    for (name, value) in [("margin", margin), ("overshoot", overshoot)] {
        if !(value >= 0.0 && value.is_finite()) {
            return Err(CollisionError::Parameter {
                name,
                value,
                requirement,
            });
        }
    }
    Ok(())
}
