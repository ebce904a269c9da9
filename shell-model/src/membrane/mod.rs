//! In-plane elasticity.

mod guard;
mod stvk;

pub use guard::MembraneGuard;
pub use stvk::MembraneStVk;
