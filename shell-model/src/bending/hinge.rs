use std::marker::PhantomData;

use selvedge_energy::{Curvature, EvalPoint, StencilEnergy};

use super::frame::{Floors, HingeFrame, WingBlocks, unwrap};
use crate::vec3::{
    V, add, cross, dot, node, norm, outer, put, put_transposed, scale, set_node, sub,
};
use crate::{Damping, DampingKind};

/// Rest data of one hinge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HingeRest {
    /// `x0, x1, x2, x3` of [`Hinge`](crate::Hinge).
    pub points: [u32; 4],
    /// `k_e` [N·m] (J/rad²).
    pub stiffness: f64,
    /// `θ̄` \[rad\].
    pub angle: f64,
    /// Rest length of the edge \[m\]; 0 turns the guard against a collapsing
    /// edge off.
    pub length: f64,
    /// Rest heights of the wings \[m\]; 0 turns the guard of a wing off.
    pub heights: [f64; 2],
    /// `β_b` \[s\].
    pub damping: f64,
}

/// A function of the hinge angle, as a type.
pub trait AngleLaw: sealed::Sealed + Copy + std::fmt::Debug + Send + Sync + 'static {
    /// Strain measure `φ(θ)`, `φ'` and `φ''`; the energy is `½ k (φ − φ̄)²`.
    fn measure(angle: f64) -> [f64; 3];
}

/// `φ = θ`.
#[derive(Clone, Copy, Debug, Default)]
pub struct PlainAngle;

/// `φ = 2 tan(θ/2)`: grows without bound as the hinge closes at `±π`, which
/// keeps wings from passing through each other.
#[derive(Clone, Copy, Debug, Default)]
pub struct TangentAngle;

mod sealed {
    pub trait Sealed {}
    impl Sealed for super::PlainAngle {}
    impl Sealed for super::TangentAngle {}
}

impl AngleLaw for PlainAngle {
    #[inline(always)]
    fn measure(angle: f64) -> [f64; 3] {
        [angle, 1.0, 0.0]
    }
}

impl AngleLaw for TangentAngle {
    #[inline(always)]
    fn measure(angle: f64) -> [f64; 3] {
        let t = (0.5 * angle).tan();
        let slope = 1.0 + t * t;
        [2.0 * t, slope, slope * t]
    }
}

/// Bending energy of hinges, with internal friction and angle law by type.
///
/// ```text
/// θ = atan2((n_1 × n_2)·t, n_1·n_2),   E = ½ k_e (θ − θ̄)²
/// ∇E = k_e (θ − θ̄) ∇θ,   ∇²E = k_e [∇θ ∇θᵀ + (θ − θ̄) ∇²θ]
/// ```
/// \[Grinspun2003\], \[Tamstorf2013\]; the closed form of `∇²θ` is in the module.
/// With [`TangentAngle`] `θ` is replaced by `2 tan(θ/2)`. Friction adds the
/// moment `k_e β_b θ̇`, see [`Damping`](crate::Damping).
///
/// | symbol | is | unit |
/// |---|---|---|
/// | `θ, θ̄` | angle and rest angle, positive where the surface bulges along its normals | rad |
/// | `k_e` | stiffness | N·m |
/// | `β_b` | dissipation time | s |
/// | `η, l` | wing height, edge length | m |
///
/// Second derivatives: `Exact`; `Projected` takes the positive part of each
/// wing's share of `∇²θ`, at least as large as the exact one; `GaussNewton` is
/// `k_e ∇θ ∇θᵀ`.
///
/// **Unwrapping.** The angle at the last accepted step is kept (the term's
/// history) and the angle is continued from it, so that a hinge swept through
/// `±π` keeps its energy and force. It starts at `θ̄`.
///
/// **Degenerate wings.** `|∇θ| = 1/η` has no bound. The stiffness is scaled by
/// a smoothstep that falls from 1 at a tenth of a rest height (or of the rest
/// length of the edge) to 0 at a fiftieth, taken at the start of the step and
/// constant in it. Below a fiftieth the hinge is ignored in any case, so no
/// force exceeds that at a height of `η̄/50`.
#[derive(Clone, Debug)]
pub struct BendingHinge<D, L = PlainAngle> {
    stencils: Vec<[u32; 4]>,
    hot: Vec<Hot>,
    rest_stiffness: Vec<f64>,
    beta: Vec<f64>,
    previous: Vec<f64>,
    law: PhantomData<(D, L)>,
}

