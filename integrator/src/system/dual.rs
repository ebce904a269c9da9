use std::sync::Arc;

use selvedge_collision::ContactResponse;
use selvedge_energy::Curvature;
use selvedge_linsolve::{Bsr, DualMatrix, ExplicitOperator, LinearSolver, Mirror, Pattern, Real};

use super::{Evaluation, Storage, StoredSystem, add_contacts};
use crate::assemble::Assembler;
use crate::{AssemblyOptions, Ledger, PlanError, Term};

/// Static matrix with slots found once, and contacts kept apart
/// [Pizana2025, § 4.1].
pub type DualSystem<T> = StoredSystem<Mirrored<T>>;

/// The matrix of a [`DualSystem`], and what copies its lower half to the upper
/// one.
pub struct Mirrored<T: Real> {
    matrix: DualMatrix<T>,
    mirror: Mirror,
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
        Ok(Self::of(assembler, Mirrored { matrix, mirror }, solver))
    }
}

impl<T: Real> Storage for Mirrored<T> {
    type Scalar = T;
    const NAME: &'static str = "dual";
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
        let stat = &mut self.matrix.stat;
        ledger.time("assembly: zero", || stat.fill_zero());
        let pattern = stat.pattern().clone();
        assembler.add_matrix(
            e,
            curvature,
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

    fn operator(&self) -> &dyn ExplicitOperator<T> {
        &self.matrix
    }

    fn heap_bytes(&self) -> usize {
        self.matrix.heap_bytes() + self.mirror.heap_bytes()
    }
}
