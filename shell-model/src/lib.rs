//! Triangle shells: meshes with material coordinates, fabrics, membrane and
//! bending energies with internal friction, and what holds cloth (drag, seams,
//! attachments, rigid trims).
//!
//! The crate turns a [`ShellMesh`] and some [`Fabric`]s into
//! terms for the energy contract of `selvedge_energy`. It knows no solver, no
//! contact and no time stepping.
//!
//! ```
//! use selvedge_energy::{DofLayout, EvalPoint};
//! use selvedge_shell_model::fabric::{BendingRigidity, Fabric, MembraneModuli};
//! use selvedge_shell_model::{BendingOptions, DampingKind, bending_term, membrane_term, sheet};
//!
//! let sheet = sheet::equilateral_edge([0.1, 0.1], 0.01)?;
//! let fabrics = [Fabric::new(
//!     "poplin",
//!     0.12, // kg/m²
//!     MembraneModuli::from_moduli(2000.0, 1500.0, 60.0, 0.1)?,
//!     BendingRigidity::isotropic(5e-6)?,
//! )?];
//! let membrane = membrane_term(&sheet.mesh, &fabrics, DampingKind::Off)?;
//! let bending = bending_term(&sheet.mesh, &fabrics, &BendingOptions::default())?;
//!
//! // One percent of uniaxial strain along the warp: ½ k_u ε² A.
//! let q = sheet.positions(|[u, v]| [1.01 * u, 0.0, -v]);
//! let layout = DofLayout::points(sheet.mesh.points());
//! let at = EvalPoint { layout, q: &q, q_start: &q, dt: 1e-3 };
//! let strain = 0.5 * (1.01_f64.powi(2) - 1.0);
//! let expected = 0.5 * fabrics[0].membrane.warp * strain * strain * 0.01;
//! assert!((membrane.value(&at, 0..membrane.len()) / expected - 1.0).abs() < 1e-9);
//! assert!(bending.value(&at, 0..bending.len()) < 1e-30);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | term | energy | stencil |
//! |---|---|---|
//! | [`membrane_term`] | [`MembraneStVk`] | triangle |
//! | [`membrane_guard_term`] | [`MembraneGuard`] | triangle |
//! | [`bending_term`] | [`BendingHinge`], [`BendingQuadratic`] | hinge, 4 points |
//! | [`drag_term`] | [`PointDrag`] | point |
//! | [`seam_term`], [`joint_term`], [`patch_term`] | [`WeightedSpring`] | 3, 2, 4 points |
//! | [`attachment_term`] | [`Attachment`] | point |
//! | [`trim_term`] | [`RigidTrims`] | triangle, centre, spin |

mod attach;
mod bending;
mod damping;
mod error;
pub mod fabric;
mod lanes;
mod membrane;
mod mesh;
pub mod shape;
pub mod strain;
mod terms;
mod vec3;

pub use attach::{
    Attachment, BodyInertia, PointDrag, RigidTrims, SeamSpring, SharedScalar, SharedTargets,
    TrimBody, TrimThread, WeightedSpring,
};
pub use bending::{
    AngleLaw, BendingHinge, BendingQuadratic, DirectionalRigidity, HingeNorm, HingeRest,
    PlainAngle, QuadraticRest, TangentAngle,
};
pub use damping::{Damping, DampingKind, IncrementalDamping, RateDamping, Undamped};
pub use error::ModelError;
pub use fabric::{BendingRigidity, Fabric, MembraneModuli};
pub use membrane::{MembraneGuard, MembraneStVk};
pub use mesh::sheet;
pub use mesh::{Edge, Hinge, HingeQuality, NONE, RestTriangle, ShellMesh, Wing};
pub use terms::{
    BendingModel, BendingOptions, Term, attachment_term, bending_term, drag_term, hinge_rest,
    joint_term, lumped_masses, membrane_guard_term, membrane_term, patch_term, seam_term,
    trim_term, uncalibrated,
};
