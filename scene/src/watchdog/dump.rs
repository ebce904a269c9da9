use std::path::{Path, PathBuf};

use selvedge_integrator::{Outcome, Simulation, SimulationError, Snapshot};
use serde::{Deserialize, Serialize};

use super::{EnergyMeter, Event, Ladder, Scope};
use crate::assembly;
use crate::build::{Built, BuiltScene};
use crate::diagnostic::Diagnostics;
use crate::driver::chain;
use crate::file::model::DampingKind;
use crate::file::{self, Source};

/// What the `format` of a dump says.
const FORMAT: &str = "selvedge-step";

/// File name of a dump in the folder of the results.
pub const DUMP: &str = "stopped-step.json";

/// A step that could not be taken, with all that it depends on.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Dump {
    format: String,
    /// Version of the program that wrote it.
    pub version: String,
    /// The finding.
    pub event: Event,
    /// Length of the step [s].
    pub dt: f64,
    /// Rung of the ladder that it was tried on.
    pub rung: u8,
    /// The scene, with what the command line changed.
    pub scene: Source,
    /// Every effective setting, for readers.
    pub settings: serde_json::Value,
    /// Whether the garment crossed itself when it was sewn.
    #[serde(default)]
    crossed: bool,
    /// Positions at the start of the stage, 16 hexadecimal digits a number.
    pub start: String,
    /// Mechanical energy before the step [J], where it is known.
    pub energy_before: Option<f64>,
    /// State and history before the step, by name, as `start`.
    pub sections: Vec<(String, String)>,
}

