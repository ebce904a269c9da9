use crate::{CurvaturePolicy, Ledger, ScenePlan, State, StepError, TermEnergy};

/// One step asked of an integrator.
#[derive(Clone, Copy, Debug)]
pub struct StepRequest {
    /// Length [s].
    pub dt: f64,
    /// Factor on the stiffness of relaxed terms [1].
    pub stiffness: f64,
}

/// Advances a state by one step.
pub trait Integrator: Send {
    /// Name in scene files and reports.
    fn name(&self) -> &str;

    /// Makes one step. Time, unknowns and rates of `state` and the history of
    /// the plan change only when it returns `Ok`.
    ///
    /// # Errors
    /// [`StepError`]; a smaller step may succeed from the same state.
    fn step(
        &mut self,
        plan: &mut ScenePlan,
        state: &mut State,
        request: StepRequest,
        ledger: &mut Ledger,
    ) -> Result<StepReport, StepError>;

    /// Changes the curvature of Newton's matrix; `None` goes back to that of
    /// the settings. Integrators without such a choice do nothing.
    fn force_curvature(&mut self, _policy: Option<CurvaturePolicy>) {}

    /// Fixes the relative tolerance of the linear solves for integrators that
    /// choose it themselves; `None` leaves it to them again.
    fn force_tolerance(&mut self, _tolerance: Option<f64>) {}

    /// What the next steps depend on beside the state, for checkpoints.
    fn history(&self) -> Vec<f64> {
        Vec::new()
    }

    /// Takes back what [`history`](Self::history) gave; `false` where it does
    /// not fit.
    fn restore_history(&mut self, history: &[f64]) -> bool {
        history.is_empty()
    }

    /// Heap memory of work arrays [bytes].
    fn heap_bytes(&self) -> usize;
}

/// What an accepted step took.
#[derive(Clone, Debug, Default)]
pub struct StepReport {
    /// Newton iterations.
    pub newton_iterations: usize,
    /// Iterations of the linear solver, summed.
    pub linear_iterations: usize,
    /// Line-search halvings, summed.
    pub halvings: usize,
    /// Linear solves that met negative curvature.
    pub negative_curvature: usize,
    /// Iterations repeated with projected curvature.
    pub projected: usize,
    /// Final residual in the units of the chosen norm; of a static solve the
    /// largest unbalanced force [N].
    pub residual: f64,
    /// How far from rest a static solve is; `None` from time stepping.
    pub rest: Option<RestReport>,
    /// Energy of every term at the end of the step [J].
    pub energies: Vec<TermEnergy>,
    /// Energy of all contacts at the end of the step, the potential of the
    /// step's friction included [J].
    pub contact_energy: f64,
    /// Active contacts at the end of the step.
    pub contacts: usize,
    /// Contact candidates.
    pub candidates: usize,
    /// Deepest contact penetration [m].
    pub max_penetration: f64,
    /// Force with which every pin holds its point at the end of the step [N],
    /// in the order of [`Pins::points`](crate::Pins::points). It is what is
    /// missing in the constrained directions, `R = M (v − v_0)/h − F`; a point
    /// that is listed twice has its whole force at both places.
    pub pin_forces: Vec<[f64; 3]>,
}

impl StepReport {
    /// Adds what terms, contacts and pins are like at the end of a step, with
    /// the energies of terms and of contacts [J] and the impulses that pins take
    /// over `dt` [N·s].
    pub(crate) fn with_end(
        self,
        plan: &ScenePlan,
        (energies, contact_energy): (&[f64], f64),
        held: &[[f64; 3]],
        dt: f64,
    ) -> Self {
        let named = plan.terms.iter().zip(energies);
        let named = named.map(|(term, &value)| TermEnergy {
            name: term.batch.name().to_owned(),
            value,
        });
        let contacts = plan.contacts.iter();
        let depths = contacts.clone().map(|c| c.max_penetration());
        Self {
            energies: named.collect(),
            contact_energy,
            contacts: contacts.clone().map(|c| c.active()).sum(),
            candidates: contacts.map(|c| c.candidates()).sum(),
            max_penetration: depths.fold(0.0, f64::max),
            pin_forces: held.iter().map(|j| j.map(|j| -j / dt)).collect(),
            ..self
        }
    }
}

/// How far a static solve is from rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestReport {
    /// Largest unbalanced force on a free point or scalar [N]. That on a point
    /// that stands for a rotation is a moment [N·m].
    pub force: f64,
    /// The point that it acts on, or where the scalar lives.
    pub point: usize,
    /// Force below which the cloth is at rest [N].
    pub tolerance: f64,
    /// Pseudo-step of the iteration [s].
    pub pseudo_step: f64,
}

impl RestReport {
    /// Whether all forces are balanced.
    pub fn at_rest(&self) -> bool {
        self.force < self.tolerance
    }
}
