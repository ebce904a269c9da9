use serde::Serialize;

use super::{Distances, SurfaceDistance, SurfaceOptions, compare_points, compare_surfaces};
use crate::{RecordError, Recording, Surface};

/// What to compare.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CompareOptions {
    /// Frames of both runs belong together when their times differ by no more
    /// than this \[s\].
    pub time_tolerance: f64,
    /// Whether the surfaces of the last common frame are compared.
    pub surfaces: Option<SurfaceOptions>,
}

impl Default for CompareOptions {
    fn default() -> Self {
        Self {
            time_tolerance: 1e-4,
            surfaces: Some(SurfaceOptions::default()),
        }
    }
}

/// Figures of one run.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct RunFigures {
    /// Scene.
    pub scene: String,
    /// Program version.
    pub version: String,
    /// Whether the run came to its end.
    pub complete: bool,
    /// Points.
    pub points: usize,
    /// Triangles.
    pub triangles: usize,
    /// Frames.
    pub frames: usize,
    /// Time of the last frame \[s\].
    pub end_time: f64,
    /// Accepted steps.
    pub steps: usize,
    /// Rejected steps.
    pub rejected_steps: usize,
    /// Newton iterations.
    pub newton_iterations: u64,
    /// Iterations of the linear solver.
    pub linear_iterations: u64,
    /// Sum of the ledger \[s\].
    pub seconds: f64,
    /// Deepest penetration of all steps \[m\].
    pub max_penetration: f64,
    /// What could not be read.
    pub warnings: Vec<String>,
}

/// Distance of two frames.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FrameComparison {
    /// Time in the first run \[s\].
    pub time_a: f64,
    /// Time in the second run \[s\].
    pub time_b: f64,
    /// Between points of equal index.
    pub distances: Distances,
}

/// An energy in both runs \[J\]; `None` where the term is absent.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EnergyPair {
    /// Term, or `kinetic`.
    pub name: String,
    /// In the first run.
    pub a: Option<f64>,
    /// In the second run.
    pub b: Option<f64>,
}

/// The last common frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LastFrame {
    /// Time in the first run \[s\].
    pub time_a: f64,
    /// Time in the second run \[s\].
    pub time_b: f64,
    /// Between points of equal index; `None` for different meshes.
    pub points: Option<Distances>,
    /// Between the surfaces; `None` when not asked for or without triangles.
    pub surfaces: Option<SurfaceDistance>,
    /// Energies after the last accepted steps up to then.
    pub energies: Vec<EnergyPair>,
}

/// Two recordings side by side.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// The first run.
    pub a: RunFigures,
    /// The second run.
    pub b: RunFigures,
    /// Whether both have the same mesh, so that points correspond.
    pub same_mesh: bool,
    /// Every common frame; empty for different meshes.
    pub frames: Vec<FrameComparison>,
    /// Frames of the first run without a partner.
    pub unmatched_a: usize,
    /// Frames of the second run without a partner.
    pub unmatched_b: usize,
    /// The last common frame, if there is one.
    pub last: Option<LastFrame>,
}

/// Compares two recordings frame by frame.
///
/// # Errors
/// What reading frames gives.
pub fn compare_recordings(
    a: &Recording,
    b: &Recording,
    options: &CompareOptions,
) -> Result<Comparison, RecordError> {
    let same_mesh =
        a.header().points == b.header().points && a.header().triangles == b.header().triangles;
    let pairs = matching(a, b, options.time_tolerance);
    let points = 3 * a.header().points;
    let mut frames = Vec::new();
    if same_mesh {
        for &(i, j) in &pairs {
            let (x, y) = (a.frame(i)?, b.frame(j)?);
            frames.push(FrameComparison {
                time_a: x.time,
                time_b: y.time,
                distances: compare_points(&x.positions[..points], &y.positions[..points])?,
            });
        }
    }
    let last = match pairs.last() {
        None => None,
        Some(&(i, j)) => {
            let (x, y) = (a.frame(i)?, b.frame(j)?);
            let surface_a = Surface::of(a.header(), &x.positions);
            let surface_b = Surface::of(b.header(), &y.positions);
            let solid = !surface_a.triangles.is_empty() && !surface_b.triangles.is_empty();
            let surfaces = options
                .surfaces
                .filter(|_| solid)
                .map(|options| compare_surfaces(&surface_a, &surface_b, &options))
                .transpose()?;
            Some(LastFrame {
                time_a: x.time,
                time_b: y.time,
                points: frames.last().map(|f| f.distances),
                surfaces,
                energies: energies(a, b, x.time, y.time),
            })
        }
    };
    Ok(Comparison {
        a: figures(a),
        b: figures(b),
        same_mesh,
        frames,
        unmatched_a: a.frames().len() - pairs.len(),
        unmatched_b: b.frames().len() - pairs.len(),
        last,
    })
}

/// Pairs of frames in order; each frame has one partner at most, the nearest
/// one still free.
fn matching(a: &Recording, b: &Recording, tolerance: f64) -> Vec<(usize, usize)> {
    let (a, b) = (a.frames(), b.frames());
    let mut pairs = Vec::new();
    let mut j = 0;
    for (i, frame) in a.iter().enumerate() {
        let off = |j: usize| (b[j].time - frame.time).abs();
        while j + 1 < b.len() && off(j + 1) <= off(j) {
            j += 1;
        }
        if j < b.len() && off(j) <= tolerance {
            pairs.push((i, j));
            j += 1;
        }
    }
    pairs
}

fn figures(run: &Recording) -> RunFigures {
    let header = run.header();
    let steps = run.diagnostics();
    let accepted = steps.iter().filter(|s| s.accepted).count();
    RunFigures {
        scene: header.scene_name.clone(),
        version: header.version.clone(),
        complete: run.is_complete(),
        points: header.points,
        triangles: header.triangles.len(),
        frames: run.frames().len(),
        end_time: run.frames().last().map_or(0.0, |f| f.time),
        steps: accepted,
        rejected_steps: steps.len() - accepted,
        newton_iterations: steps.iter().map(|s| u64::from(s.newton_iterations)).sum(),
        linear_iterations: steps.iter().map(|s| u64::from(s.linear_iterations)).sum(),
        seconds: steps.iter().flat_map(|s| &s.ledger).map(|l| l.1).sum(),
        max_penetration: steps.iter().map(|s| s.max_penetration).fold(0.0, f64::max),
        warnings: run.warnings().to_vec(),
    }
}

fn energies(a: &Recording, b: &Recording, time_a: f64, time_b: f64) -> Vec<EnergyPair> {
    let at = |run: &Recording, time: f64| -> Vec<(String, f64)> {
        // A frame comes right after its step, so rounding is all that differs.
        let limit = time * (1.0 + 1e-12);
        let step = run
            .diagnostics()
            .iter()
            .rev()
            .find(|s| s.accepted && s.time <= limit);
        step.map_or_else(Vec::new, |s| {
            let mut all = s.energies.clone();
            all.push(("kinetic".into(), s.kinetic));
            all
        })
    };
    let (a, b) = (at(a, time_a), at(b, time_b));
    let find = |all: &[(String, f64)], name: &str| all.iter().find(|e| e.0 == name).map(|e| e.1);
    let only_b = b.iter().filter(|e| find(&a, &e.0).is_none());
    a.iter()
        .chain(only_b)
        .map(|(name, _)| EnergyPair {
            name: name.clone(),
            a: find(&a, name),
            b: find(&b, name),
        })
        .collect()
}
