//! A guard over the steps of a run: names trouble within the step in which it
//! arises, answers it by a ladder, and leaves a step that can be replayed.
//!
//! | finding | sign |
//! |---|---|
//! | not finite | a refused step whose error is a NaN or an infinity |
//! | stall | refused steps in a row; steps that stay small |
//! | energy | `E₁ − E₀` above what was worked on the cloth, see [`EnergyMeter`] |
//! | underflow | a step below `integrator.min_step` |
//!
//! Every stage of a run is watched: the sewing of garments and the drape. Energy
//! is compared in the drape only, after its relaxation, since before that
//! stiffness grows and velocities are taken away.
//!
//! The ladder: tighter linear tolerance, projected curvature, smaller steps,
//! clean stop with a [`Dump`]. A run without findings has the same bits with
//! and without the guard: it reads, and writes only to answer.

mod answer;
mod dump;
mod finding;
mod ladder;
mod meter;
#[cfg(test)]
mod tests;

use std::path::Path;
use std::time::{Duration, Instant};

use selvedge_collision::Body;
use selvedge_integrator::{Simulation, SimulationError, Snapshot, StepError, StepReport};

use crate::build::BuiltScene;
use crate::driver::chain;
use crate::file::SceneFile;
use crate::file::model::{DampingKind, WatchdogAnswer, WatchdogSettings};
use finding::{hardest_pulled, place};

pub use dump::{DUMP, Dump, Replay, ReplayError};
pub use finding::{Answer, Event, Trouble};
pub use ladder::Ladder;
pub use meter::EnergyMeter;

/// Rung on which steps are cut; below it only the solver changes.
const CUT: u8 = 3;
/// Highest rung: the step cut to 4⁻⁴ of itself.
const TOP: u8 = 6;

/// Where a run is, for the dump.
pub(crate) struct Scope<'a> {
    pub built: &'a BuiltScene,
    pub directory: &'a Path,
    pub start: &'a [f64],
    pub version: &'a str,
    pub stage: Stage,
}

/// Which part of a run is watched.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stage {
    pub name: &'static str,
    /// Whether the garment crossed itself when it was sewn, which decides about
    /// contact in its first stage.
    pub crossed: bool,
}

impl Stage {
    /// Name of the drape itself.
    pub const DRAPE: &str = "drape";

    /// The drape.
    pub fn drape() -> Self {
        Self {
            name: Self::DRAPE,
            crossed: false,
        }
    }
}

/// What comes after a step.
pub(crate) enum Verdict {
    /// It stands.
    Fine,
    /// It was taken back and is to be tried again.
    Again,
    /// The run ends, for this reason.
    Stop(String),
}

/// The guard over one run.
pub(crate) struct Watchdog {
    settings: WatchdogSettings,
    ladder: Ladder,
    stage: &'static str,
    rung: u8,
    /// Accepted steps since the last finding.
    calm: usize,
    /// Rejections in a row, and the step before the first.
    refused: usize,
    refused_dt: f64,
    /// Small accepted steps in a row.
    slow: usize,
    meter: EnergyMeter,
    energy_before: Option<f64>,
    before: Option<Snapshot>,
    /// Something not finite has been met in this step.
    met_not_finite: bool,
    driven: f64,
    /// Time spent watching.
    pub spent: Duration,
    pub events: Vec<Event>,
    pub unlisted: u64,
}

impl Watchdog {
    /// A guard, where the scene asks for one.
    pub fn new(scene: &SceneFile) -> Option<Self> {
        scene.watchdog.enabled.then(|| Self {
            settings: scene.watchdog,
            ladder: Ladder::of(scene),
            stage: Stage::DRAPE,
            rung: 0,
            calm: 0,
            refused: 0,
            refused_dt: 0.0,
            slow: 0,
            meter: EnergyMeter::new(scene.damping.kind == DampingKind::Incremental),
            energy_before: None,
            before: None,
            met_not_finite: false,
            driven: 0.0,
            spent: Duration::ZERO,
            events: Vec::new(),
            unlisted: 0,
        })
    }

    /// A new simulation begins: nothing of the one before counts but its events.
    pub fn enter(&mut self, stage: Stage, scene: &SceneFile) {
        self.stage = stage.name;
        self.rung = 0;
        self.calm = 0;
        self.refused = 0;
        self.slow = 0;
        self.meter = EnergyMeter::new(scene.damping.kind == DampingKind::Incremental);
        self.energy_before = None;
        self.before = None;
        self.met_not_finite = false;
    }

    /// Before the other ends of attachments move.
    pub fn before_motion(&mut self, simulation: &Simulation) {
        self.driven = EnergyMeter::driven(simulation);
    }

    /// After they moved: pulling on springs is work.
    pub fn after_motion(&mut self, simulation: &Simulation) {
        self.meter
            .add_work(EnergyMeter::driven(simulation) - self.driven);
    }

    /// Right before a step.
    pub fn begin(&mut self, simulation: &Simulation) {
        let clock = Instant::now();
        if self.refused == 0 {
            self.refused_dt = simulation.next_dt();
        }
        self.meter.begin(simulation);
        self.energy_before = self.meter.last();
        let mends = self.settings.answer == WatchdogAnswer::Ladder;
        // Nothing is taken back before there is an energy to compare with.
        self.before = (mends && self.energy_before.is_some()).then(|| simulation.snapshot());
        self.spent += clock.elapsed();
    }

