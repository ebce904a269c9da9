//! Settings of the integrator, with the defaults of [Pizana2025, §3, §5].

use crate::PlanError;

/// Norm in which Newton's residual is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ResidualNorm {
    /// `sqrt(fᵀ M⁻¹ f / m_total)` [m/s]: a mean velocity error that does not
    /// depend on the mesh.
    #[default]
    Mass,
    /// `‖f‖₂` [N·s], as printed in [Pizana2025]; grows with the number of
    /// points.
    Paper,
}

/// Which curvature Newton's matrix is assembled from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CurvaturePolicy {
    /// Exact; projected for an iteration that meets negative curvature or
    /// whose line search fails.
    #[default]
    Auto,
    /// Always exact, as in [Pizana2025]: trouble is left to step splitting.
    Exact,
    /// Always positive semidefinite.
    Projected,
}

/// Newton's method of one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NewtonSettings {
    /// Residual at which a step is accepted, in the units of `norm`.
    pub tolerance: f64,
    /// Iterations before a step fails.
    pub iterations: usize,
    /// Tries of the line search, halving from a full step.
    pub line_search_tries: usize,
    /// Norm of the residual.
    pub norm: ResidualNorm,
    /// Curvature policy.
    pub curvature: CurvaturePolicy,
}

impl Default for NewtonSettings {
    fn default() -> Self {
        Self {
            tolerance: 1e-2,
            iterations: 5,
            line_search_tries: 5,
            norm: ResidualNorm::Mass,
            curvature: CurvaturePolicy::Auto,
        }
    }
}

/// Step size control by splitting and recovery.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControlSettings {
    /// Largest step [s].
    pub max_step: f64,
    /// Factor applied to the step after a rejection [1].
    pub splitting: f64,
    /// Accepted steps in a row before the step grows by `1 / splitting`.
    pub recovery_steps: usize,
    /// Smallest step as a fraction of the largest [1].
    pub min_step_fraction: f64,
}

impl Default for ControlSettings {
    fn default() -> Self {
        Self {
            max_step: 1e-3,
            splitting: 0.75,
            recovery_steps: 5,
            min_step_fraction: 1.0 / (1u32 << 20) as f64,
        }
    }
}

/// Initial relaxation: a window of small steps without velocity in which the
/// fabric gains its stiffness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelaxationSettings {
    /// Length of the window [s]; zero switches it off.
    pub duration: f64,
    /// First step as a fraction of the largest [1].
    pub step_fraction: f64,
    /// Fabric stiffness at the start of the window, relative to its own [1].
    pub stiffness_start: f64,
}

impl Default for RelaxationSettings {
    fn default() -> Self {
        Self {
            duration: 0.1,
            step_fraction: 1.0 / 16.0,
            stiffness_start: 1e-2,
        }
    }
}

impl RelaxationSettings {
    /// No window at all.
    pub const OFF: Self = Self {
        duration: 0.0,
        step_fraction: 1.0,
        stiffness_start: 1.0,
    };

    /// Fabric stiffness at time `t` [s], relative to its own [1].
    pub fn stiffness(&self, t: f64) -> f64 {
        if t >= self.duration {
            return 1.0;
        }
        self.stiffness_start + (1.0 - self.stiffness_start) * t / self.duration
    }
}

/// When a drape counts as being at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StopSettings {
    /// Whether to stop before the end.
    pub early: bool,
    /// Percentile of the per-point kinetic energies, 0 to 100.
    pub percentile: f64,
    /// Kinetic energy of one point [J] below which it rests.
    pub kinetic_energy: f64,
    /// Time [s] for which every step must stay below.
    pub window: f64,
}

impl Default for StopSettings {
    fn default() -> Self {
        Self {
            early: true,
            percentile: 99.0,
            kinetic_energy: 1e-8,
            window: 0.1,
        }
    }
}

/// All settings of a [`Simulation`](crate::Simulation).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Settings {
    /// Simulated time at which to end [s].
    pub duration: f64,
    /// Step control.
    pub control: ControlSettings,
    /// Initial relaxation.
    pub relaxation: RelaxationSettings,
    /// Early stop.
    pub stop: StopSettings,
}

impl NewtonSettings {
    /// Checks every range.
    ///
    /// # Errors
    /// [`PlanError::Setting`] for the first value outside its range.
    pub fn validate(&self) -> Result<(), PlanError> {
        positive("newton_tolerance", self.tolerance)?;
        at_least_one("newton_iterations", self.iterations)?;
        at_least_one("line_search_halvings", self.line_search_tries)
    }
}

impl Settings {
    /// Checks every range.
    ///
    /// # Errors
    /// [`PlanError::Setting`] for the first value outside its range.
    pub fn validate(&self) -> Result<(), PlanError> {
        let c = &self.control;
        non_negative("duration", self.duration)?;
        positive("max_step", c.max_step)?;
        fraction("step_splitting", c.splitting)?;
        at_least_one("recovery_steps", c.recovery_steps)?;
        fraction("min_step_fraction", c.min_step_fraction)?;
        let r = &self.relaxation;
        non_negative("relaxation.duration", r.duration)?;
        if r.duration > 0.0 {
            positive("relaxation.step_fraction", r.step_fraction)?;
            positive("relaxation.stiffness_start", r.stiffness_start)?;
        }
        let s = &self.stop;
        non_negative("stop.window", s.window)?;
        positive("stop.kinetic_energy", s.kinetic_energy)?;
        if !(s.percentile > 0.0 && s.percentile <= 100.0) {
            return Err(PlanError::Setting {
                name: "stop.percentile",
                value: s.percentile,
                allowed: "above 0 and at most 100",
            });
        }
        Ok(())
    }
}

fn positive(name: &'static str, value: f64) -> Result<(), PlanError> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(PlanError::Setting {
        name,
        value,
        allowed: "positive and finite",
    })
}

fn non_negative(name: &'static str, value: f64) -> Result<(), PlanError> {
    if value >= 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(PlanError::Setting {
        name,
        value,
        allowed: "zero or positive, and finite",
    })
}

fn fraction(name: &'static str, value: f64) -> Result<(), PlanError> {
    if value > 0.0 && value < 1.0 {
        return Ok(());
    }
    Err(PlanError::Setting {
        name,
        value,
        allowed: "between 0 and 1, both excluded",
    })
}

fn at_least_one(name: &'static str, value: usize) -> Result<(), PlanError> {
    if value >= 1 {
        return Ok(());
    }
    Err(PlanError::Setting {
        name,
        value: value as f64,
        allowed: "at least 1",
    })
}
