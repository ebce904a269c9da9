use crate::{Curvature, EvalPoint, StencilEnergy};

/// A vector of `K` strain measures of a stencil, differentiated once and shared
/// by elasticity, damping and plasticity.
pub trait Measure<const N: usize, const M: usize, const K: usize>: Send + Sync {
    /// Unknowns of each node: 3 or 1.
    const NODE_DIMS: [usize; N];
    /// Nodes of every stencil.
    fn stencils(&self) -> &[[u32; N]];
    /// Weight of a stencil, for example its rest area [m²].
    fn weight(&self, e: usize) -> f64;
    /// The measures at `q`.
    fn measure(&self, e: usize, q: &[f64; M]) -> [f64; K];
    /// The measures and their first derivatives at `q`.
    fn jacobian(&self, e: usize, q: &[f64; M], jacobian: &mut [[f64; M]; K]) -> [f64; K];
    /// Adds `Σ_k s_k ∇²measure_k` to `hessian`; `projected` asks for a positive
    /// semidefinite majorant of that sum.
    fn add_second(
        &self,
        e: usize,
        q: &[f64; M],
        s: &[f64; K],
        projected: bool,
        hessian: &mut [[f64; M]; M],
    );
    /// Heap memory held [bytes].
    fn heap_bytes(&self) -> usize {
        size_of_val(self.stencils())
    }
}

/// Energy per unit weight as a function of the measures at the end of a step
/// and, where it asks for them, at its start.
pub trait Density<const K: usize>: Send + Sync {
    /// Whether [`evaluate`](Self::evaluate) reads the start of the step.
    const NEEDS_START: bool = false;
    /// Value, stress `∂ψ/∂ε` and tangent `∂²ψ/∂ε²` at measures `m`.
    fn evaluate(
        &self,
        e: usize,
        m: &[f64; K],
        m_start: &[f64; K],
        dt: f64,
    ) -> (f64, [f64; K], [[f64; K]; K]);
    /// Heap memory held [bytes].
    fn heap_bytes(&self) -> usize {
        0
    }
}

/// The energy `Σ_e weight_e ψ(measure_e)`.
#[derive(Clone, Debug)]
pub struct Strained<S, D, const K: usize> {
    /// Strain measure.
    pub measure: S,
    /// Energy density of the measure.
    pub density: D,
}

impl<S, D, const N: usize, const M: usize, const K: usize> StencilEnergy<N, M> for Strained<S, D, K>
where
    S: Measure<N, M, K>,
    D: Density<K>,
{
    const NODE_DIMS: [usize; N] = S::NODE_DIMS;

    fn stencils(&self) -> &[[u32; N]] {
        self.measure.stencils()
    }

    fn value(&self, e: usize, q: &[f64; M], at: &EvalPoint<'_>) -> f64 {
        let m = self.measure.measure(e, q);
        let start = self.start(e, at, &m);
        self.measure.weight(e) * self.density.evaluate(e, &m, &start, at.dt).0
    }

    fn gradient(&self, e: usize, q: &[f64; M], at: &EvalPoint<'_>, g: &mut [f64; M]) -> f64 {
        let mut jacobian = [[0.0; M]; K];
        let m = self.measure.jacobian(e, q, &mut jacobian);
        let start = self.start(e, at, &m);
        let (value, stress, _) = self.density.evaluate(e, &m, &start, at.dt);
        let w = self.measure.weight(e);
        contract(w, &stress, &jacobian, g);
        w * value
    }

    fn hessian(
        &self,
        e: usize,
        q: &[f64; M],
        at: &EvalPoint<'_>,
        curvature: Curvature,
        g: &mut [f64; M],
        h: &mut [[f64; M]; M],
    ) -> f64 {
        let mut jacobian = [[0.0; M]; K];
        let m = self.measure.jacobian(e, q, &mut jacobian);
        let start = self.start(e, at, &m);
        let (value, stress, tangent) = self.density.evaluate(e, &m, &start, at.dt);
        let w = self.measure.weight(e);
        contract(w, &stress, &jacobian, g);
        let mut rows = [[0.0; M]; K];
        for k in 0..K {
            for l in 0..K {
                let c = w * tangent[k][l];
                for j in 0..M {
                    rows[k][j] += c * jacobian[l][j];
                }
            }
        }
        for i in 0..M {
            h[i] = [0.0; M];
            for k in 0..K {
                for j in 0..M {
                    h[i][j] += jacobian[k][i] * rows[k][j];
                }
            }
        }
        if curvature != Curvature::GaussNewton {
            let weighted = stress.map(|s| w * s);
            self.measure
                .add_second(e, q, &weighted, curvature == Curvature::Projected, h);
        }
        w * value
    }

    fn heap_bytes(&self) -> usize {
        self.measure.heap_bytes() + self.density.heap_bytes()
    }
}

impl<S, D, const K: usize> Strained<S, D, K> {
    #[inline]
    fn start<const N: usize, const M: usize>(
        &self,
        e: usize,
        at: &EvalPoint<'_>,
        end: &[f64; K],
    ) -> [f64; K]
    where
        S: Measure<N, M, K>,
        D: Density<K>,
    {
        if D::NEEDS_START {
            let q = at.gather_start::<N, M>(&S::NODE_DIMS, &self.measure.stencils()[e]);
            self.measure.measure(e, &q)
        } else {
            *end
        }
    }
}

#[inline]
fn contract<const M: usize, const K: usize>(
    w: f64,
    stress: &[f64; K],
    jacobian: &[[f64; M]; K],
    g: &mut [f64; M],
) {
    *g = [0.0; M];
    for k in 0..K {
        let s = w * stress[k];
        for j in 0..M {
            g[j] += s * jacobian[k][j];
        }
    }
}
