use std::f64::consts::{FRAC_PI_2, TAU};

use selvedge_energy::{Curvature, EvalPoint, StencilEnergy};

use super::dihedral::Dihedral;
use super::fading::{FADE, Wrapped, both, flat};
use crate::vec3::{V, get, set};
use crate::{NONE, StitchContact, YarnNetwork};

/// Twice the area of a wing and its axis, in units of `L²`, below which the
/// element has no angle.
const FLAT: f64 = 1e-8;

/// Which yarns an element of a stitch contact takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WrapPair {
    /// Axis A to B; wings: the child's sinker at A, the parent's head at B.
    ChildAtA,
    /// Axis B to A; wings: the child's leg at B, the parent's leg at A.
    ChildAtB,
}

/// One wrapping element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WrapElement {
    /// Axis `x0, x1`, then the wings: `x3` beside `x1`, `x4` beside `x0`.
    pub points: [u32; 4],
    /// Index of the stitch contact.
    pub contact: u32,
    /// Which of its pairs.
    pub pair: WrapPair,
    /// Sign that makes the rest angle positive.
    pub sigma: f64,
    /// `k_w L` [N·m].
    pub stiffness: f64,
    /// Rest length `L` of the contact [m].
    pub length: f64,
}

/// Wrapping of yarns around each other in stitch contacts.
///
/// ```text
/// v_a = (x4 − x1) × (x0 − x1),   v_b = (x0 − x1) × (x3 − x1)
/// ψ = σ atan2(e·(n_a × n_b), n_a·n_b)      (0 flat, ±π folded)
/// V = ½ k_w L (ψ − ψ0)²,   ψ0 = π/2
/// ∂V/∂x = k_w L (ψ − ψ0) ∇ψ,   H = k_w L (∇ψ ∇ψᵀ + (ψ − ψ0) ∇²ψ)
/// ```
/// [Cirio2017]. Unknowns: `x0, x1, x3, x4`.
///
/// | symbol | is | unit |
/// |---|---|---|
/// | `k_w` | wrapping stiffness, the mean of both yarns | N |
/// | `L` | rest length of the contact | m |
/// | `e, n` | directions of the axis and the normals of the wings | 1 |
/// | `σ` | ±1, see [`elements`](Self::elements) | 1 |
///
/// Second derivatives: `Exact`; `GaussNewton` is `k_w L ∇ψ ∇ψᵀ`, which is not
/// an upper bound of the exact one; `Projected` is one: it adds the positive
/// part of `(ψ − ψ0) ∇²ψ`, which has a closed form for each wing.
///
/// **Unwrapping.** The angle of the last accepted step is kept (the term's
/// history) and continued from, so that an element swept through ±π keeps its
/// energy and force.
///
/// **Fading.** A wing in line with the axis has no angle, and near it the force
/// of the energy above grows as the inverse of the wing's height η. Bending
/// pulls the wings there, so that nothing comes to rest. Elements of
/// [`new`](Self::new) therefore have
///
/// ```text
/// V = k_w L (½ ψ0² + w(η_3) w(η_4) (½ (ψ − ψ0)² − ½ ψ0²))
/// w(η) = x⁴ (35 − 84 x + 70 x² − 20 x³),   x = min(1, η/(L/2))
/// ```
/// which is the same where both wings stand L/2 or more above the axis, has the
/// energy of a flat stitch where one is in line with it, and has continuous
/// third derivatives in between. So a wing that is wrapped at all is kept off
/// its axis by the energy it would lose. Their semidefinite second derivatives
/// keep the positive part by `(ψ, η_3, η_4)`; `Projected` adds those of `∇²ψ` and
/// `∇²η`, `GaussNewton` drops them. Where
/// `w w < ½` the angle continued from is ψ0: a wing that passes its axis has no
/// turns to remember. Deviation: [Cirio2017] has no such factor.
///
/// Degenerate cases: a wing in line with the axis (`|v| < 1e-8 L²`) or an axis
/// without length has no angle and no force; without fading the element is
/// ignored.
#[derive(Clone, Debug)]
pub struct StitchWrapping {
    stencils: Vec<[u32; 4]>,
    data: Vec<Data>,
    rest: f64,
    previous: Vec<f64>,
    /// Whether wings near their axis fade.
    fading: bool,
}

#[derive(Clone, Copy, Debug)]
struct Data {
    stiffness: f64,
    /// Square of the least `|v|` [m⁴].
    floor: f64,
    sigma: f64,
    /// Rest length of the contact [m].
    length: f64,
}

