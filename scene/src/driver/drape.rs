//! The drape itself, step by step.

use std::borrow::Cow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use selvedge_integrator::{
    EndReason, Outcome, RelaxationSettings, RestReport, Simulation, SimulationError, StepReport,
};
use selvedge_record::{Recorder, StepDiagnostics};

use super::frames::{Booked, Frames, checkpoint_now, diagnostics};
use super::{Progress, RunError, RunOptions, Tick, chain};
use crate::assembly;
use crate::build::{Built, BuiltAttachment, BuiltScene, PinGroup, StageOptions, Topology};
use crate::process::Stopwatch;
use crate::summary::{StageSummary, Status};
use crate::watchdog::{Scope, Stage, Verdict, Watchdog};

/// Step that went wrong or the end of a drape.
pub(super) struct Drape {
    pub(super) status: Status,
    pub(super) reason: String,
}

/// Name of the checkpoint section with the drape's first positions.
pub(super) const START: &str = "start";

/// Name of the checkpoint section that says that a coarser mesh came before.
pub(super) const CARRIED: &str = "carried";

/// Where the drape begins.
pub(super) struct Start {
    /// Positions in the solver's order [m].
    pub(super) q: Vec<f64>,
    /// Whether from the drape on a coarser mesh.
    pub(super) carried: bool,
}

/// What has draped on a coarser mesh keeps its stiffness.
pub(super) fn drape_stage(built: &BuiltScene, carried: bool) -> StageOptions {
    let mut stage = built.drape_stage();
    if carried {
        stage.settings.relaxation = RelaxationSettings::OFF;
    }
    stage
}

/// A drape without results of its own.
pub(crate) struct Draped {
    /// Positions in the scene's order [m].
    pub positions: Vec<f64>,
    /// How sewing and draping went.
    pub stages: Vec<StageSummary>,
    /// How it ended.
    pub status: Status,
    /// Why.
    pub reason: String,
}

/// Sews and drapes the garments of a scene, writing nothing.
pub(crate) fn drape_alone(
    built: &BuiltScene,
    options: &RunOptions,
    progress: &mut (dyn Progress + Send),
    interrupt: &AtomicBool,
) -> Result<Draped, RunError> {
    let clock = Stopwatch::start();
    let scene = built.scene();
    let mut dog = Watchdog::new(scene);
    let state = built.geometry.start();
    let (state, mut stages, carried) =
        match assembly::assemble(built, state, dog.as_mut(), options, progress, interrupt)? {
            assembly::Assembled::Done {
                state,
                summaries,
                carried,
            } => (state, summaries, carried),
            assembly::Assembled::Cut {
                state,
                summaries,
                status,
                reason,
            } => {
                return Ok(Draped {
                    positions: built.geometry.flat_to_scene(&state.q),
                    stages: summaries,
                    status,
                    reason,
                });
            }
        };
    let start = Start {
        q: state.q.clone(),
        carried,
    };
    let Built {
        mut simulation,
        attachments,
        pins,
        ..
    } = built.simulation(state, &drape_stage(built, carried))?;
    if let Some(dog) = &mut dog {
        dog.enter(Stage::drape(), scene);
    }
    let mut frames = Frames::new(scene, &simulation);
    let mut now = Now {
        built: Cow::Borrowed(built),
        topology: Topology::default(),
    };
    let ending = drape(
        &mut now,
        &mut simulation,
        &mut Held { attachments, pins },
        None,
        &mut frames,
        &start,
        &mut StepReport::default(),
        dog.as_mut(),
        options,
        progress,
        interrupt,
    )?;
    let mut state = simulation.state().clone();
    built.cloth_alone(&mut state);
    let counters = simulation.counters();
    let what = "as the drape itself, on a coarser mesh";
    stages.push(assembly::summarise(
        built,
        &state,
        StageSummary {
            simulated_s: state.time,
            steps: counters.steps,
            rejected_steps: counters.rejected,
            ..assembly::empty("drape", what, clock)
        },
    ));
    let edge = 1e3 * scene.mesh.edge_length;
    for stage in &mut stages {
        if !stage.name.ends_with(" mm") {
            stage.name = format!("{}, {edge} mm", stage.name);
        }
    }
    Ok(Draped {
        positions: built.geometry.flat_to_scene(&state.q),
        stages,
        status: ending.status,
        reason: ending.reason,
    })
}

