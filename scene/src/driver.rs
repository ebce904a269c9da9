//! Runs a scene from its start, or from a checkpoint, to its results.

use std::borrow::Cow;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use selvedge_integrator::{
    EndReason, Ledger, Outcome, RelaxationSettings, Simulation, SimulationError, Snapshot,
    StepReport,
};
use selvedge_record::{
    BodySurface, Checkpoint, RecordError, Recorder, RecorderOptions, RunHeader, StepDiagnostics,
};

use crate::assembly;
use crate::build::{Built, BuiltAttachment, BuiltScene, PinGroup, StageOptions, Topology};
use crate::diagnostic::Diagnostics;
use crate::process;
use crate::result;
use crate::summary::{StageSummary, Status, Summary};
use crate::watchdog::{Scope, Stage, Verdict, Watchdog};

/// What a run is asked for, beside the scene.
#[derive(Clone, Debug)]
pub struct RunOptions {
    /// Folder of the results.
    pub directory: PathBuf,
    /// Whether to go on from the last checkpoint found there.
    pub resume: bool,
    /// Text of the scene file, kept in the recording.
    pub scene_text: String,
    /// Version of the program.
    pub version: String,
}

/// Why a run gave no result.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// The scene cannot be simulated.
    #[error("{} error(s) in the scene", .0.len())]
    Scene(Diagnostics),
    /// The recording or another result could not be written or read.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A folder or file of the results could not be written.
    #[error("cannot write `{path}`: {source}")]
    Write {
        /// The path.
        path: PathBuf,
        /// The reason that the system gives.
        source: std::io::Error,
    },
    /// The checkpoint and the scene do not belong together.
    #[error(transparent)]
    Checkpoint(SimulationError),
    /// The worker threads could not be started.
    #[error("cannot start {threads} threads: {reason}")]
    Threads {
        /// Threads asked for.
        threads: usize,
        /// The reason.
        reason: String,
    },
}

impl From<Diagnostics> for RunError {
    fn from(findings: Diagnostics) -> Self {
        Self::Scene(findings)
    }
}

/// Where a run stands, after every step.
#[derive(Clone, Copy, Debug)]
pub struct Tick<'a> {
    /// Name of the stage.
    pub stage: &'a str,
    /// Simulated time [s].
    pub time: f64,
    /// Time at which the stage ends [s].
    pub end: f64,
    /// Step size [s].
    pub dt: f64,
    /// Accepted steps.
    pub steps: u64,
    /// Rejected steps.
    pub rejected: u64,
    /// Newton residual of the last step.
    pub residual: f64,
    /// Active contacts.
    pub contacts: usize,
    /// Percentile of the kinetic energy that decides about rest [J].
    pub rest_energy: f64,
}

