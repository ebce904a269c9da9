use selvedge_energy::Curvature;
use selvedge_linsolve::{LinsolveError, SolveStatus, dot};

use crate::contact::Contacts;
use crate::euler::{end_point, extrapolate, hold, not_finite, not_finite_at, step_start};
use crate::system::Evaluation;
use crate::{
    CurvaturePolicy, Integrator, Ledger, MassEvaluation, PlanError, RestReport, ScenePlan, State,
    StaticSettings, StepError, StepReport, StepRequest, TermEnergy,
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
/// Share of the slope that a step has to gain (Armijo) \[1\].
const ARMIJO: f64 = 1e-4;
/// Share of the slope that may be left, of either sign, where energies no
/// longer tell steps apart \[1\].
const FLATTER: f64 = 0.9;
/// Round-off of an energy, relative to the sum of its parts \[1\].
const ROUND_OFF: f64 = 1e-13;
/// Pseudo-steps between which the search moves \[s\].
const PSEUDO: [f64; 2] = [1e-7, 1e3];
/// Relative tolerance of the linear solves, far from rest and near it.
const SOLVE: [f64; 2] = [1e-2, 1e-5];
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

/// Energy at a state.
#[derive(Clone, Copy)]
struct Energy {
    /// Sum \[J\].
    value: f64,
    /// What rounding may change it by \[J\].
    noise: f64,
}

/// A direction.
enum Direction {
    Found,
    /// The linear solver met negative curvature.
    Negative,
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

    /// Forces at `q`, times the pseudo-step, into `b_try`, without what pins
    /// hold; returns the energy. With `curvature` the matrix is assembled too.
    fn evaluate(
        &mut self,
        plan: &mut ScenePlan,
        state: &State,
        stiffness: f64,
        curvature: Option<Curvature>,
        ledger: &mut Ledger,
    ) -> Result<Energy, StepError> {
        let h = self.pseudo;
        let at = end_point(state, &self.q, h);
        let inertia = &plan.inertia;
        let points = 3 * inertia.masses.len();
        let b = &mut self.b_try;
        b.fill(0.0);
        let pull = inertia.gravity.map(|g| h * g);
        let mut weight = [0.0; 2];
        if pull != [0.0; 3] {
            for (p, m) in inertia.masses.iter().enumerate() {
                for i in 0..3 {
                    b[3 * p + i] = m * pull[i];
                }
            }
            for &p in &inertia.weightless {
                b[3 * p as usize..3 * p as usize + 3].fill(0.0);
            }
            for (b, x) in b[..points].iter().zip(&self.q) {
                weight[0] -= b * x / h;
                weight[1] += (b * x / h).abs();
            }
        }
        let asked = curvature.is_some();
        self.contact_energy =
            self.contacts
                .add_impulse(&mut plan.contacts, &at, asked, b, ledger)?;
        let mass = inertia.coupled.as_deref().map(|batch| MassEvaluation {
            batch,
            start: selvedge_energy::RatePoint {
                layout: state.layout,
                q: &state.q,
                v: &self.zero,
            },
            change: &self.zero,
            damping: 0.0,
            dt: h,
        });
        let evaluation = Evaluation {
            terms: &plan.terms,
            at,
            stiffness,
            masses: &inertia.masses,
            scalar_masses: &inertia.scalar_masses,
            mass,
        };
        match curvature {
            Some(curvature) => plan.system.assemble(
                &evaluation,
                curvature,
                &self.contacts.response,
                b,
                &mut self.energies,
                ledger,
            ),
            None => plan
                .system
                .add_impulse(&evaluation, b, &mut self.energies, ledger),
        }
        hold(&plan.pins, b, &mut self.held);
        let parts = || self.energies.iter().chain([&self.contact_energy]);
        Ok(Energy {
            value: weight[0] + parts().sum::<f64>(),
            noise: ROUND_OFF * (weight[1] + parts().map(|e| e.abs()).sum::<f64>()),
        })
    }

    /// Largest force in `b` [N] and the point that it acts on.
    fn worst(&self, plan: &ScenePlan, b: &[f64]) -> (usize, f64) {
        let points = 3 * plan.inertia.masses.len();
        let mut worst = (0, 0.0);
        let mut see = |point: usize, force: f64| {
            if force > worst.1 || force.is_nan() {
                worst = (point, force);
            }
        };
        let (forces, scalars) = b.split_at(points);
        for (p, f) in forces.as_chunks::<3>().0.iter().enumerate() {
            see(p, (f[0] * f[0] + f[1] * f[1] + f[2] * f[2]).sqrt());
        }
        for (s, f) in scalars.iter().enumerate() {
            see(plan.owners.get(s).map_or(0, |p| *p as usize), f.abs());
        }
        (worst.0, worst.1 / self.pseudo)
    }

    /// Solves for the direction, into `p`.
    fn direction(
        &mut self,
        plan: &mut ScenePlan,
        force: f64,
        report: &mut StepReport,
        ledger: &mut Ledger,
    ) -> Result<Direction, StepError> {
        if self.forced_tolerance.is_none() {
            let first = *self.first.get_or_insert(force);
            let [loose, tight] = SOLVE;
            plan.system
                .set_tolerance((loose * (force / first).sqrt()).clamp(tight, loose));
        }
        let filter = plan.pins.as_ref().map(|p| &p.filter);
        let (system, b, p) = (&mut plan.system, &self.b, &mut self.p);
        let solve = match ledger.time("solve", || system.solve(b, filter, p)) {
            Ok(solve) => solve,
            Err(LinsolveError::Indefinite { .. }) => {
                report.negative_curvature += 1;
                return Ok(Direction::Negative);
            }
            Err(e) => return Err(e.into()),
        };
        report.linear_iterations += solve.iterations;
        if solve.status == SolveStatus::NegativeCurvature {
            report.negative_curvature += 1;
            return Ok(Direction::Negative);
        }
        Ok(Direction::Found)
    }

    /// Takes the first of the steps 1, ½, ¼, … that lowers the energy enough;
    /// returns its share of the direction, the energy gained over `½ F·p` and
    /// whether the move was cut. The unknowns are then in `q`, the forces in
    /// `b_try`.
    fn search(
        &mut self,
        plan: &mut ScenePlan,
        state: &State,
        stiffness: f64,
        start: Energy,
        report: &mut StepReport,
        ledger: &mut Ledger,
    ) -> Result<Option<(f64, bool)>, StepError> {
        let h = self.pseudo;
        let longest = self.p.iter().fold(0.0, |m: f64, p| m.max(p.abs())) * h;
        let cut = longest > self.settings.max_move;
        let mut factor = if cut {
            self.settings.max_move / longest
        } else {
            1.0
        };
        let slope = dot(&self.b, &self.p);
        if !(slope > 0.0 && slope.is_finite()) {
            return Ok(None);
        }
        for _ in 0..self.settings.line_search_tries {
            let p = std::mem::take(&mut self.p);
            extrapolate(&state.q, &self.zero, Some((&p, factor)), h, &mut self.q);
            self.p = p;
            let tried = self.evaluate(plan, state, stiffness, None, ledger)?;
            let gain = start.value - tried.value;
            let left = dot(&self.b_try, &self.p);
            let lower = gain >= ARMIJO * factor * slope;
            let flat = gain.abs() <= start.noise && left.abs() <= FLATTER * slope;
            if tried.value.is_finite() && left.is_finite() && (lower || flat) {
                let at = end_point(state, &self.q, h);
                if !plan.contacts.iter().all(|c| c.covers(&at)) {
                    // Contacts beyond the candidates may have been missed.
                    let start = step_start(state, &self.q, h);
                    self.contacts.detect(&mut plan.contacts, &start, ledger)?;
                    continue;
                }
                let foreseen = factor * slope * (1.0 - 0.5 * factor);
                let ratio = if flat { 1.0 } else { gain / foreseen };
                return Ok(Some((if factor < 1.0 && !cut { 0.0 } else { ratio }, cut)));
            }
            factor *= 0.5;
            report.halvings += 1;
        }
        Ok(None)
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
                return Err(not_finite(plan, state, &at, &self.b));
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
        if let Some((place, what)) = state.first_not_finite() {
            let point = state.point_of(place, &plan.owners);
            return Err(not_finite_at(state, point, what, None));
        }
        let start = end_point(state, &state.q, self.pseudo);
        for term in &mut plan.terms {
            term.batch.begin_step(&start);
        }
        let start = step_start(state, &state.q, self.pseudo);
        self.contacts
            .begin_step(&mut plan.contacts, &start, ledger)?;
        let report = self.iterate(plan, state, request.stiffness, ledger)?;
        let at = end_point(state, &self.q, self.pseudo);
        for term in &mut plan.terms {
            term.batch.commit(&at);
        }
        for contact in &mut plan.contacts {
            contact.commit(&at);
        }
        state.q.copy_from_slice(&self.q);
        state.v.fill(0.0);
        state.time += request.dt;
        let pseudo = report.rest.map_or(1.0, |r| r.pseudo_step);
        let names = plan.terms.iter().map(|t| t.batch.name().to_owned());
        let energies = names.zip(&self.energies);
        Ok(StepReport {
            residual: report.rest.map_or(f64::NAN, |r| r.force),
            energies: energies
                .map(|(name, &value)| TermEnergy { name, value })
                .collect(),
            contact_energy: self.contact_energy,
            contacts: plan.contacts.iter().map(|c| c.active()).sum(),
            candidates: plan.contacts.iter().map(|c| c.candidates()).sum(),
            max_penetration: plan
                .contacts
                .iter()
                .map(|c| c.max_penetration())
                .fold(0.0, f64::max),
            pin_forces: self.held.iter().map(|j| j.map(|j| -j / pseudo)).collect(),
            ..report
        })
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
