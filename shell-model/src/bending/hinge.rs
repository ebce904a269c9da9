use std::marker::PhantomData;
use std::ops::Range;

use selvedge_energy::{Curvature, EvalPoint, StencilEnergy};
use wide::f64x4;

use super::frame::{Floors, HingeFrame, WingBlocks, unwrap};
use crate::lanes::{Lanes, apart, together};
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

/// What a hinge, or each of four, brings along to an evaluation.
struct Own<S> {
    stiffness: S,
    rest: S,
    floors: Floors<S>,
    /// Angle at the last accepted step \[rad\].
    previous: S,
    /// `β_b/dt`
    time: S,
}

impl<S: Lanes> Own<S> {
    #[inline(always)]
    fn numbers(&self) -> [S; 7] {
        let [a, b, c] = self.floors;
        [self.stiffness, self.rest, a, b, c, self.previous, self.time]
    }

    #[inline(always)]
    fn of([stiffness, rest, a, b, c, previous, time]: [S; 7]) -> Self {
        Self {
            stiffness,
            rest,
            floors: [a, b, c],
            previous,
            time,
        }
    }
}

/// Angular state of a hinge, or of four, at an evaluation.
struct Turned<S> {
    value: S,
    /// `∂E/∂θ`
    moment: S,
    /// Factor of `∇θ ∇θᵀ`, and its part that is never negative.
    stiffness: [S; 2],
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
    fn own(&self, e: usize, at: &EvalPoint<'_>) -> Own<f64> {
        let hot = &self.hot[e];
        Own {
            stiffness: hot.stiffness,
            rest: hot.rest,
            floors: hot.floors,
            previous: self.previous[e],
            time: match D::KIND {
                DampingKind::Off => 0.0,
                _ => self.beta[e] / at.dt,
            },
        }
    }

    #[inline(always)]
    fn start(&self, e: usize, at: &EvalPoint<'_>) -> [f64; 12] {
        match D::KIND {
            DampingKind::Off => [0.0; 12],
            _ => at.gather_start::<4, 12>(&[3; 4], &self.stencils[e]),
        }
    }

    /// Angle-dependent part; `start` is read when there is friction.
    #[inline(always)]
    fn turned<S: Lanes>(
        own: &Own<S>,
        frame: &HingeFrame<S>,
        gradient: &[V<S>; 4],
        q: &[S; 12],
        start: &[S; 12],
    ) -> Turned<S> {
        let zero = S::splat(0.0);
        let k = own.stiffness;
        let measure = |frame: &HingeFrame<S>| unwrap(frame.angle(), own.previous).each(L::measure);
        let [phi, slope, bend] = measure(frame);
        let strain = phi - own.rest;
        let half = S::splat(0.5) * k;
        let mut value = half * strain * strain;
        let mut stress = k * strain;
        let mut tangent = k;
        if D::KIND != DampingKind::Off {
            // Strain increment over the step.
            let change = if D::KIND == DampingKind::Rate {
                let part = |i| dot(gradient[i], sub(node(q, i), node(start, i)));
                slope * (part(0) + part(1) + part(2) + part(3))
            } else {
                match HingeFrame::new(start, &own.floors) {
                    Some(before) => phi - measure(&before)[0],
                    None => zero,
                }
            };
            if D::KIND == DampingKind::Incremental {
                value = value + half * own.time * change * change;
            }
            stress = stress + k * own.time * change;
            tangent = tangent * (S::splat(1.0) + own.time);
        }
        let material = tangent * slope * slope;
        let curved = stress * bend;
        Turned {
            value,
            moment: stress * slope,
            stiffness: [
                material + curved,
                material + curved.greater(zero, curved, zero),
            ],
        }
    }

    #[inline(always)]
    fn write_gradient<S: Lanes>(turned: &Turned<S>, theta: &[V<S>; 4], g: &mut [S; 12]) {
        for i in 0..4 {
            set_node(g, i, scale(turned.moment, theta[i]));
        }
    }

