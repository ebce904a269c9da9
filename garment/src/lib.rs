//! Sewing patterns to panels, triangulation, seams and placement on a body.
//!
//! ```text
//! JSON ── Pattern ── examine            mistakes, with names and places
//!            └─ GarmentMesh::build      panels filled, seams welded
//!                  ├─ preassemble       closed around a body, by geometry alone
//!                  └─ to_shell_mesh     for the shell model
//! ```
//!
//! Lengths are metres, y is up. Nothing here simulates: the positions that
//! come out are a start for a solver.

pub mod assemble;
pub mod mesh;
pub mod pattern;
pub mod place;

mod error;
mod math;
mod shell;
mod union_find;

pub use assemble::{AssembleReport, AssembleSettings, preassemble, prolong, untangle};
pub use error::GarmentError;
pub use mesh::{GarmentMesh, MeshSettings, MeshStats, SeamMode, SpringSeam};
pub use pattern::{Finding, Pattern, Severity};
pub use place::{inside_fraction, push_out};
