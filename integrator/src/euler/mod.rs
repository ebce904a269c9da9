mod momentum;
mod newton;
mod residual;

use momentum::Pieces;

use crate::contact::Contacts;
use crate::motion::{end_point, extrapolate, step_start};
use crate::pins::prescribe;
use crate::{
    CurvaturePolicy, Integrator, Ledger, NewtonSettings, PlanError, ScenePlan, Scheme, State,
    StepError, StepReport, StepRequest, finite,
};

/// Backward Euler by Newton's method in velocities with a backtracking line
/// search on the residual.
///
/// ```text
/// b(v) = M (v_0 − v) + h F(x_0 + h v, v),   A Δv = b,   A = M − h² ∂F/∂x − h ∂F/∂v
/// ```
/// [Pizana2025, Alg. 1]. A step is accepted when `‖b‖` falls below the
/// tolerance *after* at least one solve: tested at entry, free fall would stop
/// in mid-air, since the first residual of a small step is tiny in `N·s`.
///
/// Deviations: a try that meets the tolerance is taken even where it does not
/// reduce the residual, which a force that jumps (the gradient of a sampled
/// distance field) may not allow; a step whose residual is down to round-off
/// counts as converged; and [`CurvaturePolicy::Auto`] repeats an iteration with positive
/// semidefinite curvature before it gives up.
pub struct BackwardEuler {
    settings: NewtonSettings,
    contacts: Contacts,
    /// Unknowns at the end of the step, for the iterate or the try at hand.
    q: Vec<f64>,
    v: Vec<f64>,
    dv: Vec<f64>,
    b: Vec<f64>,
    b_try: Vec<f64>,
    /// What [`MassEvaluation::rates`] is, where inertia couples unknowns.
    rates: Vec<f64>,
    energies: Vec<f64>,
    contact_energy: f64,
    /// Impulse that every pin takes of the last residual [N·s].
    held: Vec<[f64; 3]>,
    forced: Option<CurvaturePolicy>,
    forced_tolerance: Option<f64>,
    /// Residual and linear tolerance of the iteration before.
    before: Option<(f64, f64)>,
    pieces: Pieces,
}

impl BackwardEuler {
    /// Checks the settings; arrays are sized by the first step.
    ///
    /// # Errors
    /// [`PlanError::Setting`] for a value outside its range.
    pub fn new(settings: NewtonSettings) -> Result<Self, PlanError> {
        settings.validate()?;
        Ok(Self {
            settings,
            contacts: Contacts::default(),
            q: Vec::new(),
            v: Vec::new(),
            dv: Vec::new(),
            b: Vec::new(),
            b_try: Vec::new(),
            rates: Vec::new(),
            energies: Vec::new(),
            contact_energy: 0.0,
            held: Vec::new(),
            forced: None,
            forced_tolerance: None,
            before: None,
            pieces: Pieces::default(),
        })
    }

    /// Settings in use.
    pub fn settings(&self) -> &NewtonSettings {
        &self.settings
    }

    /// Velocities and unknowns where the iteration begins.
    fn begin(&mut self, plan: &ScenePlan, state: &State, dt: f64) {
        match self.settings.scheme {
            Scheme::Newton => self.v.copy_from_slice(&state.v),
            Scheme::Linearised => self.v.fill(0.0),
        }
        if let Some(pins) = &plan.pins {
            prescribe(pins, &state.q, state.time + dt, dt, &mut self.v);
        }
        extrapolate(&state.q, &self.v, None, dt, &mut self.q);
    }

    fn resize(&mut self, dim: usize, terms: usize) {
        for array in [
            &mut self.q,
            &mut self.v,
            &mut self.dv,
            &mut self.b,
            &mut self.b_try,
        ] {
            array.resize(dim, 0.0);
        }
        self.energies.resize(terms, 0.0);
    }
}

impl Integrator for BackwardEuler {
    fn name(&self) -> &str {
        match self.settings.scheme {
            Scheme::Newton => "backward-euler",
            Scheme::Linearised => "linearised-euler",
        }
    }

    fn step(
        &mut self,
        plan: &mut ScenePlan,
        state: &mut State,
        request: StepRequest,
        ledger: &mut Ledger,
    ) -> Result<StepReport, StepError> {
        self.resize(state.layout.dim(), plan.terms.len());
        finite::check(state, &plan.owners)?;
        let time_end = state.time + request.dt;
        let start = end_point(state, &state.q, request.dt);
        plan.begin_step(&start);
        self.begin(plan, state, request.dt);
        let start = step_start(state, &self.q, request.dt);
        self.contacts
            .begin_step(&mut plan.contacts, &start, ledger)?;

        let report = loop {
            let report = self.newton(plan, state, request, ledger)?;
            extrapolate(&state.q, &self.v, None, request.dt, &mut self.q);
            let at = end_point(state, &self.q, request.dt);
            if plan.contacts.iter().all(|c| c.covers(&at)) {
                break report;
            }
            // Newton goes on from its own result with candidates that cover it; a
            // linearised step is taken again from its start.
            let start = step_start(state, &self.q, request.dt);
            self.contacts.detect(&mut plan.contacts, &start, ledger)?;
            if self.settings.scheme == Scheme::Linearised {
                self.begin(plan, state, request.dt);
            }
        };

        let at = end_point(state, &self.q, request.dt);
        plan.commit(&at);
        state.q.copy_from_slice(&self.q);
        state.v.copy_from_slice(&self.v);
        state.time = time_end;
        let energies = (self.energies.as_slice(), self.contact_energy);
        Ok(report.with_end(plan, energies, &self.held, request.dt))
    }

    fn force_curvature(&mut self, policy: Option<CurvaturePolicy>) {
        self.forced = policy;
    }

    fn force_tolerance(&mut self, tolerance: Option<f64>) {
        self.forced_tolerance = tolerance;
    }

    fn heap_bytes(&self) -> usize {
        5 * size_of_val(self.q.as_slice())
            + size_of_val(self.rates.as_slice())
            + self.contacts.response.heap_bytes()
            + self.pieces.heap_bytes()
    }
}
