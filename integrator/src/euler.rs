use selvedge_collision::StepStart;
use selvedge_energy::{Curvature, EvalPoint, RatePoint};
use selvedge_linsolve::{Filter, LinsolveError, SolveReport, SolveStatus, dot};

use crate::contact::Contacts;
use crate::norm::{residual_norm, worst_point};
use crate::{
    CurvaturePolicy, Evaluation, Inertia, Integrator, Ledger, LineSearch, MassEvaluation,
    NewtonSettings, Pins, PlanError, ResidualNorm, ScenePlan, Scheme, State, StepError, StepReport,
    StepRequest, Term, TermEnergy,
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
    /// What [`MassEvaluation::change`] is, where inertia couples unknowns.
    change: Vec<f64>,
    energies: Vec<f64>,
    contact_energy: f64,
    /// Impulse that every pin takes of the last residual [N·s].
    held: Vec<[f64; 3]>,
    forced: Option<CurvaturePolicy>,
    forced_tolerance: Option<f64>,
    /// Residual and linear tolerance of the iteration before.
    before: Option<(f64, f64)>,
}

/// How one Newton iteration ended.
enum Iteration {
    Reduced,
    RoundOff,
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
            change: Vec::new(),
            energies: Vec::new(),
            contact_energy: 0.0,
            held: Vec::new(),
            forced: None,
            forced_tolerance: None,
            before: None,
        })
    }

    /// Settings in use.
    pub fn settings(&self) -> &NewtonSettings {
        &self.settings
    }

    fn newton(
        &mut self,
        plan: &mut ScenePlan,
        state: &State,
        request: StepRequest,
        ledger: &mut Ledger,
    ) -> Result<StepReport, StepError> {
        let mut report = StepReport::default();
        let mut residual = f64::NAN;
        self.before = None;
        if self.settings.scheme == Scheme::Linearised {
            return self.linearised(plan, state, request, ledger);
        }
        for iteration in 0..self.settings.iterations {
            report.newton_iterations += 1;
            let end = self.iterate(
                plan,
                state,
                request,
                iteration,
                &mut residual,
                &mut report,
                ledger,
            )?;
            let reached = residual < self.settings.tolerance && self.points_reached(plan);
            if reached || matches!(end, Iteration::RoundOff) {
                report.residual = residual;
                return Ok(report);
            }
        }
        if let Some(tolerance) = self.settings.point_tolerance
            && residual < self.settings.tolerance
        {
            let (point, error) = worst_point(&self.b, &plan.inertia.masses);
            return Err(StepError::PointNotConverged {
                iterations: self.settings.iterations,
                point,
                error,
                tolerance,
            });
        }
        Err(StepError::NotConverged {
            iterations: self.settings.iterations,
            residual,
            tolerance: self.settings.tolerance,
        })
    }

    /// One solve at the state where the step starts; a step whose end has no
    /// finite forces is refused.
    fn linearised(
        &mut self,
        plan: &mut ScenePlan,
        state: &State,
        request: StepRequest,
        ledger: &mut Ledger,
    ) -> Result<StepReport, StepError> {
        let mut report = StepReport {
            newton_iterations: 1,
            ..StepReport::default()
        };
        let curvature = match self.forced.unwrap_or(self.settings.curvature) {
            CurvaturePolicy::GaussNewton => Curvature::GaussNewton,
            _ => Curvature::Projected,
        };
        self.assemble(plan, state, request, curvature, ledger)?;
        let solve = self.solve(plan, ledger)?;
        report.linear_iterations = solve.iterations;
        if solve.status == SolveStatus::NegativeCurvature {
            report.negative_curvature = 1;
        }
        let whole = Some((self.dv.as_slice(), 1.0));
        extrapolate(&state.q, &self.v, whole, request.dt, &mut self.q);
        for (v, dv) in self.v.iter_mut().zip(&self.dv) {
            *v += dv;
        }
        report.residual = self.residual(plan, state, request, ledger)?;
        if !report.residual.is_finite() {
            let at = end_point(state, &self.q, request.dt);
            return Err(not_finite(plan, state, &at, &self.b_try));
        }
        Ok(report)
    }

    /// Residual at the iterate, into `b_try`.
    fn residual(
        &mut self,
        plan: &mut ScenePlan,
        state: &State,
        request: StepRequest,
        ledger: &mut Ledger,
    ) -> Result<f64, StepError> {
        let v = std::mem::take(&mut self.v);
        let tried = self.residual_along(plan, state, request, (&v, None), ledger);
        self.v = v;
        tried
    }

    /// Residual at the end of a step with velocities `v + factor dv`, into
    /// `b_try`; unknowns there are in `q`.
    fn residual_along(
        &mut self,
        plan: &mut ScenePlan,
        state: &State,
        request: StepRequest,
        velocities: (&[f64], Option<(&[f64], f64)>),
        ledger: &mut Ledger,
    ) -> Result<f64, StepError> {
        let at = end_point(state, &self.q, request.dt);
        let (out, change) = (&mut self.b_try, &mut self.change);
        inertial_impulse(plan, state, velocities, request.dt, out, change);
        self.contact_energy =
            self.contacts
                .add_impulse(&mut plan.contacts, &at, false, &mut self.b_try, ledger)?;
        let evaluation = evaluation(
            (&plan.terms, &plan.inertia),
            state,
            at,
            request,
            &self.change,
        );
        plan.system
            .add_impulse(&evaluation, &mut self.b_try, &mut self.energies, ledger);
        hold(&plan.pins, &mut self.b_try, &mut self.held);
        Ok(norm_of(self.settings.norm, &self.b_try, plan))
    }

    /// Whether every single point is solved for, where that is asked for.
    fn points_reached(&self, plan: &ScenePlan) -> bool {
        let Some(tolerance) = self.settings.point_tolerance else {
            return true;
        };
        worst_point(&self.b, &plan.inertia.masses).1 <= tolerance
    }

    #[allow(clippy::too_many_arguments)]
    fn iterate(
        &mut self,
        plan: &mut ScenePlan,
        state: &State,
        request: StepRequest,
        iteration: usize,
        residual: &mut f64,
        report: &mut StepReport,
        ledger: &mut Ledger,
    ) -> Result<Iteration, StepError> {
        let policy = self.forced.unwrap_or(self.settings.curvature);
        let mut curvature = match policy {
            CurvaturePolicy::Projected => Curvature::Projected,
            CurvaturePolicy::GaussNewton => Curvature::GaussNewton,
            CurvaturePolicy::Auto | CurvaturePolicy::Exact => Curvature::Exact,
        };
        let before = self.before;
        loop {
            *residual = self.assemble(plan, state, request, curvature, ledger)?;
            self.set_tolerance(plan, *residual, before);
            let may_project = policy == CurvaturePolicy::Auto && curvature == Curvature::Exact;
            let negative = match self.solve(plan, ledger) {
                Ok(solve) => {
                    report.linear_iterations += solve.iterations;
                    solve.status == SolveStatus::NegativeCurvature
                }
                // A factorisation has no iterate to go on with.
                Err(StepError::Linear(LinsolveError::Indefinite { .. })) if may_project => true,
                Err(e) => return Err(e),
            };
            report.negative_curvature += usize::from(negative);
            if negative && may_project {
                curvature = Curvature::Projected;
                report.projected += 1;
                continue;
            }
            if let Some(smaller) =
                self.line_search(plan, state, request, *residual, report, ledger)?
            {
                *residual = smaller;
                return Ok(Iteration::Reduced);
            }
            if *residual <= self.round_off(plan, state, request) {
                return Ok(Iteration::RoundOff);
            }
            if !may_project {
                return Err(StepError::LineSearch {
                    iteration,
                    residual: *residual,
                });
            }
            curvature = Curvature::Projected;
            report.projected += 1;
        }
    }

    /// Assembles matrix and residual at the current iterate.
    fn assemble(
        &mut self,
        plan: &mut ScenePlan,
        state: &State,
        request: StepRequest,
        curvature: Curvature,
        ledger: &mut Ledger,
    ) -> Result<f64, StepError> {
        extrapolate(&state.q, &self.v, None, request.dt, &mut self.q);
        let at = end_point(state, &self.q, request.dt);
        let v = (self.v.as_slice(), None);
        inertial_impulse(plan, state, v, request.dt, &mut self.b, &mut self.change);
        self.contact_energy =
            self.contacts
                .add_impulse(&mut plan.contacts, &at, true, &mut self.b, ledger)?;
        let evaluation = evaluation(
            (&plan.terms, &plan.inertia),
            state,
            at,
            request,
            &self.change,
        );
        plan.system.assemble(
            &evaluation,
            curvature,
            &self.contacts.response,
            &mut self.b,
            &mut self.energies,
            ledger,
        );
        project(&plan.pins, &mut self.b);
        let residual = norm_of(self.settings.norm, &self.b, plan);
        if !residual.is_finite() {
            return Err(not_finite(plan, state, &at, &self.b));
        }
        Ok(residual)
    }

    /// How exactly the next system is solved, where the settings choose that
    /// anew in every iteration.
    fn set_tolerance(&mut self, plan: &mut ScenePlan, residual: f64, before: Option<(f64, f64)>) {
        let s = &self.settings;
        if self.forced_tolerance.is_none()
            && let Some(eta) = s.forcing.tolerance(residual, before, s.tolerance)
        {
            plan.system.set_tolerance(eta);
            self.before = Some((residual, eta));
        }
    }

    fn solve(
        &mut self,
        plan: &mut ScenePlan,
        ledger: &mut Ledger,
    ) -> Result<SolveReport, StepError> {
        let filter = plan.pins.as_ref().map(|p| &p.filter);
        let (system, b, dv) = (&mut plan.system, &self.b, &mut self.dv);
        Ok(ledger.time("solve", || system.solve(b, filter, dv))?)
    }

    /// Takes the first of the steps 1, ½, ¼, … that reduces the residual, or
    /// meets the tolerance, and returns its residual; the iterate and its
    /// residual are left as they were if none does.
    fn line_search(
        &mut self,
        plan: &mut ScenePlan,
        state: &State,
        request: StepRequest,
        residual: f64,
        report: &mut StepReport,
        ledger: &mut Ledger,
    ) -> Result<Option<f64>, StepError> {
        let goal = self.settings.tolerance;
        let work = match self.settings.line_search {
            LineSearch::Residual => None,
            LineSearch::Work => Some(dot(&self.b, &self.dv)),
        };
        let mut factor = 1.0;
        for _ in 0..self.settings.line_search_tries {
            let (v, dv) = (std::mem::take(&mut self.v), std::mem::take(&mut self.dv));
            let along = Some((dv.as_slice(), factor));
            extrapolate(&state.q, &v, along, request.dt, &mut self.q);
            let tried = self.residual_along(plan, state, request, (&v, along), ledger);
            (self.v, self.dv) = (v, dv);
            let tried = tried?;
            let reduced = match work {
                None => tried < residual,
                Some(work) => dot(&self.b_try, &self.dv) >= -0.9 * work,
            };
            if tried.is_finite() && (reduced || tried < goal) {
                for (v, dv) in self.v.iter_mut().zip(&self.dv) {
                    *v += factor * dv;
                }
                std::mem::swap(&mut self.b, &mut self.b_try);
                return Ok(Some(tried));
            }
            factor *= 0.5;
            report.halvings += 1;
        }
        Ok(None)
    }

    /// Residual that cancellation alone can leave: `16 ε (‖M v_0‖ + ‖M v‖ +
    /// ‖h |F|‖)` with `|F|` the sum of absolute contributions of each point,
    /// and what the forces change by when every coordinate is rounded once:
    /// in cloth that is hardly strained that is far more than `ε |F|`.
    fn round_off(&mut self, plan: &mut ScenePlan, state: &State, request: StepRequest) -> f64 {
        extrapolate(&state.q, &self.v, None, request.dt, &mut self.q);
        let at = end_point(state, &self.q, request.dt);
        let sum = &mut self.b_try;
        let points = 3 * state.layout.points;
        for (i, s) in sum.iter_mut().enumerate() {
            let (m, pull) = match i < points {
                true => (plan.inertia.masses[i / 3], plan.inertia.gravity[i % 3]),
                false => (plan.inertia.scalar_masses[i - points], 0.0),
            };
            *s = m * (state.v[i].abs() + self.v[i].abs() + request.dt * pull.abs());
        }
        let mut rounded = self.q.clone();
        for (i, x) in rounded.iter_mut().enumerate() {
            // Signs that no motion has.
            let sign = if (i * i + i / 3) % 7 < 3 { 1.0 } else { -1.0 };
            *x *= 1.0 + sign * f64::EPSILON;
        }
        let moved = end_point(state, &rounded, request.dt);
        let (mut g, mut h) = (Vec::new(), Vec::new());
        for term in &plan.terms {
            let batch = term.batch.as_ref();
            let factor = request.dt * if term.relaxed { request.stiffness } else { 1.0 };
            g.resize(batch.local_dim(), 0.0);
            h.resize(batch.local_dim(), 0.0);
            for e in 0..batch.len() {
                batch.gradients(&at, e..e + 1, &mut g);
                batch.gradients(&moved, e..e + 1, &mut h);
                let mut k = 0;
                for (&n, &dim) in batch.nodes(e).iter().zip(batch.node_dims()) {
                    let from = state.layout.offset(n, dim);
                    for i in 0..dim {
                        let noise = (g[k] - h[k]).abs() / f64::EPSILON;
                        sum[from + i] += factor * (g[k].abs() + noise);
                        k += 1;
                    }
                }
            }
        }
        16.0 * f64::EPSILON * norm_of(self.settings.norm, sum, plan)
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
        if let Some((place, what)) = state.first_not_finite() {
            let point = state.point_of(place, &plan.owners);
            return Err(not_finite_at(state, point, what, None));
        }
        match self.settings.scheme {
            Scheme::Newton => self.v.copy_from_slice(&state.v),
            Scheme::Linearised => self.v.fill(0.0),
        }
        let time_end = state.time + request.dt;
        if let Some(pins) = &plan.pins {
            prescribe(pins, &state.q, time_end, request.dt, &mut self.v);
        }
        let start = end_point(state, &state.q, request.dt);
        for term in &mut plan.terms {
            term.batch.begin_step(&start);
        }
        extrapolate(&state.q, &self.v, None, request.dt, &mut self.q);
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
            // Newton goes on from its own result with candidates that cover it.
            let start = step_start(state, &self.q, request.dt);
            self.contacts.detect(&mut plan.contacts, &start, ledger)?;
        };

        let at = end_point(state, &self.q, request.dt);
        for term in &mut plan.terms {
            term.batch.commit(&at);
        }
        for contact in &mut plan.contacts {
            contact.commit(&at);
        }
        state.q.copy_from_slice(&self.q);
        state.v.copy_from_slice(&self.v);
        state.time = time_end;
        let names = plan.terms.iter().map(|t| t.batch.name().to_owned());
        let energies = names.zip(&self.energies);
        Ok(StepReport {
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
            pin_forces: self
                .held
                .iter()
                .map(|j| j.map(|j| -j / request.dt))
                .collect(),
            ..report
        })
    }

    fn force_curvature(&mut self, policy: Option<CurvaturePolicy>) {
        self.forced = policy;
    }

    fn force_tolerance(&mut self, tolerance: Option<f64>) {
        self.forced_tolerance = tolerance;
    }

    fn heap_bytes(&self) -> usize {
        5 * size_of_val(self.q.as_slice())
            + size_of_val(self.change.as_slice())
            + self.contacts.response.heap_bytes()
    }
}

