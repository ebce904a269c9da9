use selvedge_energy::{Curvature, EvalPoint, StencilEnergy};

use super::{CROSSED, crossed};
use crate::vec3::{V, get, put, put_column, set, square};
use crate::{NodeContact, YarnNetwork};

/// Stretching of the segments of yarns whose arc lengths slide.
///
/// ```text
/// Δu = u1 − u0,   l = |x1 − x0|,   |w| = l/Δu
/// V = ½ k_s Δu (|w| − 1)²
/// ∂V/∂x1 = k_s (|w| − 1) t = −∂V/∂x0
/// ∂V/∂u1 = −½ k_s (|w|² − 1) = −∂V/∂u0
/// B = k_s/Δu [ I − P/|w|, −|w| t; −|w| tᵀ, |w|² ],   H = [B, −B; −B, B]
/// ```
/// [Cirio2014]. Unknowns: `x0, x1, u0, u1`.
///
/// | symbol | is | unit |
/// |---|---|---|
/// | `k_s` | stretch stiffness `Y π R²` | N |
/// | `t, P` | direction of the segment, projector across it | 1 |
/// | `Δu` | material between the nodes | m |
///
/// Second derivatives: `Exact`; `Projected` drops `I − P/|w|` to `t tᵀ` in
/// compression, at least as large as the exact one; `GaussNewton` does so
/// always.
///
/// Degenerate cases: a segment of no length has no direction and no force on
/// its points. Arc lengths in the wrong order, or nearer than [`LEAST_MATERIAL`]
/// says: see [`CROSSED`].
#[derive(Clone, Debug)]
pub struct YarnStretch {
    stencils: Vec<[u32; 4]>,
    stiffness: Vec<f64>,
    /// Least material between the nodes [m].
    least: Vec<f64>,
}

/// Part of the material at rest between two crossings of woven cloth below which
/// they have met.
/// `V` is homogeneous in `(l, Δu)`: it falls as a segment shrinks to nothing,
/// so that nothing parts arc lengths that are this close.
pub const LEAST_MATERIAL: f64 = 1e-2;

impl YarnStretch {
    /// Every segment of a network.
    pub fn new(network: &YarnNetwork) -> Self {
        let strands = &network.strands;
        let stencils = network
            .segments()
            .map(|[a, b]| [strands[a as usize].node, strands[b as usize].node, a, b]);
        let stiffness = network
            .segments()
            .map(|[a, _]| network.material_of(a).stretch_stiffness());
        let crossing = |s: u32| {
            let contact = network.contacts[strands[s as usize].node as usize];
            matches!(contact, NodeContact::Crossing(_))
        };
        // Stitches may be drawn out, with no material left in the end.
        let least = network.segments().map(|[a, b]| {
            let rest = strands[b as usize].arc - strands[a as usize].arc;
            let kept = crossing(a) && crossing(b);
            if kept { LEAST_MATERIAL * rest } else { 0.0 }
        });
        Self {
            stencils: stencils.collect(),
            stiffness: stiffness.collect(),
            least: least.collect(),
        }
    }
}

/// Force on `x1` [N], minus that on `x0`, of a segment of stiffness `k_s` [N].
/// Zero for a segment without length.
#[inline(always)]
pub(crate) fn stretch_force(k_s: f64, x0: V, u0: f64, x1: V, u1: f64) -> V {
    let d = x1 - x0;
    let l = d.norm();
    if l == 0.0 {
        return V::zeros();
    }
    d * (k_s * (1.0 / l - 1.0 / (u1 - u0)))
}

/// One segment at an evaluation.
struct Segment {
    t: V,
    du: f64,
    ratio: f64,
}

impl Segment {
    #[inline(always)]
    fn new(q: &[f64; 8], least: f64) -> Option<Self> {
        let du = q[7] - q[6];
        if du <= least {
            return None;
        }
        let d = get(q, 3) - get(q, 0);
        let l = d.norm();
        let t = if l == 0.0 { V::zeros() } else { d / l };
        let ratio = l / du;
        Some(Self { t, du, ratio })
    }

    #[inline(always)]
    fn gradient(&self, k: f64, g: &mut [f64; 8]) -> f64 {
        let strain = self.ratio - 1.0;
        let f = self.t * (k * strain);
        set(g, 0, -f);
        set(g, 3, f);
        g[6] = 0.5 * k * strain * (self.ratio + 1.0);
        g[7] = -g[6];
        0.5 * k * self.du * strain * strain
    }
}

impl StencilEnergy<4, 8> for YarnStretch {
    const NODE_DIMS: [usize; 4] = [3, 3, 1, 1];

    fn stencils(&self) -> &[[u32; 4]] {
        &self.stencils
    }

