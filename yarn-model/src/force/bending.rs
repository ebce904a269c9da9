use std::f64::consts::{FRAC_PI_2, PI};

use selvedge_energy::{Curvature, EvalPoint, StencilEnergy};

use super::angle::{Angle, AngleBlocks};
use super::ramp::{JAM_FACTOR, ramp};
use super::{CROSSED, crossed};
use crate::vec3::{V, get, put, put_both, put_column, set};
use crate::{NONE, Yarn, YarnNetwork};

/// Angle past which loops jam [rad] [Cirio2017].
pub const JAM_ANGLE: f64 = FRAC_PI_2;
/// Range over which they do [rad].
pub const JAM_WIDTH: f64 = PI / 12.0;

/// Segments shorter than this part of the stencil's material have no
/// direction.
const SHORTEST: f64 = 1e-6;

/// Bending of yarns at every inner node, `x2 − x0 − x1` in the order of the
/// yarn.
///
/// ```text
/// Δu = u1 − u2,   θ = angle between x0 − x2 and x1 − x0   (0 = straight)
/// V = (k_b/Δu) E(θ),   E = θ²  [+ 2 (J − 1) Q(θ − θ_j; w) if JAMMING]
/// ∂V/∂x = (k_b/Δu) E' ∂θ/∂x
/// ∂V/∂u1 = −k_b E/Δu² = −∂V/∂u2
/// H_xx = (k_b/Δu) (E'' ∇θ ∇θᵀ + E' ∇²θ),   H_xu1 = −(k_b/Δu²) E' ∇θ
/// H_uu = 2 k_b E/Δu³ [1, −1; −1, 1]
/// ```
/// [Cirio2014], jamming ramp `Q` [Cirio2017]. Unknowns: `x2, x0, x1, u2, u1`.
///
/// | symbol | is | unit |
/// |---|---|---|
/// | `k_b` | bending stiffness, EI of a rod | N·m² |
/// | `θ_j, w` | jamming angle π/2 and its range π/12 | rad |
/// | `J` | stiffening by jamming, 1000 | 1 |
///
/// Second derivatives: `Exact`; `Projected` is at least as large. As
/// `2 E E'' ≥ E'²`, `E/Δu` is convex in `(θ, Δu)` and only `E' ∇²θ` needs a
/// bound, which is taken apart along the plane of the three points and its
/// normal in closed form. `GaussNewton` drops the part in the plane, the
/// change of the force's direction.
///
/// Degenerate cases: exact down to θ = 0. Within 1e-4 of π, folded back, the
/// direction of the force is undefined and fades out. A segment shorter than
/// 1e-6 Δu has no direction: the stencil is ignored. Arc lengths in the wrong
/// order: see [`CROSSED`].
#[derive(Clone, Debug)]
pub struct YarnBending<const JAMMING: bool> {
    stencils: Vec<[u32; 5]>,
    stiffness: Vec<f64>,
}

/// Bending of woven yarns.
pub type PlainBending = YarnBending<false>;
/// Bending of knitted yarns, with jamming.
pub type JammingBending = YarnBending<true>;

impl<const JAMMING: bool> YarnBending<JAMMING> {
    /// Every three consecutive nodes of every yarn.
    pub fn new(network: &YarnNetwork) -> Self {
        Self::of_yarns(network, |_| true)
    }

    /// Every three consecutive nodes of some of the yarns.
    pub fn of_yarns(network: &YarnNetwork, of: impl Fn(&Yarn) -> bool) -> Self {
        let mut stencils = Vec::new();
        let mut stiffness = Vec::new();
        let yarns = 0..network.yarns.len() as u32;
        for yarn in yarns.filter(|y| of(&network.yarns[*y as usize])) {
            for s in network.along(yarn) {
                let strand = &network.strands[s as usize];
                if strand.prev == NONE || strand.next == NONE {
                    continue;
                }
                let node = |s: u32| network.strands[s as usize].node;
                let (p, n) = (strand.prev, strand.next);
                stencils.push([node(p), strand.node, node(n), p, n]);
                stiffness.push(network.material_of(s).bending_stiffness());
            }
        }
        Self {
            stencils,
            stiffness,
        }
    }
}

/// `E, E', E''` at an angle.
#[inline(always)]
fn law<const JAMMING: bool>(theta: f64) -> [f64; 3] {
    let mut law = [theta * theta, 2.0 * theta, 2.0];
    if JAMMING && theta > JAM_ANGLE {
        let q = ramp(theta - JAM_ANGLE, JAM_WIDTH);
        for (l, q) in law.iter_mut().zip(q) {
            *l += 2.0 * (JAM_FACTOR - 1.0) * q;
        }
    }
    law
}

/// Forces [N] on `x2, x0, x1`, the nodes in the order of the yarn, of bending
/// with stiffness `k_b` [N·m²] over `du = u1 − u2` [m].
#[inline(always)]
pub(crate) fn bending_force<const JAMMING: bool>(k_b: f64, x2: V, x0: V, x1: V, du: f64) -> [V; 3] {
    let Some(angle) = Angle::new::<true>(x0 - x2, x1 - x0, SHORTEST * du) else {
        return [V::zeros(); 3];
    };
    let [_, slope, _] = law::<JAMMING>(angle.angle);
    let [p, r] = angle.gradient().map(|g| g * (slope * k_b / du));
    [p, r - p, -r]
}

