//! What is kept of a simulation.

use std::collections::BTreeMap;

use selvedge_scene::build::BuiltScene;
use selvedge_scene::driver::RunResult;
use selvedge_scene::summary::{Status, Summary};
use serde::{Deserialize, Serialize};

use crate::shape::Shape;

/// How a simulation ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Ending {
    /// The cloth came to rest.
    Converged,
    /// The simulated time is over.
    Finished,
    /// It could not go on, or not begin.
    Failed,
}

impl Ending {
    /// As it stands in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Converged => "converged",
            Self::Finished => "finished",
            Self::Failed => "failed",
        }
    }
}

/// Principal stretches at the end, weighted by rest area \[1\].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Stretch {
    /// One per cent of both principal stretches is below.
    pub p1: f64,
    /// The median.
    pub p50: f64,
    /// One per cent is above.
    pub p99: f64,
    /// The largest.
    pub max: f64,
}

/// Figures of one simulation; lists have one entry a repetition.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Figures {
    /// How it ended.
    pub status: Ending,
    /// Why, in a sentence.
    pub reason: String,
    /// Wall time of the stepping \[s\].
    pub wall_s: Vec<f64>,
    /// User time of the stepping, all threads \[s\]; empty where runs share a
    /// process.
    pub cpu_s: Vec<f64>,
    /// The same without sewing: of the drape alone \[s\].
    #[serde(default)]
    pub drape_cpu_s: Vec<f64>,
    /// Wall time of the drape alone \[s\].
    #[serde(default)]
    pub drape_wall_s: Vec<f64>,
    /// Worker threads.
    pub threads: usize,
    /// Simulated time \[s\].
    pub simulated_s: f64,
    /// Accepted steps.
    pub steps: u64,
    /// Rejected steps.
    pub rejected_steps: u64,
    /// Newton iterations of accepted steps.
    pub newton_iterations: u64,
    /// Iterations of the linear solver in accepted steps.
    pub linear_iterations: u64,
    /// Points of the mesh.
    pub points: usize,
    /// Edge-triangle intersections of the cloth with itself at the end.
    pub self_intersections: usize,
    /// Deepest penetration of a body at the end \[m\].
    pub max_penetration_m: f64,
    /// Stretches at the end.
    pub stretch: Stretch,
    /// Newton residual of the last step, in the units of the chosen norm.
    pub residual: f64,
    /// Energies after the last step by term, and `kinetic` \[J\].
    pub energies_j: BTreeMap<String, f64>,
    /// Wall time by stage, of the first repetition \[s\].
    pub stages_s: BTreeMap<String, f64>,
    /// Heap memory of the simulation itself \[bytes\].
    pub simulation_bytes: usize,
    /// Peak resident memory of its process \[bytes\]; `None` where runs share
    /// one, whose peak is that of the largest.
    #[serde(default)]
    pub peak_memory_bytes: Option<u64>,
    /// Hash of the final positions and velocities.
    pub final_state_hash: String,
}

impl Figures {
    /// Of a run with its repetitions' times not yet added.
    pub fn of(built: &BuiltScene, result: &RunResult) -> Self {
        let s: &Summary = &result.summary;
        Self {
            status: match s.status {
                Status::Converged => Ending::Converged,
                Status::Finished => Ending::Finished,
                Status::Stopped | Status::Failed => Ending::Failed,
            },
            reason: s.reason.clone(),
            wall_s: vec![s.wall_s],
            cpu_s: vec![s.cpu_s],
            drape_cpu_s: vec![s.cpu_s - s.assembly.iter().map(|a| a.cpu_s).sum::<f64>()],
            drape_wall_s: vec![s.wall_s - s.assembly.iter().map(|a| a.wall_s).sum::<f64>()],
            threads: s.threads,
            simulated_s: s.simulated_s,
            steps: s.steps,
            rejected_steps: s.rejected_steps,
            newton_iterations: s.newton_iterations,
            linear_iterations: s.linear_iterations,
            points: s.points,
            self_intersections: s.self_intersections,
            max_penetration_m: s.max_penetration_m,
            stretch: stretch(built, &result.stretches),
            residual: finite(s.residual),
            energies_j: result
                .energies
                .iter()
                .map(|(n, e)| (n.clone(), finite(*e)))
                .collect(),
            stages_s: s.stages.clone(),
            simulation_bytes: s.simulation_bytes,
            peak_memory_bytes: Some(s.peak_memory_bytes),
            final_state_hash: s.final_state_hash.clone(),
        }
    }

    /// Of a run that could not begin.
    pub fn failed(reason: String) -> Self {
        Self {
            status: Ending::Failed,
            reason,
            wall_s: Vec::new(),
            cpu_s: Vec::new(),
            drape_cpu_s: Vec::new(),
            drape_wall_s: Vec::new(),
            threads: 0,
            simulated_s: 0.0,
            steps: 0,
            rejected_steps: 0,
            newton_iterations: 0,
            linear_iterations: 0,
            points: 0,
            self_intersections: 0,
            max_penetration_m: 0.0,
            stretch: Stretch::default(),
            residual: 0.0,
            energies_j: BTreeMap::new(),
            stages_s: BTreeMap::new(),
            simulation_bytes: 0,
            peak_memory_bytes: None,
            final_state_hash: String::new(),
        }
    }
}

/// JSON has no other numbers; a failed run may end with them.
fn finite(x: f64) -> f64 {
    if x.is_finite() { x } else { f64::MAX }
}

fn stretch(built: &BuiltScene, stretches: &[[f64; 2]]) -> Stretch {
    let g = &built.geometry;
    let mut all = Vec::with_capacity(2 * stretches.len());
    for (solver, scene) in g.triangle_order.iter().enumerate() {
        for s in stretches.get(*scene as usize).into_iter().flatten() {
            all.push((finite(*s), g.mesh.rest_area(solver)));
        }
    }
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let whole: f64 = all.iter().map(|s| s.1).sum();
    let percentile = |p: f64| {
        let mut below = 0.0;
        let found = all.iter().find(|s| {
            below += s.1;
            below >= p * whole
        });
        found.or(all.last()).map_or(0.0, |s| s.0)
    };
    Stretch {
        p1: percentile(0.01),
        p50: percentile(0.5),
        p99: percentile(0.99),
        max: all.last().map_or(0.0, |s| s.0),
    }
}

/// A simulation with its last shape.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// Its figures.
    pub figures: Figures,
    /// The last shape; `None` when there is none.
    pub shape: Option<Shape>,
    /// The step at which it failed, as the watchdog wrote it down.
    pub dump: Option<String>,
}

/// A line of an index: a finished simulation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// Which.
    pub hash: String,
    /// BLAKE3 of its shape's file; `None` without one.
    pub shape: Option<String>,
    /// Its figures.
    pub figures: Figures,
}