impl StitchWrapping {
    /// Elements of all stitch contacts with the rest angle ψ0 = π/2, fading.
    /// Angles continue from those of the network's points, within π of ψ0.
    pub fn new(network: &YarnNetwork) -> Self {
        let elements = Self::elements(network);
        let mut energy = Self::from_elements(&elements, &network.points, FRAC_PI_2);
        energy.fading = true;
        energy
    }

    /// Given elements, the points where their angles start [m], and the rest
    /// angle ψ0 [rad]; they do not fade.
    ///
    /// # Panics
    /// When an element names a point that does not exist.
    pub fn from_elements(elements: &[WrapElement], points: &[[f64; 3]], rest: f64) -> Self {
        let mut energy = Self {
            stencils: elements.iter().map(|e| e.points).collect(),
            data: elements
                .iter()
                .map(|e| Data {
                    stiffness: e.stiffness,
                    floor: (FLAT * e.length * e.length).powi(2),
                    sigma: e.sigma,
                    length: e.length,
                })
                .collect(),
            rest,
            previous: vec![rest; elements.len()],
            fading: false,
        };
        for e in 0..elements.len() {
            let q = gathered(&elements[e].points, points);
            if let Some(angle) = energy.angle(e, &q) {
                energy.previous[e] = angle;
            }
        }
        energy
    }

    /// Elements of a network: for every child and parent of a contact the two
    /// of [`WrapPair`], where the yarns go on beyond the contact.
    ///
    /// `σ` is that of the flat template: for a knit stitch positive on the left
    /// side and negative on the right, for a purl stitch opposite. With several
    /// parents it is the sign of the change of ψ when both wings move the way
    /// that the stitch unwraps: with a knit stitch the wings of
    /// [`ChildAtA`](WrapPair::ChildAtA) to the back and those of
    /// [`ChildAtB`](WrapPair::ChildAtB) to the front, with a purl stitch the
    /// other way round. Where the wings disagree because the layout folds them
    /// onto each other, it is again that of the flat template.
    pub fn elements(network: &YarnNetwork) -> Vec<WrapElement> {
        let mut elements = Vec::with_capacity(4 * network.stitches.len());
        for (index, contact) in network.stitches.iter().enumerate() {
            let index = index as u32;
            let child = network.child_at_a(contact);
            for parent in network.parents_at_b(contact) {
                let strands = [child, parent];
                elements.extend(element(network, index, WrapPair::ChildAtA, strands));
            }
            let child = network.child_at_b(contact);
            for parent in network.parents_at_a(contact) {
                let strands = [child, parent];
                elements.extend(element(network, index, WrapPair::ChildAtB, strands));
            }
        }
        elements
    }

    /// Angle ψ [rad] of element `e`, continued from the last accepted step;
    /// `None` where it has none.
    pub fn angle(&self, e: usize, q: &[f64; 12]) -> Option<f64> {
        let frame = frame(q, self.data[e].floor)?;
        Some(unwrap(self.data[e].sigma * frame.angle(), self.previous[e]))
    }

    /// Sign σ of element `e`.
    pub fn sigma(&self, e: usize) -> f64 {
        self.data[e].sigma
    }

    /// Rest angle ψ0 [rad].
    pub fn rest_angle(&self) -> f64 {
        self.rest
    }

    #[inline(always)]
    fn wrapped(&self, e: usize, q: &[f64; 12]) -> Option<Wrapped> {
        let data = &self.data[e];
        let frame = frame(q, data.floor)?;
        let angle = unwrap(data.sigma * frame.angle(), self.previous[e]);
        let high = if self.fading { FADE * data.length } else { 0.0 };
        let (sigma, strain) = (data.sigma, angle - self.rest);
        Some(Wrapped::new(
            frame,
            strain,
            sigma,
            data.stiffness,
            high,
            flat(self.rest),
        ))
    }

    /// Weight of a fading element.
    fn weight_of(&self, e: usize, frame: &Dihedral) -> f64 {
        both(frame, FADE * self.data[e].length)
    }

    /// Value of an element without an angle [J].
    fn constant(&self, e: usize) -> f64 {
        if self.fading {
            self.data[e].stiffness * flat(self.rest)
        } else {
            0.0
        }
    }
}