#[derive(Clone, Copy, Debug)]
struct Hot {
    /// `k_e` times the lagged scale.
    stiffness: f64,
    /// `φ̄`
    rest: f64,
    floors: Floors,
}

/// Fraction of a rest size below which a hinge is ignored, and above which it
/// is whole.
const GONE: f64 = 0.02;
const WHOLE: f64 = 0.1;

/// Angular state of one hinge at an evaluation.
struct Turned {
    value: f64,
    /// `∂E/∂θ`
    moment: f64,
    /// Factor of `∇θ ∇θᵀ`, and its part that is never negative.
    stiffness: [f64; 2],
}

impl<D: Damping, L: AngleLaw> BendingHinge<D, L> {
    /// Hinges from their rest data.
    pub fn new(rest: &[HingeRest]) -> Self {
        let floor = |size: f64| (GONE * size).powi(2).max(f64::MIN_POSITIVE);
        Self {
            stencils: rest.iter().map(|r| r.points).collect(),
            hot: rest
                .iter()
                .map(|r| Hot {
                    stiffness: r.stiffness,
                    rest: L::measure(r.angle)[0],
                    floors: [floor(r.length), floor(r.heights[0]), floor(r.heights[1])],
                })
                .collect(),
            rest_stiffness: rest.iter().map(|r| r.stiffness).collect(),
            beta: match D::KIND {
                DampingKind::Off => Vec::new(),
                _ => rest.iter().map(|r| r.damping).collect(),
            },
            previous: rest.iter().map(|r| r.angle).collect(),
            law: PhantomData,
        }
    }

    #[inline(always)]
    fn turned(
        &self,
        e: usize,
        frame: &HingeFrame,
        q: &[f64; 12],
        gradient: &[V; 4],
        at: &EvalPoint<'_>,
    ) -> Turned {
        let hot = &self.hot[e];
        let k = hot.stiffness;
        let [phi, slope, bend] = L::measure(unwrap(frame.angle(), self.previous[e]));
        let strain = phi - hot.rest;
        let mut value = 0.5 * k * strain * strain;
        let mut stress = k * strain;
        let mut tangent = k;
        if D::KIND != DampingKind::Off {
            let time = self.beta[e] / at.dt;
            let start = at.gather_start::<4, 12>(&[3; 4], &self.stencils[e]);
            // Strain increment over the step.
            let change = if D::KIND == DampingKind::Rate {
                let move_ = |i| sub(node(q, i), node(&start, i));
                slope * (0..4).map(|i| dot(gradient[i], move_(i))).sum::<f64>()
            } else {
                match HingeFrame::new(&start, &hot.floors) {
                    Some(f) => phi - L::measure(unwrap(f.angle(), self.previous[e]))[0],
                    None => 0.0,
                }
            };
            if D::KIND == DampingKind::Incremental {
                value += 0.5 * k * time * change * change;
            }
            stress += k * time * change;
            tangent *= 1.0 + time;
        }
        let material = tangent * slope * slope;
        let curved = stress * bend;
        Turned {
            value,
            moment: stress * slope,
            stiffness: [material + curved, material + curved.max(0.0)],
        }
    }
}

impl<D: Damping, L: AngleLaw> StencilEnergy<4, 12> for BendingHinge<D, L> {
    const NODE_DIMS: [usize; 4] = [3; 4];