/// Why a dump cannot be replayed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReplayError {
    /// The file cannot be read.
    #[error("cannot read `{path}`: {source}")]
    Read {
        /// The file.
        path: PathBuf,
        /// The reason that the system gives.
        source: std::io::Error,
    },
    /// The file is no dump, or not a whole one.
    #[error("`{path}` is not a stopped step: {reason}")]
    Format {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// The scene in the dump cannot be built.
    #[error("{} error(s) in the scene of the stopped step", .0.len())]
    Scene(Diagnostics),
    /// State and scene do not belong together.
    #[error(transparent)]
    State(#[from] SimulationError),
}

/// What the step did when it was tried again.
#[derive(Clone, Debug, Serialize)]
pub struct Replay {
    /// The finding in the dump.
    pub event: Event,
    /// Length of the step [s].
    pub dt_s: f64,
    /// Whether the step was accepted this time.
    pub accepted: bool,
    /// Why it was not, or what it took.
    pub outcome: String,
    /// What the energy grew by [J], where the dump knows it from before.
    pub energy_gain_j: Option<f64>,
    /// Version of the program that wrote the dump.
    pub version: String,
}

/// Sixteen hexadecimal digits a number: every bit, also of NaN.
fn hex(values: &[f64]) -> String {
    values.iter().fold(String::new(), |mut text, x| {
        text += &format!("{:016x}", x.to_bits());
        text
    })
}

fn unhex(text: &str) -> Option<Vec<f64>> {
    let bytes = text.as_bytes();
    let (words, rest) = bytes.as_chunks::<16>();
    let word = |w: &[u8; 16]| {
        let digits = std::str::from_utf8(w).ok()?;
        u64::from_str_radix(digits, 16).ok().map(f64::from_bits)
    };
    rest.is_empty()
        .then(|| words.iter().map(word).collect())
        .flatten()
}

impl Dump {
    pub(super) fn new(
        scope: &Scope<'_>,
        snapshot: &Snapshot,
        event: Event,
        rung: u8,
        energy_before: Option<f64>,
    ) -> Self {
        let built = scope.built;
        let mut scene = built.parsed.source.clone();
        // It can be replayed from any folder.
        scene.path = std::path::absolute(&scene.path).unwrap_or(scene.path);
        let sections = snapshot.sections.iter();
        Self {
            format: FORMAT.to_owned(),
            version: scope.version.to_owned(),
            dt: event.dt_s,
            event,
            rung,
            scene,
            settings: built.scene().effective(),
            crossed: scope.stage.crossed,
            start: hex(scope.start),
            energy_before,
            sections: sections.map(|(n, v)| (n.clone(), hex(v))).collect(),
        }
    }

    /// Whether a file begins like a dump.
    pub fn is_at(path: &Path) -> bool {
        use std::io::Read;
        let mut head = [0; 64];
        let read = std::fs::File::open(path).and_then(|mut f| f.read(&mut head));
        let head = String::from_utf8_lossy(&head);
        read.is_ok() && head.contains("\"format\"") && head.contains(FORMAT)
    }

    /// Reads a dump.
    ///
    /// # Errors
    /// [`ReplayError::Read`], [`ReplayError::Format`].
    pub fn read(path: &Path) -> Result<Self, ReplayError> {
        let format = |reason: String| ReplayError::Format {
            path: path.to_owned(),
            reason,
        };
        let text = std::fs::read_to_string(path).map_err(|source| ReplayError::Read {
            path: path.to_owned(),
            source,
        })?;
        let dump: Self = serde_json::from_str(&text).map_err(|e| format(e.to_string()))?;
        if dump.format != FORMAT {
            return Err(format(format!("its format is `{}`", dump.format)));
        }
        if !(dump.dt > 0.0 && dump.dt.is_finite()) {
            return Err(format(format!("its step is {} s", dump.dt)));
        }
        Ok(dump)
    }

    /// Takes the step again, with further overrides of the scene's keys.
    ///
    /// # Errors
    /// [`ReplayError::Format`] for numbers that are not whole,
    /// [`ReplayError::Scene`], [`ReplayError::State`].
    pub fn replay(
        &self,
        path: &Path,
        overrides: &[(String, String)],
    ) -> Result<Replay, ReplayError> {
        let broken = |name: &str| ReplayError::Format {
            path: path.to_owned(),
            reason: format!("the numbers of `{name}` are damaged"),
        };
        let mut all = self.scene.overrides.clone();
        all.extend_from_slice(overrides);
        let parsed =
            file::parse(&self.scene.text, &self.scene.path, &all).map_err(ReplayError::Scene)?;
        let built = BuiltScene::new(parsed).map_err(ReplayError::Scene)?;
        let mut state = built.geometry.start();
        let start = unhex(&self.start).ok_or_else(|| broken("start"))?;
        if start.len() != state.q.len() || start.iter().any(|x| !x.is_finite()) {
            return Err(broken("start"));
        }
        state.q = start;
        let sewing = assembly::stage(&built, self.crossed, &self.event.stage);
        let stage = sewing.unwrap_or_else(|| built.drape_stage());
        let Built {
            mut simulation,
            attachments,
            ..
        } = built
            .simulation(state, &stage)
            .map_err(ReplayError::Scene)?;
        let mut snapshot = Snapshot::default();
        for (name, text) in &self.sections {
            let values = unhex(text).ok_or_else(|| broken(name))?;
            snapshot.sections.push((name.clone(), values));
        }
        simulation.restore(&snapshot)?;
        simulation.set_next_dt(self.dt);
        Ladder::of(built.scene()).apply(&mut simulation, self.rung);
        for attachment in attachments.iter().filter(|a| a.moves()) {
            attachment.update(simulation.state().time + self.dt);
        }
        let incremental = built.scene().damping.kind == DampingKind::Incremental;
        Ok(self.again(&mut simulation, EnergyMeter::new(incremental)))
    }

    fn again(&self, simulation: &mut Simulation, mut meter: EnergyMeter) -> Replay {
        meter.set_last(self.energy_before);
        let mut gain = None;
        let (accepted, outcome) = match simulation.advance() {
            Ok(Outcome::Accepted { report, .. }) => {
                gain = meter.end(simulation, &report);
                let text = format!(
                    "accepted after {} Newton and {} linear iterations, residual {:.3e}",
                    report.newton_iterations, report.linear_iterations, report.residual
                );
                (true, text)
            }
            Ok(Outcome::Rejected { reason, .. }) => (false, chain(&reason)),
            Ok(Outcome::Ended(reason)) => (true, format!("nothing to do: {reason:?}")),
            Err(e) => (false, chain(&e)),
        };
        Replay {
            event: self.event.clone(),
            dt_s: self.dt,
            accepted,
            outcome,
            energy_gain_j: gain,
            version: self.version.clone(),
        }
    }
}
