//! What holds cloth: air, seams, attachments, trims.

mod drag;
mod rotation;
mod shared;
mod spring;
mod target;
mod trim;

pub use drag::PointDrag;
pub use shared::{SharedScalar, SharedTargets};
pub use spring::{SeamSpring, WeightedSpring};
pub use target::Attachment;
pub use trim::{BodyInertia, RigidTrims, TrimBody, TrimThread};
