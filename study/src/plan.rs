//! What a study runs.

use std::path::PathBuf;

use selvedge_scene::diagnostic::{Diagnostics, Severity};
use selvedge_scene::file::{self, SceneFile};
use serde::{Deserialize, Serialize};

use crate::StudyError;
use crate::axes::Axis;
use crate::hash::content_hash;
use crate::sampling::{grid, latin_hypercube};

/// Version of the layout of a study's files.
pub const STUDY_SCHEMA: u32 = 1;

/// Keys of a scene with their values, as `--set` takes them.
pub type Overrides = Vec<(String, String)>;

/// What a study is asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StudySpec {
    /// Scene file.
    pub scene: PathBuf,
    /// Changes of the scene that every run has.
    pub set: Overrides,
    /// What is varied.
    pub axes: Vec<Axis>,
    /// A sample of the combinations instead of all.
    pub sample: Option<Sample>,
    /// Changes that make the reference, beside its defaults.
    pub reference: Overrides,
    /// Whether the reference leaves [`reference_defaults`] out.
    pub plain_reference: bool,
    /// How often every point is run for its time.
    pub repeat: usize,
    /// Perturbed repetitions of the reference that measure the floor.
    pub floor: usize,
    /// Version of the program.
    pub version: String,
}

impl StudySpec {
    /// Nothing varied, one run, a floor from two repetitions.
    pub fn new(scene: impl Into<PathBuf>, version: &str) -> Self {
        Self {
            scene: scene.into(),
            set: Overrides::new(),
            axes: Vec::new(),
            sample: None,
            reference: Overrides::new(),
            plain_reference: false,
            repeat: 1,
            floor: 2,
            version: version.to_owned(),
        }
    }
}

/// A Latin hypercube.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sample {
    /// Number of points.
    pub count: usize,
    /// Seed.
    pub seed: u64,
}

/// Random displacements of all points at the start.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Perturbation {
    /// Standard deviation along each axis \[m\].
    pub size_m: f64,
    /// Seed.
    pub seed: u64,
}

/// Size of the perturbations that measure the floor \[m\].
pub const PERTURBATION_M: f64 = 1e-9;

/// One simulation, perhaps repeated for its time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Job {
    /// [`content_hash`] of it: its name in the folder.
    pub hash: String,
    /// Scene file.
    pub scene: PathBuf,
    /// Changes of the scene.
    pub overrides: Overrides,
    /// Displacement of the start.
    pub perturbation: Option<Perturbation>,
    /// Runs for the time.
    pub repeats: usize,
    /// What it is called in messages.
    pub label: String,
}

/// One combination of the varied settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Values in the order of the axes.
    pub settings: Vec<String>,
    /// Its simulation; several points may share one.
    pub job: usize,
}

/// All simulations of a study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// [`STUDY_SCHEMA`].
    pub schema: u32,
    /// What was asked for.
    pub spec: StudySpec,
    /// Name of the scene.
    pub name: String,
    /// Its description.
    pub description: String,
    /// All changes that make the reference, [`StudySpec::set`] left out.
    pub reference: Overrides,
    /// The simulations: the reference, the perturbed references, the points.
    pub jobs: Vec<Job>,
    /// The points.
    pub points: Vec<Point>,
}

/// Changes that make a reference out of a scene: double precision, linear
/// systems to 1e-8, Newton's residual to 1e-7 m/s, a tenth of the step, no
/// early stop. Contact, friction and the mesh stay as they are. Such a run
/// takes about 20 to 50 times as long as one with the scene's own defaults.
pub fn reference_defaults(scene: &SceneFile) -> Overrides {
    let step = format!("{:?}", 0.1 * scene.integrator.max_step);
    [
        ("solver.kind", "cg"),
        ("solver.precision", "f64"),
        ("solver.tolerance", "1e-8"),
        ("solver.max_iterations", "10000"),
        ("integrator.residual_norm", "mass"),
        ("integrator.newton_tolerance", "1e-7"),
        ("integrator.newton_iterations", "30"),
        ("integrator.max_step", &step),
        ("stop.early", "false"),
    ]
    .map(|(key, value)| (key.to_owned(), value.to_owned()))
    .to_vec()
}

