//! Persistent contacts between yarns: how hard they press, and their friction.

mod stack;

pub use stack::{StackRule, stack_compression};

/// Vectors of the kernels.
type V = nalgebra::Vector3<f64>;