/// Unknowns `q` at the end of a step that begins at `state`.
pub(crate) fn end_point<'a>(state: &'a State, q: &'a [f64], dt: f64) -> EvalPoint<'a> {
    EvalPoint {
        layout: state.layout,
        q,
        q_start: &state.q,
        dt,
    }
}

pub(crate) fn step_start<'a>(state: &'a State, q_predicted: &'a [f64], dt: f64) -> StepStart<'a> {
    // Contact knows points alone.
    let points = 3 * state.layout.points;
    StepStart {
        q_start: &state.q[..points],
        q_predicted: &q_predicted[..points],
        dt,
        time: state.time,
    }
}

/// Gives constrained directions the velocity that brings them to their target.
fn prescribe(pins: &Pins, q: &[f64], time_end: f64, dt: f64, v: &mut [f64]) {
    // v ← S v + (I − S) w with w the velocity towards the target: S is linear,
    // so S (v − w) + w does it.
    let (q, _) = q.as_chunks::<3>();
    let shift = |v: &mut [f64], sign: f64| {
        let (v, _) = v.as_chunks_mut::<3>();
        for (k, &p) in pins.points.iter().enumerate() {
            let p = p as usize;
            let target = pins.trajectory.position(k, time_end);
            for i in 0..3 {
                v[p][i] += sign * (target[i] - q[p][i]) / dt;
            }
        }
    };
    shift(v, -1.0);
    Filter::<f64>::project(&pins.filter, v);
    shift(v, 1.0);
}

