use std::sync::Arc;

use selvedge_collision::ContactResponse;
use selvedge_energy::Curvature;
use selvedge_linsolve::{
    BlockFilter, Bsr, DualMatrix, Filter, LinearSolver, LinsolveError, Mirror, NoFilter, Pattern,
    Real, SolveReport,
};

use super::{Evaluation, NewtonSystem, add_contacts, solve_from_zero};
use crate::assemble::Assembler;
use crate::{AssemblyOptions, Ledger, PlanError, Term};

/// Static matrix with slots found once, and contacts kept apart
/// [Pizana2025, § 4.1].
pub struct DualSystem<T: Real> {
    assembler: Assembler,
    mirror: Mirror,
    matrix: DualMatrix<T>,
    solver: Box<dyn LinearSolver<T>>,
}

impl<T: Real> DualSystem<T> {
    /// Builds the static pattern from the terms' stencils.
    ///
    /// # Errors
    /// [`PlanError`] for a term with scalar unknowns or a bad option.
    pub fn new(
        points: usize,
        terms: &[Term],
        options: AssemblyOptions,
        solver: Box<dyn LinearSolver<T>>,
    ) -> Result<Self, PlanError> {
        let groups = terms.iter().flat_map(|t| {
            let batch = t.batch.as_ref();
            (0..batch.len()).map(move |e| batch.nodes(e))
        });
        let pattern = Arc::new(Pattern::from_groups(points, groups));
        let assembler = Assembler::new(points, terms, Some(&pattern), options)?;
        let mirror = Mirror::new(&pattern);
        let matrix = DualMatrix::new(Bsr::zeros(pattern));
        Ok(Self {
            assembler,
            mirror,
            matrix,
            solver,
        })
    }

    /// The matrix as last assembled.
    pub fn matrix(&self) -> &DualMatrix<T> {
        &self.matrix
    }
}

impl<T: Real> NewtonSystem for DualSystem<T>
where
    BlockFilter: Filter<T>,
    NoFilter: Filter<T>,
{
    fn name(&self) -> String {
        format!("dual {}, {}", T::NAME, self.solver.name())
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
        let stat = &mut self.matrix.stat;
        ledger.time("assembly: zero", || stat.fill_zero());
        let pattern = stat.pattern().clone();
        self.assembler.add_matrix(
            e.terms,
            &e.at,
            curvature,
            e.stiffness,
            (&pattern, stat.values_mut()),
            impulse,
            energies,
            ledger,
        );
        let Self { matrix, mirror, .. } = self;
        ledger.time("assembly: mirror", || matrix.stat.mirror(mirror));
        let dt2 = e.at.dt * e.at.dt;
        ledger.time("assembly: contact", || {
            for (i, &m) in e.masses.iter().enumerate() {
                self.matrix.stat.add_diagonal(i, m);
            }
            add_contacts(&mut self.matrix, contacts, dt2);
        });
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
        self.assembler.heap_bytes()
            + self.mirror.heap_bytes()
            + self.matrix.heap_bytes()
            + self.solver.heap_bytes()
    }
}
