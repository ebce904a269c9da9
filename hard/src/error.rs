use selvedge_collision::CollisionError;
use selvedge_integrator::{PlanError, SimulationError};
use selvedge_linsolve::LinsolveError;
use selvedge_scene::diagnostic::Diagnostics;
use selvedge_scene::driver::RunError;
use selvedge_shell_model::ModelError;

/// Why a case gave no figures.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum HardError {
    /// There is no such case.
    #[error("there is no case `{name}`; the nearest is `{nearest}`")]
    Unknown {
        /// What was asked for.
        name: String,
        /// The case whose name comes nearest.
        nearest: &'static str,
    },
    /// The scene was refused.
    #[error("scene: {0}")]
    Scene(#[from] Diagnostics),
    /// The simulation gave up.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// A run gave no result.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The linear algebra refused.
    #[error(transparent)]
    Linear(#[from] LinsolveError),
    /// The shell model refused.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A fabric was refused.
    #[error(transparent)]
    Fabric(#[from] selvedge_shell_model::fabric::FabricError),
    /// The plan was refused.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// Contact failed.
    #[error(transparent)]
    Contact(#[from] CollisionError),
    /// A file of the case could not be written.
    #[error("file of the case: {0}")]
    File(#[from] std::io::Error),
    /// A case of yarns got none that slide.
    #[error("the scene has no yarns that slide")]
    NoYarns,
    /// It took too long.
    #[error("not done after {seconds:.0} s, at t = {time:.4} s")]
    Budget {
        /// Wall time allowed [s].
        seconds: f64,
        /// Simulated time reached [s].
        time: f64,
    },
    /// The code gave up on the spot.
    #[error("it panicked: {0}")]
    Panicked(String),
}
