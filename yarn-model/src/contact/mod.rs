//! Persistent contacts between yarns: how hard they press, and their friction.

mod compression;
mod friction;
mod normal;
mod spring;
mod stack;
mod wraps;

pub use compression::{Compression, CompressionSettings, TensionRule};
pub use friction::{FrictionSettings, SlidingFriction};
pub use normal::plane_normal;
pub use spring::StickRule;
pub use stack::{StackRule, stack_compression};