    #[inline]
    fn value(&self, e: usize, q: &[f64; 8], _: &EvalPoint<'_>) -> f64 {
        match Segment::new(q, self.least[e]) {
            Some(s) => 0.5 * self.stiffness[e] * s.du * (s.ratio - 1.0) * (s.ratio - 1.0),
            None => CROSSED,
        }
    }

    #[inline]
    fn gradient(&self, e: usize, q: &[f64; 8], _: &EvalPoint<'_>, g: &mut [f64; 8]) -> f64 {
        match Segment::new(q, self.least[e]) {
            Some(s) => s.gradient(self.stiffness[e], g),
            None => crossed(g),
        }
    }

    #[inline]
    fn hessian(
        &self,
        e: usize,
        q: &[f64; 8],
        _: &EvalPoint<'_>,
        curvature: Curvature,
        g: &mut [f64; 8],
        h: &mut [[f64; 8]; 8],
    ) -> f64 {
        let Some(s) = Segment::new(q, self.least[e]) else {
            *h = [[f64::NAN; 8]; 8];
            return crossed(g);
        };
        let k = self.stiffness[e];
        let value = s.gradient(k, g);
        let k = k / s.du;
        let across = match curvature {
            Curvature::Exact if s.ratio == 0.0 => 0.0,
            Curvature::Exact => 1.0 - 1.0 / s.ratio,
            Curvature::Projected if s.ratio > 1.0 => 1.0 - 1.0 / s.ratio,
            Curvature::Projected | Curvature::GaussNewton => 0.0,
        };
        // t tᵀ + across (I − t tᵀ)
        let mut xx = square(k * (1.0 - across), s.t);
        for i in 0..3 {
            xx[(i, i)] += k * across;
        }
        let xu = s.t * (-k * s.ratio);
        let uu = k * s.ratio * s.ratio;
        put(h, 0, 0, &xx);
        put(h, 3, 3, &xx);
        put(h, 0, 3, &-xx);
        put(h, 3, 0, &-xx);
        put_column(h, 0, 6, xu);
        put_column(h, 3, 7, xu);
        put_column(h, 0, 7, -xu);
        put_column(h, 3, 6, -xu);
        h[6][6] = uu;
        h[7][7] = uu;
        h[6][7] = -uu;
        h[7][6] = -uu;
        value
    }

    fn complaint(&self, e: usize, q: &[f64; 8]) -> Option<String> {
        let (left, least) = (q[7] - q[6], self.least[e]);
        (left <= least).then(|| {
            format!(
                "{left:.3e} m of yarn are left between two contacts, at least {least:.3e} m are \
                 needed: the contacts have met"
            )
        })
    }

    fn heap_bytes(&self) -> usize {
        size_of_val(&self.stencils[..])
            + size_of_val(&self.stiffness[..])
            + size_of_val(&self.least[..])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A segment with less than a hundredth of its material is no state, and
    /// the energy says why.
    #[test]
    fn met_contacts_are_told() {
        let stretch = YarnStretch {
            stencils: vec![[0, 1, 0, 1]],
            stiffness: vec![2.0],
            least: vec![LEAST_MATERIAL * 1e-3],
        };
        let at = |du: f64| [0.0, 0.0, 0.0, 1e-3, 0.0, 0.0, 0.5, 0.5 + du];
        let layout = selvedge_energy::DofLayout::points(0);
        let nowhere = EvalPoint {
            layout,
            q: &[],
            q_start: &[],
            dt: 1.0,
        };
        let mut g = [0.0; 8];
        for du in [1.1e-5, 1e-3] {
            assert!(stretch.gradient(0, &at(du), &nowhere, &mut g).is_finite());
            assert_eq!(stretch.complaint(0, &at(du)), None);
        }
        for du in [0.9e-5, 1e-12, 0.0, -1e-5] {
            assert_eq!(stretch.value(0, &at(du), &nowhere), CROSSED);
            assert!(stretch.gradient(0, &at(du), &nowhere, &mut g).is_infinite());
            assert!(g.iter().all(|g| g.is_nan()));
            let why = stretch.complaint(0, &at(du)).unwrap();
            assert!(why.contains("at least 1.000e-5 m"), "{why}");
        }
    }

    #[test]
    fn force_is_minus_the_gradient() {
        let q = [0.0, 0.1, 0.2, 1.0, -0.3, 0.4, 0.2, 1.1];
        let segment = Segment::new(&q, 0.0).unwrap();
        let mut g = [0.0; 8];
        segment.gradient(3.0, &mut g);
        let (x0, x1) = (get(&q, 0), get(&q, 3));
        let f = stretch_force(3.0, x0, q[6], x1, q[7]);
        assert!((f + get(&g, 3)).norm() < 1e-14);
        assert!((f - get(&g, 0)).norm() < 1e-14);
        // Stretched: the end is pulled back.
        assert!(f.dot(&(x1 - x0)) < 0.0);
        assert_eq!(stretch_force(3.0, x0, 0.0, x0, 1.0), V::zeros());
    }
}
