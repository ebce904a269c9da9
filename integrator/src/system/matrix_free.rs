use selvedge_collision::ContactResponse;
use selvedge_energy::{Curvature, MassBatch};
use selvedge_linsolve::{
    BlockFilter, ElementGroup, ElementMatrix, Filter, LinearSolver, LinsolveError, NoFilter, Real,
    SolveReport,
};

use super::{Evaluation, NewtonSystem, add_contacts, solve_from_zero};
use crate::assemble::Assembler;
use crate::{AssemblyOptions, Ledger, PlanError, Term};

/// Points, with scalars or without: second derivatives stay stencil by stencil,
/// and products take each stencil alone. For preconditioners that need nothing
/// but products and nodes' blocks.
pub struct MatrixFreeSystem<T: Real> {
    assembler: Assembler,
    matrix: ElementMatrix<T>,
    solver: Box<dyn LinearSolver<T>>,
}

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
        if !owners.is_sorted() || owners.last().is_some_and(|&p| p as usize >= points) {
            return Err(PlanError::Owners { points });
        }
        let counts = |dim: usize| if dim == 3 { points } else { owners.len() };
        let check = |name: &str, e: usize, nodes: &[u32], dims: &[usize]| {
            let mut both = nodes.iter().zip(dims);
            match both.find(|&(&node, &dim)| node as usize >= counts(dim)) {
                None => Ok(()),
                Some((&node, &dim)) => Err(PlanError::Node {
                    term: name.into(),
                    stencil: e,
                    node,
                    count: counts(dim),
                }),
            }
        };
        let mut groups: Vec<(&[usize], Vec<u32>)> = Vec::new();
        for term in terms {
            let batch = term.batch.as_ref();
            let mut nodes = Vec::new();
            for e in 0..batch.len() {
                check(batch.name(), e, batch.nodes(e), batch.node_dims())?;
                nodes.extend_from_slice(batch.nodes(e));
            }
            groups.push((batch.node_dims(), nodes));
        }
        if let Some(mass) = mass {
            let mut nodes = Vec::new();
            for e in 0..mass.len() {
                check(mass.name(), e, mass.nodes(e), mass.node_dims())?;
                nodes.extend_from_slice(mass.nodes(e));
            }
            groups.push((mass.node_dims(), nodes));
        }
        let assembler = Assembler::mixed(terms, mass, (points, owners), None, options)?;
        let groups: Vec<ElementGroup<'_>> = groups
            .iter()
            .map(|(dims, nodes)| ElementGroup { dims, nodes })
            .collect();
        let matrix = ElementMatrix::zeros(points, owners, &groups, options.chunk);
        Ok(Self {
            assembler,
            matrix,
            solver,
        })
    }

    /// The matrix as last evaluated.
    pub fn matrix(&self) -> &ElementMatrix<T> {
        &self.matrix
    }
}

impl<T: Real> NewtonSystem for MatrixFreeSystem<T>
where
    BlockFilter: Filter<T>,
    NoFilter: Filter<T>,
{
    fn name(&self) -> String {
        format!("matrix-free {}, {}", T::NAME, self.solver.name())
    }

    fn couples_masses(&self) -> bool {
        true
    }

    fn add_impulse(
        &mut self,
        e: &Evaluation<'_>,
        impulse: &mut [f64],
        energies: &mut [f64],
        ledger: &mut Ledger,
    ) {
        if let Some(mass) = &e.mass {
            self.assembler.add_mass::<T>(mass, impulse, None, ledger);
        }
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
        let matrix = &mut self.matrix;
        ledger.time("assembly: zero", || matrix.fill_zero());
        if let Some(mass) = &e.mass {
            self.assembler
                .add_mass_elements(mass, impulse, matrix, ledger);
        } else {
            for (i, &m) in e.masses.iter().enumerate() {
                matrix.own.stat.add_diagonal(i, m);
            }
            for (out, &m) in matrix.own_scalars.iter_mut().zip(e.scalar_masses) {
                *out = T::from_f64(m);
            }
        }
        self.assembler.add_elements(
            e.terms,
            &e.at,
            curvature,
            e.stiffness,
            matrix,
            impulse,
            energies,
            ledger,
        );
        let dt2 = e.at.dt * e.at.dt;
        ledger.time("assembly: contact", || {
            add_contacts(&mut matrix.own, contacts, dt2);
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
        self.assembler.heap_bytes() + self.matrix.heap_bytes() + self.solver.heap_bytes()
    }
}
