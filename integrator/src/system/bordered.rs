use std::sync::Arc;

use selvedge_collision::ContactResponse;
use selvedge_energy::{Curvature, MassBatch};
use selvedge_linsolve::{
    BlockFilter, BorderPattern, BorderedMatrix, Bsr, Filter, LinearSolver, LinsolveError, NoFilter,
    Pattern, Real, SolveReport,
};

use super::{Evaluation, NewtonSystem, add_contacts, solve_from_zero};
use crate::assemble::{Assembler, Patterns, Values};
use crate::{AssemblyOptions, Ledger, PlanError, Term};

/// Points and scalars: a static matrix with slots found once, contacts kept
/// apart, and inertia that may couple unknowns.
pub struct BorderedSystem<T: Real> {
    assembler: Assembler,
    matrix: BorderedMatrix<T>,
    solver: Box<dyn LinearSolver<T>>,
}

impl<T: Real> BorderedSystem<T> {
    /// Builds the patterns from the stencils of terms and inertia; `owners`
    /// holds the point of every scalar.
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
        let mut of_points: Vec<u32> = Vec::new();
        let mut ends = vec![0];
        let mut groups: Vec<(&[u32], &[usize])> = Vec::new();
        let mut add = |name: &str, e: usize, nodes, dims| {
            for (&node, &dim) in std::iter::zip::<&[u32], &[usize]>(nodes, dims) {
                if node as usize >= counts(dim) {
                    return Err(PlanError::Node {
                        term: name.into(),
                        stencil: e,
                        node,
                        count: counts(dim),
                    });
                }
                if dim == 3 {
                    of_points.push(node);
                }
            }
            ends.push(of_points.len());
            groups.push((nodes, dims));
            Ok(())
        };
        for term in terms {
            let batch = term.batch.as_ref();
            for e in 0..batch.len() {
                add(batch.name(), e, batch.nodes(e), batch.node_dims())?;
            }
        }
        if let Some(mass) = mass {
            for e in 0..mass.len() {
                add(mass.name(), e, mass.nodes(e), mass.node_dims())?;
            }
        }
        let of_points = ends.windows(2).map(|w| &of_points[w[0]..w[1]]);
        let pattern = Arc::new(Pattern::from_groups(points, of_points));
        let border = BorderPattern::from_groups(points, owners.to_vec(), groups.iter().copied());
        let patterns = Patterns {
            points: &pattern,
            border: &border,
        };
        let assembler = Assembler::mixed(terms, mass, (points, owners), Some(patterns), options)?;
        let matrix = BorderedMatrix::zeros(Bsr::zeros(pattern), Arc::new(border));
        Ok(Self {
            assembler,
            matrix,
            solver,
        })
    }

    /// The matrix as last assembled.
    pub fn matrix(&self) -> &BorderedMatrix<T> {
        &self.matrix
    }
}

impl<T: Real> NewtonSystem for BorderedSystem<T>
where
    BlockFilter: Filter<T>,
    NoFilter: Filter<T>,
{
    fn name(&self) -> String {
        format!("bordered {}, {}", T::NAME, self.solver.name())
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
        let border = Arc::clone(matrix.border());
        let points = Arc::clone(matrix.points.stat.pattern());
        let patterns = Patterns {
            points: &points,
            border: &border,
        };
        if let Some(mass) = &e.mass {
            let values = Some((patterns, values(matrix)));
            self.assembler.add_mass(mass, impulse, values, ledger);
        } else {
            for (i, &m) in e.masses.iter().enumerate() {
                matrix.points.stat.add_diagonal(i, m);
            }
            let scalars = values(matrix).scalars;
            for (s, &m) in e.scalar_masses.iter().enumerate() {
                if let Some(slot) = border.scalar_slot(s as u32, s as u32) {
                    scalars[slot as usize] += T::from_f64(m);
                }
            }
        }
        self.assembler.add_mixed(
            e.terms,
            &e.at,
            curvature,
            e.stiffness,
            (patterns, values(matrix)),
            impulse,
            energies,
            ledger,
        );
        let dt2 = e.at.dt * e.at.dt;
        ledger.time("assembly: contact", || {
            add_contacts(&mut matrix.points, contacts, dt2);
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
        self.memory().iter().map(|(_, bytes)| bytes).sum()
    }

    fn memory(&self) -> Vec<(&'static str, usize)> {
        vec![
            ("slots and chunks", self.assembler.heap_bytes()),
            ("matrix", self.matrix.heap_bytes()),
            ("linear solver", self.solver.heap_bytes()),
        ]
    }
}

fn values<T: Real>(matrix: &mut BorderedMatrix<T>) -> Values<'_, T> {
    let (blocks, coupling, scalars) = matrix.values_mut();
    Values {
        blocks,
        coupling,
        scalars,
    }
}