    fn stencils(&self) -> &[[u32; 4]] {
        &self.stencils
    }

    #[inline]
    fn value(&self, e: usize, q: &[f64; 12], at: &EvalPoint<'_>) -> f64 {
        match HingeFrame::new(q, &self.hot[e].floors) {
            // Only friction on increments reads more than the angle.
            Some(frame) if D::KIND == DampingKind::Incremental => {
                self.turned(e, &frame, q, &[[0.0; 3]; 4], at).value
            }
            Some(frame) => {
                let hot = &self.hot[e];
                let strain = L::measure(unwrap(frame.angle(), self.previous[e]))[0] - hot.rest;
                0.5 * hot.stiffness * strain * strain
            }
            None => 0.0,
        }
    }

    #[inline]
    fn gradient(&self, e: usize, q: &[f64; 12], at: &EvalPoint<'_>, g: &mut [f64; 12]) -> f64 {
        let Some(frame) = HingeFrame::new(q, &self.hot[e].floors) else {
            *g = [0.0; 12];
            return 0.0;
        };
        let theta = frame.gradient();
        let turned = self.turned(e, &frame, q, &theta, at);
        for i in 0..4 {
            set_node(g, i, scale(turned.moment, theta[i]));
        }
        turned.value
    }

    #[inline]
    fn hessian(
        &self,
        e: usize,
        q: &[f64; 12],
        at: &EvalPoint<'_>,
        curvature: Curvature,
        g: &mut [f64; 12],
        h: &mut [[f64; 12]; 12],
    ) -> f64 {
        let Some(frame) = HingeFrame::new(q, &self.hot[e].floors) else {
            *g = [0.0; 12];
            *h = [[0.0; 12]; 12];
            return 0.0;
        };
        let theta = frame.gradient();
        let turned = self.turned(e, &frame, q, &theta, at);
        for i in 0..4 {
            set_node(g, i, scale(turned.moment, theta[i]));
        }
        let [exact, positive] = turned.stiffness;
        let (t, il) = (frame.t, frame.inverse_length);
        let [one, two] = &frame.wings;
        match curvature {
            Curvature::Exact => {
                let a = one.second(t, il, turned.moment);
                let b = two.second(t, il, turned.moment);
                write(exact, &theta, &a, &b, h);
            }
            Curvature::Projected => {
                let [a, b] = one.positive(2, t, il, turned.moment);
                let [c, d] = two.positive(3, t, il, turned.moment);
                write_squares(&[stretched(positive, &theta), a, b, c, d], h);
            }
            Curvature::GaussNewton => write_squares(&[stretched(positive, &theta)], h),
        }
        turned.value
    }

    fn is_conservative(&self) -> bool {
        D::KIND != DampingKind::Rate
    }

    fn begin_step(&mut self, at: &EvalPoint<'_>) {
        for e in 0..self.stencils.len() {
            let q = at.gather_start::<4, 12>(&[3; 4], &self.stencils[e]);
            self.hot[e].stiffness = self.rest_stiffness[e] * wholeness(&q, &self.hot[e].floors);
        }
    }

