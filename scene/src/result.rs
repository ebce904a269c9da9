//! What a run leaves: figures at the end, and the files.

mod figures;
mod files;
mod maps;

use std::collections::BTreeMap;
use std::time::Duration;

use selvedge_integrator::{ScenePlan, Simulation, State, StepReport};

use crate::build::BuiltScene;
use crate::effects::EffectRow;
use crate::process;
use crate::summary::{SUMMARY_SCHEMA, StageSummary, Status, Summary, TopologySummary};
use crate::watchdog::Event;

pub(crate) use figures::{figures, yarn_strains};
pub(crate) use files::{OBJ, SUMMARY, write};
pub use files::{check_results, write_summary, write_whole};
pub(crate) use maps::maps;

pub(crate) struct Inputs<'a> {
    pub built: &'a BuiltScene,
    pub simulation: &'a Simulation,
    pub status: Status,
    pub reason: String,
    pub effects: Vec<EffectRow>,
    pub topology: Option<TopologySummary>,
    pub assembly: Vec<StageSummary>,
    pub last: &'a StepReport,
    pub watchdog: Vec<Event>,
    pub watchdog_unlisted: u64,
    pub threads: usize,
    pub wall: Duration,
    pub cpu: f64,
    pub version: &'a str,
}

/// Heap memory by owner [bytes].
fn memory(simulation: &Simulation) -> BTreeMap<String, usize> {
    let mut all = BTreeMap::new();
    for (name, bytes) in simulation.memory() {
        *all.entry(name).or_default() += bytes;
    }
    all
}

pub(crate) fn summary(i: Inputs<'_>) -> Summary {
    let state = i.simulation.state();
    let figures = figures(i.built, &state.q, state.time);
    let counters = i.simulation.counters();
    Summary {
        schema: SUMMARY_SCHEMA,
        status: i.status,
        reason: i.reason,
        simulated_s: state.time,
        wall_s: i.wall.as_secs_f64(),
        cpu_s: i.cpu,
        threads: i.threads,
        steps: counters.steps,
        rejected_steps: counters.rejected,
        newton_iterations: counters.newton_iterations,
        linear_iterations: counters.linear_iterations,
        points: i.built.geometry.mesh.points(),
        scalars: state.layout.scalars,
        triangles: i.built.geometry.mesh.triangles().len(),
        peak_memory_bytes: process::peak_memory_bytes(),
        simulation_bytes: i.simulation.heap_bytes(),
        memory: memory(i.simulation),
        max_penetration_m: figures.max_penetration,
        self_intersections: figures.self_intersections,
        max_abs_edge_strain: figures.max_strain,
        mean_abs_edge_strain: figures.mean_strain,
        max_seam_gap_m: figures.max_seam_gap,
        trims: i.built.trims.summary(&i.built.parsed, i.simulation),
        max_drop_m: figures.max_drop,
        topology: i.topology,
        defects: figures.defects,
        kinetic_energy_j: state.kinetic_energy(&i.simulation.plan().inertia.masses),
        residual: i.last.residual,
        error_estimate: None,
        error: None,
        stages: i
            .simulation
            .ledger()
            .entries()
            .iter()
            .map(|e| (e.name.clone(), e.time.as_secs_f64()))
            .collect(),
        watchdog: i.watchdog,
        watchdog_unlisted: i.watchdog_unlisted,
        assembly: i.assembly,
        effects: i.effects,
        settings: i.built.scene().effective(),
        version: i.version.to_owned(),
        final_state_hash: state_hash(&state.q, &state.v),
        warnings: i
            .built
            .warnings
            .findings()
            .iter()
            .map(ToString::to_string)
            .collect(),
    }
}

/// Energies after a step by term, and the kinetic energy [J].
pub(crate) fn energies(last: &StepReport, state: &State, plan: &ScenePlan) -> Vec<(String, f64)> {
    let terms = last.energies.iter().map(|e| (e.name.clone(), e.value));
    let kinetic = state.kinetic_energy(&plan.inertia.masses);
    terms.chain([("kinetic".to_owned(), kinetic)]).collect()
}

/// BLAKE3 of the exact bits of positions and velocities.
pub(crate) fn state_hash(q: &[f64], v: &[f64]) -> String {
    let mut hasher = blake3::Hasher::new();
    for x in q.iter().chain(v) {
        hasher.update(&x.to_le_bytes());
    }
    hasher.finalize().to_hex().to_string()
}
