//! The iterations of one step.

use selvedge_energy::Curvature;
use selvedge_linsolve::{LinsolveError, SolveReport, SolveStatus, dot};

use super::BackwardEuler;
use crate::motion::{end_point, extrapolate};
use crate::norm::worst_point;
use crate::pins::project;
use crate::{
    CurvaturePolicy, Ledger, LineSearch, ScenePlan, Scheme, State, StepError, StepReport,
    StepRequest, finite,
};

/// How one Newton iteration ended.
enum Iteration {
    Reduced,
    RoundOff,
}

impl BackwardEuler {
    /// Newton's method from the velocities at hand, or a single linear system.
    pub(super) fn newton(
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
                self.share_momentum(plan, ledger);
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

    /// One solve at the state where the step starts, for the change of the
    /// velocities: a relative tolerance of the velocities themselves would leave
    /// a part of them over in every step. A step whose end has no finite forces
    /// is refused.
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
        // from prescribed velocities alone to those of the step's start
        self.dv.copy_from_slice(&state.v);
        project(&plan.pins, &mut self.dv);
        self.take_up(plan, ledger);
        let solve = self.solve(plan, ledger)?;
        report.linear_iterations = solve.iterations;
        if solve.status == SolveStatus::NegativeCurvature {
            report.negative_curvature = 1;
        }
        self.take_up(plan, ledger);
        self.share_momentum(plan, ledger);
        extrapolate(&state.q, &self.v, None, request.dt, &mut self.q);
        report.residual = self.residual(plan, state, request, ledger)?;
        if !report.residual.is_finite() {
            let at = end_point(state, &self.q, request.dt);
            return Err(finite::in_residual(plan, state, &at, &self.b_try));
        }
        Ok(report)
    }

    /// Adds the change at hand to the velocities of a linearised step, and takes it
    /// off the residual.
    fn take_up(&mut self, plan: &mut ScenePlan, ledger: &mut Ledger) {
        let (system, dv, b) = (&mut plan.system, &self.dv, &mut self.b);
        ledger.time("solve", || system.subtract_product(dv, b));
        project(&plan.pins, &mut self.b);
        for (v, dv) in self.v.iter_mut().zip(&self.dv) {
            *v += dv;
        }
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
}
