//! Angle of a hinge and its derivatives.

use std::f64::consts::TAU;

use crate::vec3::{Block, V, add, blend, cross, dot, node, outer, scale, set_node, sub};

/// Frame of one wing.
///
/// ```text
/// o = x0 + s e + η m,   n = normal of the wing's triangle
/// ∇θ  = − Σ_w (α_w ⊗ n_w),      α = (−(1−s), −s, 1 at o)/η,   β = (−1, 1)/l
/// ∇²θ = Σ_w (P_w + P_wᵀ),       P = (α⊗n)(α⊗m)ᵀ + (β⊗n)(α⊗t + ½ β⊗m)ᵀ
/// ```
#[derive(Clone, Copy)]
pub(crate) struct WingFrame {
    pub n: V,
    pub m: V,
    /// `s`
    pub foot: f64,
    /// `1/η` [1/m]
    pub inverse_height: f64,
}

/// Frames of a hinge `(x0, x1, x2, x3)`, see [`Hinge`](crate::Hinge).
#[derive(Clone, Copy)]
pub(crate) struct HingeFrame {
    pub t: V,
    /// `1/l` [1/m]
    pub inverse_length: f64,
    pub wings: [WingFrame; 2],
}

/// Squared edge length and wing heights [m²] below which a hinge is ignored.
pub(crate) type Floors = [f64; 3];

impl HingeFrame {
    /// `None` when the edge or a wing is degenerate. NaN is not: it must reach
    /// whoever checks the result.
    #[inline(always)]
    pub fn new(q: &[f64; 12], floors: &Floors) -> Option<Self> {
        let x0 = node(q, 0);
        let e = sub(node(q, 1), x0);
        let (d2, d3) = (sub(node(q, 2), x0), sub(node(q, 3), x0));
        let l2 = dot(e, e);
        let (area1, area2) = (cross(e, d2), cross(d3, e));
        let (a1, a2) = (dot(area1, area1), dot(area2, area2));
        if l2 <= floors[0] || a1 <= floors[1] * l2 || a2 <= floors[2] * l2 {
            return None;
        }
        let l = l2.sqrt();
        let inverse_length = 1.0 / l;
        let (i1, i2) = (1.0 / a1.sqrt(), 1.0 / a2.sqrt());
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
    pub fn angle(&self) -> f64 {
        let [one, two] = &self.wings;
        (-dot(one.m, two.n)).atan2(dot(one.n, two.n))
    }

    /// `∇θ`
    #[inline(always)]
    pub fn gradient(&self) -> [V; 4] {
        let [one, two] = &self.wings;
        let (g2, g3) = (
            scale(-one.inverse_height, one.n),
            scale(-two.inverse_height, two.n),
        );
        let g1 = blend(-one.foot, g2, -two.foot, g3);
        let g0 = scale(-1.0, add(g1, add(g2, g3)));
        [g0, g1, g2, g3]
    }
}

/// The angle nearest to `previous` among those that differ by full turns.
#[inline(always)]
pub(crate) fn unwrap(angle: f64, previous: f64) -> f64 {
    angle + TAU * ((previous - angle) / TAU).round()
}

/// Blocks `(1,1), (1,o), (o,o)` of a wing's contribution; node 0 follows from
/// translation, the other wing's node has none.
pub(crate) struct WingBlocks {
    pub b11: Block,
    pub b1o: Block,
    pub boo: Block,
}

impl WingFrame {
    /// `c (P + Pᵀ)`
    #[inline(always)]
    pub fn second(&self, t: V, inverse_length: f64, c: f64) -> WingBlocks {
        let beta = inverse_length;
        let alpha_o = self.inverse_height;
        let alpha_1 = -self.foot * alpha_o;
        let nm = outer(self.n, self.m);
        let nt = outer(self.n, t);
        // Coefficients of n mᵀ + m nᵀ, n tᵀ and t nᵀ in each block.
        let m11 = c * (alpha_1 * alpha_1 + 0.5 * beta * beta);
        let m1o = c * alpha_1 * alpha_o;
        let moo = c * alpha_o * alpha_o;
        let t11 = c * beta * alpha_1;
        let t1o = c * beta * alpha_o;
        let mut out = WingBlocks {
            b11: [[0.0; 3]; 3],
            b1o: [[0.0; 3]; 3],
            boo: [[0.0; 3]; 3],
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
    pub fn positive(&self, opposite: usize, t: V, inverse_length: f64, c: f64) -> [[f64; 12]; 2] {
        let beta = inverse_length;
        let alpha_o = self.inverse_height;
        let s = self.foot;
        let alpha_1 = -s * alpha_o;
        let aa = alpha_o * alpha_o * ((1.0 - s) * (1.0 - s) + s * s + 1.0);
        let ab = (1.0 - 2.0 * s) * alpha_o * beta;
        let bb = 2.0 * beta * beta;
        let det_left = 3.0 * (alpha_o * beta) * (alpha_o * beta);
        let det_right = aa * aa + 0.25 * det_left;
        let (il, ir) = (1.0 / det_left.sqrt(), 1.0 / det_right.sqrt());
        let s11 = bb * il + aa * ir;
        let s12 = ab * (0.5 * ir - il);
        let det_s = 2.0 + (aa * aa + ab * ab + bb * (aa + 0.25 * bb)) * il * ir;
        // Λ = [[a, 0], [b, d]], det X = γ²
        let gamma = (il / ir).sqrt();
        let x = gamma / det_s.sqrt();
        let a = (x * s11).sqrt();
        let (ia, b) = (1.0 / a, x * s12 / a);
        let (d, id) = (gamma * ia, a / gamma);
        let weight = (0.5 * c.abs()).sqrt();
        let sign = weight * c.signum();
        // Each vector's part on the node with coefficients (α, β).
        let first = |alpha: f64, beta: f64| {
            blend(
                weight * (a * alpha + b * beta),
                self.n,
                sign * ia * alpha,
                self.m,
            )
        };
        let second = |alpha: f64, beta: f64| {
            let m = sign * id * (0.5 * beta - b * ia * alpha);
            add(
                blend(weight * d * beta, self.n, m, self.m),
                scale(sign * id * alpha, t),
            )
        };
        [
            spread(opposite, first(alpha_1, beta), first(alpha_o, 0.0)),
            spread(opposite, second(alpha_1, beta), second(alpha_o, 0.0)),
        ]
    }
}

/// A vector on all nodes from its parts on node 1 and the wing's own; node 0
/// has minus their sum, because a translation does nothing.
#[inline(always)]
fn spread(opposite: usize, at_1: V, at_opposite: V) -> [f64; 12] {
    let mut v = [0.0; 12];
    set_node(&mut v, 0, scale(-1.0, add(at_1, at_opposite)));
    set_node(&mut v, 1, at_1);
    set_node(&mut v, opposite, at_opposite);
    v
}
