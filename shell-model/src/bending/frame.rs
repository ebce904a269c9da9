//! Angle of a hinge and its derivatives.

use std::f64::consts::TAU;

use super::arctangent::arctangent;
use crate::lanes::Lanes;
use crate::vec3::{Block, V, add, blend, cross, dot, minus, node, outer, scale, set_node, sub};

/// Frame of one wing.
///
/// ```text
/// o = x0 + s e + η m,   n = normal of the wing's triangle
/// ∇θ  = − Σ_w (α_w ⊗ n_w),      α = (−(1−s), −s, 1 at o)/η,   β = (−1, 1)/l
/// ∇²θ = Σ_w (P_w + P_wᵀ),       P = (α⊗n)(α⊗m)ᵀ + (β⊗n)(α⊗t + ½ β⊗m)ᵀ
/// ```
#[derive(Clone, Copy)]
pub(crate) struct WingFrame<S = f64> {
    pub n: V<S>,
    pub m: V<S>,
    /// `s`
    pub foot: S,
    /// `1/η` [1/m]
    pub inverse_height: S,
}

/// Frames of a hinge `(x0, x1, x2, x3)`, see [`Hinge`](crate::Hinge).
#[derive(Clone, Copy)]
pub(crate) struct HingeFrame<S = f64> {
    pub t: V<S>,
    /// `1/l` [1/m]
    pub inverse_length: S,
    pub wings: [WingFrame<S>; 2],
}

/// Squared edge length and wing heights [m²] below which a hinge is ignored.
pub(crate) type Floors<S = f64> = [S; 3];

impl<S: Lanes> HingeFrame<S> {
    /// `None` when the edge or a wing is degenerate, of any hinge. NaN is not: it must reach
    /// whoever checks the result.
    #[inline(always)]
    pub fn new(q: &[S; 12], floors: &Floors<S>) -> Option<Self> {
        let x0 = node(q, 0);
        let e = sub(node(q, 1), x0);
        let (d2, d3) = (sub(node(q, 2), x0), sub(node(q, 3), x0));
        let l2 = dot(e, e);
        let (area1, area2) = (cross(e, d2), cross(d3, e));
        let (a1, a2) = (dot(area1, area1), dot(area2, area2));
        if l2.any_at_most(floors[0])
            || a1.any_at_most(floors[1] * l2)
            || a2.any_at_most(floors[2] * l2)
        {
            return None;
        }
        let one = S::splat(1.0);
        let l = l2.sqrt();
        let inverse_length = one / l;
        let (i1, i2) = (one / a1.sqrt(), one / a2.sqrt());
        let t = scale(inverse_length, e);
        let (n1, n2) = (scale(i1, area1), scale(i2, area2));
        let inverse_l2 = inverse_length * inverse_length;
        Some(Self {
            t,
            inverse_length,
            wings: [
                WingFrame {
                    n: n1,
                    m: cross(n1, t),
                    foot: dot(d2, e) * inverse_l2,
                    inverse_height: l * i1,
                },
                WingFrame {
                    n: n2,
                    m: cross(t, n2),
                    foot: dot(d3, e) * inverse_l2,
                    inverse_height: l * i2,
                },
            ],
        })
    }

    /// `θ` in (−π, π], positive where the surface bulges along its normals.
    #[inline(always)]
    pub fn angle(&self) -> S {
        let [one, two] = &self.wings;
        arctangent(-dot(one.m, two.n), dot(one.n, two.n))
    }

    /// `∇θ`
    #[inline(always)]
    pub fn gradient(&self) -> [V<S>; 4] {
        let [one, two] = &self.wings;
        let (g2, g3) = (
            scale(-one.inverse_height, one.n),
            scale(-two.inverse_height, two.n),
        );
        let g1 = blend(-one.foot, g2, -two.foot, g3);
        let g0 = minus(add(g1, add(g2, g3)));
        [g0, g1, g2, g3]
    }
}

/// The angle nearest to `previous` among those that differ by full turns.
#[inline(always)]
pub(crate) fn unwrap<S: Lanes>(angle: S, previous: S) -> S {
    angle + S::splat(TAU) * ((previous - angle) * S::splat(1.0 / TAU)).round()
}

/// Blocks `(1,1), (1,o), (o,o)` of a wing's contribution; node 0 follows from
/// translation, the other wing's node has none.
pub(crate) struct WingBlocks<S = f64> {
    pub b11: Block<S>,
    pub b1o: Block<S>,
    pub boo: Block<S>,
}

