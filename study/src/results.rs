//! What a study found: every run beside the reference.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::StudyError;
use crate::metrics::{Distances, Floor, distances, energy_differences, median};
use crate::pareto::{front, knee};
use crate::plan::{Job, Overrides, Plan, STUDY_SCHEMA, one_line};
use crate::record::{Ending, Figures};
use crate::shape::Shape;
use crate::store::{Entries, read_entries, read_shape};

/// Contents of `study.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Results {
    /// Version of this layout.
    pub schema: u32,
    /// Name of the scene.
    pub name: String,
    /// Its description.
    pub description: String,
    /// Scene file.
    pub scene: String,
    /// Version of the program.
    pub version: String,
    /// Changes of the scene that every run has.
    pub set: Overrides,
    /// Varied keys.
    pub keys: Vec<String>,
    /// Changes that make the reference.
    pub reference_settings: Overrides,
    /// Time by which points are judged.
    pub time: Clock,
    /// Distance by which points are judged.
    pub measure: Measure,
    /// The floor; `None` when it was not measured.
    pub floor: Option<Floor>,
    /// The reference.
    pub reference: Row,
    /// Its perturbed repetitions.
    pub floor_runs: Vec<Row>,
    /// The points in the order of the plan.
    pub rows: Vec<Row>,
    /// Pareto front: indices of `rows` by increasing time, each more accurate
    /// than the one before it by more than the floor ([`crate::front`]).
    pub front: Vec<usize>,
    /// Recommended point.
    pub recommended: Option<Recommended>,
    /// What could not be read.
    pub remarks: Vec<String>,
}

/// A time of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Clock {
    /// Wall time of the stepping.
    Wall,
    /// User time of the stepping, all threads.
    Cpu,
}

/// A distance to the reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Measure {
    /// Mean between points of equal index.
    Vertices,
    /// Mean of the surfaces, for runs of different meshes.
    Surfaces,
}

/// The recommended point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Recommended {
    /// Index of `rows`.
    pub row: usize,
    /// Why, in a sentence.
    pub reason: String,
}

/// One run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// What it is: `reference`, `floor` or `point`.
    pub role: String,
    /// Values of the varied keys; empty for the reference.
    pub settings: Vec<String>,
    /// `converged`, `finished`, `failed` or `missing`.
    pub status: String,
    /// Why, in a sentence.
    pub reason: String,
    /// Content hash.
    pub hash: String,
    /// Command that runs it alone.
    pub command: String,
    /// Distances to the reference.
    pub distances: Option<Distances>,
    /// Whether the distance is within the floor: as good as the reference.
    pub within_floor: bool,
    /// Energies less those of the reference, by term \[J\].
    pub energy_differences_j: BTreeMap<String, f64>,
    /// Its figures; `None` for a run that is missing.
    pub figures: Option<Figures>,
}

impl Row {
    /// Median of its times \[s\].
    pub fn seconds(&self, clock: Clock) -> Option<f64> {
        let figures = self.figures.as_ref()?;
        median(match clock {
            Clock::Wall => &figures.wall_s,
            Clock::Cpu => &figures.cpu_s,
        })
    }

    /// The distance by which it is judged \[m\].
    pub fn error(&self, measure: Measure) -> Option<f64> {
        let d = self.distances.as_ref()?;
        match measure {
            Measure::Vertices => d.vertices.map(|v| v.mean_m),
            Measure::Surfaces => Some(d.surface_mean_m),
        }
    }
}

impl Results {
    /// The floor of the distance by which points are judged \[m\]; 0 without.
    pub fn floor_m(&self) -> f64 {
        self.floor.map_or(0.0, |f| match self.measure {
            Measure::Vertices => f.mean_m,
            Measure::Surfaces => f.surface_mean_m,
        })
    }

    /// Time [s] and error [m] of a point for the knee, in logarithms; errors
    /// within the floor are all the same. `None` for runs that failed, or have
    /// no such time.
    pub fn place(&self, row: usize) -> Option<(f64, f64)> {
        let row = &self.rows[row];
        let error = row.error(self.measure)?.max(self.floor_m());
        // Without a floor an exact repetition still needs a logarithm.
        Some((row.seconds(self.time)?.max(1e-3), error.max(1e-15)))
    }

    /// Points that are not there yet.
    pub fn missing(&self) -> usize {
        let all = self.floor_runs.iter().chain(&self.rows);
        all.filter(|r| r.figures.is_none()).count()
    }

