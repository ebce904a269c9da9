use selvedge_energy::{Curvature, EvalPoint, StencilEnergy};

use super::{YarnBending, YarnGravity, YarnStretch};
use crate::{Yarn, YarnNetwork};

/// An energy of `P` points and sliding arc lengths, with the arc lengths frozen
/// as they are at rest: only the `X = 3 P` unknowns of its points remain.
///
/// The second derivative is the leading block of the sliding one, so that its
/// semidefiniteness and its bounds carry over.
#[derive(Clone, Debug)]
pub struct Locked<E, const N: usize, const M: usize, const P: usize, const X: usize> {
    energy: E,
    points: Vec<[u32; P]>,
    /// Frozen arc lengths by strand [m].
    arcs: Vec<f64>,
}

/// [`YarnStretch`] without sliding.
pub type LockedStretch = Locked<YarnStretch, 4, 8, 2, 6>;
/// [`YarnBending`] without sliding.
pub type LockedBending<const JAMMING: bool> = Locked<YarnBending<JAMMING>, 5, 11, 3, 9>;
/// [`YarnGravity`] without sliding.
pub type LockedGravity = Locked<YarnGravity, 4, 8, 2, 6>;

impl<E, const N: usize, const M: usize, const P: usize, const X: usize> Locked<E, N, M, P, X>
where
    E: StencilEnergy<N, M>,
{
    /// Freezes an energy of the same network. Its stencils must list `P`
    /// points, then strands; it must neither read the start of the step nor
    /// keep a history.
    ///
    /// # Panics
    /// When the stencils are of another shape.
    pub fn new(energy: E, network: &YarnNetwork) -> Self {
        assert!(
            X == 3 * P
                && E::NODE_DIMS
                    .iter()
                    .enumerate()
                    .all(|(n, d)| *d == if n < P { 3 } else { 1 }),
            "points first, then strands"
        );
        let points = energy.stencils().iter();
        let points = points.map(|s| std::array::from_fn(|n| s[n])).collect();
        Self {
            energy,
            points,
            arcs: network.strands.iter().map(|s| s.arc).collect(),
        }
    }

    /// The energy with its arc lengths.
    pub fn energy(&self) -> &E {
        &self.energy
    }

    /// All unknowns of stencil `e`.
    #[inline(always)]
    fn whole(&self, e: usize, q: &[f64; X]) -> [f64; M] {
        let mut whole = [0.0; M];
        whole[..X].copy_from_slice(q);
        for (w, strand) in whole[X..].iter_mut().zip(&self.energy.stencils()[e][P..]) {
            *w = self.arcs[*strand as usize];
        }
        whole
    }
}

impl<E, const N: usize, const M: usize, const P: usize, const X: usize> StencilEnergy<P, X>
    for Locked<E, N, M, P, X>
where
    E: StencilEnergy<N, M>,
{
    const NODE_DIMS: [usize; P] = [3; P];

    fn stencils(&self) -> &[[u32; P]] {
        &self.points
    }

    #[inline]
    fn value(&self, e: usize, q: &[f64; X], at: &EvalPoint<'_>) -> f64 {
        self.energy.value(e, &self.whole(e, q), at)
    }

    #[inline]
    fn gradient(&self, e: usize, q: &[f64; X], at: &EvalPoint<'_>, g: &mut [f64; X]) -> f64 {
        let mut whole = [0.0; M];
        let value = self.energy.gradient(e, &self.whole(e, q), at, &mut whole);
        g.copy_from_slice(&whole[..X]);
        value
    }

    #[inline]
    fn hessian(
        &self,
        e: usize,
        q: &[f64; X],
        at: &EvalPoint<'_>,
        curvature: Curvature,
        g: &mut [f64; X],
        h: &mut [[f64; X]; X],
    ) -> f64 {
        let mut whole = [0.0; M];
        let mut second = [[0.0; M]; M];
        let q = self.whole(e, q);
        let value = self
            .energy
            .hessian(e, &q, at, curvature, &mut whole, &mut second);
        g.copy_from_slice(&whole[..X]);
        for (row, second) in h.iter_mut().zip(&second) {
            row.copy_from_slice(&second[..X]);
        }
        value
    }

    fn is_conservative(&self) -> bool {
        self.energy.is_conservative()
    }

    fn heap_bytes(&self) -> usize {
        self.energy.heap_bytes() + size_of_val(&self.points[..]) + size_of_val(&self.arcs[..])
    }
}

impl LockedStretch {
    /// Every segment of a network.
    pub fn stretch(network: &YarnNetwork) -> Self {
        Self::new(YarnStretch::new(network), network)
    }
}

impl<const JAMMING: bool> LockedBending<JAMMING> {
    /// Every three consecutive nodes of every yarn of a network.
    pub fn bending(network: &YarnNetwork) -> Self {
        Self::new(YarnBending::new(network), network)
    }

    /// Every three consecutive nodes of some of the yarns.
    pub fn of_yarns(network: &YarnNetwork, of: impl Fn(&Yarn) -> bool) -> Self {
        Self::new(YarnBending::of_yarns(network, of), network)
    }
}

impl LockedGravity {
    /// Every segment of a network; gravity in m/s².
    pub fn gravity(network: &YarnNetwork, gravity: [f64; 3]) -> Self {
        Self::new(YarnGravity::new(network, gravity), network)
    }
}
