//! Runs made for a comparison.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use selvedge_scene::build::BuiltScene;
use selvedge_scene::driver::{self, Coarser, Progress, RunError, RunOptions, RunResult};
use selvedge_scene::file::{Parsed, SceneFile};
use selvedge_scene::summary::Status;

use crate::kept::Kept;
use crate::{EstimateError, Surface};

/// What all runs of one estimate share.
pub struct Session<'a> {
    /// The scene as it was read.
    pub parsed: &'a Parsed,
    /// Its text, kept in recordings.
    pub scene_text: &'a str,
    /// Version of the program.
    pub version: &'a str,
    /// Folder below which the companions get folders of their own.
    pub directory: PathBuf,
    /// Listens to the runs.
    pub progress: &'a mut (dyn Progress + Send),
    /// Ends them when raised.
    pub interrupt: &'a AtomicBool,
    /// Whether to take over what an interrupted session has finished, and to go
    /// on with what it had begun.
    pub resume: bool,
    /// User time of the runs so far [s], those taken over included.
    pub cpu_s: f64,
}

/// A run and what it ran on.
pub struct Companion {
    /// The scene as it was built.
    pub built: BuiltScene,
    /// Final positions in the scene's order [m].
    pub positions: Vec<f64>,
    /// User time of its stepping [s].
    pub cpu_s: f64,
    /// How it ended; `None` for one taken over from an interrupted session.
    pub result: Option<RunResult>,
}

impl Companion {
    /// The cloth at the end.
    pub fn surface(&self) -> Surface<'_> {
        surface(&self.built, &self.positions)
    }

    /// Points of its mesh.
    pub fn points(&self) -> usize {
        self.built.geometry.mesh.points()
    }
}

/// The cloth at the end of a run.
pub(crate) fn surface<'a>(built: &'a BuiltScene, positions: &'a [f64]) -> Surface<'a> {
    let g = &built.geometry;
    Surface {
        triangles: &g.scene_triangles,
        material: &g.scene_material,
        panel: &g.scene_panel,
        positions,
    }
}

impl Session<'_> {
    /// Runs a changed scene into `directory/name`, with a recording where
    /// `record` and the scene ask for one. Garments begin where they rest on the
    /// mesh of `coarser` with edges twice as long, where there is one and the
    /// scene's `assemble.coarsest` allows it.
    ///
    /// # Errors
    /// [`EstimateError::Run`] where it cannot be run or fails, as a sewing
    /// pattern may on a coarse mesh; [`EstimateError::Interrupted`].
    pub fn run(
        &mut self,
        name: &str,
        coarser: Option<&Companion>,
        mut scene: SceneFile,
        record: bool,
    ) -> Result<Companion, EstimateError> {
        scene.output.recording &= record;
        self.run_displaced(name, coarser, scene, None)
    }

    /// As [`run`](Self::run), with the start displaced by a size [m] and a seed
    /// ([`BuiltScene::perturb`]).
    pub(crate) fn run_displaced(
        &mut self,
        name: &str,
        coarser: Option<&Companion>,
        scene: SceneFile,
        displaced: Option<(f64, u64)>,
    ) -> Result<Companion, EstimateError> {
        let parsed = Parsed {
            scene,
            locations: self.parsed.locations.clone(),
            source: self.parsed.source.clone(),
            warnings: Default::default(),
        };
        let mut built = BuiltScene::new(parsed).map_err(|e| EstimateError::Run {
            name: name.to_owned(),
            source: Box::new(e.into()),
        })?;
        if let Some((size, seed)) = displaced {
            built.perturb(size, seed);
        }
        let digest = driver::digest(&built, &self.options(name));
        if self.resume
            && let Some(kept) = Kept::read(&self.folder(name), &digest)
        {
            self.progress.note(&format!("{name}: finished before"));
            self.cpu_s += kept.cpu_s;
            return Ok(Companion {
                built,
                positions: kept.positions(),
                cpu_s: kept.cpu_s,
                result: None,
            });
        }
        let result = self.simulate(name, coarser, &built)?;
        let cpu_s = result.summary.cpu_s;
        self.cpu_s += cpu_s;
        Kept::new(digest, cpu_s, &result.positions)
            .write(&self.folder(name))
            .map_err(|source| EstimateError::Run {
                name: name.to_owned(),
                source: Box::new(source),
            })?;
        Ok(Companion {
            built,
            positions: result.positions.clone(),
            cpu_s,
            result: Some(result),
        })
    }

    /// The result of a run. One taken over from an interrupted session is run
    /// again, to the same end.
    ///
    /// # Errors
    /// As [`run`](Self::run).
    pub fn result(
        &mut self,
        name: &str,
        coarser: Option<&Companion>,
        run: Companion,
    ) -> Result<(BuiltScene, RunResult), EstimateError> {
        let result = match run.result {
            Some(result) => result,
            None => self.simulate(name, coarser, &run.built)?,
        };
        Ok((run.built, result))
    }

    fn simulate(
        &mut self,
        name: &str,
        coarser: Option<&Companion>,
        built: &BuiltScene,
    ) -> Result<RunResult, EstimateError> {
        let points = built.geometry.mesh.points();
        self.progress.note(&format!("{name}: {points} points"));
        let mut options = self.options(name);
        options.resume = self.resume
            && built.scene().output.recording
            && options.directory.join("run.mcap.part").exists();
        let coarser = coarser.map(|c| Coarser {
            built: &c.built,
            positions: &c.positions,
        });
        let mut run = |options: &RunOptions| {
            driver::run_after(built, coarser, options, self.progress, self.interrupt)
        };
        let result = match run(&options) {
            // Cut off before its first checkpoint, or not the same run.
            Err(RunError::Record(_) | RunError::Checkpoint(_)) if options.resume => {
                options.resume = false;
                run(&options)
            }
            result => result,
        };
        let result = result.map_err(|source| EstimateError::Run {
            name: name.to_owned(),
            source: Box::new(source),
        })?;
        match result.summary.status {
            Status::Stopped => Err(EstimateError::Interrupted {
                name: name.to_owned(),
            }),
            Status::Failed => Err(EstimateError::Failed {
                name: name.to_owned(),
                reason: result.summary.reason,
            }),
            _ => Ok(result),
        }
    }

    fn options(&self, name: &str) -> RunOptions {
        RunOptions {
            directory: self.folder(name),
            resume: false,
            scene_text: self.scene_text.to_owned(),
            version: self.version.to_owned(),
        }
    }

    /// Where a companion's files are.
    pub fn folder(&self, name: &str) -> PathBuf {
        Path::new(&self.directory).join(name)
    }
}

/// The scene with steps `factor` times as long.
pub fn scaled_step(scene: &SceneFile, factor: f64) -> SceneFile {
    let mut out = scene.clone();
    out.integrator.max_step *= factor;
    out.integrator.min_step *= factor.min(1.0);
    out
}

/// The scene with tolerances of Newton's method and of the linear solver
/// multiplied by `factor`.
pub fn scaled_tolerance(scene: &SceneFile, factor: f64) -> SceneFile {
    let mut out = scene.clone();
    out.integrator.newton_tolerance *= factor;
    // Tight solves are cheap next to a step that fails for a loose one.
    out.solver.tolerance *= factor.min(1.0);
    if factor < 1.0 {
        out.integrator.newton_iterations = (2 * scene.integrator.newton_iterations).min(1000);
    }
    out
}