fn project(pins: &Option<Pins>, b: &mut [f64]) {
    if let Some(pins) = pins {
        Filter::<f64>::project(&pins.filter, b);
    }
}

/// [`project`], and what it takes from the points of pins.
pub(crate) fn hold(pins: &Option<Pins>, b: &mut [f64], taken: &mut Vec<[f64; 3]>) {
    taken.clear();
    let Some(held) = pins else { return };
    let at = |b: &[f64], p: u32| b.as_chunks::<3>().0[p as usize];
    taken.extend(held.points.iter().map(|&p| at(b, p)));
    project(pins, b);
    for (taken, &p) in taken.iter_mut().zip(&held.points) {
        let left = at(b, p);
        for i in 0..3 {
            taken[i] -= left[i];
        }
    }
}

/// `out = q + dt (v + factor dv)`
pub(crate) fn extrapolate(
    q: &[f64],
    v: &[f64],
    along: Option<(&[f64], f64)>,
    dt: f64,
    out: &mut [f64],
) {
    match along {
        None => {
            for ((out, q), v) in out.iter_mut().zip(q).zip(v) {
                *out = q + dt * v;
            }
        }
        Some((dv, factor)) => {
            for (((out, q), v), dv) in out.iter_mut().zip(q).zip(v).zip(dv) {
                *out = q + dt * (v + factor * dv);
            }
        }
    }
}

