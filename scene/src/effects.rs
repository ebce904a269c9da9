//! The effect plan: on or off, why, and at what cost.

use serde::Serialize;

/// Name of the row of error estimates, which are made beside a run.
pub const ESTIMATE: &str = "error estimate";

/// One row of the effect plan: an effect is on because the scene calls for it,
/// or absent.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EffectRow {
    /// Name of the effect.
    pub name: String,
    /// Whether it is in the plan.
    pub on: bool,
    /// Why, in a sentence.
    pub reason: String,
    /// Stencils, points or pairs that it adds.
    pub stencils: usize,
    /// Heap memory that it holds [bytes].
    pub bytes: usize,
    /// Wall time that it took so far [s].
    pub seconds: f64,
}

impl EffectRow {
    /// An effect that is in the plan.
    pub fn on(
        name: impl Into<String>,
        reason: impl Into<String>,
        stencils: usize,
        bytes: usize,
    ) -> Self {
        Self {
            name: name.into(),
            on: true,
            reason: reason.into(),
            stencils,
            bytes,
            seconds: 0.0,
        }
    }

    /// An effect that is absent.
    pub fn off(name: impl Into<String>, reason: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            on: false,
            reason: reason.into(),
            stencils: 0,
            bytes: 0,
            seconds: 0.0,
        }
    }
}