    /// After an accepted step of length `dt`.
    pub fn accepted(
        &mut self,
        simulation: &mut Simulation,
        dt: f64,
        report: &StepReport,
        scope: &Scope<'_>,
    ) -> Verdict {
        let clock = Instant::now();
        let verdict = self.examine(simulation, dt, report, scope);
        self.spent += clock.elapsed();
        verdict
    }

    fn examine(
        &mut self,
        simulation: &mut Simulation,
        dt: f64,
        report: &StepReport,
        scope: &Scope<'_>,
    ) -> Verdict {
        self.refused = 0;
        self.met_not_finite = false;
        if simulation.state().time <= simulation.settings().relaxation.duration {
            // Velocities are taken away and stiffness grows: nothing to compare.
            self.meter.reset();
            return Verdict::Fine;
        }
        let floor = self.settings.energy_floor;
        let gain = self.meter.end(simulation, report);
        let bound = (self.settings.energy_gain * self.meter.scale()).max(floor);
        if let Some(gain) = gain
            && gain > bound
        {
            let moving = scope.built.bodies.iter().filter(|b| b.moves);
            let bodies: Vec<&dyn Body> = moving.map(|b| b.body.as_ref()).collect();
            let reach = 2.0 * scope.built.scene().contact.body_thickness;
            let work = self.meter.work(simulation, dt, &bodies, reach);
            let unexplained = gain - work.max(0.0);
            if unexplained > bound {
                return self.injected(simulation, dt, unexplained, scope);
            }
        }
        self.calm += 1;
        if self.rung > 0 && self.calm >= self.settings.recovery_steps {
            self.climb(simulation, 0);
        }
        let small = dt < self.settings.slow_fraction * simulation.settings().control.max_step;
        self.slow = if small { self.slow + 1 } else { 0 };
        if self.slow == self.settings.slow_steps {
            self.slow = 0;
            let what = format!(
                "{} steps in a row are below {:.1e} of the largest step",
                self.settings.slow_steps, self.settings.slow_fraction
            );
            let place = hardest_pulled(scope.built, simulation);
            // Slow is no reason to end.
            let answer = self.next_rung(simulation, 2);
            self.note(simulation, Trouble::Stall, what, dt, place, answer);
        }
        Verdict::Fine
    }

    fn injected(
        &mut self,
        simulation: &mut Simulation,
        dt: f64,
        gain: f64,
        scope: &Scope<'_>,
    ) -> Verdict {
        let what = format!(
            "mechanical energy grew by {gain:.3e} J without work; the largest kinetic and stored \
             energy so far is {:.3e} J",
            self.meter.scale()
        );
        let place = hardest_pulled(scope.built, simulation);
        let Some(before) = self.before.take() else {
            self.note(simulation, Trouble::Energy, what, dt, place, Answer::Noted);
            return Verdict::Fine;
        };
        if let Err(e) = simulation.restore(&before) {
            return Verdict::Stop(chain(&e));
        }
        self.meter.set_last(self.energy_before);
        if self.rung < TOP {
            let answer = self.next_rung(simulation, TOP);
            if self.rung >= CUT {
                simulation.set_next_dt(0.25 * dt);
            }
            self.note(simulation, Trouble::Energy, what, dt, place, answer);
            return Verdict::Again;
        }
        Verdict::Stop(self.stop(simulation, Trouble::Energy, what, dt, place, scope))
    }

    /// After a refused step of length `dt`.
    pub fn rejected(
        &mut self,
        simulation: &mut Simulation,
        dt: f64,
        reason: &StepError,
        scope: &Scope<'_>,
    ) -> Verdict {
        self.refused += 1;
        self.calm = 0;
        let mends = self.settings.answer == WatchdogAnswer::Ladder;
        if let StepError::NotFinite { .. } = reason {
            let place = place(scope.built, simulation, reason);
            if mends && simulation.state().first_not_finite().is_some() {
                // No step mends a state that is broken already.
                let what = reason.to_string();
                let trouble = Trouble::NotFinite;
                return Verdict::Stop(self.stop(simulation, trouble, what, dt, place, scope));
            }
            if !self.met_not_finite {
                self.met_not_finite = true;
                let answer = if mends {
                    Answer::SmallerStep
                } else {
                    Answer::Noted
                };
                let what = reason.to_string();
                self.note(simulation, Trouble::NotFinite, what, dt, place, answer);
            }
        }
        if self.refused.is_multiple_of(self.settings.rejections) {
            let what = format!(
                "{} steps in a row were refused, the last because {}",
                self.refused,
                chain(reason)
            );
            let place = place(scope.built, simulation, reason);
            let answer = self.next_rung(simulation, CUT);
            if mends && self.rung < CUT {
                // The new settings get the step that failed first.
                simulation.set_next_dt(self.refused_dt);
            }
            self.note(simulation, Trouble::Stall, what, dt, place, answer);
        }
        Verdict::Fine
    }

    /// The simulation gave up.
    pub fn gave_up(
        &mut self,
        simulation: &mut Simulation,
        error: &SimulationError,
        scope: &Scope<'_>,
    ) -> String {
        let (dt, place) = match error {
            SimulationError::StepUnderflow { dt, source, .. } => {
                (*dt, place(scope.built, simulation, source))
            }
            _ => (
                simulation.next_dt(),
                hardest_pulled(scope.built, simulation),
            ),
        };
        let what = chain(error);
        self.stop(simulation, Trouble::Underflow, what, dt, place, scope)
    }
}
