//! The residual of a step, its matrix and its round-off.

use selvedge_energy::{Curvature, EvalPoint, RatePoint};

use super::BackwardEuler;
use crate::motion::{end_point, extrapolate};
use crate::norm::{residual_norm, worst_point};
use crate::pins::{hold, project};
use crate::{
    Evaluation, Inertia, Ledger, MassEvaluation, ResidualNorm, ScenePlan, State, StepError,
    StepRequest, Term, finite,
};

impl BackwardEuler {
    /// Residual at the iterate, into `b_try`.
    pub(super) fn residual(
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
    pub(super) fn residual_along(
        &mut self,
        plan: &mut ScenePlan,
        state: &State,
        request: StepRequest,
        velocities: (&[f64], Option<(&[f64], f64)>),
        ledger: &mut Ledger,
    ) -> Result<f64, StepError> {
        let at = end_point(state, &self.q, request.dt);
        let (out, rates) = (&mut self.b_try, &mut self.rates);
        inertial_impulse(plan, state, velocities, request.dt, out, rates);
        self.contact_energy =
            self.contacts
                .add_impulse(&mut plan.contacts, &at, false, &mut self.b_try, ledger)?;
        let evaluation = evaluation(
            (&plan.terms, &plan.inertia),
            state,
            at,
            request,
            &self.rates,
        );
        plan.system
            .add_impulse(&evaluation, &mut self.b_try, &mut self.energies, ledger);
        hold(&plan.pins, &mut self.b_try, &mut self.held);
        Ok(norm_of(self.settings.norm, &self.b_try, plan))
    }

    /// Whether every single point is solved for, where that is asked for.
    pub(super) fn points_reached(&self, plan: &ScenePlan) -> bool {
        let Some(tolerance) = self.settings.point_tolerance else {
            return true;
        };
        worst_point(&self.b, &plan.inertia.masses).1 <= tolerance
    }

    /// Assembles matrix and residual at the current iterate.
    pub(super) fn assemble(
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
        inertial_impulse(plan, state, v, request.dt, &mut self.b, &mut self.rates);
        self.contact_energy =
            self.contacts
                .add_impulse(&mut plan.contacts, &at, true, &mut self.b, ledger)?;
        let evaluation = evaluation(
            (&plan.terms, &plan.inertia),
            state,
            at,
            request,
            &self.rates,
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
            return Err(finite::in_residual(plan, state, &at, &self.b));
        }
        Ok(residual)
    }

    /// Residual that cancellation alone can leave: `16 ε (‖M v_0‖ + ‖M v‖ +
    /// ‖h |F|‖)` with `|F|` the sum of absolute contributions of each point,
    /// and what the forces change by when every coordinate is rounded once:
    /// in cloth that is hardly strained that is far more than `ε |F|`.
    pub(super) fn round_off(
        &mut self,
        plan: &mut ScenePlan,
        state: &State,
        request: StepRequest,
    ) -> f64 {
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
}

/// `out = M (v_0 − v − factor dv) + dt M g` of lumped masses, for velocities
/// `v + factor dv`. Where inertia couples unknowns, `rates`
/// receives those velocities instead.
fn inertial_impulse(
    plan: &ScenePlan,
    state: &State,
    (v, along): (&[f64], Option<(&[f64], f64)>),
    dt: f64,
    out: &mut [f64],
    rates: &mut Vec<f64>,
) {
    let inertia = &plan.inertia;
    let gravity = inertia.gravity.map(|g| dt * g);
    let at = |i: usize| v[i] + along.map_or(0.0, |(dv, factor)| factor * dv[i]);
    let (points, scalars) = out.split_at_mut(3 * inertia.masses.len());
    let (points, _) = points.as_chunks_mut::<3>();
    if inertia.coupled.is_some() {
        rates.clear();
        rates.extend((0..v.len()).map(at));
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

/// What a system is evaluated at; `rates` as in [`MassEvaluation`].
fn evaluation<'a>(
    (terms, inertia): (&'a [Term], &'a Inertia),
    state: &'a State,
    at: EvalPoint<'a>,
    request: StepRequest,
    rates: &'a [f64],
) -> Evaluation<'a> {
    Evaluation {
        terms,
        at,
        stiffness: request.stiffness,
        masses: &inertia.masses,
        scalar_masses: &inertia.scalar_masses,
        mass: mass_evaluation(inertia, state, rates, request.dt),
    }
}

fn mass_evaluation<'a>(
    inertia: &'a Inertia,
    state: &'a State,
    rates: &'a [f64],
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
        rates,
        damping: &inertia.damping,
        dt,
    })
}

fn norm_of(norm: ResidualNorm, f: &[f64], plan: &ScenePlan) -> f64 {
    residual_norm(norm, f, &plan.inertia.masses, &plan.inertia.scalar_masses)
}
