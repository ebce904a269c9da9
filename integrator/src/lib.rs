//! Implicit time stepping of whatever energies, contacts and pins a plan
//! holds.
//!
//! A [`ScenePlan`] lists what a scene calls for; an [`Integrator`] makes one
//! step of it; a [`Simulation`] chooses the steps, relaxes the start and stops
//! at rest. [`BackwardEuler`] is the default integrator: Newton's method in
//! velocities with a line search [Pizana2025, Alg. 1]; [`StaticRest`] seeks a
//! state of rest instead. No concrete energy,
//! contact model or solver is named here.

mod assemble;
mod contact;
mod control;
mod error;
mod euler;
mod finite;
mod ledger;
mod motion;
mod norm;
mod pins;
mod plan;
mod settings;
mod simulation;
mod sink;
mod state;
mod statics;
mod step;
mod system;

pub use assemble::{AssemblyOptions, MassEvaluation, Scatter, TermEnergy};
pub use control::{RestDetector, StepControl};
pub use error::{PlanError, SimulationError, StepError};
pub use euler::BackwardEuler;
pub use ledger::{Ledger, LedgerEntry};
pub use plan::{Fixed, Inertia, Pins, ScenePlan, Term, Trajectory};
pub use settings::{
    ControlSettings, CurvaturePolicy, Forcing, LineSearch, NewtonSettings, RelaxationSettings,
    ResidualNorm, Scheme, Settings, StaticSettings, StopSettings,
};
pub use simulation::{Counters, EndReason, Outcome, Simulation};
pub use state::{Snapshot, State};
pub use statics::StaticRest;
pub use step::{Integrator, RestReport, StepReport, StepRequest};
pub use system::{
    BorderedSystem, DualSystem, Evaluation, MatrixFreeSystem, NewtonSystem, ReassembledSystem,
    StoredSystem,
};
