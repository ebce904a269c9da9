use std::marker::PhantomData;
use std::ops::Range;

use selvedge_energy::{Curvature, EvalPoint, StencilEnergy};
use wide::f64x4;

use super::blocks::{stretched, write, write_squares};
use super::collapse::{floors, wholeness};
use super::frame::{Floors, HingeFrame, unwrap};
use super::law::{AngleLaw, PlainAngle};
use crate::lanes::{Lanes, apart, together};
use crate::vec3::{V, dot, node, scale, set_node, sub};
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

/// Bending energy of hinges, with internal friction and angle law by type.
///
/// ```text
/// θ = atan2((n_1 × n_2)·t, n_1·n_2),   E = ½ k_e (θ − θ̄)²
/// ∇E = k_e (θ − θ̄) ∇θ,   ∇²E = k_e [∇θ ∇θᵀ + (θ − θ̄) ∇²θ]
/// ```
/// \[Grinspun2003\], \[Tamstorf2013\]; the closed form of `∇²θ` is in the module.
/// With [`TangentAngle`](crate::TangentAngle) `θ` is replaced by `2 tan(θ/2)`. Friction adds the
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
        Self {
            stencils: rest.iter().map(|r| r.points).collect(),
            hot: rest
                .iter()
                .map(|r| Hot {
                    stiffness: r.stiffness,
                    rest: L::measure(r.angle)[0],
                    floors: floors(r.length, r.heights),
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