/// Name of the checkpoint section with all that happened to yarns.
pub(super) const TOPOLOGY: &str = "topology";

/// What a drape holds by springs and pins.
pub(super) struct Held {
    pub(super) attachments: Vec<BuiltAttachment>,
    pub(super) pins: Vec<PinGroup>,
}

/// The scene as it is by now, and what has happened to it.
pub(super) struct Now<'a> {
    pub(super) built: Cow<'a, BuiltScene>,
    pub(super) topology: Topology,
}

impl Now<'_> {
    /// Goes to where a checkpoint was taken.
    pub(super) fn resume(&mut self, section: &[f64]) -> Result<(), RunError> {
        let broken = || SimulationError::Snapshot {
            what: format!("section `{TOPOLOGY}` is broken"),
        };
        let topology = Topology::of_section(section);
        self.topology = topology.ok_or_else(|| RunError::Checkpoint(broken()))?;
        self.built = Cow::Owned(self.topology.replay(&self.built)?);
        Ok(())
    }

    /// Changes the simulation where yarns leave their contacts after a step;
    /// what is held now and a line about it.
    pub(super) fn after_step(
        &mut self,
        simulation: &mut Simulation,
    ) -> Result<Option<(Held, String)>, RunError> {
        let stage = self.built.drape_stage();
        let next = self.topology.after_step(&self.built, simulation, &stage)?;
        Ok(next.map(|(built, made, line)| {
            simulation.go_on_with(made.simulation);
            self.built = Cow::Owned(built);
            let (attachments, pins) = (made.attachments, made.pins);
            (Held { attachments, pins }, line)
        }))
    }
}

