use std::ops::Range;

use selvedge_energy::{Curvature, EnergyBatch, EvalPoint};

/// Entries of local matrices that fit on the stack.
const ROOM: usize = 2048;

/// Stiffness-proportional (Rayleigh) damping of any energy.
///
/// ```text
/// D = β/(2 dt) Δqᵀ K Δq,   ∂D/∂q = β/dt K Δq,   ∂²D/∂q² = β/dt K
/// ```
/// with `Δq = q − q_start` and `K` the [`Projected`](Curvature::Projected)
/// second derivative of the energy at the start of the step [Cirio2017]. At
/// the end of a step the force is `−β K q̇`.
///
/// | symbol | is | unit |
/// |---|---|---|
/// | `β` | stiffness damping | s |
///
/// `K` is evaluated anew at every call rather than kept: `M²` numbers a stencil
/// would be more than all that a yarn network holds otherwise. `D` is quadratic,
/// so that all [`Curvature`]s are the same. Friction is not to be damped: its
/// stiffness is that of its anchors.
///
/// Validity: `K Δq` does not vanish for a rotation of a state under stress, so
/// that fast rotations of stretched yarns are damped too.
pub struct RayleighDamping {
    batch: Box<dyn EnergyBatch>,
    name: String,
    beta: f64,
    elastic: bool,
}

impl RayleighDamping {
    /// The damping alone, with `β` [s]. The energy is a copy of the one that
    /// acts; begin, commit and history are passed on to it.
    pub fn new(batch: Box<dyn EnergyBatch>, beta: f64) -> Self {
        Self {
            name: format!("{} damping", batch.name()),
            batch,
            beta,
            elastic: false,
        }
    }

    /// The energy and its damping as one term, which costs one addition to the
    /// system's matrix instead of two. Keeps the energy's name.
    pub fn added_to(batch: Box<dyn EnergyBatch>, beta: f64) -> Self {
        Self {
            name: batch.name().into(),
            elastic: true,
            ..Self::new(batch, beta)
        }
    }

    /// Stiffness damping `β` [s].
    pub fn beta(&self) -> f64 {
        self.beta
    }

    /// The energy.
    pub fn energy(&self) -> &dyn EnergyBatch {
        &*self.batch
    }

    /// Calls `f` with every stencil of a range, its `β/dt K` and its product
    /// with `Δq`.
    fn for_each(
        &self,
        at: &EvalPoint<'_>,
        range: Range<usize>,
        mut f: impl FnMut(usize, &[f64], &[f64], &[f64]),
    ) {
        let m = self.local_dim();
        let start = EvalPoint {
            q: at.q_start,
            ..*at
        };
        let mut stack = [0.0; ROOM];
        let mut heap = Vec::new();
        let buffer = if m * (m + 3) <= ROOM {
            &mut stack[..]
        } else {
            heap.resize(m * (m + 3), 0.0);
            &mut heap[..]
        };
        let count = (buffer.len() - 2 * m) / (m * (m + 1));
        let (vectors, buffer) = buffer.split_at_mut(2 * m);
        let (change, product) = vectors.split_at_mut(m);
        let (gradients, hessians) = buffer.split_at_mut(count * m);
        let scale = self.beta / at.dt;
        let mut from = range.start;
        while from < range.end {
            let to = range.end.min(from + count);
            let n = to - from;
            self.batch.hessians(
                &start,
                Curvature::Projected,
                from..to,
                &mut gradients[..n * m],
                &mut hessians[..n * m * m],
            );
            for (e, k) in (from..to).zip(hessians.chunks_exact_mut(m * m)) {
                self.change(at, e, change);
                for (row, product) in k.chunks_exact_mut(m).zip(product.iter_mut()) {
                    let mut sum = 0.0;
                    for (k, change) in row.iter_mut().zip(change.iter()) {
                        *k *= scale;
                        sum += *k * change;
                    }
                    *product = sum;
                }
                f(e, k, product, change);
            }
            from = to;
        }
    }

    /// `q − q_start` of a stencil.
    fn change(&self, at: &EvalPoint<'_>, e: usize, change: &mut [f64]) {
        let mut k = 0;
        for (node, dim) in self.batch.nodes(e).iter().zip(self.batch.node_dims()) {
            let from = at.layout.offset(*node, *dim);
            for u in from..from + dim {
                change[k] = at.q[u] - at.q_start[u];
                k += 1;
            }
        }
    }
}

fn half_dot(a: &[f64], b: &[f64]) -> f64 {
    0.5 * a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>()
}

impl EnergyBatch for RayleighDamping {
    fn name(&self) -> &str {
        &self.name
    }

    fn len(&self) -> usize {
        self.batch.len()
    }

    fn node_dims(&self) -> &[usize] {
        self.batch.node_dims()
    }

    fn nodes(&self, e: usize) -> &[u32] {
        self.batch.nodes(e)
    }

    fn value(&self, at: &EvalPoint<'_>, range: Range<usize>) -> f64 {
        let mut value = match self.elastic {
            true => self.batch.value(at, range.clone()),
            false => 0.0,
        };
        self.for_each(at, range, |_, _, force, change| {
            value += half_dot(force, change);
        });
        value
    }

    fn gradients(&self, at: &EvalPoint<'_>, range: Range<usize>, gradients: &mut [f64]) -> f64 {
        let m = self.local_dim();
        let first = range.start;
        let mut value = match self.elastic {
            true => self.batch.gradients(at, range.clone(), gradients),
            false => {
                gradients[..m * range.len()].fill(0.0);
                0.0
            }
        };
        self.for_each(at, range, |e, _, force, change| {
            value += half_dot(force, change);
            for (g, f) in gradients[(e - first) * m..].iter_mut().zip(force) {
                *g += f;
            }
        });
        value
    }

    fn hessians(
        &self,
        at: &EvalPoint<'_>,
        curvature: Curvature,
        range: Range<usize>,
        gradients: &mut [f64],
        hessians: &mut [f64],
    ) -> f64 {
        let m = self.local_dim();
        let first = range.start;
        let mut value = match self.elastic {
            true => self
                .batch
                .hessians(at, curvature, range.clone(), gradients, hessians),
            false => {
                gradients[..m * range.len()].fill(0.0);
                hessians[..m * m * range.len()].fill(0.0);
                0.0
            }
        };
        self.for_each(at, range, |e, stiffness, force, change| {
            value += half_dot(force, change);
            for (g, f) in gradients[(e - first) * m..].iter_mut().zip(force) {
                *g += f;
            }
            for (h, k) in hessians[(e - first) * m * m..].iter_mut().zip(stiffness) {
                *h += k;
            }
        });
        value
    }

    /// Within a step the damping force is the derivative of `D`.
    fn is_conservative(&self) -> bool {
        !self.elastic || self.batch.is_conservative()
    }

    fn begin_step(&mut self, at: &EvalPoint<'_>) {
        self.batch.begin_step(at);
    }

    fn commit(&mut self, at: &EvalPoint<'_>) {
        self.batch.commit(at);
    }

    fn history(&self) -> &[f64] {
        self.batch.history()
    }

    fn restore_history(&mut self, history: &[f64]) {
        self.batch.restore_history(history);
    }

    fn complaint(&self, at: &EvalPoint<'_>, e: usize) -> Option<String> {
        self.batch.complaint(at, e)
    }

    fn heap_bytes(&self) -> usize {
        self.batch.heap_bytes()
    }
}