    fn commit(&mut self, at: &EvalPoint<'_>) {
        for e in 0..self.stencils.len() {
            let q = at.gather::<4, 12>(&[3; 4], &self.stencils[e]);
            if let Some(frame) = HingeFrame::new(&q, &self.hot[e].floors) {
                let angle = unwrap(frame.angle(), self.previous[e]);
                if angle.is_finite() {
                    self.previous[e] = angle;
                }
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
            + size_of_val(&self.hot[..])
            + size_of_val(&self.rest_stiffness[..])
            + size_of_val(&self.beta[..])
            + size_of_val(&self.previous[..])
    }
}

/// `Π smoothstep(size/rest size)` over the edge and both wings.
fn wholeness(q: &[f64; 12], floors: &Floors) -> f64 {
    let x0 = node(q, 0);
    let e = sub(node(q, 1), x0);
    let l = norm(e);
    let sizes = [
        l,
        norm(cross(e, sub(node(q, 2), x0))) / l,
        norm(cross(e, sub(node(q, 3), x0))) / l,
    ];
    let mut product = 1.0;
    for (size, floor) in sizes.into_iter().zip(floors) {
        if *floor > f64::MIN_POSITIVE {
            // `size` is NaN when the edge has no length.
            let z = (size / floor.sqrt() - 1.0) / (WHOLE / GONE - 1.0);
            let z = if z > 0.0 { z.min(1.0) } else { 0.0 };
            product *= z * z * (3.0 - 2.0 * z);
        }
    }
    product
}

/// `√k ∇θ`
#[inline(always)]
fn stretched(k: f64, theta: &[V; 4]) -> [f64; 12] {
    let root = k.sqrt();
    let mut v = [0.0; 12];
    for i in 0..4 {
        set_node(&mut v, i, scale(root, theta[i]));
    }
    v
}

/// Writes `Σ v vᵀ`.
#[inline(always)]
fn write_squares<const K: usize>(vectors: &[[f64; 12]; K], h: &mut [[f64; 12]; 12]) {
    for i in 0..12 {
        let mut row = [0.0; 12];
        for v in vectors {
            for j in 0..12 {
                row[j] += v[i] * v[j];
            }
        }
        h[i] = row;
    }
}

/// Writes `k ∇θ ∇θᵀ` plus the wings' blocks.
#[inline(always)]
fn write(k: f64, theta: &[V; 4], one: &WingBlocks, two: &WingBlocks, h: &mut [[f64; 12]; 12]) {
    let [_, g1, g2, g3] = *theta;
    let mut h11 = outer(scale(k, g1), g1);
    let mut h12 = outer(scale(k, g1), g2);
    let mut h13 = outer(scale(k, g1), g3);
    let mut h22 = outer(scale(k, g2), g2);
    let h23 = outer(scale(k, g2), g3);
    let mut h33 = outer(scale(k, g3), g3);
    for i in 0..3 {
        h11[i] = add(h11[i], add(one.b11[i], two.b11[i]));
        h12[i] = add(h12[i], one.b1o[i]);
        h13[i] = add(h13[i], two.b1o[i]);
        h22[i] = add(h22[i], one.boo[i]);
        h33[i] = add(h33[i], two.boo[i]);
    }
    // Symmetric to the last bit.
    for b in [&mut h11, &mut h22, &mut h33] {
        for (i, j) in [(0, 1), (0, 2), (1, 2)] {
            b[j][i] = b[i][j];
        }
    }
    // A translation does nothing: every block row sums to zero.
    let mut h01 = [[0.0; 3]; 3];
    let mut h02 = [[0.0; 3]; 3];
    let mut h03 = [[0.0; 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            h01[i][j] = -(h11[i][j] + h12[j][i] + h13[j][i]);
            h02[i][j] = -(h12[i][j] + h22[i][j] + h23[j][i]);
            h03[i][j] = -(h13[i][j] + h23[i][j] + h33[i][j]);
        }
    }
    let mut h00 = [[0.0; 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            let (a, b) = (
                h01[i][j] + h02[i][j] + h03[i][j],
                h01[j][i] + h02[j][i] + h03[j][i],
            );
            h00[i][j] = -0.5 * (a + b);
        }
    }
    put(h, 0, 0, &h00);
    for (i, j, b) in [
        (0, 1, &h01),
        (0, 2, &h02),
        (0, 3, &h03),
        (1, 2, &h12),
        (1, 3, &h13),
        (2, 3, &h23),
    ] {
        put(h, i, j, b);
        put_transposed(h, j, i, b);
    }
    put(h, 1, 1, &h11);
    put(h, 2, 2, &h22);
    put(h, 3, 3, &h33);
}
