use selvedge_energy::{Curvature, EvalPoint, StencilEnergy};

/// Rest data of one stencil of [`BendingQuadratic`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuadraticRest {
    /// `x0, x1, x2, x3` of [`Hinge`](crate::Hinge).
    pub points: [u32; 4],
    /// Hinge stiffness `k_e` [N·m], as for [`HingeRest`](crate::HingeRest).
    pub stiffness: f64,
    /// Feet of the wings' heights along `x0 → x1` \[1\].
    pub feet: [f64; 2],
    /// Heights of the wings \[m\].
    pub heights: [f64; 2],
}

/// Isometric bending of flat cloth: a quadratic energy with a constant, always
/// semidefinite second derivative.
///
/// ```text
/// E = ½ k_e |Σ_i κ_i x_i|²,   κ = a_1/η̄_1 + a_2/η̄_2,   a = (−(1−s), −s, 1 at the opposite corner)
/// ```
/// \[Bergou2006\]. For an isometric hinge `|Σ κ_i x_i| = 2 sin(θ/2)`, so that it
/// agrees with [`BendingHinge`](crate::BendingHinge) for small angles; stretch
/// also loads it. Flat rest shapes only. For previews and constant operators.
/// `k_e` in [N·m], `κ` in [1/m].
#[derive(Clone, Debug)]
pub struct BendingQuadratic {
    stencils: Vec<[u32; 4]>,
    /// `√k_e κ` [√(N/m)]
    rows: Vec<[f64; 4]>,
}

impl BendingQuadratic {
    /// Stencils from their rest data.
    pub fn new(rest: &[QuadraticRest]) -> Self {
        let row = |r: &QuadraticRest| {
            let [(s1, i1), (s2, i2)] = [0, 1].map(|w| (r.feet[w], 1.0 / r.heights[w]));
            let k = r.stiffness.sqrt();
            [
                -(1.0 - s1) * i1 - (1.0 - s2) * i2,
                -s1 * i1 - s2 * i2,
                i1,
                i2,
            ]
            .map(|x| k * x)
        };
        Self {
            stencils: rest.iter().map(|r| r.points).collect(),
            rows: rest.iter().map(row).collect(),
        }
    }

    #[inline(always)]
    fn bent(&self, e: usize, q: &[f64; 12]) -> [f64; 3] {
        let row = &self.rows[e];
        // Differences first: the weights sum to zero.
        std::array::from_fn(|a| {
            row[1] * (q[3 + a] - q[a]) + row[2] * (q[6 + a] - q[a]) + row[3] * (q[9 + a] - q[a])
        })
    }
}

impl StencilEnergy<4, 12> for BendingQuadratic {
    const NODE_DIMS: [usize; 4] = [3; 4];

    fn stencils(&self) -> &[[u32; 4]] {
        &self.stencils
    }

    #[inline]
    fn value(&self, e: usize, q: &[f64; 12], _: &EvalPoint<'_>) -> f64 {
        let b = self.bent(e, q);
        0.5 * (b[0] * b[0] + b[1] * b[1] + b[2] * b[2])
    }

    #[inline]
    fn gradient(&self, e: usize, q: &[f64; 12], _: &EvalPoint<'_>, g: &mut [f64; 12]) -> f64 {
        let b = self.bent(e, q);
        for i in 0..4 {
            for a in 0..3 {
                g[3 * i + a] = self.rows[e][i] * b[a];
            }
        }
        0.5 * (b[0] * b[0] + b[1] * b[1] + b[2] * b[2])
    }

    #[inline]
    fn hessian(
        &self,
        e: usize,
        q: &[f64; 12],
        at: &EvalPoint<'_>,
        _: Curvature,
        g: &mut [f64; 12],
        h: &mut [[f64; 12]; 12],
    ) -> f64 {
        *h = [[0.0; 12]; 12];
        let row = &self.rows[e];
        for i in 0..4 {
            for j in 0..4 {
                for a in 0..3 {
                    h[3 * i + a][3 * j + a] = row[i] * row[j];
                }
            }
        }
        self.gradient(e, q, at, g)
    }

    fn heap_bytes(&self) -> usize {
        size_of_val(&self.stencils[..]) + size_of_val(&self.rows[..])
    }
}
