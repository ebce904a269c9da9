use selvedge_energy::{Curvature, EvalPoint, StencilEnergy};

/// Drag of still air on points, a device to bring drapes to rest.
///
/// ```text
/// f_i = −α m_i v_i,   E = ½ Σ α m_i |q_i − q_start,i|²/dt
/// ```
/// [Pizana2025, eq. 5]. `α` in [1/s], `m` in \[kg\]. The value is the
/// dissipation potential of the step. Free fall ends at `g/α` (1.96 m/s for
/// 5 /s): leave the term out where the physics of motion matters.
#[derive(Clone, Debug)]
pub struct PointDrag {
    stencils: Vec<[u32; 1]>,
    /// `α m` [kg/s]
    coefficients: Vec<f64>,
}

impl PointDrag {
    /// Drag on the points whose coefficient `α m` [kg/s] is not zero.
    pub fn new(coefficients: &[f64]) -> Self {
        let moving = || (0..).zip(coefficients).filter(|(_, c)| **c != 0.0);
        Self {
            stencils: moving().map(|(i, _)| [i]).collect(),
            coefficients: moving().map(|(_, c)| *c).collect(),
        }
    }
}

impl StencilEnergy<1, 3> for PointDrag {
    const NODE_DIMS: [usize; 1] = [3];

    fn stencils(&self) -> &[[u32; 1]] {
        &self.stencils
    }

    #[inline]
    fn value(&self, e: usize, q: &[f64; 3], at: &EvalPoint<'_>) -> f64 {
        self.gradient(e, q, at, &mut [0.0; 3])
    }

    #[inline]
    fn gradient(&self, e: usize, q: &[f64; 3], at: &EvalPoint<'_>, g: &mut [f64; 3]) -> f64 {
        let start = at.point_start(self.stencils[e][0]);
        let k = self.coefficients[e] / at.dt;
        let mut value = 0.0;
        for a in 0..3 {
            let d = q[a] - start[a];
            g[a] = k * d;
            value += 0.5 * k * d * d;
        }
        value
    }

    #[inline]
    fn hessian(
        &self,
        e: usize,
        q: &[f64; 3],
        at: &EvalPoint<'_>,
        _: Curvature,
        g: &mut [f64; 3],
        h: &mut [[f64; 3]; 3],
    ) -> f64 {
        let k = self.coefficients[e] / at.dt;
        *h = [[k, 0.0, 0.0], [0.0, k, 0.0], [0.0, 0.0, k]];
        self.gradient(e, q, at, g)
    }

    fn heap_bytes(&self) -> usize {
        size_of_val(&self.stencils[..]) + size_of_val(&self.coefficients[..])
    }
}
