use selvedge_energy::{Curvature, EvalPoint, StencilEnergy};

use crate::{NONE, YarnNetwork};

/// Length of every yarn inside every stitch contact.
///
/// ```text
/// V = ½ k_l L (l/L − 1)²,   l = u1 − u0
/// ∂V/∂u1 = k_l (l/L − 1) = −∂V/∂u0,   H = k_l/L [1, −1; −1, 1]
/// ```
/// [Cirio2017]. Unknowns: `u0, u1`, the arc lengths at the contact's nodes in
/// the order of the yarn.
///
/// | symbol | is | unit |
/// |---|---|---|
/// | `k_l` | ten times the stretch stiffness | N |
/// | `L` | rest length of the contact | m |
///
/// All second derivatives are exact and semidefinite.
#[derive(Clone, Debug)]
pub struct StitchLength {
    stencils: Vec<[u32; 2]>,
    /// `k_l` and `L`.
    data: Vec<[f64; 2]>,
}

impl StitchLength {
    /// One element for every yarn that runs from node to node inside a stitch
    /// contact.
    pub fn new(network: &YarnNetwork) -> Self {
        let (mut stencils, mut data) = (Vec::new(), Vec::new());
        for contact in &network.stitches {
            for s in network.strands_of(contact.a) {
                let strand = &network.strands[s as usize];
                let at_b = |s: u32| s != NONE && network.strands[s as usize].node == contact.b;
                let pair = if at_b(strand.next) {
                    [s, strand.next]
                } else if at_b(strand.prev) {
                    [strand.prev, s]
                } else {
                    continue;
                };
                stencils.push(pair);
                data.push([network.material_of(s).length_stiffness(), contact.rest]);
            }
        }
        Self { stencils, data }
    }
}

impl StencilEnergy<2, 2> for StitchLength {
    const NODE_DIMS: [usize; 2] = [1, 1];

    fn stencils(&self) -> &[[u32; 2]] {
        &self.stencils
    }

    #[inline]
    fn value(&self, e: usize, q: &[f64; 2], _: &EvalPoint<'_>) -> f64 {
        let [k, length] = self.data[e];
        let strain = (q[1] - q[0]) / length - 1.0;
        0.5 * k * length * strain * strain
    }

    #[inline]
    fn gradient(&self, e: usize, q: &[f64; 2], _: &EvalPoint<'_>, g: &mut [f64; 2]) -> f64 {
        let [k, length] = self.data[e];
        let strain = (q[1] - q[0]) / length - 1.0;
        *g = [-k * strain, k * strain];
        0.5 * k * length * strain * strain
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
        let [k, length] = self.data[e];
        let k = k / length;
        *h = [[k, -k], [-k, k]];
        self.gradient(e, q, at, g)
    }

    fn heap_bytes(&self) -> usize {
        size_of_val(&self.stencils[..]) + size_of_val(&self.data[..])
    }
}
