//! Where simulations run.

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use selvedge_scene::build::BuiltScene;
use selvedge_scene::diagnostic::{Diagnostics, Severity};
use selvedge_scene::driver::{self, Progress, RunError, RunOptions, Silent, Tick};
use selvedge_scene::file;
use selvedge_scene::summary::Status;
use selvedge_scene::watchdog::DUMP;

use crate::plan::Job;
use crate::record::{Figures, Measured};
use crate::shape::Shape;

/// Why a simulation left nothing.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Halt {
    /// It was asked to end.
    #[error("interrupted")]
    Interrupted,
    /// The machine, not the simulation, failed: a full disk, no memory for
    /// threads. Going on would fail the rest of the study as well.
    #[error("{0}")]
    Machine(String),
}

/// Runs simulations, several at once when asked by several threads.
///
/// A simulation that fails is a result, see [`Figures::failed`]; results do not
/// depend on the executor, apart from their times.
pub trait Executor: Sync {
    /// Its name for messages.
    fn name(&self) -> &str;

    /// Runs a job, all of its repetitions.
    ///
    /// # Errors
    /// [`Halt`] when there is nothing to keep.
    fn execute(&self, job: &Job, interrupt: &AtomicBool) -> Result<Measured, Halt>;
}

/// Listens to simulations in this process.
pub trait Watch: Sync {
    /// After every step.
    fn tick(&self, job: &Job, tick: &Tick<'_>);
}

/// Runs in this process.
pub struct InProcess<'a> {
    /// Folder for what a run writes beside its figures; emptied again.
    pub scratch: PathBuf,
    /// Version of the program.
    pub version: String,
    /// Whether no other run shares the process, so that its processor time is
    /// that of the run.
    pub alone: bool,
    /// Hears of every step.
    pub watch: Option<&'a dyn Watch>,
}

impl Executor for InProcess<'_> {
    fn name(&self) -> &str {
        "in-process"
    }

    fn execute(&self, job: &Job, interrupt: &AtomicBool) -> Result<Measured, Halt> {
        let mut measured = self.repeated(job, interrupt)?;
        // Other runs share the process, before if not beside.
        measured.figures.peak_memory_bytes = None;
        Ok(measured)
    }
}

impl InProcess<'_> {
    /// One run at a time, unheard.
    pub fn new(scratch: impl Into<PathBuf>, version: &str) -> Self {
        Self {
            scratch: scratch.into(),
            version: version.to_owned(),
            alone: true,
            watch: None,
        }
    }

    /// All repetitions of a job; the memory is that of the process.
    pub(crate) fn repeated(&self, job: &Job, interrupt: &AtomicBool) -> Result<Measured, Halt> {
        let mut first: Option<Measured> = None;
        for _ in 0..job.repeats.max(1) {
            let run = self.once(job, interrupt)?;
            let Some(whole) = &mut first else {
                let done = run.shape.is_none();
                first = Some(run);
                if done {
                    break;
                }
                continue;
            };
            whole.figures.wall_s.extend(run.figures.wall_s);
            whole.figures.cpu_s.extend(run.figures.cpu_s);
            whole.figures.drape_cpu_s.extend(run.figures.drape_cpu_s);
            whole.figures.drape_wall_s.extend(run.figures.drape_wall_s);
        }
        first.ok_or(Halt::Interrupted)
    }

    fn once(&self, job: &Job, interrupt: &AtomicBool) -> Result<Measured, Halt> {
        let failed = |reason: String| {
            Ok(Measured {
                figures: Figures::failed(reason),
                shape: None,
                dump: None,
            })
        };
        let mut overrides = job.overrides.clone();
        for key in ["output.recording", "output.report"] {
            overrides.retain(|(k, _)| k != key);
            overrides.push((key.to_owned(), "false".to_owned()));
        }
        let parsed = match file::read(&job.scene, &overrides) {
            Ok(parsed) => parsed,
            Err(findings) => return failed(errors(&findings)),
        };
        let mut built = match BuiltScene::new(parsed) {
            Ok(built) => built,
            Err(findings) => return failed(errors(&findings)),
        };
        if let Some(p) = &job.perturbation {
            built.perturb(p.size_m, p.seed);
        }
        let directory = self.scratch.join(&job.hash);
        let options = RunOptions {
            directory: directory.clone(),
            resume: false,
            scene_text: String::new(),
            version: self.version.clone(),
        };
        let mut forward = self.watch.map(|watch| Forward { watch, job });
        let mut silent = Silent;
        let progress: &mut (dyn Progress + Send) = match &mut forward {
            Some(forward) => forward,
            None => &mut silent,
        };
        let result = driver::run(&built, &options, progress, interrupt);
        let left = directory.join(DUMP);
        let dump = std::fs::read_to_string(&left).ok();
        // Only figures, shape and dump are kept; a folder in the way shows next time.
        let _ = std::fs::remove_dir_all(&directory);
        let result = match result {
            Ok(result) => result,
            Err(RunError::Scene(findings)) => return failed(errors(&findings)),
            Err(e) => return Err(Halt::Machine(e.to_string())),
        };
        if result.summary.status == Status::Stopped {
            return Err(Halt::Interrupted);
        }
        let mut figures = Figures::of(&built, &result);
        if !self.alone {
            figures.cpu_s.clear();
            figures.drape_cpu_s.clear();
        }
        if dump.is_some() {
            // Whoever keeps it says where.
            let place = format!("; the step is in {}", left.display());
            figures.reason = figures.reason.replace(&place, "");
        }
        let whole = result.positions.iter().all(|x| x.is_finite());
        let shape = (whole && !result.positions.is_empty()).then(|| Shape {
            positions: result.positions,
            triangles: built.geometry.scene_triangles.clone(),
        });
        Ok(Measured {
            figures,
            shape,
            dump,
        })
    }
}

/// Errors in one line.
fn errors(findings: &Diagnostics) -> String {
    let errors = findings.findings().iter();
    let errors = errors.filter(|f| f.severity == Severity::Error);
    errors
        .map(ToString::to_string)
        .collect::<Vec<_>>()
        .join("; ")
}

struct Forward<'a> {
    watch: &'a dyn Watch,
    job: &'a Job,
}

impl Progress for Forward<'_> {
    fn tick(&mut self, tick: &Tick<'_>) {
        self.watch.tick(self.job, tick);
    }

    fn note(&mut self, _: &str) {}
}
