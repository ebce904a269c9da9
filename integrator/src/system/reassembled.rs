use selvedge_collision::ContactResponse;
use selvedge_energy::{Curvature, EnergyBatch};
use selvedge_linsolve::{ExplicitOperator, LinearSolver, Real, ReassembledMatrix};

use super::{Evaluation, Storage, StoredSystem};
use crate::assemble::Assembler;
use crate::{AssemblyOptions, Ledger, PlanError, Term};

/// Everything gathered as triplets and compressed anew in every iteration: the
/// baseline that [`DualSystem`](super::DualSystem) is measured against.
pub type ReassembledSystem<T> = StoredSystem<ReassembledMatrix<T>>;

impl<T: Real> ReassembledSystem<T> {
    /// Prepares the evaluation of the terms; no pattern is kept.
    ///
    /// # Errors
    /// [`PlanError`] for a term with scalar unknowns or a bad option.
    pub fn new(
        points: usize,
        terms: &[Term],
        options: AssemblyOptions,
        solver: Box<dyn LinearSolver<T>>,
    ) -> Result<Self, PlanError> {
        let assembler = Assembler::new(points, terms, None, options)?;
        Ok(Self::of(assembler, ReassembledMatrix::new(points), solver))
    }
}

impl<T: Real> Storage for ReassembledMatrix<T> {
    type Scalar = T;
    const NAME: &'static str = "reassembled";
    const COUPLES_MASSES: bool = false;

    fn assemble(
        &mut self,
        assembler: &mut Assembler,
        e: &Evaluation<'_>,
        curvature: Curvature,
        contacts: &ContactResponse,
        impulse: &mut [f64],
        energies: &mut [f64],
        ledger: &mut Ledger,
    ) {
        assembler.add_impulse(e, impulse, energies, ledger);
        self.clear();
        for (i, &m) in e.masses.iter().enumerate() {
            let block = [[m, 0.0, 0.0], [0.0, m, 0.0], [0.0, 0.0, m]];
            self.push_block(i, i, &block);
        }
        let dt2 = e.at.dt * e.at.dt;
        for term in e.terms {
            let factor = if term.relaxed { e.stiffness } else { 1.0 };
            let batch = term.batch.as_ref();
            let name = format!("assembly: {}", batch.name());
            ledger.time(&name, || push_term(batch, e, curvature, dt2 * factor, self));
        }
        ledger.time("assembly: contact", || {
            for (&i, k) in contacts.body_nodes.iter().zip(&contacts.body_curvature) {
                self.push_block(i as usize, i as usize, &scaled(k, dt2));
            }
            let all = contacts
                .nodes
                .iter()
                .zip(&contacts.weights)
                .zip(&contacts.curvature);
            for ((nodes, weights), k) in all {
                for a in 0..4 {
                    for b in 0..4 {
                        let w = weights[a] * weights[b];
                        if w != 0.0 {
                            self.push_block(
                                nodes[a] as usize,
                                nodes[b] as usize,
                                &scaled(k, dt2 * w),
                            );
                        }
                    }
                }
            }
        });
        ledger.time("assembly: compress", || self.compress());
    }

    fn operator(&self) -> &dyn ExplicitOperator<T> {
        self
    }

    fn heap_bytes(&self) -> usize {
        self.heap_bytes()
    }
}

fn push_term<T: Real>(
    batch: &dyn EnergyBatch,
    at: &Evaluation<'_>,
    curvature: Curvature,
    scale: f64,
    matrix: &mut ReassembledMatrix<T>,
) {
    let m = batch.local_dim();
    let (mut g, mut h) = (vec![0.0; m], vec![0.0; m * m]);
    for e in 0..batch.len() {
        batch.hessians(&at.at, curvature, e..e + 1, &mut g, &mut h);
        let nodes = batch.nodes(e);
        for (a, &i) in nodes.iter().enumerate() {
            for (b, &j) in nodes.iter().enumerate() {
                let block = std::array::from_fn(|r| {
                    std::array::from_fn(|c| scale * h[(3 * a + r) * m + 3 * b + c])
                });
                matrix.push_block(i as usize, j as usize, &block);
            }
        }
    }
}

fn scaled(k: &[[f64; 3]; 3], factor: f64) -> [[f64; 3]; 3] {
    k.map(|row| row.map(|x| factor * x))
}
