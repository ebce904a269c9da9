use selvedge_collision::Body;
use selvedge_energy::EvalPoint;
use selvedge_integrator::{Simulation, StepReport};

/// Mechanical energy from step to step.
///
/// ```text
/// E = Σ ½ m |v|² + Σ W(x) + W_contact − Σ m g·x
/// ```
/// Backward Euler takes energy out of a system whose potentials are convex
/// along the step: `E₁ − E₀ ≤ work` of what is moved from outside. What
/// exceeds that comes from an equation that was not solved, or from a force
/// that jumped.
#[derive(Debug, Default)]
pub struct EnergyMeter {
    q: Vec<f64>,
    v: Vec<f64>,
    last: Option<f64>,
    scale: f64,
    /// Whether values hold the step's dissipation, so that they have to be
    /// taken again at rest.
    incremental: bool,
}

/// Terms whose value is the dissipation of a step, not stored energy.
const NOT_STORED: [&str; 1] = ["drag"];

/// Terms whose other ends a motion may move.
const DRIVEN: &str = "attachment";

impl EnergyMeter {
    /// For a scene with damping as a potential of the step, or without.
    pub fn new(incremental: bool) -> Self {
        Self {
            incremental,
            ..Self::default()
        }
    }

    /// Before a step: keeps where it starts.
    pub fn begin(&mut self, simulation: &Simulation) {
        let state = simulation.state();
        self.q.clone_from(&state.q);
        self.v.clone_from(&state.v);
    }

    /// Energy [J] that attachments hold where the step starts; its change from
    /// before their other ends move to after is work.
    pub fn driven(simulation: &Simulation) -> f64 {
        stored(simulation, |name| name == DRIVEN)
    }

    /// Books work [J] done from outside before a step.
    pub fn add_work(&mut self, work: f64) {
        if let Some(last) = &mut self.last {
            *last += work;
        }
    }

    /// After an accepted step: what the energy grew by [J]; `None` for the
    /// first step, which has nothing before it to compare with.
    pub fn end(&mut self, simulation: &Simulation, report: &StepReport) -> Option<f64> {
        let (total, size) = self.energy(simulation, report);
        self.scale = self.scale.max(size);
        let gain = self.last.map(|last| total - last);
        self.last = Some(total);
        gain
    }

    /// Largest sum of kinetic and stored energy so far [J].
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// Energy at the end of the last step [J].
    pub fn last(&self) -> Option<f64> {
        self.last
    }

    /// Goes back to the energy before a step that was taken back.
    pub fn set_last(&mut self, energy: Option<f64>) {
        self.last = energy;
    }

    /// Forgets the past, where energies cannot be compared.
    pub fn reset(&mut self) {
        self.last = None;
    }

    /// Work [J] that prescribed points and `bodies`, which move, did on the
    /// cloth in the step of length `dt` that just ended: the part of every such
    /// point's momentum that gravity and the terms do not explain, times its
    /// way. `reach` [m] is how near a body touches.
    pub fn work(&self, simulation: &Simulation, dt: f64, bodies: &[&dyn Body], reach: f64) -> f64 {
        let (plan, state) = (simulation.plan(), simulation.state());
        let at = EvalPoint {
            layout: state.layout,
            q: &state.q,
            q_start: &self.q,
            dt,
        };
        let mut force = vec![0.0; state.q.len()];
        let mut g = Vec::new();
        for term in &plan.terms {
            let batch = term.batch.as_ref();
            g.resize(batch.local_dim(), 0.0);
            for e in 0..batch.len() {
                batch.gradients(&at, e..e + 1, &mut g);
                for (n, g) in batch.nodes(e).iter().zip(g.as_chunks::<3>().0) {
                    for i in 0..3 {
                        force[3 * *n as usize + i] -= g[i];
                    }
                }
            }
        }
        let mut driven = vec![false; plan.layout.points];
        for p in plan.pins.iter().flat_map(|p| &p.points) {
            driven[*p as usize] = true;
        }
        let mut samples = Vec::new();
        for body in bodies {
            samples.clear();
            body.sample_many(state.q.as_chunks::<3>().0, state.time, &mut samples);
            for (driven, s) in driven.iter_mut().zip(&samples) {
                *driven |= s.distance < reach;
            }
        }
        let mut work = 0.0;
        for p in (0..driven.len()).filter(|p| driven[*p]) {
            let m = plan.inertia.masses[p];
            for i in 0..3 {
                let k = 3 * p + i;
                let gravity = m * plan.inertia.gravity[i];
                let reaction = m * (state.v[k] - self.v[k]) / dt - gravity - force[k];
                work += reaction * (state.q[k] - self.q[k]);
            }
        }
        work
    }

    /// Mechanical energy, and its part without gravity [J].
    fn energy(&self, simulation: &Simulation, report: &StepReport) -> (f64, f64) {
        let (plan, state) = (simulation.plan(), simulation.state());
        let inertia = &plan.inertia;
        let held = |name: &str| !NOT_STORED.contains(&name);
        let stored: f64 = if self.incremental {
            stored(simulation, held)
        } else {
            let held = report.energies.iter().filter(|e| held(&e.name));
            held.map(|e| e.value).sum()
        };
        let size = state.kinetic_energy(&inertia.masses) + stored + report.contact_energy;
        let mut lift = 0.0;
        for (x, m) in state.q.as_chunks::<3>().0.iter().zip(&inertia.masses) {
            lift -= m * (0..3).map(|i| inertia.gravity[i] * x[i]).sum::<f64>();
        }
        for &p in &inertia.weightless {
            let p = p as usize;
            let pull: f64 = (0..3)
                .map(|i| inertia.gravity[i] * state.q[3 * p + i])
                .sum();
            lift += inertia.masses[p] * pull;
        }
        (size + lift, size)
    }
}

fn stored(simulation: &Simulation, of: impl Fn(&str) -> bool) -> f64 {
    let state = simulation.state();
    let at = EvalPoint {
        layout: state.layout,
        q: &state.q,
        q_start: &state.q,
        dt: 1.0,
    };
    let terms = simulation.plan().terms.iter();
    terms
        .filter(|t| of(t.batch.name()))
        .map(|t| t.batch.value(&at, 0..t.batch.len()))
        .sum()
}