fn gathered(stencil: &[u32; 4], points: &[[f64; 3]]) -> [f64; 12] {
    let mut q = [0.0; 12];
    for (x, &p) in q.as_chunks_mut::<3>().0.iter_mut().zip(stencil) {
        *x = points[p as usize];
    }
    q
}

#[inline(always)]
fn frame(q: &[f64; 12], floor: f64) -> Option<Dihedral> {
    Dihedral::new(get(q, 0), get(q, 3), get(q, 6), get(q, 9), floor)
}

/// The angle nearest to `previous` among those that differ by full turns.
#[inline(always)]
fn unwrap(angle: f64, previous: f64) -> f64 {
    angle + TAU * ((previous - angle) / TAU).round()
}

/// Point beside a strand that is not the contact's other node; `None` where
/// the yarn ends or does not pass that node.
fn wing(network: &YarnNetwork, strand: u32, other: u32) -> Option<u32> {
    let s = &network.strands[strand as usize];
    let node = |s: u32| (s != NONE).then(|| network.strands[s as usize].node);
    match (node(s.prev), node(s.next)) {
        (Some(inside), outside) if inside == other => outside,
        (outside, Some(inside)) if inside == other => outside,
        _ => None,
    }
}

fn element(
    network: &YarnNetwork,
    index: u32,
    pair: WrapPair,
    [child, parent]: [u32; 2],
) -> Option<WrapElement> {
    let contact = &network.stitches[index as usize];
    let (x0, x1) = match pair {
        WrapPair::ChildAtA => (contact.a, contact.b),
        WrapPair::ChildAtB => (contact.b, contact.a),
    };
    let x4 = wing(network, child, x1)?;
    let x3 = wing(network, parent, x0)?;
    let mean = 0.5 * (network.material_of(child).wrapping + network.material_of(parent).wrapping);
    let points = [x0, x1, x3, x4];
    Some(WrapElement {
        points,
        contact: index,
        pair,
        sigma: sigma(network, contact, pair, points),
        stiffness: mean * contact.rest,
        length: contact.rest,
    })
}

/// See [`StitchWrapping::elements`].
fn sigma(network: &YarnNetwork, contact: &StitchContact, pair: WrapPair, points: [u32; 4]) -> f64 {
    let [x0, x1, x3, x4] = points.map(|p| V::from(network.points[p as usize]));
    let front = |node: u32| V::from(network.front[node as usize]);
    let to_front = (pair == WrapPair::ChildAtB) != contact.purl;
    let sign = if to_front { 1.0 } else { -1.0 };
    let way = (front(contact.a) + front(contact.b)) * sign;
    let floor = (FLAT * contact.rest * contact.rest).powi(2);
    let table = f64::from(contact.side) * if contact.purl { 1.0 } else { -1.0 };
    // Loops of plain stitches may be laid turned far out of the plane.
    if contact.parents == 1 {
        return table;
    }
    let Some(frame) = Dihedral::new(x0, x1, x3, x4, floor) else {
        return table;
    };
    let [_, _, g3, g4] = frame.gradient();
    let (one, two) = (g3.dot(&way), g4.dot(&way));
    if one > 0.0 && two > 0.0 {
        1.0
    } else if one < 0.0 && two < 0.0 {
        -1.0
    } else {
        table
    }
}

/// Forces [N] on `x0, x1, x3, x4` of one element, faded where it is. `previous` is the angle
/// ψ [rad] to continue from, the rest angle for one without history.
#[inline(always)]
pub(crate) fn wrapping_force(
    element: &WrapElement,
    rest: f64,
    previous: f64,
    [x0, x1, x3, x4]: [V; 4],
) -> [V; 4] {
    let floor = (FLAT * element.length * element.length).powi(2);
    let Some(frame) = Dihedral::new(x0, x1, x3, x4, floor) else {
        return [V::zeros(); 4];
    };
    let psi = unwrap(element.sigma * frame.angle(), previous);
    let (strain, sigma) = (psi - rest, element.sigma);
    let high = FADE * element.length;
    let wrapped = Wrapped::new(frame, strain, sigma, element.stiffness, high, flat(rest));
    wrapped.gradient().map(|g| -g)
}

impl StencilEnergy<4, 12> for StitchWrapping {
    const NODE_DIMS: [usize; 4] = [3; 4];

    fn stencils(&self) -> &[[u32; 4]] {
        &self.stencils
    }

    #[inline]
    fn value(&self, e: usize, q: &[f64; 12], _: &EvalPoint<'_>) -> f64 {
        match self.wrapped(e, q) {
            Some(w) => w.value,
            None => self.constant(e),
        }
    }