/// Listens to a run.
pub trait Progress {
    /// After every step.
    fn tick(&mut self, tick: &Tick<'_>);
    /// Something worth a line.
    fn note(&mut self, text: &str);
}

/// Listens to nothing.
pub struct Silent;

impl Progress for Silent {
    fn tick(&mut self, _: &Tick<'_>) {}
    fn note(&mut self, _: &str) {}
}

/// What a run leaves, beside its files.
pub struct RunResult {
    /// Contents of `summary.json`.
    pub summary: Summary,
    /// Final positions in the scene's order [m].
    pub positions: Vec<f64>,
    /// Sum of the contact forces' magnitudes at each point in the end, in the
    /// scene's order [N].
    pub contact_force: Vec<f64>,
    /// Principal stretches of each triangle in the end, in the scene's order.
    pub stretches: Vec<[f64; 2]>,
    /// Distance of each point to the nearest body in the end, in the scene's
    /// order [m]; empty without bodies.
    pub body_distance: Vec<f64>,
    /// Strain of the segments of sliding yarns in the end, by the arc lengths of
    /// the state, for every visit of [`YarnPaths`](selvedge_record::YarnPaths);
    /// NaN at the last visit of a yarn, empty where nothing slides.
    pub yarn_strain: Vec<f64>,
    /// Energies after the last step by term, and `kinetic` [J].
    pub energies: Vec<(String, f64)>,
    /// The recording, where one was made.
    pub recording: Option<PathBuf>,
}

/// Step that went wrong or the end of a drape.
struct Drape {
    status: Status,
    reason: String,
}

/// Simulates a scene and writes `run.mcap`, `final.obj` and `summary.json`.
/// A raised `interrupt` ends the run after the step at hand; what was recorded
/// can be resumed.
///
/// # Errors
/// [`RunError`]; results of an earlier run are then still as they were.
pub fn run(
    built: &BuiltScene,
    options: &RunOptions,
    progress: &mut (dyn Progress + Send),
    interrupt: &AtomicBool,
) -> Result<RunResult, RunError> {
    let threads = threads(built);
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|e| RunError::Threads {
            threads,
            reason: e.to_string(),
        })?;
    pool.install(|| run_here(built, options, progress, interrupt, threads))
}

/// Points below which waking a second thread costs more than it gives.
const SERIAL_POINTS: usize = 3000;

/// Worker threads for a scene: as it says, or all cores for a large one.
pub fn threads(built: &BuiltScene) -> usize {
    match built.scene().assembly.threads {
        0 if built.geometry.mesh.points() < SERIAL_POINTS => 1,
        0 => std::thread::available_parallelism().map_or(1, |n| n.get()),
        n => n,
    }
}

fn run_here(
    built: &BuiltScene,
    options: &RunOptions,
    progress: &mut (dyn Progress + Send),
    interrupt: &AtomicBool,
    threads: usize,
) -> Result<RunResult, RunError> {
    let scene = built.scene();
    let directory = &options.directory;
    let mut names = vec![result::OBJ, result::SUMMARY];
    names.extend(scene.output.recording.then_some(RECORDING));
    result::check_results(directory, &names)?;
    let header = header(built, options);
    let file = directory.join(RECORDING);
    let recording = scene.output.recording.then_some(&file);
    let (mut recorder, checkpoint) = match recording {
        None => (None, None),
        Some(path) if options.resume => {
            let (recorder, checkpoint) =
                Recorder::resume(path, &header, RecorderOptions::default())?;
            (Some(recorder), Some(checkpoint))
        }
        Some(path) => (
            Some(Recorder::create(path, &header, RecorderOptions::default())?),
            None,
        ),
    };

    let clock = (Instant::now(), process::user_seconds());
    let mut state = built.geometry.start();
    let mut stages: Vec<StageSummary> = Vec::new();
    let mut early: Option<Drape> = None;
    let mut dog = Watchdog::new(scene);
    let mut carried = checkpoint
        .as_ref()
        .is_some_and(|c| c.section(CARRIED).is_some());
    if checkpoint.is_none() && built.geometry.sewn {
        match assembly::assemble(built, state, dog.as_mut(), options, progress, interrupt)? {
            assembly::Assembled::Done {
                state: assembled,
                summaries,
                carried: from_coarser,
            } => {
                state = assembled;
                stages = summaries;
                carried = from_coarser;
            }
            assembly::Assembled::Cut {
                state: last,
                summaries,
                status,
                reason,
            } => {
                state = last;
                stages = summaries;
                early = Some(Drape { status, reason });
            }
        }
    }
    // What held labels are attached to depends on where the drape starts.
    let start = state.q.clone();
    if let Some(section) = checkpoint.as_ref().and_then(|c| c.section(START))
        && section.len() == state.q.len()
    {
        state.q.copy_from_slice(section);
    }
    let start = if checkpoint.is_some() {
        state.q.clone()
    } else {
        start
    };
    let start = Start { q: start, carried };
    let mut now = Now {
        built: Cow::Borrowed(built),
        topology: Topology::default(),
    };
    if let Some(section) = checkpoint.as_ref().and_then(|c| c.section(TOPOLOGY)) {
        now.resume(section)?;
        state = now.built.geometry.start();
    }
    let Built {
        mut simulation,
        attachments,
        mut effects,
        pins,
    } = now.built.simulation(state, &drape_stage(built, carried))?;
    let mut held = Held { attachments, pins };
    if let Some(checkpoint) = checkpoint {
        let snapshot = Snapshot {
            sections: checkpoint.sections,
        };
        simulation
            .restore(&snapshot)
            .map_err(RunError::Checkpoint)?;
        progress.note(&format!("resumed at t = {:.4} s", simulation.state().time));
    }

    let mut last = StepReport::default();
    if let Some(dog) = &mut dog {
        dog.enter(Stage::drape(), scene);
    }
    let drape = match early {
        Some(drape) => drape,
        None => {
            let mut frames = Frames::new(scene, &simulation);
            let ending = drape(
                &mut now,
                &mut simulation,
                &mut held,
                recorder.as_mut(),
                &mut frames,
                &start,
                &mut last,
                dog.as_mut(),
                options,
                progress,
                interrupt,
            )?;
            if let Some(recorder) = &mut recorder {
                frames.last(&now.built, recorder, &simulation)?;
                checkpoint_now(recorder, &simulation, &now, &start)?;
            }
            ending
        }
    };

    effects::fill_seconds(&mut effects, &simulation);
    let built: &BuiltScene = &now.built;
    let positions = built.geometry.recorded_positions(&simulation.state().q);
    let watched = dog.as_ref().map(|d| d.spent);
    let mut summary = result::summary(result::Inputs {
        built,
        simulation: &simulation,
        status: drape.status,
        reason: drape.reason,
        effects,
        topology: built.topology_changes().then(|| now.topology.summary()),
        assembly: stages,
        last: &last,
        watchdog_unlisted: dog.as_ref().map_or(0, |d| d.unlisted),
        watchdog: dog.map(|d| d.events).unwrap_or_default(),
        threads,
        wall: clock.0.elapsed(),
        cpu: process::user_seconds() - clock.1,
        version: &options.version,
    });
    if let Some(time) = watched {
        summary.stages.insert("watchdog".into(), time.as_secs_f64());
    }
    result::write(directory, built, &positions, &summary)?;
    let recording = match recorder {
        // A stopped run stays open, so that it can be resumed.
        Some(recorder) if drape.status == Status::Stopped => Some(recorder.part_path().to_owned()),
        Some(recorder) => {
            let outcome = serde_json::json!({
                "status": summary.status,
                "reason": summary.reason,
                "simulated_s": summary.simulated_s,
                "final_state_hash": summary.final_state_hash,
            });
            Some(recorder.finish(&outcome)?)
        }
        None => None,
    };
    let maps = result::maps(built, &mut simulation);
    let slides = built.geometry.yarns.as_ref().filter(|y| y.sliding);
    let yarn_strain = slides.map(|y| {
        let strains = result::yarn_strains(y, &simulation.state().q);
        built.geometry.recorded_strains(strains)
    });
    Ok(RunResult {
        yarn_strain: yarn_strain.unwrap_or_default(),
        summary,
        positions,
        contact_force: maps.contact_force,
        stretches: maps.stretches,
        body_distance: maps.body_distance,
        energies: result::energies(&last, simulation.state(), simulation.plan()),
        recording,
    })
}

/// File name of the recording.
const RECORDING: &str = "run.mcap";

/// Name of the checkpoint section with the drape's first positions.
const START: &str = "start";

/// Name of the checkpoint section that says that a coarser mesh came before.
const CARRIED: &str = "carried";

/// Where the drape begins.
struct Start {
    /// Positions in the solver's order [m].
    q: Vec<f64>,
    /// Whether from the drape on a coarser mesh.
    carried: bool,
}

/// What has draped on a coarser mesh keeps its stiffness.
fn drape_stage(built: &BuiltScene, carried: bool) -> StageOptions {
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
    let clock = Instant::now();
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
const TOPOLOGY: &str = "topology";

/// What a drape holds by springs and pins.
struct Held {
    attachments: Vec<BuiltAttachment>,
    pins: Vec<PinGroup>,
}

/// The scene as it is by now, and what has happened to it.
struct Now<'a> {
    built: Cow<'a, BuiltScene>,
    topology: Topology,
}

impl Now<'_> {
    /// Goes to where a checkpoint was taken.
    fn resume(&mut self, section: &[f64]) -> Result<(), RunError> {
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
    fn after_step(
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
fn drape(
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
                let reason = format!("at rest since {:.3} s", simulation.settings().stop.window);
                return Ok(Drape {
                    status: Status::Converged,
                    reason,
                });
            }
            Outcome::Ended(EndReason::Duration) => {
                let reason = "the simulated time is over".to_owned();
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

/// Seconds of the ledger's rows at the last record.
#[derive(Default)]
struct Booked(Vec<f64>);

impl Booked {
    /// What every row gained since.
    fn since(&mut self, ledger: &Ledger) -> Vec<(String, f64)> {
        self.0.resize(ledger.entries().len(), 0.0);
        let rows = ledger.entries().iter().zip(&mut self.0);
        rows.map(|(entry, before)| {
            let now = entry.time.as_secs_f64();
            let gained = now - std::mem::replace(before, now);
            (entry.name.clone(), gained)
        })
        .collect()
    }
}

fn diagnostics(
    simulation: &Simulation,
    dt: f64,
    report: &StepReport,
    pins: &[PinGroup],
    booked: &mut Booked,
) -> StepDiagnostics {
    let state = simulation.state();
    StepDiagnostics {
        time: state.time,
        step: simulation.counters().steps,
        dt,
        accepted: true,
        newton_iterations: report.newton_iterations as u32,
        linear_iterations: report.linear_iterations as u32,
        line_search_halvings: report.halvings as u32,
        residual: report.residual,
        energies: report
            .energies
            .iter()
            .map(|e| (e.name.clone(), e.value))
            .collect(),
        kinetic: state.kinetic_energy(&simulation.plan().inertia.masses),
        contacts: report.contacts,
        candidates: report.candidates,
        max_penetration: report.max_penetration,
        pins: pins.iter().map(|p| p.held(state, report)).collect(),
        ledger: booked.since(simulation.ledger()),
        note: String::new(),
    }
}

/// Decides which steps become frames.
struct Frames {
    interval: f64,
    next: f64,
    recorded: Option<u64>,
}

impl Frames {
    fn new(scene: &crate::file::SceneFile, simulation: &Simulation) -> Self {
        let interval = 1.0 / scene.output.frame_rate;
        let time = simulation.state().time;
        // A resumed run goes on with the frame after those already recorded.
        let next = if time > 0.0 {
            ((time / interval).floor() + 1.0) * interval
        } else {
            0.0
        };
        Self {
            interval,
            next,
            recorded: None,
        }
    }

    fn due(
        &mut self,
        built: &BuiltScene,
        recorder: &mut Recorder,
        simulation: &Simulation,
    ) -> Result<(), RecordError> {
        let time = simulation.state().time;
        // Steps add up to the frame's time only to round-off.
        if time < self.next - 1e-9 {
            return Ok(());
        }
        self.next = ((time / self.interval + 1e-6).floor() + 1.0) * self.interval;
        self.record(built, recorder, simulation)
    }

    fn last(
        &mut self,
        built: &BuiltScene,
        recorder: &mut Recorder,
        simulation: &Simulation,
    ) -> Result<(), RecordError> {
        if self.recorded == Some(simulation.counters().steps) {
            return Ok(());
        }
        self.record(built, recorder, simulation)
    }

    fn record(
        &mut self,
        built: &BuiltScene,
        recorder: &mut Recorder,
        simulation: &Simulation,
    ) -> Result<(), RecordError> {
        let state = simulation.state();
        let step = simulation.counters().steps;
        self.recorded = Some(step);
        let g = &built.geometry;
        recorder.frame(
            state.time,
            step,
            &g.recorded_positions(&state.q),
            &g.recorded_velocities(&state.v),
        )
    }
}

fn checkpoint_now(
    recorder: &mut Recorder,
    simulation: &Simulation,
    now: &Now<'_>,
    start: &Start,
) -> Result<(), RecordError> {
    let mut sections = simulation.snapshot().sections;
    sections.push((START.to_owned(), start.q.clone()));
    if start.carried {
        sections.push((CARRIED.to_owned(), Vec::new()));
    }
    if !now.topology.is_empty() {
        sections.push((TOPOLOGY.to_owned(), now.topology.section()));
    }
    recorder.checkpoint(&Checkpoint {
        time: simulation.state().time,
        step: simulation.counters().steps,
        sections,
    })
}

fn header(built: &BuiltScene, options: &RunOptions) -> RunHeader {
    let g = &built.geometry;
    RunHeader {
        scene_name: built.scene().name.clone(),
        scene_text: options.scene_text.clone(),
        effective: built.scene().effective(),
        version: options.version.clone(),
        points: if g.passages.is_some() {
            g.recorded_points()
        } else {
            g.mesh.points()
        },
        scalars: 0,
        triangles: g.scene_triangles.clone(),
        panels: g.scene_panel.clone(),
        fabrics: g.scene_fabric.clone(),
        panel_names: g.panel_names.clone(),
        fabric_names: g.fabrics.iter().map(|f| f.name.clone()).collect(),
        material: g.scene_material.clone(),
        bodies: built
            .bodies
            .iter()
            .map(|b| BodySurface {
                name: b.name.clone(),
                points: b.surface.0.clone(),
                triangles: b.surface.1.clone(),
            })
            .collect(),
        yarns: g.yarn_paths(),
        ..RunHeader::default()
    }
}

/// An error with all of its causes.
pub(crate) fn chain(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(e) = source {
        let next = e.to_string();
        if !text.contains(&next) {
            text += &format!(": {next}");
        }
        source = e.source();
    }
    text
}

mod effects {
    use super::Simulation;
    use crate::effects::EffectRow;

    /// Books the ledger's seconds to the effects that caused them.
    pub fn fill_seconds(rows: &mut [EffectRow], simulation: &Simulation) {
        for entry in simulation.ledger().entries() {
            let Some((_, part)) = entry.name.split_once(": ") else {
                continue;
            };
            let name = match part {
                "body-contact" => "body contact",
                "trim" => "trims",
                part => part,
            };
            if let Some(row) = rows.iter_mut().find(|r| r.on && r.name == name) {
                row.seconds += entry.time.as_secs_f64();
            }
        }
    }
}
