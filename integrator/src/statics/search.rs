//! Energy and forces at a state, the direction from them and the way along it.

use selvedge_energy::{Curvature, RatePoint};
use selvedge_linsolve::{LinsolveError, SolveStatus, dot};

use super::StaticRest;
use crate::motion::{end_point, extrapolate, step_start};
use crate::pins::hold;
use crate::{Evaluation, Ledger, MassEvaluation, ScenePlan, State, StepError, StepReport};

/// Share of the slope that a step has to gain (Armijo) \[1\].
const ARMIJO: f64 = 1e-4;
/// Share of the slope that may be left, of either sign, where energies no
/// longer tell steps apart \[1\].
const FLATTER: f64 = 0.9;
/// Round-off of an energy, relative to the sum of its parts \[1\].
const ROUND_OFF: f64 = 1e-13;
/// Relative tolerance of the linear solves, far from rest and near it.
const SOLVE: [f64; 2] = [1e-2, 1e-5];

/// Energy at a state.
#[derive(Clone, Copy)]
pub(super) struct Energy {
    /// Sum \[J\].
    pub(super) value: f64,
    /// What rounding may change it by \[J\].
    noise: f64,
}

/// A direction.
pub(super) enum Direction {
    Found,
    /// The linear solver met negative curvature.
    Negative,
}

impl StaticRest {
    /// Forces at `q`, times the pseudo-step, into `b_try`, without what pins
    /// hold; returns the energy. With `curvature` the matrix is assembled too.
    pub(super) fn evaluate(
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
            start: RatePoint {
                layout: state.layout,
                q: &state.q,
                v: &self.zero,
            },
            rates: &self.zero,
            damping: &[],
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
    pub(super) fn worst(&self, plan: &ScenePlan, b: &[f64]) -> (usize, f64) {
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
    pub(super) fn direction(
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
    /// returns the energy gained over what the quadratic model foresaw,
    /// `s (1 − s/2) F·p` (zero where the step was halved), and whether the move
    /// was cut to the largest one. The unknowns are then in `q`, the forces in
    /// `b_try`. `None` where no try does.
    pub(super) fn search(
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
}
