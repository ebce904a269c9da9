use selvedge_energy::{Curvature, EvalPoint, StencilEnergy};

use crate::YarnNetwork;
use crate::vec3::{V, get, put_column, set};

/// Weight of the segments of yarns, with its pull on the sliding arc lengths.
///
/// ```text
/// V = −½ ρ Δu g·(x0 + x1),   Δu = u1 − u0
/// ∂V/∂x0 = ∂V/∂x1 = −½ ρ Δu g
/// ∂V/∂u1 = −½ ρ g·(x0 + x1) = −∂V/∂u0
/// ∂²V/∂x∂u1 = −½ ρ g = −∂²V/∂x∂u0
/// ```
/// [Cirio2014]. Unknowns: `x0, x1, u0, u1`. The force on the arc length of one
/// segment depends on the origin, that of both segments at a node does not.
///
/// | symbol | is | unit |
/// |---|---|---|
/// | `ρ` | line density | kg/m |
/// | `g` | gravity | m/s² |
///
/// Second derivatives: `Exact` is indefinite; `Projected` and `GaussNewton` are
/// zero. The positive part of the exact matrix would be `½ (√β a + b/√β)(…)ᵀ` with
/// `a = (g, g, 0, 0)`, `b = ½ ρ (0, 0, 1, −1)` and `β = |b|/|a|`: it ties points to the
/// place where they are, with `ω² = |g|/Δu`, and linearised steps of 1 ms would fall
/// as if through syrup.
#[derive(Clone, Debug)]
pub struct YarnGravity {
    stencils: Vec<[u32; 4]>,
    density: Vec<f64>,
    gravity: V,
}

impl YarnGravity {
    /// Every segment of a network; gravity in m/s².
    pub fn new(network: &YarnNetwork, gravity: [f64; 3]) -> Self {
        let node = |s: u32| network.strands[s as usize].node;
        let stencils = network.segments().map(|[a, b]| [node(a), node(b), a, b]);
        let density = network
            .segments()
            .map(|[a, _]| network.material_of(a).line_density());
        Self {
            stencils: stencils.collect(),
            density: density.collect(),
            gravity: gravity.into(),
        }
    }

    /// Gravity [m/s²].
    pub fn gravity(&self) -> [f64; 3] {
        self.gravity.into()
    }
}

impl StencilEnergy<4, 8> for YarnGravity {
    const NODE_DIMS: [usize; 4] = [3, 3, 1, 1];

    fn stencils(&self) -> &[[u32; 4]] {
        &self.stencils
    }

    #[inline]
    fn value(&self, e: usize, q: &[f64; 8], _: &EvalPoint<'_>) -> f64 {
        let height = self.gravity.dot(&(get(q, 0) + get(q, 3)));
        -0.5 * self.density[e] * (q[7] - q[6]) * height
    }

    #[inline]
    fn gradient(&self, e: usize, q: &[f64; 8], _: &EvalPoint<'_>, g: &mut [f64; 8]) -> f64 {
        let half = 0.5 * self.density[e];
        let pull = -half * self.gravity.dot(&(get(q, 0) + get(q, 3)));
        let du = q[7] - q[6];
        let x = self.gravity * (-half * du);
        set(g, 0, x);
        set(g, 3, x);
        g[6] = -pull;
        g[7] = pull;
        pull * du
    }

    #[inline]
    fn hessian(
        &self,
        e: usize,
        q: &[f64; 8],
        at: &EvalPoint<'_>,
        curvature: Curvature,
        g: &mut [f64; 8],
        h: &mut [[f64; 8]; 8],
    ) -> f64 {
        *h = [[0.0; 8]; 8];
        if curvature == Curvature::Exact {
            let xu = self.gravity * (0.5 * self.density[e]);
            for row in [0, 3] {
                put_column(h, row, 6, xu);
                put_column(h, row, 7, -xu);
            }
        }
        self.gradient(e, q, at, g)
    }

    fn heap_bytes(&self) -> usize {
        size_of_val(&self.stencils[..]) + size_of_val(&self.density[..])
    }
}
