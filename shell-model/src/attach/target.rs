use selvedge_energy::{Curvature, EvalPoint, StencilEnergy};

use super::SharedTargets;

/// Springs from points to moving targets.
///
/// ```text
/// E = ½ Σ k_i |x_i − X_i|²
/// ```
/// `k` in [N/m]. Targets are read when a step begins, see [`SharedTargets`].
/// Where a point must follow exactly, prescribe it with a filter instead.
#[derive(Clone, Debug)]
pub struct Attachment {
    stencils: Vec<[u32; 1]>,
    stiffness: Vec<f64>,
    shared: SharedTargets,
    targets: Vec<[f64; 3]>,
}

impl Attachment {
    /// Springs of `stiffness` [N/m] from `points` to `targets`.
    ///
    /// # Panics
    /// When the arrays differ in length.
    pub fn new(points: &[u32], stiffness: Vec<f64>, targets: SharedTargets) -> Self {
        assert_eq!(points.len(), stiffness.len(), "stiffness of every point");
        assert_eq!(points.len(), targets.len(), "target of every point");
        let mut now = Vec::new();
        targets.copy_to(&mut now);
        Self {
            stencils: points.iter().map(|p| [*p]).collect(),
            stiffness,
            shared: targets,
            targets: now,
        }
    }
}

impl StencilEnergy<1, 3> for Attachment {
    const NODE_DIMS: [usize; 1] = [3];

    fn stencils(&self) -> &[[u32; 1]] {
        &self.stencils
    }

    #[inline]
    fn value(&self, e: usize, q: &[f64; 3], at: &EvalPoint<'_>) -> f64 {
        self.gradient(e, q, at, &mut [0.0; 3])
    }

    #[inline]
    fn gradient(&self, e: usize, q: &[f64; 3], _: &EvalPoint<'_>, g: &mut [f64; 3]) -> f64 {
        let k = self.stiffness[e];
        let mut value = 0.0;
        for a in 0..3 {
            let d = q[a] - self.targets[e][a];
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
        let k = self.stiffness[e];
        *h = [[k, 0.0, 0.0], [0.0, k, 0.0], [0.0, 0.0, k]];
        self.gradient(e, q, at, g)
    }

    fn begin_step(&mut self, _: &EvalPoint<'_>) {
        self.shared.copy_to(&mut self.targets);
    }

    fn heap_bytes(&self) -> usize {
        size_of_val(&self.stencils[..])
            + size_of_val(&self.stiffness[..])
            + size_of_val(&self.targets[..])
    }
}
