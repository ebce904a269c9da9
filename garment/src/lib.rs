//! Sewing patterns to panels, triangulation, seams and placement on a body.

pub mod assemble;
pub mod mesh;
pub mod pattern;
pub mod place;

mod error;
mod math;
mod union_find;

pub use assemble::{AssembleReport, AssembleSettings, preassemble};
pub use error::GarmentError;
pub use mesh::{GarmentMesh, MeshSettings, MeshStats, SeamMode, SpringSeam};
pub use pattern::{Finding, Pattern, Severity};
pub use place::{inside_fraction, push_out};
