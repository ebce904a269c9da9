//! The contents of `summary.json`.

use serde::Serialize;
use std::collections::BTreeMap;

use crate::effects::EffectRow;
use crate::watchdog::Event;

/// Version of the layout of [`Summary`].
pub const SUMMARY_SCHEMA: u32 = 1;

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    /// The cloth came to rest.
    Converged,
    /// The simulated time is over.
    Finished,
    /// The user stopped the run; it can be resumed.
    Stopped,
    /// The run could not go on.
    Failed,
}

/// The contents of `summary.json`, a stable contract.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// Version of this layout.
    pub schema: u32,
    /// How the run ended.
    pub status: Status,
    /// Why it ended, in a sentence.
    pub reason: String,
    /// Simulated time of the drape [s].
    pub simulated_s: f64,
    /// Wall time of the stepping [s].
    pub wall_s: f64,
    /// User time of the stepping, all threads [s].
    pub cpu_s: f64,
    /// Worker threads.
    pub threads: usize,
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
    /// Scalar unknowns.
    pub scalars: usize,
    /// Triangles of the mesh.
    pub triangles: usize,
    /// Peak resident memory of the process [bytes].
    pub peak_memory_bytes: u64,
    /// Heap memory of the simulation itself [bytes].
    pub simulation_bytes: usize,
    /// The same by owner [bytes].
    pub memory: BTreeMap<String, usize>,
    /// Deepest penetration of a body at the end [m].
    pub max_penetration_m: f64,
    /// Edge-triangle intersections of the cloth with itself at the end; of yarns
    /// the pairs of segments that no stitch joins and whose centre lines are closer
    /// than half of the sum of their radii.
    pub self_intersections: usize,
    /// Largest `|l / l_0 − 1|` over all edges, or over all segments of yarns with
    /// the arc lengths of the state [1].
    pub max_abs_edge_strain: f64,
    /// Mean `|l / l_0 − 1|` over all edges or segments [1].
    pub mean_abs_edge_strain: f64,
    /// Largest gap between seam partners at the end [m].
    pub max_seam_gap_m: f64,
    /// Buttons, where they are at the end and what they carry.
    pub trims: Vec<TrimSummary>,
    /// How far the top of a garment ended below its place in the pattern [m];
    /// `null` without a garment.
    pub max_drop_m: Option<f64>,
    /// Where cloth is inside a body or passes through itself at the end: the
    /// deepest point and the first crossings.
    pub defects: Vec<Defect>,
    /// Kinetic energy at the end [J].
    pub kinetic_energy_j: f64,
    /// Newton residual of the last step, in the units of the chosen norm; of a
    /// static solve the largest unbalanced force [N].
    pub residual: f64,
    /// Estimated mean distance of the points to where they would be without
    /// any error of the numerics [m]; `null` unless it was asked for.
    pub error_estimate: Option<f64>,
    /// What the estimate is made of.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<ErrorReport>,
    /// Wall time by stage [s].
    pub stages: BTreeMap<String, f64>,
    /// How yarns left their contacts, where they may.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub topology: Option<TopologySummary>,
    /// What the watchdog found in the drape, in order; empty when it is off.
    pub watchdog: Vec<Event>,
    /// Findings beyond those listed.
    pub watchdog_unlisted: u64,
    /// Stages that a garment went through before the drape.
    pub assembly: Vec<StageSummary>,
    /// Every effect: on or off, why, and its cost.
    pub effects: Vec<EffectRow>,
    /// All effective settings.
    pub settings: serde_json::Value,
    /// Version of the program.
    pub version: String,
    /// Hash of the final positions and velocities.
    pub final_state_hash: String,
    /// Findings of the doctor that did not stop the run.
    pub warnings: Vec<String>,
}

/// What happened to the contacts of yarns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct TopologySummary {
    /// Contacts that a yarn left as its end slid past.
    pub released: usize,
    /// Loops drawn out of the loops that held them.
    pub drawn: usize,
    /// Nodes of single yarns taken out.
    pub removed: usize,
    /// Cuts.
    pub cut: usize,
    /// Elastic energy removed by all of it [J].
    pub energy_removed_j: f64,
    /// Time of the first event [s].
    pub first_s: Option<f64>,
    /// Time of the last event [s].
    pub last_s: Option<f64>,
}

/// One button at the end of a run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrimSummary {
    /// Its name.
    pub name: String,
    /// Its centre [m].
    pub center_m: [f64; 3],
    /// Its axis, out of the cloth [1].
    pub axis: [f64; 3],
    /// Force of its threads together on the cloth that it is sewn to [N].
    pub sewn_force_n: [f64; 3],
    /// Force on each of its buttonholes [N].
    pub hole_force_n: Vec<[f64; 3]>,
}

/// A place where the result is not as it should be.
#[derive(Clone, Debug, Serialize)]
pub struct Defect {
    /// `penetration` or `self-intersection`.
    pub kind: &'static str,
    /// Where [m].
    pub at: [f64; 3],
    /// Panels or sheets that take part.
    pub parts: Vec<String>,
    /// Depth of a penetration [m].
    pub depth_m: Option<f64>,
}

/// What an error estimate is made of.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ErrorReport {
    /// Of the mesh.
    pub space: ErrorPart,
    /// Of the time steps.
    pub time: ErrorPart,
    /// Of Newton's and the linear solver's tolerances.
    pub algebraic: ErrorPart,
    /// Of the way that the scene came to its end, which no mesh, step or
    /// tolerance lessens.
    pub path: ErrorPart,
    /// User time of the runs made for the estimate alone [s].
    pub cpu_s: f64,
    /// The error that was asked for [m].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target_m: Option<f64>,
    /// Settings chosen to meet it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub decisions: Vec<Decision>,
    /// How such estimates compare with errors that are known.
    pub effectivity: &'static [Effectivity],
}

/// An estimate over the error itself, on a case whose exact shape is known.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Effectivity {
    /// The case.
    pub case: &'static str,
    /// Estimate over error [1].
    pub value: f64,
}

/// One part of an error estimate.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ErrorPart {
    /// The part of the estimate [m]; `null` where it cannot be known.
    pub error_m: Option<f64>,
    /// Mean, 95th percentile and largest distance between the two runs that
    /// it was read off [m].
    pub distance_m: Option<[f64; 3]>,
    /// Order of convergence used.
    pub order: Option<f64>,
    /// How it came about, in a sentence.
    pub how: String,
}

/// A setting that was chosen.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Decision {
    /// Key of the scene file.
    pub setting: String,
    /// The value.
    pub value: serde_json::Value,
    /// Why.
    pub why: String,
}

/// One stage of a garment's assembly.
#[derive(Clone, Debug, Serialize)]
pub struct StageSummary {
    /// Name of the stage.
    pub name: String,
    /// What is on and off during the stage.
    pub what: String,
    /// Simulated time [s].
    pub simulated_s: f64,
    /// Wall time [s].
    pub wall_s: f64,
    /// User time, all threads [s].
    pub cpu_s: f64,
    /// Accepted steps.
    pub steps: u64,
    /// Rejected steps.
    pub rejected_steps: u64,
    /// Largest `|l / l_0 − 1|` at its end [1].
    pub max_abs_edge_strain: f64,
    /// Mean `|l / l_0 − 1|` at its end [1].
    pub mean_abs_edge_strain: f64,
    /// Deepest penetration of a body at its end [m].
    pub max_penetration_m: f64,
    /// Edge-triangle intersections at its end.
    pub self_intersections: usize,
    /// Where, as in the summary itself.
    pub defects: Vec<Defect>,
}
