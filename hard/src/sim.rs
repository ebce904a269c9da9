use std::time::Instant;

use selvedge_collision::self_intersections;
use selvedge_energy::EvalPoint;
use selvedge_integrator::{EndReason, Outcome, Simulation, SimulationError, State};
use selvedge_scene::build::{Built, BuiltAttachment, BuiltScene, broad_phase};
use selvedge_scene::file::model::DampingKind;
use selvedge_scene::watchdog::EnergyMeter;
use selvedge_shell_model::strain::principal_stretches;

use crate::HardError;

/// What happened in a simulation so far.
#[derive(Clone, Debug, Default)]
pub struct Log {
    /// Accepted steps.
    pub steps: usize,
    /// Rejected steps.
    pub rejected: usize,
    /// Smallest accepted step but the last, which the end may cut [s].
    pub min_dt: f64,
    /// Most Newton iterations of an accepted step.
    pub max_newton: usize,
    /// Most linear iterations of an accepted step, over its Newton iterations.
    pub max_linear: f64,
    /// Sum of what the mechanical energy grew by in accepted steps [J].
    pub gained: f64,
    /// Largest sum of kinetic and stored energy [J].
    pub energy: f64,
    /// Deepest contact below its thickness [m].
    pub depth: f64,
    /// Linear solves that met negative curvature.
    pub negative: usize,
    /// Fastest point after any step [m/s].
    pub speed: f64,
    /// Most contact candidates of a step.
    pub candidates: usize,
}

/// A simulation of a case, with a log.
pub struct Sim {
    /// The scene.
    pub built: BuiltScene,
    /// The simulation.
    pub s: Simulation,
    /// What happened.
    pub log: Log,
    attachments: Vec<BuiltAttachment>,
    meter: EnergyMeter,
    pending_dt: f64,
    clock: Instant,
    budget: f64,
}

impl Sim {
    /// From where the scene puts its cloth.
    ///
    /// # Errors
    /// [`HardError::Scene`].
    pub fn new(built: BuiltScene, budget: f64) -> Result<Self, HardError> {
        let state = built.geometry.start();
        Self::from(built, state, budget)
    }

    /// From a state in the solver's order.
    ///
    /// # Errors
    /// [`HardError::Scene`].
    pub fn from(built: BuiltScene, state: State, budget: f64) -> Result<Self, HardError> {
        let Built {
            simulation,
            attachments,
            ..
        } = built.simulation(state, &built.drape_stage())?;
        let incremental = built.scene().damping.kind == DampingKind::Incremental;
        Ok(Self {
            built,
            s: simulation,
            log: Log {
                min_dt: f64::INFINITY,
                ..Log::default()
            },
            attachments,
            meter: EnergyMeter::new(incremental),
            pending_dt: f64::INFINITY,
            clock: Instant::now(),
            budget,
        })
    }

    /// One try of a step; `false` at the end.
    ///
    /// # Errors
    /// [`HardError::Simulation`], [`HardError::Budget`].
    pub fn step(&mut self) -> Result<bool, HardError> {
        let time = self.s.state().time;
        if self.clock.elapsed().as_secs_f64() > self.budget {
            let seconds = self.budget;
            return Err(HardError::Budget { seconds, time });
        }
        for a in self.attachments.iter().filter(|a| a.moves()) {
            a.update(time + self.s.next_dt());
        }
        self.meter.begin(&self.s);
        match self.s.advance()? {
            Outcome::Accepted { dt, report } => {
                let log = &mut self.log;
                log.steps += 1;
                log.min_dt = log.min_dt.min(self.pending_dt);
                self.pending_dt = dt;
                log.max_newton = log.max_newton.max(report.newton_iterations);
                let solves = report.newton_iterations + report.projected;
                let each = report.linear_iterations as f64 / solves.max(1) as f64;
                log.max_linear = log.max_linear.max(each);
                log.depth = log.depth.max(report.max_penetration);
                log.negative += report.negative_curvature;
                log.candidates = log.candidates.max(report.candidates);
                if self.s.state().time > self.s.settings().relaxation.duration {
                    let gain = self.meter.end(&self.s, &report).unwrap_or(0.0);
                    log.gained += gain.max(0.0);
                    log.energy = self.meter.scale();
                    log.speed = log.speed.max(fastest(&self.s));
                }
                Ok(true)
            }
            Outcome::Rejected { .. } => {
                self.log.rejected += 1;
                Ok(true)
            }
            Outcome::Ended(EndReason::AtRest | EndReason::Duration) => Ok(false),
        }
    }

    /// To the end.
    ///
    /// # Errors
    /// As [`step`](Self::step).
    pub fn run(&mut self) -> Result<(), HardError> {
        while self.step()? {}
        Ok(())
    }

    /// To a time [s], or the end.
    ///
    /// # Errors
    /// As [`step`](Self::step).
    pub fn until(&mut self, time: f64) -> Result<(), HardError> {
        while self.s.state().time < time - 1e-9 && self.step()? {}
        Ok(())
    }

    /// To the end; the error of a simulation that gave up, where it did.
    ///
    /// # Errors
    /// All others.
    pub fn run_or_give_up(&mut self) -> Result<Option<SimulationError>, HardError> {
        match self.run() {
            Ok(()) => Ok(None),
            Err(HardError::Simulation(e)) => Ok(Some(e)),
            Err(e) => Err(e),
        }
    }

