//! Local matrices kept stencil by stencil.

use std::ops::Range;
use std::time::Instant;

use selvedge_energy::{Curvature, EvalPoint};
use selvedge_linsolve::{BorderPattern, ElementMatrix, Real, SharedValues};

use super::Assembler;
use super::mixed::{LocalMatrices, MassEvaluation, MixedWork, SlotsOf, Stencils};
use crate::sink::{Shared, Sink};
use crate::{Ledger, Term};

/// Triangles of the stencils, and the blocks of nodes that they add up to.
#[derive(Clone)]
struct Elements<'a, T: Real> {
    triangles: SharedValues<'a, T>,
    /// Blocks of points, couplings with owners, scalars of one owner.
    diagonal: [Shared<'a, T>; 3],
    border: &'a BorderPattern,
}

impl<T: Real> LocalMatrices<T> for Elements<'_, T> {
    fn add(
        &mut self,
        stencils: &impl Stencils,
        _: Option<SlotsOf<'_>>,
        range: Range<usize>,
        local: &[f64],
        scale: f64,
    ) {
        let dims = stencils.dims();
        let m: usize = dims.iter().sum();
        let packed = m * (m + 1) / 2;
        for (e, h) in range.zip(local.chunks_exact(m * m)) {
            let mut at = e * packed;
            for (r, row) in h.chunks_exact(m).enumerate() {
                for &v in &row[..=r] {
                    self.triangles.add_value(at, v, scale);
                    at += 1;
                }
            }
            self.add_diagonal(stencils.stencil(e), dims, h, scale);
        }
    }
}

impl<T: Real> Elements<'_, T> {
    fn add_diagonal(&mut self, nodes: &[u32], dims: &[usize], h: &[f64], scale: f64) {
        let m: usize = dims.iter().sum();
        let [blocks, coupling, scalars] = &mut self.diagonal;
        let owner = |s: u32| self.border.owners()[s as usize];
        let mut row = 0;
        for (&i, &di) in nodes.iter().zip(dims) {
            let mut column = 0;
            for (&j, &dj) in nodes.iter().zip(dims) {
                let at = row * m + column;
                match (di, dj) {
                    (3, 3) if i == j => {
                        let line = |r: usize| [h[at + r * m], h[at + r * m + 1], h[at + r * m + 2]];
                        blocks.add_block(i as usize, &[line(0), line(1), line(2)], scale);
                    }
                    (1, 3) if owner(i) == j => {
                        let line = [h[at], h[at + 1], h[at + 2]];
                        coupling.add_point(i as usize, &line, scale);
                    }
                    (1, 1) if owner(i) == owner(j) => {
                        if let Some(slot) = self.border.scalar_slot(i, j) {
                            scalars.add_value(slot as usize, h[at], scale);
                        }
                    }
                    _ => {}
                }
                column += dj;
            }
            row += di;
        }
    }
}

impl Assembler {
    /// As [`add_mixed`](Self::add_mixed), stencil by stencil; group `k` of the
    /// matrix is term `k`.
    #[allow(clippy::too_many_arguments)]
    pub(crate) fn add_elements<T: Real>(
        &mut self,
        terms: &[Term],
        at: &EvalPoint<'_>,
        curvature: Curvature,
        stiffness: f64,
        matrix: &mut ElementMatrix<T>,
        impulse: &mut [f64],
        energies: &mut [f64],
        ledger: &mut Ledger,
    ) {
        let options = self.options;
        let all = terms.iter().zip(&mut self.schedules).zip(energies);
        for (k, ((term, schedule), energy)) in all.enumerate() {
            let start = Instant::now();
            let factor = if term.relaxed { stiffness } else { 1.0 };
            let work = MixedWork {
                batch: term.batch.as_ref(),
                at,
                curvature,
                factor,
                slots: None,
            };
            let values = matrix.values_mut(k);
            let elements = Elements {
                triangles: SharedValues::new(values.triangles),
                diagonal: [values.blocks, values.coupling, values.scalars]
                    .map(|v| options.shared(v)),
                border: &values.border,
            };
            let out = options.shared(impulse);
            schedule.run(|range, scratch| {
                work.run(range, scratch, &mut out.clone(), &mut elements.clone())
            });
            *energy = factor * schedule.sum();
            ledger.time_term("assembly", term.batch.name(), start.elapsed());
        }
    }

    /// As [`add_mass`](Self::add_mass), stencil by stencil, to the matrix' last
    /// group.
    pub(crate) fn add_mass_elements<T: Real>(
        &mut self,
        mass: &MassEvaluation<'_>,
        impulse: &mut [f64],
        matrix: &mut ElementMatrix<T>,
        ledger: &mut Ledger,
    ) -> f64 {
        let Some(schedule) = &mut self.mass else {
            return 0.0;
        };
        let start = Instant::now();
        let values = matrix.values_mut(self.schedules.len());
        let elements = Elements {
            triangles: SharedValues::new(values.triangles),
            diagonal: [values.blocks, values.coupling, values.scalars]
                .map(|v| self.options.shared(v)),
            border: &values.border,
        };
        let out = self.options.shared(impulse);
        schedule.run(|range, scratch| {
            let elements = &mut elements.clone();
            mass.run(None, range, scratch, &mut out.clone(), Some(elements))
        });
        ledger.book("assembly: inertia", start.elapsed());
        schedule.sum()
    }
}
