use std::f64::consts::{FRAC_PI_2, PI};

use selvedge_energy::{Curvature, EvalPoint, StencilEnergy};

use super::ParallelYarns;
use super::angle::{Angle, AngleBlocks};
use super::ramp::{JAM_FACTOR, ramp};
use crate::vec3::{V, get, put, put_both, set};
use crate::{Crossing, NONE, YarnNetwork};

/// Range over which sheared yarns jam [rad].
const WIDTH: f64 = PI / 18.0;

/// Arms shorter than this part of their rest length have no direction.
const SHORTEST: f64 = 1e-6;

/// Shear between the yarns of woven crossings, with jamming: one element for
/// every pair of a warp neighbour `x1` and a weft neighbour `x3` of a crossing
/// `x0`.
///
/// ```text
/// φ = angle(x1 − x0, x3 − x0),   ψ = φ − φ0
/// V = k_x L [½ ψ² + (J − 1) Q(|ψ| − ψ_j; w)],   k_x = S R_warp R_weft
/// ∂V/∂x = V' ∂φ/∂x,   H = V'' ∇φ ∇φᵀ + V' ∇²φ
/// ```
/// [Cirio2014], jamming ramp `Q` [Cirio2017]. Unknowns: `x0, x1, x3`.
///
/// | symbol | is | unit |
/// |---|---|---|
/// | `S` | shear modulus, the mean of both yarns | Pa |
/// | `R` | radii | m |
/// | `L` | mean of the rest lengths of both arms | m |
/// | `φ0` | rest angle | rad |
/// | `ψ_j` | shear at which parallel yarns touch: the least over both families of `min(φ0, π − φ0) − asin(d/L)`, `d` of [`ParallelYarns::spacing`] | rad |
/// | `J, w` | stiffening 1000, over π/18 | 1, rad |
///
/// Second derivatives: `Exact`; `Projected` is at least as large and
/// `GaussNewton` drops the change of the force's direction, as in
/// [`YarnBending`](crate::YarnBending).
///
/// Degenerate cases: within 1e-4 of φ = 0 and π the force's direction is
/// undefined and fades out. An arm shorter than 1e-6 L has no direction: the
/// element is ignored.
#[derive(Clone, Debug)]
pub struct YarnShear {
    stencils: Vec<[u32; 3]>,
    data: Vec<Data>,
}

#[derive(Clone, Copy, Debug)]
struct Data {
    /// `k_x L` [N·m].
    stiffness: f64,
    rest: f64,
    jam: f64,
    /// Least length of an arm [m].
    floor: f64,
}

impl YarnShear {
    /// All crossings, at rest when yarns are square.
    pub fn new(network: &YarnNetwork) -> Self {
        Self::with_rest(network, |_| FRAC_PI_2)
    }

    /// All crossings, at rest with the angles of the network's points.
    pub fn from_layout(network: &YarnNetwork) -> Self {
        Self::with_rest(network, |points| {
            let [x0, x1, x3] = points.map(|p| V::from(network.points[p as usize]));
            Angle::new::<false>(x1 - x0, x3 - x0, 0.0).map_or(FRAC_PI_2, |a| a.angle)
        })
    }

    fn with_rest(network: &YarnNetwork, rest: impl Fn([u32; 3]) -> f64) -> Self {
        let mut energy = Self {
            stencils: Vec::new(),
            data: Vec::new(),
        };
        for crossing in &network.crossings {
            let Crossing { node, warp, weft } = *crossing;
            let around = |s: u32| {
                let strand = &network.strands[s as usize];
                // Segments in the order of the yarn, and the strand beside.
                [(strand.prev, strand.prev, s), (strand.next, s, strand.next)]
            };
            for (one, a1, b1) in around(warp) {
                for (three, a3, b3) in around(weft) {
                    if one == NONE || three == NONE {
                        continue;
                    }
                    let point = |s: u32| network.strands[s as usize].node;
                    let stencil = [node, point(one), point(three)];
                    let arms = [[a1, b1], [a3, b3]];
                    energy.stencils.push(stencil);
                    energy
                        .data
                        .push(data(network, [warp, weft], arms, rest(stencil)));
                }
            }
        }
        energy
    }

