use selvedge_energy::{Curvature, EvalPoint, StencilEnergy};

use super::SharedScalar;

/// Springs of zero rest length on weighted sums of points.
///
/// ```text
/// E = ½ k |Σ_i w_i x_i|²,   Σ w_i = 0
/// ```
/// `k` in [N/m], `w` in \[1\]. With weights `(1, −(1−w), −w)` a spring joins a
/// point to a place on an edge ([`seam`](Self::seam)), with two nodes a point
/// to a point, with four a point to a place in a triangle (a buttonhole on
/// its button's thread). The second derivative is exact, constant and
/// semidefinite.
#[derive(Clone, Debug)]
pub struct WeightedSpring<const N: usize> {
    stencils: Vec<[u32; N]>,
    weights: Vec<[f64; N]>,
    /// Relative stiffness of every spring \[1\].
    shares: Vec<f64>,
    shared: SharedScalar,
    stiffness: f64,
}

/// Springs that sew a point to a place on an edge.
pub type SeamSpring = WeightedSpring<3>;

impl<const N: usize> WeightedSpring<N> {
    /// Springs of the common stiffness `k` [N/m] times `shares`.
    ///
    /// # Panics
    /// When the arrays differ in length.
    pub fn new(
        stencils: Vec<[u32; N]>,
        weights: Vec<[f64; N]>,
        shares: Vec<f64>,
        stiffness: SharedScalar,
    ) -> Self {
        assert_eq!(stencils.len(), weights.len(), "weights of every spring");
        assert_eq!(stencils.len(), shares.len(), "share of every spring");
        let now = stiffness.get();
        Self {
            stencils,
            weights,
            shares,
            shared: stiffness,
            stiffness: now,
        }
    }

    /// The vector that each spring pulls to zero \[m\].
    pub fn gap(&self, e: usize, at: &EvalPoint<'_>) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (p, w) in self.stencils[e].iter().zip(&self.weights[e]) {
            let x = at.point(*p);
            for a in 0..3 {
                sum[a] += w * x[a];
            }
        }
        sum
    }

    #[inline(always)]
    fn local_gap<const M: usize>(&self, e: usize, q: &[f64; M]) -> [f64; 3] {
        // Differences first: the weights sum to zero.
        std::array::from_fn(|a| {
            (1..N)
                .map(|i| self.weights[e][i] * (q[3 * i + a] - q[a]))
                .sum::<f64>()
        })
    }
}

impl WeightedSpring<3> {
    /// Seam pairs `(point, [edge ends], w)`: the point is sewn to
    /// `(1−w) x_j + w x_k`. `stiffness` [N/m] may be raised between steps.
    pub fn seam(pairs: &[(u32, [u32; 2], f64)], stiffness: SharedScalar) -> Self {
        Self::new(
            pairs.iter().map(|(i, [j, k], _)| [*i, *j, *k]).collect(),
            pairs
                .iter()
                .map(|(_, _, w)| [1.0, -(1.0 - w), -w])
                .collect(),
            vec![1.0; pairs.len()],
            stiffness,
        )
    }
}

impl WeightedSpring<2> {
    /// Point-to-point pairs. `stiffness` [N/m] may be raised between steps.
    pub fn joint(pairs: &[[u32; 2]], stiffness: SharedScalar) -> Self {
        Self::new(
            pairs.to_vec(),
            vec![[1.0, -1.0]; pairs.len()],
            vec![1.0; pairs.len()],
            stiffness,
        )
    }
}

impl WeightedSpring<4> {
    /// Points tied to places `b` (barycentric, summing to 1) in triangles: a
    /// buttonhole held by the button's thread, a pocket corner.
    pub fn patch(pairs: &[(u32, [u32; 3], [f64; 3])], stiffness: SharedScalar) -> Self {
        Self::new(
            pairs
                .iter()
                .map(|(p, [i, j, k], _)| [*p, *i, *j, *k])
                .collect(),
            pairs
                .iter()
                .map(|(_, _, b)| [1.0, -b[0], -b[1], -b[2]])
                .collect(),
            vec![1.0; pairs.len()],
            stiffness,
        )
    }
}

impl<const N: usize, const M: usize> StencilEnergy<N, M> for WeightedSpring<N> {
    const NODE_DIMS: [usize; N] = [3; N];

    fn stencils(&self) -> &[[u32; N]] {
        &self.stencils
    }

    #[inline]
    fn value(&self, e: usize, q: &[f64; M], _: &EvalPoint<'_>) -> f64 {
        let d = self.local_gap(e, q);
        0.5 * self.stiffness * self.shares[e] * (d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
    }

    #[inline]
    fn gradient(&self, e: usize, q: &[f64; M], _: &EvalPoint<'_>, g: &mut [f64; M]) -> f64 {
        let d = self.local_gap(e, q);
        let k = self.stiffness * self.shares[e];
        for i in 0..N {
            for a in 0..3 {
                g[3 * i + a] = k * self.weights[e][i] * d[a];
            }
        }
        0.5 * k * (d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
    }

    #[inline]
    fn hessian(
        &self,
        e: usize,
        q: &[f64; M],
        at: &EvalPoint<'_>,
        _: Curvature,
        g: &mut [f64; M],
        h: &mut [[f64; M]; M],
    ) -> f64 {
        *h = [[0.0; M]; M];
        let k = self.stiffness * self.shares[e];
        let w = &self.weights[e];
        for i in 0..N {
            for j in 0..N {
                for a in 0..3 {
                    h[3 * i + a][3 * j + a] = k * (w[i] * w[j]);
                }
            }
        }
        StencilEnergy::<N, M>::gradient(self, e, q, at, g)
    }

    fn begin_step(&mut self, _: &EvalPoint<'_>) {
        self.stiffness = self.shared.get();
    }

    fn heap_bytes(&self) -> usize {
        size_of_val(&self.stencils[..])
            + size_of_val(&self.weights[..])
            + size_of_val(&self.shares[..])
    }
}