/// `out = M (v_0 − v − factor dv) + dt M g` of lumped masses, for velocities
/// `v + factor dv`. Where inertia couples unknowns, `change` instead.
fn inertial_impulse(
    plan: &ScenePlan,
    state: &State,
    (v, along): (&[f64], Option<(&[f64], f64)>),
    dt: f64,
    out: &mut [f64],
    change: &mut Vec<f64>,
) {
    let inertia = &plan.inertia;
    let gravity = inertia.gravity.map(|g| dt * g);
    let at = |i: usize| v[i] + along.map_or(0.0, |(dv, factor)| factor * dv[i]);
    let (points, scalars) = out.split_at_mut(3 * inertia.masses.len());
    let (points, _) = points.as_chunks_mut::<3>();
    if inertia.coupled.is_some() {
        let keep = 1.0 + dt * inertia.damping;
        change.clear();
        change.extend((0..v.len()).map(|i| state.v[i] - keep * at(i)));
        for (out, &m) in points.iter_mut().zip(&inertia.masses) {
            *out = gravity.map(|g| m * g);
        }
        scalars.fill(0.0);
    } else {
        for (p, (out, &m)) in points.iter_mut().zip(&inertia.masses).enumerate() {
            for i in 0..3 {
                out[i] = m * (state.v[3 * p + i] - at(3 * p + i) + gravity[i]);
            }
        }
        let first = 3 * inertia.masses.len();
        for (s, (out, &m)) in scalars.iter_mut().zip(&inertia.scalar_masses).enumerate() {
            *out = m * (state.v[first + s] - at(first + s));
        }
    }
    for &p in &inertia.weightless {
        let p = p as usize;
        for i in 0..3 {
            points[p][i] -= inertia.masses[p] * gravity[i];
        }
    }
}

