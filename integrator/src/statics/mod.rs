mod search;

use search::Direction;
use selvedge_energy::Curvature;

use crate::contact::Contacts;
use crate::motion::{end_point, step_start};
use crate::{
    CurvaturePolicy, Integrator, Ledger, PlanError, RestReport, ScenePlan, State, StaticSettings,
    StepError, StepReport, StepRequest, finite,
};

/// Factor on the pseudo-step after a full step that the model foresaw.
const GROW: f64 = 3.0;
/// Factor on it after a step that gained much less than the model foresaw.
const SHRINK: f64 = 0.5;
/// Factor on it after a refused direction.
const REFUSED: f64 = 0.1;
/// Share of the foreseen gain of energy that lets the pseudo-step grow \[1\].
const GOOD: f64 = 0.5;
/// Share of it below which the pseudo-step shrinks \[1\].
const POOR: f64 = 0.1;
/// Pseudo-steps between which the search moves \[s\].
const PSEUDO: [f64; 2] = [1e-7, 1e3];
/// Most iterations with semidefinite curvature before the exact one is tried
/// again.
const MOST_PROJECTED: usize = 16;

/// Seeks a state of rest: a minimum of the energy, all velocities zero.
///
/// One step is one iteration of Newton's method with pseudo-transient
/// continuation, backward Euler from zero velocity with a length `h` of its own
/// [KelleyKeyes1998]:
///
/// ```text
/// (M/h² + K) p = F(x),   x ← x + s p,   E(x + s p) ≤ E(x) − 10⁻⁴ s F·p
/// ```
/// with `s` halved from 1 and no unknown moved further than
/// [`StaticSettings::max_move`]. `h` grows threefold while steps gain what the
/// quadratic model foresees, so that the last ones are Newton's own, and
/// shrinks where they do not. The energy of every accepted step is below that
/// of the one before, up to round-off: there, a step counts that leaves less
/// slope along `p` than before [HagerZhang2005].
///
/// `K` is exact with [`CurvaturePolicy::Auto`] as long as the linear solver
/// meets no negative curvature, else semidefinite for 1, 2, 4, … 16 iterations.
///
/// The step asked for ([`StepRequest::dt`]) only counts iterations: time in a
/// static solve is their number. Ends when the largest force on a free point or
/// scalar is below [`StaticSettings::tolerance`]; where no direction gains any
/// energy, with [`StepError::Stalled`], which names the point.
pub struct StaticRest {
    settings: StaticSettings,
    contacts: Contacts,
    /// The pseudo-step `h` [s].
    pseudo: f64,
    /// Where it stops growing: beyond, `M/h²` is lost in the rounding of `K` [s].
    most: f64,
    /// Iterations left with semidefinite curvature, and their last number.
    projected: [usize; 2],
    q: Vec<f64>,
    p: Vec<f64>,
    zero: Vec<f64>,
    b: Vec<f64>,
    b_try: Vec<f64>,
    energies: Vec<f64>,
    contact_energy: f64,
    held: Vec<[f64; 3]>,
    forced: Option<CurvaturePolicy>,
    forced_tolerance: Option<f64>,
    /// Largest force of the first iteration [N].
    first: Option<f64>,
}

impl StaticRest {
    /// Checks the settings; arrays are sized by the first step.
    ///
    /// # Errors
    /// [`PlanError::Setting`] for a value outside its range.
    pub fn new(settings: StaticSettings) -> Result<Self, PlanError> {
        settings.validate()?;
        Ok(Self {
            settings,
            contacts: Contacts::default(),
            pseudo: settings.first_step,
            most: PSEUDO[1],
            projected: [0; 2],
            q: Vec::new(),
            p: Vec::new(),
            zero: Vec::new(),
            b: Vec::new(),
            b_try: Vec::new(),
            energies: Vec::new(),
            contact_energy: 0.0,
            held: Vec::new(),
            forced: None,
            forced_tolerance: None,
            first: None,
        })
    }

    fn resize(&mut self, dim: usize, terms: usize) {
        for array in [
            &mut self.q,
            &mut self.p,
            &mut self.zero,
            &mut self.b,
            &mut self.b_try,
        ] {
            array.resize(dim, 0.0);
        }
        self.energies.resize(terms, 0.0);
    }

