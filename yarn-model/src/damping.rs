use std::ops::Range;

use selvedge_energy::{Curvature, EnergyBatch, EvalPoint, StencilEnergy};

use crate::{YarnMaterial, YarnNetwork};

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
/// | `β` | stiffness damping, of each stencil | s |
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
    beta: Vec<f64>,
    elastic: bool,
}

impl RayleighDamping {
    /// The damping alone, with `β` of every stencil [s]. The energy is a copy of
    /// the one that acts; begin, commit and history are passed on to it.
    ///
    /// # Panics
    /// When there is not one `β` for each stencil.
    pub fn new(batch: Box<dyn EnergyBatch>, beta: Vec<f64>) -> Self {
        assert_eq!(beta.len(), batch.len(), "one damping for each stencil");
        Self {
            name: format!("{} damping", batch.name()),
            batch,
            beta,
            elastic: false,
        }
    }

    /// The energy and its damping as one term, which costs one addition to the
    /// system's matrix instead of two. Keeps the energy's name.
    ///
    /// # Panics
    /// When there is not one `β` for each stencil.
    pub fn added_to(batch: Box<dyn EnergyBatch>, beta: Vec<f64>) -> Self {
        Self {
            name: batch.name().into(),
            elastic: true,
            ..Self::new(batch, beta)
        }
    }

    /// Stiffness damping `β` of every stencil [s].
    pub fn beta(&self) -> &[f64] {
        &self.beta
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
                let scale = self.beta[e] / at.dt;
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

/// `β` of every stencil of an energy of a network [s]: that of the yarn whose
/// arc length it names first; of stencils of points alone the mean of the yarns
/// that meet at the first point.
pub fn stencil_damping<E, const N: usize, const M: usize>(
    energy: &E,
    network: &YarnNetwork,
) -> Vec<f64>
where
    E: StencilEnergy<N, M>,
{
    let scalar = E::NODE_DIMS.iter().position(|d| *d == 1);
    let of = |stencil: &[u32; N]| match scalar {
        Some(at) => network.material_of(stencil[at]).stiffness_damping,
        None => {
            let strands = network.strands_of(stencil[0]);
            let beta = |s: u32| network.material_of(s).stiffness_damping;
            let (first, n) = (beta(strands.start), strands.len() as f64);
            // Of equal yarns to the last bit.
            first + strands.map(|s| beta(s) - first).sum::<f64>() / n
        }
    };
    energy.stencils().iter().map(of).collect()
}

/// Mass damping `α` of every segment [1/s], in the order of
/// [`SegmentInertia`](crate::SegmentInertia); empty where all are zero.
pub fn segment_damping(network: &YarnNetwork) -> Vec<f64> {
    let alpha = |m: &YarnMaterial| m.mass_damping;
    if network.materials.iter().all(|m| alpha(m) == 0.0) {
        return Vec::new();
    }
    let segments = network.segments();
    segments
        .map(|[a, _]| alpha(network.material_of(a)))
        .collect()
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
        self.batch.heap_bytes() + size_of_val(&self.beta[..])
    }
}
