//! Newton's matrix: how it is stored, assembled and solved with.

mod bordered;
mod dual;
mod matrix_free;
mod reassembled;
mod stored;

pub use bordered::BorderedSystem;
pub use dual::DualSystem;
pub use matrix_free::MatrixFreeSystem;
pub use reassembled::ReassembledSystem;
use stored::Storage;
pub use stored::StoredSystem;

use selvedge_collision::ContactResponse;
use selvedge_energy::{Curvature, EvalPoint};
use selvedge_linsolve::{BlockFilter, DualMatrix, LinsolveError, Real, SolveReport};

use crate::assemble::MassEvaluation;
use crate::{Ledger, Term};

/// Where Newton's matrix or the forces are evaluated.
#[derive(Clone, Copy)]
pub struct Evaluation<'a> {
    /// Terms of the plan.
    pub terms: &'a [Term],
    /// Unknowns.
    pub at: EvalPoint<'a>,
    /// Factor on the stiffness of relaxed terms [1].
    pub stiffness: f64,
    /// Mass of each point [kg].
    pub masses: &'a [f64],
    /// Mass of each scalar [kg].
    pub scalar_masses: &'a [f64],
    /// Inertia that couples unknowns, in place of the masses.
    pub mass: Option<MassEvaluation<'a>>,
}

/// The matrix of one Newton iteration,
///
/// ```text
/// A = M + dt² (∂²E/∂q² + K_contact)     [kg]
/// ```
/// with all derivatives with respect to the unknowns at the end of the step, so
/// that damping counts too, together with its linear solver: the seam at which
/// storage, precision, preconditioner and solver are swapped.
pub trait NewtonSystem: Send {
    /// Storage, precision and solver in words, for reports.
    fn name(&self) -> String;

    /// Whether [`Evaluation::mass`] is taken into account; a plan with such
    /// inertia needs it.
    fn couples_masses(&self) -> bool {
        false
    }

    /// Adds `−dt ∂E/∂q` [N·s], and the part of inertia that couples unknowns,
    /// to `impulse` and writes each term's energy [J].
    fn add_impulse(
        &mut self,
        at: &Evaluation<'_>,
        impulse: &mut [f64],
        energies: &mut [f64],
        ledger: &mut Ledger,
    );

    /// As [`add_impulse`](Self::add_impulse), and assembles the matrix; the
    /// contacts' own impulse is not added.
    fn assemble(
        &mut self,
        at: &Evaluation<'_>,
        curvature: Curvature,
        contacts: &ContactResponse,
        impulse: &mut [f64],
        energies: &mut [f64],
        ledger: &mut Ledger,
    );

    /// Subtracts `A x` [N·s] of velocities `x` [m/s] from `b`.
    fn subtract_product(&mut self, x: &[f64], b: &mut [f64]);

    /// Solves `A x = b` within the filter's range, from zero.
    ///
    /// # Errors
    /// [`LinsolveError`] when the solver cannot give any iterate.
    fn solve(
        &mut self,
        b: &[f64],
        filter: Option<&BlockFilter>,
        x: &mut [f64],
    ) -> Result<SolveReport, LinsolveError>;

    /// Sets the relative tolerance of the linear solver.
    fn set_tolerance(&mut self, relative: f64);

    /// Heap memory held [bytes].
    fn heap_bytes(&self) -> usize;

    /// [`heap_bytes`](Self::heap_bytes) by owner.
    fn memory(&self) -> Vec<(&'static str, usize)> {
        vec![("linear system", self.heap_bytes())]
    }
}

/// Adds `dt2 ·` the curvature of contacts: with bodies to the points' blocks,
/// among points in place of the former ones.
fn add_contacts<T: Real>(matrix: &mut DualMatrix<T>, contacts: &ContactResponse, dt2: f64) {
    let stat = &mut matrix.stat;
    for (&i, k) in contacts.body_nodes.iter().zip(&contacts.body_curvature) {
        let slot = stat.pattern().diagonal_slot(i as usize) as usize;
        stat.add_block(slot, k, dt2);
    }
    matrix.dynamic.rebuild(
        stat.pattern().points(),
        &contacts.nodes,
        &contacts.weights,
        &contacts.curvature,
        dt2,
    );
}
