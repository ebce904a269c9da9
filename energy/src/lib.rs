//! The contract between energies and everything that consumes them.
//!
//! Unknowns are *points* (3-vectors) followed by *scalars* (sliding arc
//! lengths, twists) in one flat slice. An energy is the mathematics of one
//! *stencil*, a handful of unknowns that it couples; [`Batch`] turns a
//! homogeneous array of stencils into an object-safe [`EnergyBatch`] that
//! assemblers consume range by range.
//!
//! The crate knows nothing of cloth, matrices or time stepping.
//!
//! ```
//! use selvedge_energy::{Batch, Curvature, DofLayout, EnergyBatch, EvalPoint, StencilEnergy};
//!
//! /// `E = k |x_1 - x_0|² / 2`
//! struct Spring { stiffness: f64, ends: Vec<[u32; 2]> }
//!
//! impl StencilEnergy<2, 6> for Spring {
//!     const NODE_DIMS: [usize; 2] = [3, 3];
//!     fn stencils(&self) -> &[[u32; 2]] { &self.ends }
//!     fn value(&self, _: usize, q: &[f64; 6], _: &EvalPoint<'_>) -> f64 {
//!         (0..3).map(|i| (q[3 + i] - q[i]).powi(2)).sum::<f64>() * 0.5 * self.stiffness
//!     }
//!     fn gradient(&self, e: usize, q: &[f64; 6], at: &EvalPoint<'_>, g: &mut [f64; 6]) -> f64 {
//!         for i in 0..3 {
//!             g[3 + i] = self.stiffness * (q[3 + i] - q[i]);
//!             g[i] = -g[3 + i];
//!         }
//!         self.value(e, q, at)
//!     }
//!     fn hessian(
//!         &self, e: usize, q: &[f64; 6], at: &EvalPoint<'_>, _: Curvature,
//!         g: &mut [f64; 6], h: &mut [[f64; 6]; 6],
//!     ) -> f64 {
//!         for i in 0..6 {
//!             for j in 0..6 {
//!                 let sign = if i == j { 1.0 } else if i % 3 == j % 3 { -1.0 } else { 0.0 };
//!                 h[i][j] = sign * self.stiffness;
//!             }
//!         }
//!         self.gradient(e, q, at, g)
//!     }
//! }
//!
//! let batch = Batch::new("spring", Spring { stiffness: 2.0, ends: vec![[0, 1]] });
//! let q = [0.0, 0.0, 0.0, 3.0, 0.0, 0.0];
//! let at = EvalPoint { layout: DofLayout::points(2), q: &q, q_start: &q, dt: 1e-3 };
//! assert_eq!(batch.value(&at, 0..1), 9.0);
//! ```

mod batch;
mod check;
mod error;
mod layout;
mod mass;
mod measure;
mod stencil;

pub use batch::{Batch, EnergyBatch};
pub use check::{DerivativeReport, check_derivatives, check_projection, check_rigid_motion};
pub use error::EnergyError;
pub use layout::{DofLayout, EvalPoint};
pub use mass::{MassBatch, RatePoint};
pub use measure::{Density, Measure, Strained};
pub use stencil::{Curvature, StencilEnergy};
