use selvedge_energy::{Curvature, EvalPoint, StencilEnergy};

use crate::{NodeContact, YarnNetwork};

/// Contact between the parallel yarns at two consecutive contacts of a yarn.
///
/// ```text
/// V = ½ k_c L max(0, d − Δu)²,   Δu = u1 − u0
/// ∂V/∂u1 = −k_c L max(0, d − Δu) = −∂V/∂u0
/// H = k_c L [1, −1; −1, 1] where Δu < d
/// ```
/// [Cirio2014]. Unknowns: `u0, u1`.
///
/// | symbol | is | unit |
/// |---|---|---|
/// | `k_c L` | `0.1 k_s/L` | N/m |
/// | `L` | rest length between the contacts | m |
/// | `d` | least length between them, see [`spacing`](Self::spacing) | m |
///
/// All second derivatives are exact and semidefinite; at `Δu = d` the
/// derivative has a kink.
#[derive(Clone, Debug)]
pub struct ParallelYarns {
    stencils: Vec<[u32; 2]>,
    /// `k_c L` and `d`.
    data: Vec<[f64; 2]>,
}

/// Part of the rest length that `d` may reach, so that cloth is free of force
/// at rest.
pub(crate) const LOOSE: f64 = 0.95;

impl ParallelYarns {
    /// Segments between two crossings, and those between two stitch contacts.
    pub fn new(network: &YarnNetwork) -> Self {
        let (mut stencils, mut data) = (Vec::new(), Vec::new());
        for [a, b] in network.segments() {
            if let Some(d) = Self::spacing(network, a, b) {
                let rest = network.strands[b as usize].arc - network.strands[a as usize].arc;
                let stiffness = 0.1 * network.material_of(a).stretch_stiffness() / rest;
                stencils.push([a, b]);
                data.push([stiffness, d]);
            }
        }
        Self { stencils, data }
    }

    /// Least length `d` [m] of the segment from strand `a` to `b`; `None` where
    /// nothing is in the way.
    ///
    /// In woven cloth the sum of the radii of the two crossing yarns, and the
    /// yarn's own diameter more where it changes side and passes between them;
    /// in knitted cloth twice the yarn's own radius. At most 0.95 of the rest
    /// length, but for yarns with a [`spacing`](crate::YarnMaterial::spacing) of
    /// their own.
    pub fn spacing(network: &YarnNetwork, a: u32, b: u32) -> Option<f64> {
        let strand = |s: u32| &network.strands[s as usize];
        let contact = |s: u32| network.contacts[strand(s).node as usize];
        let own = network.material_of(a).radius;
        let d = match (contact(a), contact(b)) {
            (NodeContact::Crossing(i), NodeContact::Crossing(j)) => {
                let other = |crossing: u32, s: u32| {
                    let c = &network.crossings[crossing as usize];
                    let other = if c.warp == s { c.weft } else { c.warp };
                    network.material_of(other).radius
                };
                let front = |s: u32| network.strands_of(strand(s).node).start == s;
                let between = if front(a) == front(b) { 0.0 } else { 2.0 * own };
                other(i, a) + other(j, b) + between
            }
            (
                NodeContact::StitchA(i) | NodeContact::StitchB(i),
                NodeContact::StitchA(j) | NodeContact::StitchB(j),
            ) if i != j => match network.material_of(a).spacing {
                Some(d) => return Some(d),
                None => 2.0 * own,
            },
            _ => return None,
        };
        Some(d.min(LOOSE * (strand(b).arc - strand(a).arc)))
    }
}

impl StencilEnergy<2, 2> for ParallelYarns {
    const NODE_DIMS: [usize; 2] = [1, 1];

    fn stencils(&self) -> &[[u32; 2]] {
        &self.stencils
    }

    #[inline]
    fn value(&self, e: usize, q: &[f64; 2], _: &EvalPoint<'_>) -> f64 {
        let [k, d] = self.data[e];
        // Not `max`, which would hide NaN.
        let depth = d - (q[1] - q[0]);
        if depth <= 0.0 {
            0.0
        } else {
            0.5 * k * depth * depth
        }
    }

    #[inline]
    fn gradient(&self, e: usize, q: &[f64; 2], _: &EvalPoint<'_>, g: &mut [f64; 2]) -> f64 {
        let [k, d] = self.data[e];
        let depth = d - (q[1] - q[0]);
        if depth <= 0.0 {
            *g = [0.0; 2];
            return 0.0;
        }
        *g = [k * depth, -k * depth];
        0.5 * k * depth * depth
    }

    #[inline]
    fn hessian(
        &self,
        e: usize,
        q: &[f64; 2],
        at: &EvalPoint<'_>,
        _: Curvature,
        g: &mut [f64; 2],
        h: &mut [[f64; 2]; 2],
    ) -> f64 {
        let [k, d] = self.data[e];
        let k = if d - (q[1] - q[0]) <= 0.0 { 0.0 } else { k };
        *h = [[k, -k], [-k, k]];
        self.gradient(e, q, at, g)
    }

    fn heap_bytes(&self) -> usize {
        size_of_val(&self.stencils[..]) + size_of_val(&self.data[..])
    }
}
