//! Energies and inertia of yarn networks.
//!
//! Stencils list points first and scalars (arc lengths, by strand) last.
//! Where sliding is locked there are no scalars: [`Locked`] evaluates the same
//! kernels with arc lengths frozen as they are at rest.

mod angle;
pub(crate) mod bending;
mod dihedral;
mod fading;
mod gravity;
mod inertia;
mod length;
mod locked;
mod parallel;
mod ramp;
mod shear;
pub(crate) mod stretch;
pub(crate) mod wrapping;

pub use bending::{JAM_ANGLE, JAM_WIDTH, JammingBending, PlainBending, YarnBending};
pub use gravity::YarnGravity;
pub use inertia::{
    InertiaForce, LockedInertia, SegmentInertia, lumped_point_masses, lumped_scalar_masses,
};
pub use length::StitchLength;
pub use locked::{Locked, LockedBending, LockedGravity, LockedStretch};
pub(crate) use parallel::LOOSE;
pub use parallel::ParallelYarns;
pub use shear::YarnShear;
pub use stretch::{LEAST_MATERIAL, YarnStretch};
pub use wrapping::{StitchWrapping, WrapElement, WrapPair};

/// Value [J] of a stencil whose arc lengths have met or are in the wrong order:
/// no state at all. Its derivatives are NaN, so that a step that ends there is
/// refused by name instead of continued.
pub const CROSSED: f64 = f64::INFINITY;

#[inline(always)]
fn crossed<const M: usize>(g: &mut [f64; M]) -> f64 {
    *g = [f64::NAN; M];
    CROSSED
}
