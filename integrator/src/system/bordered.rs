use std::sync::Arc;

use selvedge_collision::ContactResponse;
use selvedge_energy::{Curvature, MassBatch};
use selvedge_linsolve::{
    BorderPattern, BorderedMatrix, Bsr, ExplicitOperator, LinearSolver, Pattern, Real,
};

use super::{Evaluation, Storage, StoredSystem, add_contacts};
use crate::assemble::{Assembler, Patterns, Values};
use crate::plan::check_stencils;
use crate::{AssemblyOptions, Ledger, PlanError, Term};

/// Points and scalars: a static matrix with slots found once, contacts kept
/// apart, and inertia that may couple unknowns.
pub type BorderedSystem<T> = StoredSystem<BorderedMatrix<T>>;

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
        check_stencils(points, owners, terms, mass)?;
        let of_terms = terms.iter().flat_map(|t| {
            let batch = t.batch.as_ref();
            (0..batch.len()).map(move |e| (batch.nodes(e), batch.node_dims()))
        });
        let of_mass = mass.into_iter();
        let of_mass = of_mass.flat_map(|m| (0..m.len()).map(move |e| (m.nodes(e), m.node_dims())));
        let groups: Vec<(&[u32], &[usize])> = of_terms.chain(of_mass).collect();
        let (mut nodes, mut ends) = (Vec::new(), vec![0]);
        for (group, dims) in &groups {
            let of_points = group.iter().zip(*dims).filter(|(_, dim)| **dim == 3);
            nodes.extend(of_points.map(|(node, _)| *node));
            ends.push(nodes.len());
        }
        let of_points = ends.windows(2).map(|w| &nodes[w[0]..w[1]]);
        let pattern = Arc::new(Pattern::from_groups(points, of_points));
        let border = BorderPattern::from_groups(points, owners.to_vec(), groups.iter().copied());
        let patterns = Patterns {
            points: &pattern,
            border: &border,
        };
        let assembler = Assembler::mixed(terms, mass, (points, owners), Some(patterns), options)?;
        let matrix = BorderedMatrix::zeros(Bsr::zeros(pattern), Arc::new(border));
        Ok(Self::of(assembler, matrix, solver))
    }
}

impl<T: Real> Storage for BorderedMatrix<T> {
    type Scalar = T;
    const NAME: &'static str = "bordered";
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
        let border = Arc::clone(self.border());
        let points = Arc::clone(self.points.stat.pattern());
        let patterns = Patterns {
            points: &points,
            border: &border,
        };
        if let Some(mass) = &e.mass {
            let values = (patterns, values(self));
            assembler.add_mass(mass, impulse, values, ledger);
        } else {
            for (i, &m) in e.masses.iter().enumerate() {
                self.points.stat.add_diagonal(i, m);
            }
            let scalars = values(self).scalars;
            for (s, &m) in e.scalar_masses.iter().enumerate() {
                if let Some(slot) = border.scalar_slot(s as u32, s as u32) {
                    scalars[slot as usize] += T::from_f64(m);
                }
            }
        }
        assembler.add_mixed(
            e,
            curvature,
            (patterns, values(self)),
            impulse,
            energies,
            ledger,
        );
        let dt2 = e.at.dt * e.at.dt;
        ledger.time("assembly: contact", || {
            add_contacts(&mut self.points, contacts, dt2);
        });
    }

    fn operator(&self) -> &dyn ExplicitOperator<T> {
        self
    }

    fn heap_bytes(&self) -> usize {
        self.heap_bytes()
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
