//! Contact of cloth with itself and with bodies: broad and narrow phase,
//! contact and friction potentials, bodies.
//!
//! Layers, each replaceable on its own:
//!
//! | question | trait | implementations |
//! |---|---|---|
//! | which boxes overlap | [`BroadPhase`] | [`BvhParry`], [`HashGrid`], [`BruteForce`] |
//! | which primitives may touch | [`CollisionBackend`] | [`ProximityBackend`] |
//! | how hard do they repel | [`ContactPotential`] | [`ContactQuadratic`] |
//! | how do they rub | [`Friction`] | [`FrictionAnchored`], [`FrictionLagged`] |
//! | where is an obstacle | [`Body`] | see [`body`] |
//! | what does the solver get | [`ContactSource`] | [`SelfContact`], [`BodyContact`], [`BodyFaces`] |
//!
//! A contact is one gap vector `Σ wᵢ xᵢ` of four nodes; forces and 3 × 3
//! curvatures act on it, so that a contact is some 20 numbers and not a
//! 12 × 12 matrix. The crate knows no matrices and no time integration.
//!
//! ```
//! use selvedge_collision::{CollisionMesh, ContactResponse, ContactSource, SelfContact, StepStart};
//! use selvedge_energy::{DofLayout, EvalPoint};
//!
//! // A vertex half a millimetre above the middle of a triangle.
//! let q = [0.0, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 0.1, 0.0,
//!          0.03, 0.03, 5e-4, 0.13, 0.03, 0.1, 0.03, 0.13, 0.1];
//! let mesh = CollisionMesh::from_positions(&q, vec![[0, 1, 2], [3, 4, 5]], &[], 1e-3)?;
//! let mut contact = SelfContact::new(mesh);
//! contact.detect(&StepStart { q_start: &q, q_predicted: &q, dt: 1e-3, time: 0.0 })?;
//! let at = EvalPoint { layout: DofLayout::points(6), q: &q, q_start: &q, dt: 1e-3 };
//! let mut out = ContactResponse::default();
//! let energy = contact.evaluate(&at, true, &mut out)?;
//! assert!((energy - 0.5 * 100.0 * 5e-4_f64.powi(2)).abs() < 1e-15);
//! assert_eq!(out.nodes, [[3, 0, 1, 2]]);
//! # Ok::<(), selvedge_collision::CollisionError>(())
//! ```

// `!(a < b)` also catches NaN, which is what it is for.
#![allow(clippy::neg_cmp_op_on_partial_ord)]
// `to_body` and `from_body` are a pair of maps, not conversions of `self`.
#![allow(clippy::wrong_self_convention)]

mod aabb;
mod backend;
pub mod body;
mod broad_phase;
mod contact_set;
mod error;
mod friction;
mod intersection;
mod mesh;
pub mod narrow;
mod potential;
mod proximity;
mod source;
pub mod testing;
mod untangle;
mod vec3;

pub use aabb::Aabb;
pub use backend::{Candidates, CollisionBackend};
pub use body::{Body, SurfaceSample};
pub use broad_phase::{BroadPhase, BruteForce, BvhParry, HashGrid};
pub use contact_set::{ContactResponse, ContactSet};
pub use error::CollisionError;
pub use friction::{
    AnchorResponse, AnchorState, Friction, FrictionAnchored, FrictionLagged, LaggedResponse,
    pair_friction,
};
pub use intersection::{Intersection, self_intersections};
pub use mesh::{CollisionMesh, Joined, Segment};
pub use potential::{ContactPotential, ContactQuadratic, ContactStiffness, Repulsion};
pub use proximity::ProximityBackend;
pub use source::{
    AgainstBodies, BodyContact, BodyContactSettings, BodyElement, BodyFaces, ContactSource,
    SelfContact, SelfContactSettings, StepStart,
};
pub use untangle::Untangle;