    /// One accepted iteration, from the unknowns of the state into `q`.
    fn iterate(
        &mut self,
        plan: &mut ScenePlan,
        state: &State,
        stiffness: f64,
        ledger: &mut Ledger,
    ) -> Result<StepReport, StepError> {
        let mut report = StepReport::default();
        let policy = self.forced.unwrap_or(self.settings.curvature);
        let mut curvature = match policy {
            CurvaturePolicy::Projected => Curvature::Projected,
            CurvaturePolicy::GaussNewton => Curvature::GaussNewton,
            CurvaturePolicy::Auto if self.projected[0] > 0 => Curvature::Projected,
            _ => Curvature::Exact,
        };
        loop {
            report.newton_iterations += 1;
            self.q.copy_from_slice(&state.q);
            let start = self.evaluate(plan, state, stiffness, Some(curvature), ledger)?;
            std::mem::swap(&mut self.b, &mut self.b_try);
            let (point, force) = self.worst(plan, &self.b);
            if !(force.is_finite() && start.value.is_finite()) {
                let at = end_point(state, &self.q, self.pseudo);
                return Err(finite::in_residual(plan, state, &at, &self.b));
            }
            if force < self.settings.tolerance {
                report.rest = Some(self.rest(point, force));
                return Ok(report);
            }
            let may_project = policy == CurvaturePolicy::Auto && curvature == Curvature::Exact;
            let found = match self.direction(plan, force, &mut report, ledger)? {
                Direction::Negative => {
                    if curvature != Curvature::Exact {
                        self.most = self.most.min(self.pseudo / GROW);
                    }
                    None
                }
                Direction::Found => {
                    self.search(plan, state, stiffness, start, &mut report, ledger)?
                }
            };
            if let Some((ratio, cut)) = found {
                if policy == CurvaturePolicy::Auto {
                    match curvature {
                        Curvature::Exact => self.projected[1] = 0,
                        _ => self.projected[0] = self.projected[0].saturating_sub(1),
                    }
                }
                // Forces are in units of the pseudo-step that they were made with.
                let (point, force) = self.worst(plan, &self.b_try);
                report.rest = Some(self.rest(point, force));
                if ratio >= GOOD && !cut {
                    self.pseudo *= GROW;
                } else if ratio < POOR {
                    self.pseudo *= SHRINK;
                }
                self.pseudo = self.pseudo.clamp(PSEUDO[0], self.most);
                return Ok(report);
            }
            if may_project {
                let again = (2 * self.projected[1]).clamp(1, MOST_PROJECTED);
                self.projected = [again; 2];
                curvature = Curvature::Projected;
                report.projected += 1;
                continue;
            }
            self.pseudo *= REFUSED;
            if self.pseudo < PSEUDO[0] {
                self.pseudo = self.settings.first_step;
                let at = |i: usize| state.q[3 * point + i];
                return Err(StepError::Stalled {
                    point,
                    x: at(0),
                    y: at(1),
                    z: at(2),
                    force,
                    tolerance: self.settings.tolerance,
                });
            }
        }
    }

    fn rest(&self, point: usize, force: f64) -> RestReport {
        RestReport {
            force,
            point,
            tolerance: self.settings.tolerance,
            pseudo_step: self.pseudo,
        }
    }
}

impl Integrator for StaticRest {
    fn name(&self) -> &str {
        "static"
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
        let start = end_point(state, &state.q, self.pseudo);
        plan.begin_step(&start);
        let start = step_start(state, &state.q, self.pseudo);
        self.contacts
            .begin_step(&mut plan.contacts, &start, ledger)?;
        let report = self.iterate(plan, state, request.stiffness, ledger)?;
        let at = end_point(state, &self.q, self.pseudo);
        plan.commit(&at);
        state.q.copy_from_slice(&self.q);
        state.v.fill(0.0);
        state.time += request.dt;
        let pseudo = report.rest.map_or(1.0, |r| r.pseudo_step);
        let report = StepReport {
            residual: report.rest.map_or(f64::NAN, |r| r.force),
            ..report
        };
        let energies = (self.energies.as_slice(), self.contact_energy);
        Ok(report.with_end(plan, energies, &self.held, pseudo))
    }

    fn force_curvature(&mut self, policy: Option<CurvaturePolicy>) {
        self.forced = policy;
    }

    fn force_tolerance(&mut self, tolerance: Option<f64>) {
        self.forced_tolerance = tolerance;
    }

    fn history(&self) -> Vec<f64> {
        let [left, last] = self.projected.map(|n| n as f64);
        let first = self.first.unwrap_or(-1.0);
        vec![self.pseudo, self.most, left, last, first]
    }

    fn restore_history(&mut self, history: &[f64]) -> bool {
        let [pseudo, most, left, last, first] = history else {
            return false;
        };
        (self.pseudo, self.most) = (*pseudo, *most);
        self.projected = [*left as usize, *last as usize];
        self.first = (*first >= 0.0).then_some(*first);
        true
    }

    fn heap_bytes(&self) -> usize {
        5 * size_of_val(self.q.as_slice()) + self.contacts.response.heap_bytes()
    }
}