    /// Reads what a folder holds and compares it.
    ///
    /// # Errors
    /// [`StudyError::Reference`] when there is no reference to compare with.
    pub fn of_folder(folder: &Path, plan: &Plan, time: Clock) -> Result<Self, StudyError> {
        let mut remarks = Vec::new();
        let entries = read_entries(folder, &mut remarks)?;
        let fail = |reason: String| StudyError::Reference { reason };
        let job = &plan.jobs[0];
        let entry = entries
            .get(&job.hash)
            .ok_or_else(|| fail("is not there yet".to_owned()))?;
        let failed = entry.figures.status == Ending::Failed;
        let shape = read_shape(folder, entry).filter(|_| !failed);
        let shape = shape.ok_or_else(|| reference_failed(plan, &entry.figures))?;
        let compare = Comparison {
            folder,
            entries: &entries,
            reference: (&entry.figures, &shape),
        };
        let reference = compare.row("reference", Vec::new(), job).0;
        let floor: Vec<(Row, Option<Shape>)> = plan.jobs[plan.floor_jobs()]
            .iter()
            .map(|job| compare.row("floor", Vec::new(), job))
            .collect();
        let shapes: Vec<&Shape> = [&shape]
            .into_iter()
            .chain(floor.iter().filter_map(|f| f.1.as_ref()))
            .collect();
        let floor_m = Floor::of(&shapes);
        let points = plan.points.iter();
        let rows = points.map(|p| {
            let job = &plan.jobs[p.job];
            compare.row("point", p.settings.clone(), job).0
        });
        let mut results = Self {
            schema: STUDY_SCHEMA,
            name: plan.name.clone(),
            description: plan.description.clone(),
            scene: plan.spec.scene.display().to_string(),
            version: plan.spec.version.clone(),
            set: plan.spec.set.clone(),
            keys: plan.spec.axes.iter().map(|a| a.key.clone()).collect(),
            reference_settings: plan.reference.clone(),
            time,
            measure: Measure::Vertices,
            floor: floor_m,
            reference,
            rows: rows.collect(),
            floor_runs: floor.into_iter().map(|f| f.0).collect(),
            front: Vec::new(),
            recommended: None,
            remarks,
        };
        results.judge();
        Ok(results)
    }

    /// Finds what is within the floor, the front and the knee.
    fn judge(&mut self) {
        let other_mesh = |r: &Row| r.distances.is_some_and(|d| d.vertices.is_none());
        if self.rows.iter().any(other_mesh) {
            self.measure = Measure::Surfaces;
        }
        let (floor, measure) = (self.floor_m(), self.measure);
        for row in self.rows.iter_mut().chain(&mut self.floor_runs) {
            row.within_floor = row.error(measure).is_some_and(|e| e <= floor);
        }
        self.reference.within_floor = true;
        let nowhere = (f64::NAN, f64::NAN);
        let places: Vec<(f64, f64)> = (0..self.rows.len())
            .map(|i| self.place(i).unwrap_or(nowhere))
            .collect();
        // Differences are told apart as they are; logarithms need the floor.
        let errors = self.rows.iter().map(|r| r.error(measure));
        let told: Vec<(f64, f64)> = places
            .iter()
            .zip(errors)
            .map(|(place, error)| (place.0, error.unwrap_or(f64::NAN)))
            .collect();
        self.front = front(&told, floor);
        self.recommended = recommended(&self.front, &places, &told, floor);
        let timeless = |r: &&Row| r.error(measure).is_some() && r.seconds(self.time).is_none();
        let timeless = self.rows.iter().filter(timeless).count();
        if timeless > 0 {
            let what = match self.time {
                Clock::Wall => "wall",
                Clock::Cpu => "processor",
            };
            self.remarks.push(format!(
                "{timeless} of {} points have no {what} time of their own and are left out of the \
                 front and the recommendation: several runs shared a process; judge by the other \
                 time, or run each in a process of its own",
                self.rows.len()
            ));
        }
    }
}

/// The point of the front to recommend: its knee, or the least product of time
/// and error; where the floor tells none of the points within it of the most
/// accurate from the fastest, the fastest.
fn recommended(
    front: &[usize],
    places: &[(f64, f64)],
    told: &[(f64, f64)],
    floor: f64,
) -> Option<Recommended> {
    let ends: Vec<(f64, f64)> = front.iter().map(|i| places[*i]).collect();
    let reason = |row: usize, reason: String| Some(Recommended { row, reason });
    if let &[only] = front {
        let others = || told.iter().filter(|p| p.0.is_finite() && p.1.is_finite());
        let least = others().map(|p| p.1).fold(f64::INFINITY, f64::min);
        let alike = others().filter(|p| p.1 <= least + floor).count();
        return reason(
            only,
            match alike {
                1 => "both the fastest and the most accurate".to_owned(),
                _ => format!(
                    "the fastest of {alike} points that the floor does not tell apart: within \
                     {:.3e} mm of the most accurate, which is {:.3e} mm from the reference",
                    1e3 * floor,
                    1e3 * least
                ),
            },
        );
    }
    if let Some(k) = knee(&ends) {
        let why = "the knee of the front: farthest below the chord between its ends";
        return reason(front[k], why.to_owned());
    }
    // No corner: as many times faster counts as much as as many times more
    // accurate.
    let product = |i: &usize| places[*i].0 * places[*i].1;
    let best = front.iter().copied();
    let best = best.min_by(|a, b| product(a).total_cmp(&product(b)))?;
    let why = "the least product of time and distance; the front has no knee";
    reason(best, why.to_owned())
}

