use selvedge_collision::ContactResponse;
use selvedge_energy::Curvature;
use selvedge_linsolve::{
    BlockFilter, ExplicitOperator, Filter, LinearSolver, LinsolveError, NoFilter, Real, SolveReport,
};

use super::{Evaluation, NewtonSystem};
use crate::Ledger;
use crate::assemble::Assembler;

/// A matrix as the assembler writes into it.
pub trait Storage: Send {
    /// Precision of the entries.
    type Scalar: Real;

    /// Name of the storage in reports.
    const NAME: &'static str;

    /// Whether inertia may couple unknowns.
    const COUPLES_MASSES: bool;

    /// Assembles the matrix and adds the impulse, as
    /// [`NewtonSystem::assemble`] says.
    #[allow(clippy::too_many_arguments)]
    fn assemble(
        &mut self,
        assembler: &mut Assembler,
        e: &Evaluation<'_>,
        curvature: Curvature,
        contacts: &ContactResponse,
        impulse: &mut [f64],
        energies: &mut [f64],
        ledger: &mut Ledger,
    );

    /// The matrix as linear solvers see it.
    fn operator(&self) -> &dyn ExplicitOperator<Self::Scalar>;

    /// Heap memory held [bytes].
    fn heap_bytes(&self) -> usize;
}

/// Newton's matrix stored as `M`, with its assembler and its linear solver.
pub struct StoredSystem<M: Storage> {
    assembler: Assembler,
    matrix: M,
    solver: Box<dyn LinearSolver<M::Scalar>>,
    /// Operand and product of [`NewtonSystem::subtract_product`].
    operand: Vec<M::Scalar>,
    product: Vec<M::Scalar>,
}

impl<M: Storage> StoredSystem<M> {
    pub(super) fn of(
        assembler: Assembler,
        matrix: M,
        solver: Box<dyn LinearSolver<M::Scalar>>,
    ) -> Self {
        Self {
            assembler,
            matrix,
            solver,
            operand: Vec::new(),
            product: Vec::new(),
        }
    }
}

impl<M: Storage> NewtonSystem for StoredSystem<M>
where
    BlockFilter: Filter<M::Scalar>,
    NoFilter: Filter<M::Scalar>,
{
    fn name(&self) -> String {
        format!("{} {}, {}", M::NAME, M::Scalar::NAME, self.solver.name())
    }

    fn couples_masses(&self) -> bool {
        M::COUPLES_MASSES
    }

    fn add_impulse(
        &mut self,
        e: &Evaluation<'_>,
        impulse: &mut [f64],
        energies: &mut [f64],
        ledger: &mut Ledger,
    ) {
        if let Some(mass) = &e.mass {
            self.assembler.add_mass_impulse(mass, impulse, ledger);
        }
        self.assembler.add_impulse(e, impulse, energies, ledger);
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
        let assembler = &mut self.assembler;
        self.matrix
            .assemble(assembler, e, curvature, contacts, impulse, energies, ledger);
    }

    fn subtract_product(&mut self, x: &[f64], b: &mut [f64]) {
        self.operand.clear();
        self.operand
            .extend(x.iter().map(|&x| M::Scalar::from_f64(x)));
        self.product.resize(b.len(), M::Scalar::ZERO);
        let a = self.matrix.operator();
        a.apply(&self.operand, &mut self.product);
        for (b, p) in b.iter_mut().zip(&self.product) {
            *b -= p.to_f64();
        }
    }

    fn solve(
        &mut self,
        b: &[f64],
        filter: Option<&BlockFilter>,
        x: &mut [f64],
    ) -> Result<SolveReport, LinsolveError> {
        x.fill(0.0);
        let a = self.matrix.operator();
        match filter {
            Some(filter) => self.solver.solve(a, b, filter, x),
            None => self.solver.solve(a, b, &NoFilter, x),
        }
    }

    fn set_tolerance(&mut self, relative: f64) {
        self.solver.set_tolerance(relative);
    }

    fn heap_bytes(&self) -> usize {
        self.memory().iter().map(|(_, bytes)| bytes).sum()
    }

    fn memory(&self) -> Vec<(&'static str, usize)> {
        vec![
            ("slots and chunks", self.assembler.heap_bytes()),
            ("matrix", self.matrix.heap_bytes()),
            ("linear solver", self.solver.heap_bytes()),
            (
                "vectors",
                size_of_val(self.operand.as_slice()) + size_of_val(self.product.as_slice()),
            ),
        ]
    }
}
