//! Block sparse operators, filters, Krylov and direct solvers, preconditioners.
//!
//! Unknowns are *points* (3-vectors) followed by scalars. A matrix is a
//! [`Bsr`] of 3×3 blocks on a fixed [`Pattern`], optionally with
//! [`WeightedBlocks`] that change their pattern from solve to solve
//! ([`DualMatrix`]) and scalars at its border ([`BorderedMatrix`]); an
//! [`ElementMatrix`] is never put together. Solvers see any [`ExplicitOperator`], a [`Filter`] with
//! the motions that constraints allow, and `f64` vectors; inside they work in
//! `f32` or `f64` ([`Real`]).
//!
//! Every result is the same to the bit for any number of threads.
//!
//! ```
//! use selvedge_linsolve::{BlockFilter, Bsr, LinearSolver, Mpcg, Pattern};
//! use std::sync::Arc;
//!
//! // three masses of 1 kg in a row, springs of 1 N/m along x between them
//! let springs: [[u32; 2]; 2] = [[0, 1], [1, 2]];
//! let pattern = Arc::new(Pattern::from_groups(3, springs.iter().map(|s| &s[..])));
//! let mut a = Bsr::<f64>::zeros(Arc::clone(&pattern));
//! for i in 0..3 {
//!     a.add_diagonal(i, 1.0);
//! }
//! let k = [[1.0, 0.0, 0.0], [0.0; 3], [0.0; 3]];
//! for [i, j] in springs {
//!     for (r, c, sign) in [(i, i, 1.0), (j, j, 1.0), (i, j, -1.0), (j, i, -1.0)] {
//!         let slot = pattern.slot(r, c).expect("springs made the pattern");
//!         a.add_block(slot as usize, &k, sign);
//!     }
//! }
//! let mut filter = BlockFilter::new();
//! filter.fix(0, [0.0; 3])?;
//! let (b, mut x) = ([0., 0., 0., 0., 0., 0., 1., 0., 0.], [0.0; 9]);
//! let report = Mpcg::with_tolerance(1e-10).solve(&a, &b, &filter, &mut x)?;
//! assert!(report.converged());
//! assert!((x[3] - 0.2).abs() < 1e-9 && (x[6] - 0.6).abs() < 1e-9);
//! # Ok::<(), selvedge_linsolve::LinsolveError>(())
//! ```

mod border;
mod bsr;
mod colouring;
mod direct;
mod dual;
mod elements;
mod error;
mod filter;
mod layout;
mod mirror;
mod mpcg;
mod names;
mod operator;
mod ordering;
mod pattern;
mod preconditioner;
mod real;
mod reassembled;
mod refined;
mod shared;
mod small;
mod solver;
mod vector;
mod weighted;

pub use border::{BorderPattern, BorderedMatrix};
pub use bsr::Bsr;
pub use colouring::{ChunkColouring, ColourOrder, Colouring, colour_chunks, colour_stencils};
pub use direct::Direct;
pub use dual::DualMatrix;
pub use elements::{ElementGroup, ElementMatrix, ElementValues};
pub use error::LinsolveError;
pub use filter::{BlockFilter, Filter, NoFilter};
pub use layout::BlockLayout;
pub use mirror::Mirror;
pub use mpcg::{Mpcg, MpcgSettings, StopNorm};
pub use names::{PRECONDITIONERS, SOLVERS, preconditioner_by_name, rescued_cg, solver_by_name};
pub use operator::{ExplicitOperator, LinearOperator};
pub use ordering::{Permutation, reverse_cuthill_mckee};
pub use pattern::Pattern;
pub use preconditioner::{
    BlockIc, BlockJacobi, ByStiffness, Chebyshev, Diagonal, Multigrid, NoPreconditioner, NodeIc,
    NodeJacobi, Pointwise, Preconditioner, ScalarIc,
};
pub use real::Real;
pub use reassembled::ReassembledMatrix;
pub use refined::Refined;
pub use shared::SharedValues;
pub use solver::{LinearSolver, SolveReport, SolveStatus};
pub use vector::{Sums, axpy, dot, norm, xpay};
pub use weighted::WeightedBlocks;
