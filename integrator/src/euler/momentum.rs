//! What a loose linear solve leaves of each piece's momentum.

use selvedge_linsolve::dot;

use super::BackwardEuler;
use crate::pins::project;
use crate::{Ledger, ScenePlan, Term};

/// Pieces of cloth: points that stencils join.
#[derive(Default)]
pub(super) struct Pieces {
    /// Piece of every point.
    of: Vec<u32>,
    /// Summed residual [N·s] and mass [kg] of every piece.
    sums: Vec<([f64; 3], f64)>,
}

impl Pieces {
    /// Pieces of as many points as there are masses.
    fn new(points: usize, terms: &[Term]) -> Self {
        let mut root: Vec<u32> = (0..points as u32).collect();
        for term in terms {
            let batch = term.batch.as_ref();
            for e in 0..batch.len() {
                let stencil = batch.nodes(e).iter().zip(batch.node_dims());
                let mut points = stencil.filter(|(_, dim)| **dim == 3).map(|(p, _)| *p);
                let Some(first) = points.next() else { continue };
                for p in points {
                    let (a, b) = (find(&mut root, first), find(&mut root, p));
                    // the smaller number leads, whatever the order of the stencils
                    root[a.max(b) as usize] = a.min(b);
                }
            }
        }
        let mut count = 0;
        let mut of = vec![0; points];
        for p in 0..points {
            let lead = find(&mut root, p as u32) as usize;
            if lead == p {
                of[p] = count;
                count += 1;
            } else {
                of[p] = of[lead];
            }
        }
        Self {
            of,
            sums: vec![([0.0; 3], 0.0); count as usize],
        }
    }

    /// `d = Σ r / Σ m` of its piece for every point that gravity moves, zero for
    /// scalars: the velocity that would take up the summed residual of a free
    /// piece.
    fn shift(&mut self, r: &[f64], masses: &[f64], weightless: &[u32], d: &mut [f64]) {
        self.sums.fill(([0.0; 3], 0.0));
        let (r, _) = r.as_chunks::<3>();
        for ((&piece, r), &m) in self.of.iter().zip(r).zip(masses) {
            let (sum, mass) = &mut self.sums[piece as usize];
            for i in 0..3 {
                sum[i] += r[i];
            }
            *mass += m;
        }
        let (points, scalars) = d.split_at_mut(3 * self.of.len());
        scalars.fill(0.0);
        let (points, _) = points.as_chunks_mut::<3>();
        for (d, &piece) in points.iter_mut().zip(&self.of) {
            let (sum, mass) = self.sums[piece as usize];
            *d = sum.map(|s| s / mass);
        }
        for &p in weightless {
            points[p as usize] = [0.0; 3];
        }
    }

    pub(super) fn heap_bytes(&self) -> usize {
        size_of_val(self.of.as_slice()) + size_of_val(self.sums.as_slice())
    }
}

fn find(root: &mut [u32], mut p: u32) -> u32 {
    while root[p as usize] != p {
        root[p as usize] = root[root[p as usize] as usize];
        p = root[p as usize];
    }
    p
}

impl BackwardEuler {
    /// Goes on from velocities whose residual is in `b` along the uniform motions
    /// `d` that the summed residuals of the pieces ask for, as far as the matrix at
    /// hand says that they reduce it:
    ///
    /// ```text
    /// d = Σ b / Σ m (each piece),   v += (d·b / d·A d) d
    /// ```
    /// Forces within cloth do no work in such motions, so that a piece that
    /// touches nothing gets its impulse exactly, however loosely the system was
    /// solved, for one product a step.
    pub(super) fn share_momentum(&mut self, plan: &mut ScenePlan, ledger: &mut Ledger) {
        let inertia = &plan.inertia;
        if self.pieces.of.len() != inertia.masses.len() {
            self.pieces = Pieces::new(inertia.masses.len(), &plan.terms);
        }
        let (b, v, d) = (&mut self.b, &mut self.v, &mut self.b_try);
        ledger.time("solve", || {
            self.pieces
                .shift(b, &inertia.masses, &inertia.weightless, d);
            project(&plan.pins, d);
            let gain = dot(b, d);
            plan.system.subtract_product(d, b);
            let curvature = gain - dot(b, d);
            let factor = gain / curvature;
            if curvature > 0.0 && factor.is_finite() {
                for (v, d) in v.iter_mut().zip(d.iter()) {
                    *v += factor * d;
                }
            }
        });
    }
}
