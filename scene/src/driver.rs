//! Runs a scene from its start, or from a checkpoint, to its results.

mod drape;
mod frames;

use std::borrow::Cow;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use selvedge_integrator::{SimulationError, Snapshot, StepReport};
use selvedge_record::{RecordError, Recorder, RecorderOptions};

use crate::assembly;
use crate::build::{Built, BuiltScene, Topology};
use crate::cascade;
pub use crate::cascade::Coarser;
use crate::diagnostic::Diagnostics;
use crate::process::Stopwatch;
use crate::result;
use crate::summary::{StageSummary, Status, Summary};
use crate::watchdog::{Stage, Watchdog};
use drape::{CARRIED, Drape, Held, Now, START, Start, TOPOLOGY, drape, drape_stage};
pub(crate) use drape::{drape_alone, tick};
use frames::{Frames, checkpoint_now, header};

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

/// Digest of all that two runs with the same results share: settings, meshes
/// and bodies, and the version of the program.
pub fn digest(built: &BuiltScene, options: &RunOptions) -> String {
    header(built, options).digest()
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
    run_after(built, None, options, progress, interrupt)
}

/// As [`run`], for garments that begin where those of a coarser mesh rest, the
/// coarse mesh that `assemble.coarsest` asks for being draped already. Where
/// they cannot, they are sewn as by [`run`].
///
/// # Errors
/// As [`run`].
pub fn run_after(
    built: &BuiltScene,
    coarser: Option<Coarser<'_>>,
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
    pool.install(|| run_here(built, coarser, options, progress, interrupt, threads))
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
    coarser: Option<Coarser<'_>>,
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

    let clock = Stopwatch::start();
    let mut state = built.geometry.start();
    let mut stages: Vec<StageSummary> = Vec::new();
    let mut early: Option<Drape> = None;
    let mut dog = Watchdog::new(scene);
    let mut carried = checkpoint
        .as_ref()
        .is_some_and(|c| c.section(CARRIED).is_some());
    if checkpoint.is_none() && built.geometry.sewn {
        let carried_over =
            coarser.and_then(|coarser| cascade::carried(coarser, built, &state, progress));
        let assembled = match carried_over {
            Some(assembled) => assembled,
            None => assembly::assemble(built, state, dog.as_mut(), options, progress, interrupt)?,
        };
        match assembled {
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
        wall: clock.wall(),
        cpu: clock.user(),
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
    use selvedge_integrator::Simulation;

    use crate::effects::EffectRow;

    /// Books the ledger's seconds to the effects that caused them.
    pub fn fill_seconds(rows: &mut [EffectRow], simulation: &Simulation) {
        for entry in simulation.ledger().entries() {
            let Some((_, part)) = entry.name.split_once(": ") else {
                continue;
            };
            let name = match part {
                "body-contact" => "body contact",
                "body-faces" => "faces on bodies",
                "trim" => "trims",
                part => part,
            };
            if let Some(row) = rows.iter_mut().find(|r| r.on && r.name == name) {
                row.seconds += entry.time.as_secs_f64();
            }
        }
    }
}
