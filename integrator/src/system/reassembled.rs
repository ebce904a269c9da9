use selvedge_collision::ContactResponse;
use selvedge_energy::{Curvature, EnergyBatch};
use selvedge_linsolve::{
    BlockFilter, Filter, LinearSolver, LinsolveError, NoFilter, Real, ReassembledMatrix,
    SolveReport,
};

use super::{Evaluation, NewtonSystem, solve_from_zero};
use crate::assemble::Assembler;
use crate::{AssemblyOptions, Ledger, PlanError, Term};

/// Everything gathered as triplets and compressed anew in every iteration: the
/// baseline that [`DualSystem`](super::DualSystem) is measured against.
pub struct ReassembledSystem<T: Real> {
    assembler: Assembler,
    matrix: ReassembledMatrix<T>,
    solver: Box<dyn LinearSolver<T>>,
}

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
        Ok(Self {
            assembler,
            matrix: ReassembledMatrix::new(points),
            solver,
        })
    }
}

impl<T: Real> NewtonSystem for ReassembledSystem<T>
where
    BlockFilter: Filter<T>,
    NoFilter: Filter<T>,
{
    fn name(&self) -> String {
        format!("reassembled {}, {}", T::NAME, self.solver.name())
    }

    fn add_impulse(
        &mut self,
        e: &Evaluation<'_>,
        impulse: &mut [f64],
        energies: &mut [f64],
        ledger: &mut Ledger,
    ) {
        self.assembler
            .add_impulse(e.terms, &e.at, e.stiffness, impulse, energies, ledger);
    }

    fn assemble(
        &mut self,
        e: &Evaluation<'_>,
        curvature: Curvature,
        contacts: &ContactResponse,
        impulse: &mut [f64],
        energies: &mut [f64],
        ledger: &mut Ledger,
    ) {
        self.assembler
            .add_impulse(e.terms, &e.at, e.stiffness, impulse, energies, ledger);
        let matrix = &mut self.matrix;
        matrix.clear();
        for (i, &m) in e.masses.iter().enumerate() {
            let block = [[m, 0.0, 0.0], [0.0, m, 0.0], [0.0, 0.0, m]];
            matrix.push_block(i, i, &block);
        }
        let dt2 = e.at.dt * e.at.dt;
        for term in e.terms {
            let factor = if term.relaxed { e.stiffness } else { 1.0 };
            let batch = term.batch.as_ref();
            let name = format!("assembly: {}", batch.name());
            ledger.time(&name, || {
                push_term(batch, e, curvature, dt2 * factor, matrix)
            });
        }
        ledger.time("assembly: contact", || {
            for (&i, k) in contacts.body_nodes.iter().zip(&contacts.body_curvature) {
                matrix.push_block(i as usize, i as usize, &scaled(k, dt2));
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
                            matrix.push_block(
                                nodes[a] as usize,
                                nodes[b] as usize,
                                &scaled(k, dt2 * w),
                            );
                        }
                    }
                }
            }
        });
        ledger.time("assembly: compress", || matrix.compress());
    }

    fn solve(
        &mut self,
        b: &[f64],
        filter: Option<&BlockFilter>,
        x: &mut [f64],
    ) -> Result<SolveReport, LinsolveError> {
        solve_from_zero(self.solver.as_mut(), &self.matrix, b, filter, x)
    }

    fn set_tolerance(&mut self, relative: f64) {
        self.solver.set_tolerance(relative);
    }

    fn heap_bytes(&self) -> usize {
        self.assembler.heap_bytes() + self.matrix.heap_bytes() + self.solver.heap_bytes()
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