/// One stencil at an evaluation.
#[derive(Debug)]
struct Bent {
    angle: Angle,
    law: [f64; 3],
    /// `1/Δu`
    inverse: f64,
    /// `k_b/Δu`
    k: f64,
}

/// A stencil without an angle.
#[derive(Debug)]
enum Unbent {
    /// A segment has no direction.
    Collapsed,
    /// The arc lengths are in the wrong order.
    Crossed,
}

impl Unbent {
    #[inline(always)]
    fn value(&self) -> f64 {
        match self {
            Self::Collapsed => 0.0,
            Self::Crossed => CROSSED,
        }
    }

    #[inline(always)]
    fn gradient(&self, g: &mut [f64; 11]) -> f64 {
        match self {
            Self::Collapsed => {
                *g = [0.0; 11];
                0.0
            }
            Self::Crossed => crossed(g),
        }
    }
}

impl Bent {
    #[inline(always)]
    fn new<const JAMMING: bool>(k: f64, q: &[f64; 11]) -> Result<Self, Unbent> {
        let du = q[10] - q[9];
        if du <= 0.0 {
            return Err(Unbent::Crossed);
        }
        let x0 = get(q, 3);
        let angle = Angle::new::<true>(x0 - get(q, 0), get(q, 6) - x0, SHORTEST * du)
            .ok_or(Unbent::Collapsed)?;
        Ok(Self {
            law: law::<JAMMING>(angle.angle),
            angle,
            inverse: 1.0 / du,
            k: k / du,
        })
    }

    #[inline(always)]
    fn gradient(&self, g: &mut [f64; 11]) -> f64 {
        let [energy, slope, _] = self.law;
        let [p, r] = self.angle.gradient().map(|d| d * (self.k * slope));
        set(g, 0, -p);
        set(g, 3, p - r);
        set(g, 6, r);
        let value = self.k * energy;
        g[9] = value * self.inverse;
        g[10] = -g[9];
        value
    }
}

impl<const JAMMING: bool> StencilEnergy<5, 11> for YarnBending<JAMMING> {
    const NODE_DIMS: [usize; 5] = [3, 3, 3, 1, 1];

    fn stencils(&self) -> &[[u32; 5]] {
        &self.stencils
    }

    #[inline]
    fn value(&self, e: usize, q: &[f64; 11], _: &EvalPoint<'_>) -> f64 {
        match Bent::new::<JAMMING>(self.stiffness[e], q) {
            Ok(b) => b.k * b.law[0],
            Err(unbent) => unbent.value(),
        }
    }

    #[inline]
    fn gradient(&self, e: usize, q: &[f64; 11], _: &EvalPoint<'_>, g: &mut [f64; 11]) -> f64 {
        match Bent::new::<JAMMING>(self.stiffness[e], q) {
            Ok(b) => b.gradient(g),
            Err(unbent) => unbent.gradient(g),
        }
    }

    #[inline]
    fn hessian(
        &self,
        e: usize,
        q: &[f64; 11],
        _: &EvalPoint<'_>,
        curvature: Curvature,
        g: &mut [f64; 11],
        h: &mut [[f64; 11]; 11],
    ) -> f64 {
        let b = match Bent::new::<JAMMING>(self.stiffness[e], q) {
            Ok(b) => b,
            Err(unbent) => {
                let value = unbent.gradient(g);
                *h = [[g[0]; 11]; 11];
                return value;
            }
        };
        let value = b.gradient(g);
        let [energy, slope, bend] = b.law;
        let AngleBlocks { pp, pr, rr } = b.angle.blocks(b.k * slope, b.k * bend, curvature);
        let both = pr + pr.transpose();
        put(h, 0, 0, &pp);
        put(h, 3, 3, &((pp + rr) - both));
        put(h, 6, 6, &rr);
        put_both(h, 0, 3, &(pr - pp));
        put_both(h, 0, 6, &-pr);
        put_both(h, 3, 6, &(pr - rr));
        for at in [0, 3, 6] {
            let xu = get(g, at) * b.inverse;
            put_column(h, at, 9, xu);
            put_column(h, at, 10, -xu);
        }
        let uu = 2.0 * b.k * energy * b.inverse * b.inverse;
        h[9][9] = uu;
        h[10][10] = uu;
        h[9][10] = -uu;
        h[10][9] = -uu;
        value
    }

    fn heap_bytes(&self) -> usize {
        size_of_val(&self.stencils[..]) + size_of_val(&self.stiffness[..])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn compare<const JAMMING: bool>(q: &[f64; 11]) {
        let bent = Bent::new::<JAMMING>(2.0, q).unwrap();
        let mut g = [0.0; 11];
        bent.gradient(&mut g);
        let x = [0, 3, 6].map(|at| get(q, at));
        let forces = bending_force::<JAMMING>(2.0, x[0], x[1], x[2], q[10] - q[9]);
        for (f, at) in forces.iter().zip([0, 3, 6]) {
            let g = get(&g, at);
            assert!((f + g).norm() < 1e-13 * g.norm());
        }
    }

    #[test]
    fn force_is_minus_the_gradient() {
        let q = [-1.0, 0.1, 0.2, 0.0, 0.0, 0.1, -0.4, 0.8, -0.3, 0.1, 2.3];
        compare::<true>(&q);
        compare::<false>(&q);
        let x = [0, 3].map(|at| get(&q, at));
        let none = bending_force::<true>(2.0, x[0], x[1], x[1], 2.2);
        assert_eq!(none, [V::zeros(); 3]);
    }
}
