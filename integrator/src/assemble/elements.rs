//! Local matrices kept stencil by stencil.

use std::ops::Range;
use std::sync::Arc;
use std::time::Instant;

use selvedge_energy::Curvature;
use selvedge_linsolve::{BorderPattern, ElementMatrix, Real, SharedValues};

use super::work::{LocalMatrices, MatrixWork, Stencils};
use super::{Assembler, AssemblyOptions, MassEvaluation};
use crate::sink::{Shared, Sink};
use crate::{Evaluation, Ledger};

/// Triangles of the stencils, and the blocks of nodes that they add up to.
#[derive(Clone)]
struct Elements<'a, T: Real> {
    triangles: SharedValues<'a, T>,
    /// Blocks of points, couplings with owners, scalars of one owner.
    diagonal: [Shared<'a, T>; 3],
    border: Arc<BorderPattern>,
}

impl<T: Real> LocalMatrices<T> for Elements<'_, T> {
    fn add(&mut self, stencils: &impl Stencils, range: Range<usize>, local: &[f64], scale: f64) {
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

impl<'a, T: Real> Elements<'a, T> {
    fn new(matrix: &'a mut ElementMatrix<T>, group: usize, options: AssemblyOptions) -> Self {
        let values = matrix.values_mut(group);
        Self {
            triangles: SharedValues::new(values.triangles),
            diagonal: [values.blocks, values.coupling, values.scalars].map(|v| options.shared(v)),
            border: values.border,
        }
    }

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
    pub(crate) fn add_elements<T: Real>(
        &mut self,
        e: &Evaluation<'_>,
        curvature: Curvature,
        matrix: &mut ElementMatrix<T>,
        impulse: &mut [f64],
        energies: &mut [f64],
        ledger: &mut Ledger,
    ) {
        let options = self.options;
        self.each_term(e, energies, |k, forces, schedule| {
            let start = Instant::now();
            let work = MatrixWork { forces, curvature };
            let out = options.shared(impulse);
            let elements = Elements::new(matrix, k, options);
            schedule.run(|range, scratch| {
                work.run(range, scratch, &mut out.clone(), &mut elements.clone())
            });
            ledger.time_term("assembly", work.forces.batch.name(), start.elapsed());
        });
    }

    /// As [`add_mass`](Self::add_mass), stencil by stencil, to the matrix' last
    /// group.
    pub(crate) fn add_mass_elements<T: Real>(
        &mut self,
        mass: &MassEvaluation<'_>,
        impulse: &mut [f64],
        matrix: &mut ElementMatrix<T>,
        ledger: &mut Ledger,
    ) {
        let Some(schedule) = &mut self.mass else {
            return;
        };
        let start = Instant::now();
        let out = self.options.shared(impulse);
        let elements = Elements::new(matrix, self.schedules.len(), self.options);
        schedule.run(|range, scratch| {
            mass.run(range, scratch, &mut out.clone(), &mut elements.clone())
        });
        ledger.book("assembly: inertia", start.elapsed());
    }
}
