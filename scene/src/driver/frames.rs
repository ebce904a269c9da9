//! What is recorded of a drape, and when.

use selvedge_integrator::{Ledger, Simulation, StepReport};
use selvedge_record::{BodySurface, Checkpoint, RecordError, Recorder, RunHeader, StepDiagnostics};

use super::RunOptions;
use super::drape::{CARRIED, Now, START, Start, TOPOLOGY};
use crate::build::{BuiltScene, PinGroup};

/// Seconds of the ledger's rows at the last record.
#[derive(Default)]
pub(super) struct Booked(Vec<f64>);

impl Booked {
    /// What every row gained since.
    pub(super) fn since(&mut self, ledger: &Ledger) -> Vec<(String, f64)> {
        self.0.resize(ledger.entries().len(), 0.0);
        let rows = ledger.entries().iter().zip(&mut self.0);
        rows.map(|(entry, before)| {
            let now = entry.time.as_secs_f64();
            let gained = now - std::mem::replace(before, now);
            (entry.name.clone(), gained)
        })
        .collect()
    }
}

pub(super) fn diagnostics(
    simulation: &Simulation,
    dt: f64,
    report: &StepReport,
    pins: &[PinGroup],
    booked: &mut Booked,
) -> StepDiagnostics {
    let state = simulation.state();
    StepDiagnostics {
        time: state.time,
        step: simulation.counters().steps,
        dt,
        accepted: true,
        newton_iterations: report.newton_iterations as u32,
        linear_iterations: report.linear_iterations as u32,
        line_search_halvings: report.halvings as u32,
        residual: report.residual,
        energies: report
            .energies
            .iter()
            .map(|e| (e.name.clone(), e.value))
            .collect(),
        kinetic: state.kinetic_energy(&simulation.plan().inertia.masses),
        contacts: report.contacts,
        candidates: report.candidates,
        max_penetration: report.max_penetration,
        pins: pins.iter().map(|p| p.held(state, report)).collect(),
        ledger: booked.since(simulation.ledger()),
        note: String::new(),
    }
}

/// Decides which steps become frames.
pub(super) struct Frames {
    interval: f64,
    next: f64,
    recorded: Option<u64>,
}

impl Frames {
    pub(super) fn new(scene: &crate::file::SceneFile, simulation: &Simulation) -> Self {
        let interval = 1.0 / scene.output.frame_rate;
        let time = simulation.state().time;
        // A resumed run goes on with the frame after those already recorded.
        let next = if time > 0.0 {
            ((time / interval).floor() + 1.0) * interval
        } else {
            0.0
        };
        Self {
            interval,
            next,
            recorded: None,
        }
    }

    pub(super) fn due(
        &mut self,
        built: &BuiltScene,
        recorder: &mut Recorder,
        simulation: &Simulation,
    ) -> Result<(), RecordError> {
        let time = simulation.state().time;
        // Steps add up to the frame's time only to round-off.
        if time < self.next - 1e-9 {
            return Ok(());
        }
        self.next = ((time / self.interval + 1e-6).floor() + 1.0) * self.interval;
        self.record(built, recorder, simulation)
    }

    pub(super) fn last(
        &mut self,
        built: &BuiltScene,
        recorder: &mut Recorder,
        simulation: &Simulation,
    ) -> Result<(), RecordError> {
        if self.recorded == Some(simulation.counters().steps) {
            return Ok(());
        }
        self.record(built, recorder, simulation)
    }

    pub(super) fn record(
        &mut self,
        built: &BuiltScene,
        recorder: &mut Recorder,
        simulation: &Simulation,
    ) -> Result<(), RecordError> {
        let state = simulation.state();
        let step = simulation.counters().steps;
        self.recorded = Some(step);
        let g = &built.geometry;
        recorder.frame(
            state.time,
            step,
            &g.recorded_positions(&state.q),
            &g.recorded_velocities(&state.v),
        )
    }
}

pub(super) fn checkpoint_now(
    recorder: &mut Recorder,
    simulation: &Simulation,
    now: &Now<'_>,
    start: &Start,
) -> Result<(), RecordError> {
    let mut sections = simulation.snapshot().sections;
    sections.push((START.to_owned(), start.q.clone()));
    if start.carried {
        sections.push((CARRIED.to_owned(), Vec::new()));
    }
    if !now.topology.is_empty() {
        sections.push((TOPOLOGY.to_owned(), now.topology.section()));
    }
    recorder.checkpoint(&Checkpoint {
        time: simulation.state().time,
        step: simulation.counters().steps,
        sections,
    })
}

pub(super) fn header(built: &BuiltScene, options: &RunOptions) -> RunHeader {
    let g = &built.geometry;
    RunHeader {
        scene_name: built.scene().name.clone(),
        scene_text: options.scene_text.clone(),
        effective: built.scene().effective(),
        version: options.version.clone(),
        points: if g.passages.is_some() {
            g.recorded_points()
        } else {
            g.mesh.points()
        },
        scalars: 0,
        triangles: g.scene_triangles.clone(),
        panels: g.scene_panel.clone(),
        fabrics: g.scene_fabric.clone(),
        panel_names: g.panel_names.clone(),
        fabric_names: g.fabrics.iter().map(|f| f.name.clone()).collect(),
        material: g.scene_material.clone(),
        bodies: built
            .bodies
            .iter()
            .map(|b| BodySurface {
                name: b.name.clone(),
                points: b.surface.0.clone(),
                triangles: b.surface.1.clone(),
            })
            .collect(),
        yarns: g.yarn_paths(),
        ..RunHeader::default()
    }
}
