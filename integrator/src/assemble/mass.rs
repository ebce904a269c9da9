use std::ops::Range;

use selvedge_energy::{MassBatch, RatePoint};
use selvedge_linsolve::Real;

use super::schedule::Scratch;
use super::work::{BLOCK, LocalMatrices, add_local, blocks};
use crate::sink::Sink;

/// Inertia that couples unknowns, evaluated at the start of a step.
#[derive(Clone, Copy)]
pub struct MassEvaluation<'a> {
    /// The inertia.
    pub batch: &'a dyn MassBatch,
    /// Unknowns and rates at the start of the step.
    pub start: RatePoint<'a>,
    /// Rates `v` at which the impulse is asked for.
    pub rates: &'a [f64],
    /// Mass-proportional damping α of every stencil [1/s]; empty: none.
    pub damping: &'a [f64],
    /// Length of the step [s].
    pub dt: f64,
}

impl MassEvaluation<'_> {
    /// `out += Σ M_e (v_0 − (1 + dt α_e) v) + dt Q`, and `(1 + dt α_e) M_e` to a
    /// matrix.
    pub(super) fn run<T: Real>(
        &self,
        range: Range<usize>,
        [f, m]: &mut Scratch,
        out: &mut impl Sink<f64>,
        matrix: &mut impl LocalMatrices<T>,
    ) -> f64 {
        let n = self.batch.local_dim();
        f.resize(BLOCK * n, 0.0);
        m.resize(BLOCK * n * n, 0.0);
        let mut kinetic = 0.0;
        for block in blocks(range) {
            let f = &mut f[..block.len() * n];
            let m = &mut m[..block.len() * n * n];
            kinetic += self.batch.rate_forces(&self.start, block.clone(), f);
            self.batch.masses(&self.start, block.clone(), m);
            for ((e, f), m) in block
                .clone()
                .zip(f.chunks_exact_mut(n))
                .zip(m.chunks_exact(n * n))
            {
                f.iter_mut().for_each(|f| *f *= self.dt);
                self.add_product(e, m, self.keep(e), f);
            }
            let points = self.start.layout.points;
            add_local(&self.batch, points, block.clone(), f, 1.0, out);
            // Stencils in a row that are damped alike, mostly all of them.
            let mut from = block.start;
            while from < block.end {
                let keep = self.keep(from);
                let to = (from..block.end).find(|e| self.keep(*e) != keep);
                let to = to.unwrap_or(block.end);
                let m = &m[(from - block.start) * n * n..(to - block.start) * n * n];
                matrix.add(&self.batch, from..to, m, keep);
                from = to;
            }
        }
        kinetic
    }

    /// `1 + dt α_e`
    #[inline(always)]
    fn keep(&self, e: usize) -> f64 {
        1.0 + self.dt * self.damping.get(e).copied().unwrap_or(0.0)
    }

    /// `f += M_e (v_0 − keep v)`
    fn add_product(&self, e: usize, m: &[f64], keep: f64, f: &mut [f64]) {
        let layout = self.start.layout;
        let n = f.len();
        let mut column = 0;
        for (&node, &dim) in self.batch.nodes(e).iter().zip(self.batch.node_dims()) {
            let from = layout.offset(node, dim);
            for k in 0..dim {
                let w = self.start.v[from + k] - keep * self.rates[from + k];
                for (r, f) in f.iter_mut().enumerate() {
                    *f += m[r * n + column + k] * w;
                }
            }
            column += dim;
        }
    }
}
