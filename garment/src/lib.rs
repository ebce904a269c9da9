//! Sewing patterns to panels, triangulation, seams and placement on a body.

pub mod mesh;
pub mod pattern;

mod error;
mod math;
mod union_find;

pub use error::GarmentError;
pub use mesh::{GarmentMesh, MeshSettings, MeshStats, SeamMode, SpringSeam};
pub use pattern::Pattern;
