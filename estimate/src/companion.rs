//! Runs made for a comparison.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use selvedge_scene::build::BuiltScene;
use selvedge_scene::driver::{self, Progress, RunOptions, RunResult};
use selvedge_scene::file::model::{ClothShape, Select};
use selvedge_scene::file::{Parsed, SceneFile};
use selvedge_scene::summary::Status;

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
    /// User time of the runs so far [s].
    pub cpu_s: f64,
}

/// A run and what it ran on.
pub struct Companion {
    /// The scene as it was built.
    pub built: BuiltScene,
    /// How it ended.
    pub result: RunResult,
}

impl Companion {
    /// The cloth at the end.
    pub fn surface(&self) -> Surface<'_> {
        surface(&self.built, &self.result)
    }
}

/// The cloth at the end of a run.
pub(crate) fn surface<'a>(built: &'a BuiltScene, result: &'a RunResult) -> Surface<'a> {
    let g = &built.geometry;
    Surface {
        triangles: &g.scene_triangles,
        material: &g.scene_material,
        panel: &g.scene_panel,
        positions: &result.positions,
    }
}

impl Session<'_> {
    /// Runs a changed scene into `directory/name`, with a recording where
    /// `record` and the scene ask for one.
    ///
    /// # Errors
    /// [`EstimateError::Run`] where it cannot be run or fails, as a sewing
    /// pattern may on a coarse mesh; [`EstimateError::Interrupted`].
    pub fn run(
        &mut self,
        name: &str,
        mut scene: SceneFile,
        record: bool,
    ) -> Result<Companion, EstimateError> {
        let failed = |source| EstimateError::Run {
            name: name.to_owned(),
            source,
        };
        scene.output.recording &= record;
        let parsed = Parsed {
            scene,
            locations: self.parsed.locations.clone(),
            source: self.parsed.source.clone(),
            warnings: Default::default(),
        };
        let built = BuiltScene::new(parsed).map_err(|e| failed(e.into()))?;
        let options = RunOptions {
            directory: self.directory.join(name),
            resume: false,
            scene_text: self.scene_text.to_owned(),
            version: self.version.to_owned(),
        };
        let points = built.geometry.mesh.points();
        self.progress.note(&format!("{name}: {points} points"));
        let result =
            driver::run(&built, &options, self.progress, self.interrupt).map_err(failed)?;
        self.cpu_s += result.summary.cpu_s;
        match result.summary.status {
            Status::Stopped => Err(EstimateError::Interrupted {
                name: name.to_owned(),
            }),
            Status::Failed => Err(EstimateError::Failed {
                name: name.to_owned(),
                reason: result.summary.reason,
            }),
            _ => Ok(Companion { built, result }),
        }
    }

    /// Where a companion's files are.
    pub fn folder(&self, name: &str) -> PathBuf {
        Path::new(&self.directory).join(name)
    }
}

/// The scene with edges `factor` times as long, or why there is none.
pub fn coarser(scene: &SceneFile, factor: f64) -> Result<SceneFile, String> {
    let mut out = scene.clone();
    out.mesh.edge_length *= factor;
    for cloth in &mut out.cloth {
        match &mut cloth.shape {
            ClothShape::Sheet {
                points,
                edge_length,
                ..
            } => {
                if let Some(points) = points {
                    for n in points {
                        let cells = ((*n as f64 - 1.0) / factor).round();
                        if cells < 1.0 {
                            return Err(format!("`{}` has too few points", cloth.name));
                        }
                        *n = cells as usize + 1;
                    }
                }
                if let Some(edge_length) = edge_length {
                    *edge_length *= factor;
                }
            }
            ClothShape::Pattern { edge_length, .. } => {
                if let Some(edge_length) = edge_length {
                    *edge_length *= factor;
                }
            }
            ClothShape::Mesh { .. } => {
                return Err(format!(
                    "the mesh of `{}` is a file: there is no other one to compare with",
                    cloth.name
                ));
            }
            ClothShape::Knit { .. }
            | ClothShape::Woven { .. }
            | ClothShape::KnitMesh { .. }
            | ClothShape::KnitPattern { .. }
            | ClothShape::WovenMesh { .. } => {
                return Err(format!(
                    "the points of `{}` are where its yarns cross: there is no coarser cloth to \
                     compare with",
                    cloth.name
                ));
            }
        }
    }
    let numbered = |select: &Select| matches!(select, Select::Points(_));
    let pins = scene.pin.iter().map(|p| &p.select);
    let attachments = scene.attachment.iter().map(|a| &a.select);
    if pins.chain(attachments).any(numbered) {
        return Err("pins name points by number, which other meshes number differently".into());
    }
    Ok(out)
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
