//! Broad and narrow phase, bodies, contact and friction potentials.

mod aabb;
pub mod body;
mod error;

pub use aabb::Aabb;
pub use body::{Body, SurfaceSample};
pub use error::CollisionError;
