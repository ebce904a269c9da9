use selvedge_collision::ContactResponse;
use selvedge_energy::{Curvature, MassBatch};
use selvedge_linsolve::{ElementGroup, ElementMatrix, ExplicitOperator, LinearSolver, Real};

use super::{Evaluation, Storage, StoredSystem, add_contacts};
use crate::assemble::Assembler;
use crate::plan::check_stencils;
use crate::{AssemblyOptions, Ledger, PlanError, Term};

/// Points, with scalars or without: second derivatives stay stencil by stencil,
/// and products take each stencil alone. For preconditioners that need nothing
/// but products and nodes' blocks.
pub type MatrixFreeSystem<T> = StoredSystem<ElementMatrix<T>>;

impl<T: Real> MatrixFreeSystem<T> {
    /// Takes the stencils of terms and inertia; `owners` holds the point of
    /// every scalar.
    ///
    /// # Errors
    /// [`PlanError`] for an option out of range, owners that descend or do not
    /// exist, or a stencil that names a node that does not.
    pub fn new(
        points: usize,
        owners: &[u32],
        terms: &[Term],
        mass: Option<&dyn MassBatch>,
        options: AssemblyOptions,
        solver: Box<dyn LinearSolver<T>>,
    ) -> Result<Self, PlanError> {
        check_stencils(points, owners, terms, mass)?;
        let assembler = Assembler::mixed(terms, mass, (points, owners), None, options)?;
        let of_terms = terms.iter().map(|t| {
            let batch = t.batch.as_ref();
            let nodes = (0..batch.len()).flat_map(|e| batch.nodes(e));
            (batch.node_dims(), nodes.copied().collect())
        });
        let of_mass = mass.map(|mass| {
            let nodes = (0..mass.len()).flat_map(|e| mass.nodes(e));
            (mass.node_dims(), nodes.copied().collect())
        });
        let groups: Vec<(&[usize], Vec<u32>)> = of_terms.chain(of_mass).collect();
        let groups: Vec<ElementGroup<'_>> = groups
            .iter()
            .map(|(dims, nodes)| ElementGroup { dims, nodes })
            .collect();
        let matrix = ElementMatrix::zeros(points, owners, &groups, options.chunk);
        Ok(Self::of(assembler, matrix, solver))
    }
}

impl<T: Real> Storage for ElementMatrix<T> {
    type Scalar = T;
    const NAME: &'static str = "matrix-free";
    const COUPLES_MASSES: bool = true;

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
        ledger.time("assembly: zero", || self.fill_zero());
        if let Some(mass) = &e.mass {
            assembler.add_mass_elements(mass, impulse, self, ledger);
        } else {
            for (i, &m) in e.masses.iter().enumerate() {
                self.own.stat.add_diagonal(i, m);
            }
            for (out, &m) in self.own_scalars.iter_mut().zip(e.scalar_masses) {
                *out = T::from_f64(m);
            }
        }
        assembler.add_elements(e, curvature, self, impulse, energies, ledger);
        let dt2 = e.at.dt * e.at.dt;
        ledger.time("assembly: contact", || {
            add_contacts(&mut self.own, contacts, dt2);
        });
    }

    fn operator(&self) -> &dyn ExplicitOperator<T> {
        self
    }

    fn heap_bytes(&self) -> usize {
        self.heap_bytes()
    }
}