/// What a system is evaluated at; `change` as in [`MassEvaluation`].
fn evaluation<'a>(
    (terms, inertia): (&'a [Term], &'a Inertia),
    state: &'a State,
    at: EvalPoint<'a>,
    request: StepRequest,
    change: &'a [f64],
) -> Evaluation<'a> {
    Evaluation {
        terms,
        at,
        stiffness: request.stiffness,
        masses: &inertia.masses,
        scalar_masses: &inertia.scalar_masses,
        mass: mass_evaluation(inertia, state, change, request.dt),
    }
}

fn mass_evaluation<'a>(
    inertia: &'a Inertia,
    state: &'a State,
    change: &'a [f64],
    dt: f64,
) -> Option<MassEvaluation<'a>> {
    let batch = inertia.coupled.as_deref()?;
    Some(MassEvaluation {
        batch,
        start: RatePoint {
            layout: state.layout,
            q: &state.q,
            v: &state.v,
        },
        change,
        damping: inertia.damping,
        dt,
    })
}

fn norm_of(norm: ResidualNorm, f: &[f64], plan: &ScenePlan) -> f64 {
    residual_norm(norm, f, &plan.inertia.masses, &plan.inertia.scalar_masses)
}

/// Names the term and the point behind a residual that is not finite.
pub(crate) fn not_finite(
    plan: &ScenePlan,
    state: &State,
    at: &EvalPoint<'_>,
    b: &[f64],
) -> StepError {
    let mut g = Vec::new();
    for term in &plan.terms {
        let batch = term.batch.as_ref();
        g.resize(batch.local_dim(), 0.0);
        for e in 0..batch.len() {
            let value = batch.gradients(at, e..e + 1, &mut g);
            if !value.is_finite() || g.iter().any(|g| !g.is_finite()) {
                let first = state.layout.offset(batch.nodes(e)[0], batch.node_dims()[0]);
                let point = state.point_of(first, &plan.owners);
                let term = Some(batch.name().to_owned());
                let mut error = not_finite_at(state, point, "the force", term);
                if let StepError::NotFinite { why, .. } = &mut error {
                    *why = batch.complaint(at, e);
                }
                return error;
            }
        }
    }
    let place = b.iter().position(|b| !b.is_finite()).unwrap_or(0);
    let point = state.point_of(place, &plan.owners);
    not_finite_at(state, point, "the residual", None)
}

pub(crate) fn not_finite_at(
    state: &State,
    point: usize,
    what: &'static str,
    term: Option<String>,
) -> StepError {
    let at = |i: usize| state.q.get(3 * point + i).copied().unwrap_or(f64::NAN);
    StepError::NotFinite {
        what,
        point,
        x: at(0),
        y: at(1),
        z: at(2),
        term,
        why: None,
    }
}
