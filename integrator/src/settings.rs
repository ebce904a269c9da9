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
    /// Products of first derivatives only.
    GaussNewton,
}

/// How exactly the linear systems of one step are solved.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Forcing {
    /// As the linear solver is set.
    #[default]
    Constant,
    /// Choice 2 of [EisenstatWalker1996] with its safeguard, and never more
    /// exactly than the step asks for:
    ///
    /// ```text
    /// η_0 = η_max,  η_k = 0.9 (r_k / r_k−1)²  (at least 0.9 η_k−1² where that exceeds 0.1)
    /// η_k ← clamp(max(η_k, ½ τ / r_k), η_min, η_max)
    /// ```
    /// with `r` the residual and `τ` its tolerance.
    EisenstatWalker {
        /// `η_min` [1].
        tightest: f64,
        /// `η_max` [1].
        loosest: f64,
    },
}

impl Forcing {
    /// Relative tolerance of the solve of an iteration, given its residual,
    /// the residual and the tolerance of the iteration before, and the
    /// residual to be reached; `None` leaves it to the solver.
    pub fn tolerance(self, residual: f64, before: Option<(f64, f64)>, goal: f64) -> Option<f64> {
        let Self::EisenstatWalker { tightest, loosest } = self else {
            return None;
        };
        let choice = match before {
            None => loosest,
            Some((previous, eta)) => {
                let choice = 0.9 * (residual / previous).powi(2);
                let safeguard = 0.9 * eta * eta;
                if safeguard > 0.1 {
                    choice.max(safeguard)
                } else {
                    choice
                }
            }
        };
        Some(choice.max(0.5 * goal / residual).min(loosest).max(tightest))
    }
}

/// What a try of the line search has to bring.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LineSearch {
    /// A smaller residual [Pizana2025, Alg. 1].
    #[default]
    Residual,
    /// Less of the potential whose stationary point the step is, by the work of
    /// the residual along the direction, the trapezoid rule between both ends:
    ///
    /// ```text
    /// b(v + s Δv)·Δv ≥ −0.9 b(v)·Δv
    /// ```
    /// A direction from a positive definite matrix leads down that potential
    /// even where the matrix lacks a large part of the curvature and the
    /// residual has to grow first.
    Work,
}

/// How many linear systems a step takes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scheme {
    /// As many as Newton's method needs to reach the tolerance.
    #[default]
    Newton,
    /// One, at the state where the step starts [BaraffWitkin1998]:
    ///
    /// ```text
    /// (M + h² K) v = M v_0 + h F(x_0, 0)
    /// ```
    /// The residual that the step leaves is reported, not controlled.
    Linearised,
}

/// Newton's method of one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NewtonSettings {
    /// Residual at which a step is accepted, in the units of `norm`.
    pub tolerance: f64,
    /// Velocity error of any single point [m/s] that must be met as well; `None`
    /// leaves single points to the norm, which hides those of little mass.
    pub point_tolerance: Option<f64>,
    /// Iterations before a step fails.
    pub iterations: usize,
    /// Tries of the line search, halving from a full step.
    pub line_search_tries: usize,
    /// How many linear systems a step takes.
    pub scheme: Scheme,
    /// What a try of the line search has to bring.
    pub line_search: LineSearch,
    /// Norm of the residual.
    pub norm: ResidualNorm,
    /// Curvature policy.
    pub curvature: CurvaturePolicy,
    /// How exactly the linear systems are solved.
    pub forcing: Forcing,
}

impl Default for NewtonSettings {
    fn default() -> Self {
        Self {
            tolerance: 1e-2,
            point_tolerance: None,
            iterations: 5,
            line_search_tries: 5,
            scheme: Scheme::Newton,
            line_search: LineSearch::Residual,
            norm: ResidualNorm::Mass,
            curvature: CurvaturePolicy::Auto,
            forcing: Forcing::Constant,
        }
    }
}

/// Search for a state of rest, see [`StaticRest`](crate::StaticRest).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StaticSettings {
    /// Largest unbalanced force at which the cloth is at rest [N].
    pub tolerance: f64,
    /// Largest change of any unknown in one iteration [m].
    pub max_move: f64,
    /// First pseudo-step [s].
    pub first_step: f64,
    /// Tries of the line search, halving from a full step.
    pub line_search_tries: usize,
    /// Curvature policy.
    pub curvature: CurvaturePolicy,
}

impl Default for StaticSettings {
    fn default() -> Self {
        Self {
            tolerance: 1e-6,
            max_move: 1e-2,
            first_step: 1e-3,
            line_search_tries: 8,
            curvature: CurvaturePolicy::Auto,
        }
    }
}

impl StaticSettings {
    /// Checks every range.
    ///
    /// # Errors
    /// [`PlanError::Setting`] for the first value outside its range.
    pub fn validate(&self) -> Result<(), PlanError> {
        positive("force_tolerance", self.tolerance)?;
        positive("max_move", self.max_move)?;
        positive("first_step", self.first_step)?;
        at_least_one("line_search_halvings", self.line_search_tries)
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
    /// Newton iterations above which an accepted step starts that count anew:
    /// a larger one would be rejected.
    pub recovery_iterations: usize,
    /// Smallest step as a fraction of the largest [1].
    pub min_step_fraction: f64,
}

impl Default for ControlSettings {
    fn default() -> Self {
        Self {
            max_step: 1e-3,
            splitting: 0.75,
            recovery_steps: 5,
            recovery_iterations: 3,
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
    /// Simulated time [s] before which nothing counts as rest: something is
    /// still to come.
    pub not_before: f64,
}

impl Default for StopSettings {
    fn default() -> Self {
        Self {
            early: true,
            percentile: 99.0,
            kinetic_energy: 1e-8,
            window: 0.1,
            not_before: 0.0,
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
        positive("point_tolerance", self.point_tolerance.unwrap_or(1.0))?;
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
        at_least_one("recovery_iterations", c.recovery_iterations)?;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forcing_follows_the_residual() {
        let forcing = Forcing::EisenstatWalker {
            tightest: 1e-3,
            loosest: 0.5,
        };
        let eta = |r: f64, before| forcing.tolerance(r, before, 1e-6).unwrap();
        assert_eq!(eta(1.0, None), 0.5);
        // 0.9 (r / r_0)², held up by 0.9 η² after a loose solve.
        assert!((eta(0.3, Some((1.0, 0.1))) - 0.081).abs() < 1e-15);
        assert!((eta(0.3, Some((1.0, 0.5))) - 0.225).abs() < 1e-15);
        // Within its bounds, and no more exactly than the step asks for.
        assert!((eta(1e-4, Some((1.0, 0.1))) - 5e-3).abs() < 1e-15);
        assert_eq!(forcing.tolerance(1e-3, Some((1.0, 0.1)), 0.0), Some(1e-3));
        assert_eq!(forcing.tolerance(2.0, Some((1.0, 0.1)), 0.0), Some(0.5));
        assert_eq!(Forcing::Constant.tolerance(1.0, None, 1e-6), None);
    }
}