    #[inline]
    fn gradient(&self, e: usize, q: &[f64; 12], _: &EvalPoint<'_>, g: &mut [f64; 12]) -> f64 {
        let Some(w) = self.wrapped(e, q) else {
            *g = [0.0; 12];
            return self.constant(e);
        };
        for (i, slope) in w.gradient().into_iter().enumerate() {
            set(g, 3 * i, slope);
        }
        w.value
    }

    #[inline]
    fn hessian(
        &self,
        e: usize,
        q: &[f64; 12],
        _: &EvalPoint<'_>,
        curvature: Curvature,
        g: &mut [f64; 12],
        h: &mut [[f64; 12]; 12],
    ) -> f64 {
        let Some(w) = self.wrapped(e, q) else {
            *g = [0.0; 12];
            *h = [[0.0; 12]; 12];
            return self.constant(e);
        };
        for (i, slope) in w.gradient().into_iter().enumerate() {
            set(g, 3 * i, slope);
        }
        w.hessian(curvature, h);
        w.value
    }

    fn commit(&mut self, at: &EvalPoint<'_>) {
        for e in 0..self.stencils.len() {
            let q = at.gather::<4, 12>(&[3; 4], &self.stencils[e]);
            let Some(frame) = frame(&q, self.data[e].floor) else {
                continue;
            };
            // A wing that passes its axis has no turns to remember.
            let near = match self.fading && self.weight_of(e, &frame) < 0.5 {
                true => self.rest,
                false => self.previous[e],
            };
            let angle = unwrap(self.data[e].sigma * frame.angle(), near);
            if angle.is_finite() {
                self.previous[e] = angle;
            }
        }
    }

    fn history(&self) -> &[f64] {
        &self.previous
    }

    fn restore_history(&mut self, history: &[f64]) {
        self.previous.copy_from_slice(history);
    }

    fn heap_bytes(&self) -> usize {
        size_of_val(&self.stencils[..])
            + size_of_val(&self.data[..])
            + size_of_val(&self.previous[..])
    }
}

#[cfg(test)]
mod tests {
    use selvedge_energy::DofLayout;

    use super::*;

    #[test]
    fn force_is_minus_the_gradient() {
        fn at(q: &[f64; 12]) -> EvalPoint<'_> {
            EvalPoint {
                layout: DofLayout::points(4),
                q,
                q_start: q,
                dt: 1.0,
            }
        }
        for sigma in [-1.0, 1.0] {
            let mut q = [
                0.0, 0.0, 0.0, 0.14, 0.2, 0.02, 0.5, 0.2, -0.1, -0.36, 0.03, -0.15,
            ];
            let element = WrapElement {
                points: [0, 1, 2, 3],
                contact: 0,
                pair: WrapPair::ChildAtA,
                sigma,
                stiffness: 0.7,
                length: 0.25,
            };
            let points = q.as_chunks::<3>().0;
            let mut energy = StitchWrapping::from_elements(&[element], points, FRAC_PI_2);
            let mut g = [0.0; 12];
            energy.gradient(0, &q, &at(&q), &mut g);
            let x = std::array::from_fn(|i| get(&q, 3 * i));
            let forces = wrapping_force(&element, FRAC_PI_2, 0.0, x);
            // The force alone fades; elements given one by one do not, but
            // these wings are high.
            for (i, f) in forces.iter().enumerate() {
                let g = get(&g, 3 * i);
                assert!((f + g).norm() < 1e-13 * g.norm());
            }
            energy.fading = true;
            q[9..12].copy_from_slice(&[-0.1, -0.09, 0.03]);
            energy.gradient(0, &q, &at(&q), &mut g);
            let x = std::array::from_fn(|i| get(&q, 3 * i));
            let forces = wrapping_force(&element, FRAC_PI_2, energy.previous[0], x);
            let frame = Dihedral::new(x[0], x[1], x[2], x[3], 0.0).expect("wings");
            let fade = both(&frame, FADE * element.length);
            assert!(fade > 0.1 && fade < 0.9, "{fade}");
            for (i, f) in forces.iter().enumerate() {
                let g = get(&g, 3 * i);
                assert!((f + g).norm() < 1e-13 * g.norm());
            }
            let x = [x[0], x[1], x[2], x[0]];
            let none = wrapping_force(&element, FRAC_PI_2, 0.0, x);
            assert_eq!(none, [V::zeros(); 4]);
        }
    }
}