impl<S: Lanes> WingFrame<S> {
    /// `c (P + Pᵀ)`
    #[inline(always)]
    pub fn second(&self, t: V<S>, inverse_length: S, c: S) -> WingBlocks<S> {
        let beta = inverse_length;
        let alpha_o = self.inverse_height;
        let alpha_1 = -self.foot * alpha_o;
        let nm = outer(self.n, self.m);
        let nt = outer(self.n, t);
        // Coefficients of n mᵀ + m nᵀ, n tᵀ and t nᵀ in each block.
        let m11 = c * (alpha_1 * alpha_1 + S::splat(0.5) * beta * beta);
        let m1o = c * alpha_1 * alpha_o;
        let moo = c * alpha_o * alpha_o;
        let t11 = c * beta * alpha_1;
        let t1o = c * beta * alpha_o;
        let zero = [[S::splat(0.0); 3]; 3];
        let mut out = WingBlocks {
            b11: zero,
            b1o: zero,
            boo: zero,
        };
        for i in 0..3 {
            for j in 0..3 {
                let s = nm[i][j] + nm[j][i];
                out.b11[i][j] = m11 * s + t11 * (nt[i][j] + nt[j][i]);
                out.b1o[i][j] = m1o * s + t1o * nt[i][j];
                out.boo[i][j] = moo * s;
            }
        }
        out
    }

    /// The positive semidefinite part of `c (P + Pᵀ)`.
    ///
    /// `P = L Rᵀ` has rank 2 and its factors span orthogonal spaces, so the
    /// positive part is `½ (|Pᵀ| + |P| + P + Pᵀ)`. With the Gram matrices
    /// `G_L, G_R` of the factors, `|Pᵀ| = L X Lᵀ` and `|P| = R X⁻¹ Rᵀ` where
    /// `X G_L X = G_R`: the geometric mean of `G_L⁻¹` and `G_R`, which for 2×2
    /// matrices is
    ///
    /// ```text
    /// X = γ S/√det S,   S = adj G_L/√det G_L + G_R/√det G_R,   γ = (det G_R/det G_L)^¼
    /// ```
    /// With `X = Λ Λᵀ` the sum is `½ W Wᵀ`, `W = L Λ + sign(c) R Λ⁻ᵀ`: two
    /// vectors, semidefinite in floating point too. `det G_L = 3/(η l)²` never
    /// vanishes, and `det S` is written without a difference.
    ///
    /// Returns the two vectors; `opposite` is the wing's own node, 2 or 3.
    #[inline(always)]
    pub fn positive(&self, opposite: usize, t: V<S>, inverse_length: S, c: S) -> [[S; 12]; 2] {
        let number = S::splat;
        let (zero, half, one, two) = (number(0.0), number(0.5), number(1.0), number(2.0));
        let beta = inverse_length;
        let alpha_o = self.inverse_height;
        let s = self.foot;
        let alpha_1 = -s * alpha_o;
        let aa = alpha_o * alpha_o * ((one - s) * (one - s) + s * s + one);
        let ab = (one - two * s) * alpha_o * beta;
        let bb = two * beta * beta;
        let det_left = number(3.0) * (alpha_o * beta) * (alpha_o * beta);
        let det_right = aa * aa + number(0.25) * det_left;
        let (il, ir) = (one / det_left.sqrt(), one / det_right.sqrt());
        let s11 = bb * il + aa * ir;
        let s12 = ab * (half * ir - il);
        let det_s = two + (aa * aa + ab * ab + bb * (aa + number(0.25) * bb)) * il * ir;
        // Λ = [[a, 0], [b, d]], det X = γ²
        let gamma = (il / ir).sqrt();
        let x = gamma / det_s.sqrt();
        let a = (x * s11).sqrt();
        let (ia, b) = (one / a, x * s12 / a);
        let (d, id) = (gamma * ia, a / gamma);
        let weight = (half * c.abs()).sqrt();
        let sign = weight.signed_as(c);
        // Each vector's part on the node with coefficients (α, β).
        let first = |alpha: S, beta: S| {
            blend(
                weight * (a * alpha + b * beta),
                self.n,
                sign * ia * alpha,
                self.m,
            )
        };
        let second = |alpha: S, beta: S| {
            let m = sign * id * (half * beta - b * ia * alpha);
            add(
                blend(weight * d * beta, self.n, m, self.m),
                scale(sign * id * alpha, t),
            )
        };
        [
            spread(opposite, first(alpha_1, beta), first(alpha_o, zero)),
            spread(opposite, second(alpha_1, beta), second(alpha_o, zero)),
        ]
    }
}

/// A vector on all nodes from its parts on node 1 and the wing's own; node 0
/// has minus their sum, because a translation does nothing.
#[inline(always)]
fn spread<S: Lanes>(opposite: usize, at_1: V<S>, at_opposite: V<S>) -> [S; 12] {
    let mut v = [S::splat(0.0); 12];
    set_node(&mut v, 0, minus(add(at_1, at_opposite)));
    set_node(&mut v, 1, at_1);
    set_node(&mut v, opposite, at_opposite);
    v
}