impl Plan {
    /// Reads the scene with the settings of every run, so that mistakes are
    /// found before the first one.
    ///
    /// # Errors
    /// [`StudyError`]: axes, samples, settings that no scene takes.
    pub fn new(spec: StudySpec) -> Result<Self, StudyError> {
        let keys: Vec<&str> = spec.axes.iter().flat_map(Axis::keys).collect();
        if let Some(i) = (1..keys.len()).find(|i| keys[..*i].contains(&keys[*i])) {
            return Err(StudyError::Axis {
                text: keys[i].to_owned(),
                reason: "it is varied twice: give all of its values at once".to_owned(),
            });
        }
        let base = file::read(&spec.scene, &spec.set)?.scene;
        let mut reference = Overrides::new();
        if !spec.plain_reference {
            reference = reference_defaults(&base);
        }
        for (key, value) in &spec.reference {
            reference.retain(|(k, _)| k != key);
            reference.push((key.clone(), value.clone()));
        }
        let settings = match spec.sample {
            Some(s) => latin_hypercube(&spec.axes, s.count, s.seed)?,
            None => grid(&spec.axes)?,
        };
        let mut plan = Self {
            schema: STUDY_SCHEMA,
            name: base.name,
            description: base.description,
            reference,
            jobs: Vec::new(),
            points: Vec::new(),
            spec,
        };
        plan.fill(settings)?;
        Ok(plan)
    }

    fn fill(&mut self, settings: Vec<Vec<String>>) -> Result<(), StudyError> {
        let mut wrong = Diagnostics::new();
        let reference = self.overrides(&self.reference);
        let label = "reference".to_owned();
        if let Some(job) = self.job(reference.clone(), None, 1, label, &mut wrong)? {
            self.jobs.push(job);
        }
        for seed in 1..=self.spec.floor as u64 {
            let size_m = PERTURBATION_M;
            let perturbation = Some(Perturbation { size_m, seed });
            let label = format!("reference, start displaced ({seed})");
            if let Some(job) = self.job(reference.clone(), perturbation, 1, label, &mut wrong)? {
                self.jobs.push(job);
            }
        }
        for values in settings {
            let each = self.spec.axes.iter().zip(&values);
            let own: Overrides = each.flat_map(|(a, v)| a.settings(v)).collect();
            let label = one_line(&own);
            let repeats = self.spec.repeat;
            let Some(job) = self.job(self.overrides(&own), None, repeats, label, &mut wrong)?
            else {
                continue;
            };
            let index = match self.jobs.iter().position(|j| j.hash == job.hash) {
                Some(index) => {
                    self.jobs[index].repeats = repeats;
                    index
                }
                None => {
                    self.jobs.push(job);
                    self.jobs.len() - 1
                }
            };
            let (settings, job) = (values, index);
            self.points.push(Point { settings, job });
        }
        if wrong.has_errors() {
            return Err(wrong.into());
        }
        Ok(())
    }

    /// The changes that every run has, and its own.
    fn overrides(&self, own: &Overrides) -> Overrides {
        let mut all = self.spec.set.clone();
        all.retain(|(key, _)| !own.iter().any(|(k, _)| k == key));
        all.extend(own.iter().cloned());
        all
    }

    fn job(
        &self,
        overrides: Overrides,
        perturbation: Option<Perturbation>,
        repeats: usize,
        label: String,
        wrong: &mut Diagnostics,
    ) -> Result<Option<Job>, StudyError> {
        let parsed = match file::read(&self.spec.scene, &overrides) {
            Ok(parsed) => parsed,
            Err(findings) => {
                for finding in findings.findings() {
                    let known = |f: &selvedge_scene::diagnostic::Finding| {
                        f.message == finding.message && f.file == finding.file
                    };
                    let error = finding.severity == Severity::Error;
                    if error && wrong.len() < 20 && !wrong.findings().iter().any(known) {
                        wrong.push(finding.clone());
                    }
                }
                return Ok(None);
            }
        };
        let hash = content_hash(&parsed, perturbation.as_ref(), &self.spec.version)?;
        Ok(Some(Job {
            hash,
            scene: self.spec.scene.clone(),
            overrides,
            perturbation,
            repeats,
            label,
        }))
    }

    /// Jobs of the perturbed references.
    pub fn floor_jobs(&self) -> std::ops::Range<usize> {
        1..1 + self.spec.floor
    }
}

/// Settings in one line.
pub(crate) fn one_line(settings: &Overrides) -> String {
    if settings.is_empty() {
        return "the scene as it is".to_owned();
    }
    let each = settings.iter().map(|(k, v)| format!("{k}={v}"));
    each.collect::<Vec<_>>().join(" ")
}