#[allow(clippy::too_many_arguments)]
pub(super) fn drape(
    now: &mut Now<'_>,
    simulation: &mut Simulation,
    held: &mut Held,
    mut recorder: Option<&mut Recorder>,
    frames: &mut Frames,
    start: &Start,
    last: &mut StepReport,
    mut dog: Option<&mut Watchdog>,
    options: &RunOptions,
    progress: &mut (dyn Progress + Send),
    interrupt: &AtomicBool,
) -> Result<Drape, RunError> {
    let failed = |reason: String| {
        Ok(Drape {
            status: Status::Failed,
            reason,
        })
    };
    let driven = held.attachments.iter().any(|a| a.moves());
    let mut told = 0;
    let mut booked = Booked::default();
    let changes = now.built.topology_changes();
    let interval = Duration::try_from_secs_f64(now.built.scene().output.checkpoint_seconds).ok();
    let mut saved = Instant::now();
    if let Some(recorder) = recorder.as_deref_mut() {
        frames.due(&now.built, recorder, simulation)?;
        checkpoint_now(recorder, simulation, now, start)?;
    }
    loop {
        if interrupt.load(Ordering::Relaxed) {
            let reason = format!("interrupted at t = {:.4} s", simulation.state().time);
            return Ok(Drape {
                status: Status::Stopped,
                reason,
            });
        }
        if let Some(dog) = &dog {
            for event in &dog.events[told..] {
                progress.note(&format!("watchdog: {}", event.what));
            }
            told = dog.events.len();
        }
        let time = simulation.state().time;
        if driven && let Some(dog) = &mut dog {
            dog.before_motion(simulation);
        }
        for attachment in held.attachments.iter().filter(|a| a.moves()) {
            attachment.update(time + simulation.next_dt());
        }
        if let Some(dog) = &mut dog {
            if driven {
                dog.after_motion(simulation);
            }
            dog.begin(simulation);
        }
        let scope = Scope {
            built: &now.built,
            directory: &options.directory,
            start: &start.q,
            version: &options.version,
            stage: Stage::drape(),
        };
        let outcome = match simulation.advance() {
            Ok(outcome) => outcome,
            Err(e) => {
                return failed(match &mut dog {
                    Some(dog) => dog.gave_up(simulation, &e, &scope),
                    None => chain(&e),
                });
            }
        };
        let verdict = match (&mut dog, &outcome) {
            (Some(dog), Outcome::Accepted { dt, report }) => {
                dog.accepted(simulation, *dt, report, &scope)
            }
            (Some(dog), Outcome::Rejected { dt, reason }) => {
                dog.rejected(simulation, *dt, reason, &scope)
            }
            _ => Verdict::Fine,
        };
        match verdict {
            Verdict::Fine => {}
            Verdict::Again => continue,
            Verdict::Stop(reason) => return failed(reason),
        }
        match outcome {
            Outcome::Ended(EndReason::AtRest) => {
                let reason = match &last.rest {
                    Some(rest) => unbalanced(&now.built, simulation, rest),
                    None => format!("at rest since {:.3} s", simulation.settings().stop.window),
                };
                return Ok(Drape {
                    status: Status::Converged,
                    reason,
                });
            }
            Outcome::Ended(EndReason::Duration) => {
                let reason = match &last.rest {
                    Some(rest) => format!(
                        "not at rest after {} iterations: {}",
                        simulation.counters().steps,
                        unbalanced(&now.built, simulation, rest)
                    ),
                    None => "the simulated time is over".to_owned(),
                };
                return Ok(Drape {
                    status: Status::Finished,
                    reason,
                });
            }
            Outcome::Accepted { dt, report } => {
                progress.tick(&tick("drape", simulation, dt, &report));
                // What the step did, before its yarns leave their contacts.
                let mut record = recorder
                    .as_ref()
                    .map(|_| diagnostics(simulation, dt, &report, &held.pins, &mut booked));
                if changes && let Some((new, what)) = now.after_step(simulation)? {
                    *held = new;
                    if let Some(record) = &mut record {
                        record.note = what;
                    }
                    if let Some(dog) = &mut dog {
                        dog.changed(simulation);
                    }
                }
                if let (Some(recorder), Some(record)) = (recorder.as_deref_mut(), &record) {
                    recorder.diagnostics(record)?;
                    frames.due(&now.built, recorder, simulation)?;
                    if interval.is_some_and(|i| !i.is_zero() && saved.elapsed() >= i) {
                        checkpoint_now(recorder, simulation, now, start)?;
                        saved = Instant::now();
                    }
                }
                *last = report;
            }
            Outcome::Rejected { dt, reason } => {
                if let Some(recorder) = recorder.as_deref_mut() {
                    recorder.diagnostics(&StepDiagnostics {
                        time: simulation.state().time,
                        step: simulation.counters().steps,
                        dt,
                        note: reason.to_string(),
                        ..StepDiagnostics::default()
                    })?;
                }
            }
        }
    }
}

/// How far from rest a static solve ended, and where.
fn unbalanced(built: &BuiltScene, simulation: &Simulation, rest: &RestReport) -> String {
    let (x, _) = simulation.state().q.as_chunks::<3>();
    let [x, y, z] = x[rest.point];
    let order = &built.geometry.order.old_of_new;
    let point = order.get(rest.point).map_or(rest.point, |p| *p as usize);
    format!(
        "the largest unbalanced force is {:.2e} N (tolerance {:.0e} N), on point {point} at \
         ({x:.4}, {y:.4}, {z:.4}) m",
        rest.force, rest.tolerance
    )
}

pub(crate) fn tick<'a>(
    stage: &'a str,
    simulation: &Simulation,
    dt: f64,
    report: &StepReport,
) -> Tick<'a> {
    Tick {
        stage,
        time: simulation.state().time,
        end: simulation.settings().duration,
        dt,
        steps: simulation.counters().steps,
        rejected: simulation.counters().rejected,
        residual: report.residual,
        contacts: report.contacts,
        rest_energy: simulation.rest_energy(),
    }
}