    #[inline(always)]
    fn sheared(&self, e: usize, q: &[f64; 9]) -> Option<(Angle, [f64; 3])> {
        let x0 = get(q, 0);
        let data = &self.data[e];
        let angle = Angle::new::<false>(get(q, 3) - x0, get(q, 6) - x0, data.floor)?;
        Some((angle, data.law(angle.angle)))
    }
}

fn data(network: &YarnNetwork, [warp, weft]: [u32; 2], arms: [[u32; 2]; 2], rest: f64) -> Data {
    let lengths =
        arms.map(|[a, b]| network.strands[b as usize].arc - network.strands[a as usize].arc);
    let open = rest.min(PI - rest);
    let jam = (0..2)
        .map(|i| {
            let [a, b] = arms[i];
            let d = ParallelYarns::spacing(network, a, b).unwrap_or(0.0);
            open - (d / lengths[i]).min(1.0).asin()
        })
        .fold(f64::INFINITY, f64::min)
        .max(0.0);
    let (warp, weft) = (network.material_of(warp), network.material_of(weft));
    let modulus = 0.5 * (warp.shear_modulus + weft.shear_modulus);
    let length = 0.5 * (lengths[0] + lengths[1]);
    Data {
        stiffness: modulus * warp.radius * weft.radius * length,
        rest,
        jam,
        floor: SHORTEST * length,
    }
}

impl Data {
    /// `V, V', V''` at an angle.
    #[inline(always)]
    fn law(&self, angle: f64) -> [f64; 3] {
        let psi = angle - self.rest;
        let [q, q1, q2] = ramp(psi.abs() - self.jam, WIDTH);
        let j = JAM_FACTOR - 1.0;
        [
            self.stiffness * (0.5 * psi * psi + j * q),
            self.stiffness * (psi + psi.signum() * j * q1),
            self.stiffness * (1.0 + j * q2),
        ]
    }
}

#[inline(always)]
fn write(angle: &Angle, slope: f64, g: &mut [f64; 9]) {
    let [p, r] = angle.gradient().map(|d| d * slope);
    set(g, 0, -(p + r));
    set(g, 3, p);
    set(g, 6, r);
}

impl StencilEnergy<3, 9> for YarnShear {
    const NODE_DIMS: [usize; 3] = [3; 3];

    fn stencils(&self) -> &[[u32; 3]] {
        &self.stencils
    }

    #[inline]
    fn value(&self, e: usize, q: &[f64; 9], _: &EvalPoint<'_>) -> f64 {
        self.sheared(e, q).map_or(0.0, |(_, law)| law[0])
    }

    #[inline]
    fn gradient(&self, e: usize, q: &[f64; 9], _: &EvalPoint<'_>, g: &mut [f64; 9]) -> f64 {
        let Some((angle, [value, slope, _])) = self.sheared(e, q) else {
            *g = [0.0; 9];
            return 0.0;
        };
        write(&angle, slope, g);
        value
    }

    #[inline]
    fn hessian(
        &self,
        e: usize,
        q: &[f64; 9],
        _: &EvalPoint<'_>,
        curvature: Curvature,
        g: &mut [f64; 9],
        h: &mut [[f64; 9]; 9],
    ) -> f64 {
        let Some((angle, [value, slope, bend])) = self.sheared(e, q) else {
            *g = [0.0; 9];
            *h = [[0.0; 9]; 9];
            return 0.0;
        };
        write(&angle, slope, g);
        let AngleBlocks { pp, pr, rr } = angle.blocks(slope, bend, curvature);
        put(h, 0, 0, &((pp + rr) + (pr + pr.transpose())));
        put(h, 3, 3, &pp);
        put(h, 6, 6, &rr);
        put_both(h, 3, 0, &-(pp + pr));
        put_both(h, 6, 0, &-(rr + pr.transpose()));
        put_both(h, 3, 6, &pr);
        value
    }

    fn heap_bytes(&self) -> usize {
        size_of_val(&self.stencils[..]) + size_of_val(&self.data[..])
    }
}