    /// Positions in the scene's order [m].
    pub fn points(&self) -> Vec<[f64; 3]> {
        let g = &self.built.geometry;
        g.to_scene(self.s.state().q.as_chunks::<3>().0)
    }

    /// Velocities in the scene's order [m/s].
    pub fn velocities(&self) -> Vec<[f64; 3]> {
        let g = &self.built.geometry;
        g.to_scene(self.s.state().v.as_chunks::<3>().0)
    }

    /// Moves points at the start: `map(position)`.
    pub fn place(&mut self, map: impl Fn([f64; 3]) -> [f64; 3]) {
        let (q, _) = self.s.state_mut().q.as_chunks_mut::<3>();
        for p in q {
            *p = map(*p);
        }
    }

    /// Gives points velocities: `map(position)`.
    pub fn push(&mut self, map: impl Fn([f64; 3]) -> [f64; 3]) {
        let state = self.s.state_mut();
        let (q, _) = state.q.as_chunks::<3>();
        let (v, _) = state.v.as_chunks_mut::<3>();
        for (v, p) in v.iter_mut().zip(q) {
            *v = map(*p);
        }
    }

    /// 1 when positions and velocities are finite.
    pub fn finite(&self) -> f64 {
        f64::from(u8::from(self.s.state().first_not_finite().is_none()))
    }

    /// Smallest step relative to the largest allowed; 1 for a run of one step.
    pub fn least_step(&self) -> f64 {
        (self.log.min_dt / self.s.settings().control.max_step).min(1.0)
    }

    /// Edge-triangle crossings of the cloth with itself.
    pub fn crossings(&self) -> f64 {
        let g = &self.built.geometry;
        let mut broad = broad_phase(self.built.scene().contact.broad_phase);
        let q = &self.s.state().q[..3 * g.mesh.points()];
        self_intersections(q, g.mesh.triangles(), broad.as_mut()).len() as f64
    }

    /// Depth of the deepest point inside a body [m].
    pub fn inside(&self) -> f64 {
        let state = self.s.state();
        let (x, _) = state.q.as_chunks::<3>();
        let mut deepest = 0.0_f64;
        for b in &self.built.bodies {
            for p in x {
                deepest = deepest.max(-b.body.sample(*p, state.time).distance);
            }
        }
        deepest
    }

    /// Area of the cloth relative to its rest.
    pub fn area(&self) -> f64 {
        let mesh = &self.built.geometry.mesh;
        let (x, _) = self.s.state().q.as_chunks::<3>();
        let area = mesh.triangles().iter().map(|t| area(x, t)).sum::<f64>();
        area / mesh.total_area()
    }

    /// Mean of the larger principal stretch, weighted by area.
    pub fn mean_stretch(&self) -> f64 {
        let mesh = &self.built.geometry.mesh;
        let all = principal_stretches(mesh, &self.s.state().q);
        let sum = all.iter().enumerate();
        let sum: f64 = sum.map(|(t, s)| mesh.rest_area(t) * s[0]).sum();
        sum / mesh.total_area()
    }

    /// Largest and smallest principal stretch.
    pub fn stretches(&self) -> [f64; 2] {
        let all = principal_stretches(&self.built.geometry.mesh, &self.s.state().q);
        let largest = all.iter().map(|s| s[0]).fold(0.0, f64::max);
        [largest, all.iter().map(|s| s[1]).fold(f64::MAX, f64::min)]
    }

    /// Energy of all terms at rest [J].
    pub fn stored(&self) -> f64 {
        let state = self.s.state();
        let at = EvalPoint {
            layout: state.layout,
            q: &state.q,
            q_start: &state.q,
            dt: 1.0,
        };
        let terms = self.s.plan().terms.iter();
        terms.map(|t| t.batch.value(&at, 0..t.batch.len())).sum()
    }

    /// The exact bits of positions and velocities.
    pub fn bits(&self) -> Vec<u64> {
        let state = self.s.state();
        let all = state.q.iter().chain(&state.v);
        all.map(|x| x.to_bits()).collect()
    }

    /// Figures that every scene has: `finite`, `least step`, `depth`, `speed`.
    pub fn usual(&self) -> Vec<(&'static str, f64)> {
        vec![
            ("finite", self.finite()),
            ("least step", self.least_step()),
            ("depth", self.log.depth),
            ("speed", self.log.speed),
        ]
    }
}

/// Area of a triangle [m²].
pub(crate) fn area(x: &[[f64; 3]], t: &[u32; 3]) -> f64 {
    let [a, b, c] = t.map(|p| x[p as usize]);
    let (u, v) = (sub(b, a), sub(c, a));
    0.5 * norm(cross(u, v))
}

pub(crate) fn fastest(s: &Simulation) -> f64 {
    let (v, _) = s.state().v.as_chunks::<3>();
    v.iter().map(|v| norm(*v)).fold(0.0, f64::max)
}

pub(crate) fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| a[i] - b[i])
}

pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

pub(crate) fn norm(a: [f64; 3]) -> f64 {
    a.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Largest and mean distance of points in the same order [m].
pub(crate) fn distance(a: &[[f64; 3]], b: &[[f64; 3]]) -> [f64; 2] {
    let all: Vec<f64> = a.iter().zip(b).map(|(a, b)| norm(sub(*a, *b))).collect();
    let mean = all.iter().sum::<f64>() / all.len().max(1) as f64;
    [all.iter().copied().fold(0.0, f64::max), mean]
}