/// A reference that failed: its settings, why, and how to run it alone.
pub(crate) fn reference_failed(plan: &Plan, figures: &Figures) -> StudyError {
    let settings = one_line(&plan.reference);
    StudyError::Reference {
        reason: format!(
            "failed: {}; its settings: {settings}; alone: {}",
            figures.reason,
            command(&plan.jobs[0])
        ),
    }
}

struct Comparison<'a> {
    folder: &'a Path,
    entries: &'a Entries,
    reference: (&'a Figures, &'a Shape),
}

impl Comparison<'_> {
    fn row(&self, role: &str, settings: Vec<String>, job: &Job) -> (Row, Option<Shape>) {
        let mut row = Row {
            role: role.to_owned(),
            settings,
            status: "missing".to_owned(),
            reason: "not run yet".to_owned(),
            hash: job.hash.clone(),
            command: command(job),
            distances: None,
            within_floor: false,
            energy_differences_j: BTreeMap::new(),
            figures: None,
        };
        let Some(entry) = self.entries.get(&job.hash) else {
            return (row, None);
        };
        row.status = entry.figures.status.name().to_owned();
        row.reason = entry.figures.reason.clone();
        row.figures = Some(entry.figures.clone());
        // The last shape of a run that failed is not its result.
        if entry.figures.status == Ending::Failed {
            return (row, None);
        }
        let shape = read_shape(self.folder, entry);
        row.distances = shape.as_ref().and_then(|s| distances(s, self.reference.1));
        row.energy_differences_j = energy_differences(&entry.figures, self.reference.0);
        (row, shape)
    }
}

/// The command that runs a job alone; displacements of the start are only made
/// by a study.
fn command(job: &Job) -> String {
    let quoted = |text: &str| {
        let plain = |c: char| c.is_ascii_alphanumeric() || "-_=./,:+".contains(c);
        match !text.is_empty() && text.chars().all(plain) {
            true => text.to_owned(),
            false => format!("'{}'", text.replace('\'', r"'\''")),
        }
    };
    let mut line = format!("selvedge run {}", quoted(&job.scene.display().to_string()));
    for (key, value) in &job.overrides {
        line += &format!(" --set {}", quoted(&format!("{key}={value}")));
    }
    if let Some(p) = &job.perturbation {
        line += &format!("  # start displaced by {:e} m (seed {})", p.size_m, p.seed);
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recommend(told: &[(f64, f64)], floor: f64) -> (Vec<usize>, Recommended) {
        let lifted: Vec<(f64, f64)> = told.iter().map(|p| (p.0, p.1.max(floor))).collect();
        let front = front(told, floor);
        let best = recommended(&front, &lifted, told, floor).unwrap();
        (front, best)
    }

    /// Points that the floor does not tell apart are not ranked: the fastest of
    /// them is recommended, with the figures, and never called the best.
    #[test]
    fn the_floor_ranks_nothing() {
        // 2.1 mm to 2.4 mm with a floor of 0.5 mm, and none within the floor.
        let near = [(3.0, 2.1e-3), (1.0, 2.4e-3), (2.0, 2.2e-3)];
        let (front, best) = recommend(&near, 5e-4);
        assert_eq!((front, best.row), (vec![1], 1));
        for part in ["fastest of 3 points", "5.000e-1 mm", "2.100e0 mm"] {
            assert!(best.reason.contains(part), "{}", best.reason);
        }
        assert!(!best.reason.contains("both"), "{}", best.reason);
        // Told apart, they are ranked.
        let (front, best) = recommend(&near, 5e-5);
        assert_eq!(front, [1, 2, 0]);
        assert!(best.reason.contains("front"), "{}", best.reason);
        // One that is better in both by more than the floor.
        let (front, best) = recommend(&[(1.0, 1e-3), (2.0, 3e-3)], 5e-4);
        assert_eq!((front, best.row), (vec![0], 0));
        assert_eq!(best.reason, "both the fastest and the most accurate");
    }
}
