use serde::{Deserialize, Serialize};

/// Guard over the steps of a run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WatchdogSettings {
    /// Whether to watch.
    pub enabled: bool,
    /// What to do about a finding.
    pub answer: WatchdogAnswer,
    /// Rejections in a row that are a stall.
    pub rejections: usize,
    /// Accepted steps in a row at a small step size that are a stall.
    pub slow_steps: usize,
    /// Step size relative to `integrator.max_step` below which a step is small.
    pub slow_fraction: f64,
    /// Energy gained in one step, relative to the largest so far, that is an injection.
    pub energy_gain: f64,
    /// Energy below which a gain is never an injection \[J\].
    pub energy_floor: f64,
    /// Accepted steps after which the settings of the scene come back.
    pub recovery_steps: usize,
    /// Findings that are kept; further ones are counted.
    pub most_events: usize,
}

/// What to do about a finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WatchdogAnswer {
    /// Climb the ladder; stop cleanly at its end.
    Ladder,
    /// Note it in the results and go on.
    Note,
}