    #[inline(always)]
    fn write_hessian<S: Lanes>(
        turned: &Turned<S>,
        frame: &HingeFrame<S>,
        theta: &[V<S>; 4],
        curvature: Curvature,
        h: &mut [[S; 12]; 12],
    ) {
        let [exact, positive] = turned.stiffness;
        let (t, il) = (frame.t, frame.inverse_length);
        let [one, two] = &frame.wings;
        match curvature {
            Curvature::Exact => {
                let a = one.second(t, il, turned.moment);
                let b = two.second(t, il, turned.moment);
                write(exact, theta, &a, &b, h);
            }
            Curvature::Projected => {
                let [a, b] = one.positive(2, t, il, turned.moment);
                let [c, d] = two.positive(3, t, il, turned.moment);
                write_squares(&[stretched(positive, theta), a, b, c, d], h);
            }
            Curvature::GaussNewton => write_squares(&[stretched(positive, theta)], h),
        }
    }

    /// Four consecutive hinges, from their own data to what an evaluation
    /// needs; `None` when one is degenerate or friction asks for more.
    #[inline(always)]
    fn four(&self, e: usize, at: &EvalPoint<'_>) -> Option<Four> {
        if D::KIND == DampingKind::Incremental {
            return None;
        }
        // written out: `map` of an array of closures' results is not inlined
        let q = |l: usize| at.gather::<4, 12>(&[3; 4], &self.stencils[e + l]);
        let q = together([&q(0), &q(1), &q(2), &q(3)]);
        let start = match D::KIND {
            DampingKind::Off => q,
            _ => {
                let start = |l: usize| at.gather_start::<4, 12>(&[3; 4], &self.stencils[e + l]);
                together([&start(0), &start(1), &start(2), &start(3)])
            }
        };
        let own = |l: usize| self.own(e + l, at).numbers();
        let own = Own::of(together([&own(0), &own(1), &own(2), &own(3)]));
        let frame = HingeFrame::new(&q, &own.floors)?;
        let theta = frame.gradient();
        let turned = Self::turned(&own, &frame, &theta, &q, &start);
        Some((frame, theta, turned))
    }
}

type Four = (HingeFrame<f64x4>, [V<f64x4>; 4], Turned<f64x4>);

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
                let start = self.start(e, at);
                Self::turned(&self.own(e, at), &frame, &[[0.0; 3]; 4], q, &start).value
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
        let own = self.own(e, at);
        let Some(frame) = HingeFrame::new(q, &own.floors) else {
            *g = [0.0; 12];
            return 0.0;
        };
        let theta = frame.gradient();
        let turned = Self::turned(&own, &frame, &theta, q, &self.start(e, at));
        Self::write_gradient(&turned, &theta, g);
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
        let own = self.own(e, at);
        let Some(frame) = HingeFrame::new(q, &own.floors) else {
            *g = [0.0; 12];
            *h = [[0.0; 12]; 12];
            return 0.0;
        };
        let theta = frame.gradient();
        let turned = Self::turned(&own, &frame, &theta, q, &self.start(e, at));
        Self::write_gradient(&turned, &theta, g);
        Self::write_hessian(&turned, &frame, &theta, curvature, h);
        turned.value
    }

    fn gradients(&self, range: Range<usize>, at: &EvalPoint<'_>, g: &mut [[f64; 12]]) -> f64 {
        let mut sum = 0.0;
        let mut e = range.start;
        for g in g[..range.len()].chunks_mut(4) {
            if let [a, b, c, d] = g
                && let Some((_, theta, turned)) = self.four(e, at)
            {
                let mut lanes = [f64x4::ZERO; 12];
                Self::write_gradient(&turned, &theta, &mut lanes);
                apart(&lanes, [a, b, c, d]);
                sum = turned.value.to_array().iter().fold(sum, |sum, v| sum + v);
            } else {
                for (l, g) in g.iter_mut().enumerate() {
                    let q = at.gather::<4, 12>(&[3; 4], &self.stencils[e + l]);
                    sum += self.gradient(e + l, &q, at, g);
                }
            }
            e += 4;
        }
        sum
    }

    fn hessians(
        &self,
        range: Range<usize>,
        at: &EvalPoint<'_>,
        curvature: Curvature,
        g: &mut [[f64; 12]],
        h: &mut [[[f64; 12]; 12]],
    ) -> f64 {
        let mut sum = 0.0;
        let mut e = range.start;
        let (g, h) = (&mut g[..range.len()], &mut h[..range.len()]);
        for (g, h) in g.chunks_mut(4).zip(h.chunks_mut(4)) {
            if let ([a, b, c, d], [p, q, r, s]) = (&mut *g, &mut *h)
                && let Some((frame, theta, turned)) = self.four(e, at)
            {
                let mut lanes = [f64x4::ZERO; 12];
                Self::write_gradient(&turned, &theta, &mut lanes);
                apart(&lanes, [a, b, c, d]);
                let mut lanes = [[f64x4::ZERO; 12]; 12];
                Self::write_hessian(&turned, &frame, &theta, curvature, &mut lanes);
                for (i, row) in lanes.iter().enumerate() {
                    apart(row, [&mut p[i], &mut q[i], &mut r[i], &mut s[i]]);
                }
                sum = turned.value.to_array().iter().fold(sum, |sum, v| sum + v);
            } else {
                for (l, (g, h)) in g.iter_mut().zip(h).enumerate() {
                    let q = at.gather::<4, 12>(&[3; 4], &self.stencils[e + l]);
                    sum += self.hessian(e + l, &q, at, curvature, g, h);
                }
            }
            e += 4;
        }
        sum
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
    let areas = [cross(e, sub(node(q, 2), x0)), cross(e, sub(node(q, 3), x0))];
    let l2 = dot(e, e);
    // Beyond rounding of what follows, which most hinges need not go through.
    let whole = 1.001 * (WHOLE / GONE) * (WHOLE / GONE);
    if l2 > whole * floors[0]
        && dot(areas[0], areas[0]) > whole * floors[1] * l2
        && dot(areas[1], areas[1]) > whole * floors[2] * l2
    {
        return 1.0;
    }
    let l = norm(e);
    let sizes = [l, norm(areas[0]) / l, norm(areas[1]) / l];
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
fn stretched<S: Lanes>(k: S, theta: &[V<S>; 4]) -> [S; 12] {
    let root = k.sqrt();
    let mut v = [k; 12];
    for i in 0..4 {
        set_node(&mut v, i, scale(root, theta[i]));
    }
    v
}

/// Writes `Σ v vᵀ`.
#[inline(always)]
fn write_squares<S: Lanes, const K: usize>(vectors: &[[S; 12]; K], h: &mut [[S; 12]; 12]) {
    for i in 0..12 {
        let mut row = [S::splat(0.0); 12];
        for v in vectors {
            for j in 0..12 {
                row[j] = row[j] + v[i] * v[j];
            }
        }
        h[i] = row;
    }
}

/// Writes `k ∇θ ∇θᵀ` plus the wings' blocks.
#[inline(always)]
fn write<S: Lanes>(
    k: S,
    theta: &[V<S>; 4],
    one: &WingBlocks<S>,
    two: &WingBlocks<S>,
    h: &mut [[S; 12]; 12],
) {
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
    let zero = [[S::splat(0.0); 3]; 3];
    // A translation does nothing: every block row sums to zero.
    let mut h01 = zero;
    let mut h02 = zero;
    let mut h03 = zero;
    for i in 0..3 {
        for j in 0..3 {
            h01[i][j] = -(h11[i][j] + h12[j][i] + h13[j][i]);
            h02[i][j] = -(h12[i][j] + h22[i][j] + h23[j][i]);
            h03[i][j] = -(h13[i][j] + h23[i][j] + h33[i][j]);
        }
    }
    let mut h00 = zero;
    for i in 0..3 {
        for j in 0..3 {
            let (a, b) = (
                h01[i][j] + h02[i][j] + h03[i][j],
                h01[j][i] + h02[j][i] + h03[j][i],
            );
            h00[i][j] = S::splat(-0.5) * (a + b);
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
