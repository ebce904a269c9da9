use crate::vec3::{Block, V, outer, square, symmetric};

/// Dihedral angle at an axis `x0 → x1` between two wings, `x4` and `x3`.
///
/// ```text
/// o = x0 + s l t + η m,   n = normal of the wing's triangle
/// ∇ψ  = − Σ_w (α_w ⊗ n_w),      α = (−(1−s), −s, 1 at o)/η,   β = (−1, 1)/l
/// ∇²ψ = Σ_w (P_w + P_wᵀ),       P = (α⊗n)(α⊗m)ᵀ + (β⊗n)(α⊗t + ½ β⊗m)ᵀ
/// ```
/// `η` is the height of a wing [m], `s` its foot in units of the axis. With it
///
/// ```text
/// ∇η  = η α ⊗ m
/// ∇²η = η ((α⊗n)(α⊗n)ᵀ − (α⊗t)(β⊗m)ᵀ − (β⊗m)(α⊗t)ᵀ − (β⊗m)(β⊗m)ᵀ)
/// ```
#[derive(Clone, Copy, Debug)]
pub(crate) struct Dihedral {
    t: V,
    /// `1/l`
    inverse: f64,
    /// Wings of `x4` and `x3`.
    wings: [Wing; 2],
}

#[derive(Clone, Copy, Debug)]
struct Wing {
    n: V,
    m: V,
    foot: f64,
    /// `1/η`
    inverse: f64,
}

impl Dihedral {
    /// `None` where a wing's `|v|²` is not above `floor` [m⁴].
    #[inline(always)]
    pub fn new(x0: V, x1: V, x3: V, x4: V, floor: f64) -> Option<Self> {
        let axis = x1 - x0;
        let (da, db) = (x4 - x0, x3 - x0);
        let (va, vb) = (axis.cross(&da), db.cross(&axis));
        let (a2, b2) = (va.norm_squared(), vb.norm_squared());
        let l2 = axis.norm_squared();
        if l2 == 0.0 || a2 <= floor || b2 <= floor {
            return None;
        }
        let l = l2.sqrt();
        let inverse = 1.0 / l;
        let (ia, ib) = (1.0 / a2.sqrt(), 1.0 / b2.sqrt());
        let t = axis * inverse;
        let (na, nb) = (va * ia, vb * ib);
        let il2 = inverse * inverse;
        Some(Self {
            t,
            inverse,
            wings: [
                Wing {
                    n: na,
                    m: na.cross(&t),
                    foot: da.dot(&axis) * il2,
                    inverse: l * ia,
                },
                Wing {
                    n: nb,
                    m: t.cross(&nb),
                    foot: db.dot(&axis) * il2,
                    inverse: l * ib,
                },
            ],
        })
    }

    /// Heights of the wings above the axis [m].
    #[inline(always)]
    pub fn heights(&self) -> [f64; 2] {
        [1.0 / self.wings[0].inverse, 1.0 / self.wings[1].inverse]
    }

    /// `∂η/∂x` of both heights [1], by `x0, x1, x3, x4`.
    #[inline(always)]
    pub fn height_gradients(&self) -> [[V; 4]; 2] {
        let [a, b] = &self.wings;
        let of = |w: &Wing| (w.m * (w.foot - 1.0), w.m * -w.foot);
        let ((a0, a1), (b0, b1)) = (of(a), of(b));
        let none = V::zeros();
        [[a0, a1, none, a.m], [b0, b1, b.m, none]]
    }

    /// Adds `c ∇²η` of wing `w` (0: `x4`, 1: `x3`) to a matrix of `x0, x1, x3,
    /// x4`.
    #[inline(always)]
    pub fn add_second_height(&self, w: usize, c: f64, h: &mut [[f64; 12]; 12]) {
        let wing = &self.wings[w];
        let alpha = [wing.foot - 1.0, -wing.foot, 1.0];
        let beta = [-self.inverse, self.inverse, 0.0];
        let nn = square(c * wing.inverse, wing.n);
        let mm = square(c / wing.inverse, wing.m);
        let tm = outer(self.t * c, wing.m);
        let at = [0, 3, if w == 0 { 9 } else { 6 }];
        for i in 0..3 {
            let (a, b) = (alpha[i], beta[i]);
            let own = symmetric(-c * a * b, self.t, wing.m);
            add(h, at[i], at[i], &(nn * (a * a) + own - mm * (b * b)));
            for j in i + 1..3 {
                let block = nn * (a * alpha[j])
                    - tm * (a * beta[j])
                    - tm.transpose() * (b * alpha[j])
                    - mm * (b * beta[j]);
                add_both(h, at[i], at[j], &block);
            }
        }
    }

    /// Adds the positive semidefinite part of `c ∇²ψ`, wing by wing, to a
    /// matrix of `x0, x1, x3, x4`.
    ///
    /// With `A = [α⊗n, β⊗n]` and `D = [α⊗m, α⊗t + ½ β⊗m]`, which are
    /// orthogonal, a wing's part is `c (A Dᵀ + D Aᵀ)`; its eigenvalues come in
    /// pairs ±, and the positive part is
    ///
    /// ```text
    /// ½ (|c| A S Aᵀ + |c| D S⁻¹ Dᵀ + c (A Dᵀ + D Aᵀ)),   S = (AᵀA)⁻¹ # DᵀD
    /// ```
    /// with the geometric mean of 2×2 matrices, `X # Y = √(xy/det(X/x + Y/y))
    /// (X/x + Y/y)`, `x² = det X`, `y² = det Y`.
    pub fn add_second_positive(&self, c: f64, h: &mut [[f64; 12]; 12]) {
        if c == 0.0 {
            return;
        }
        for (w, wing) in self.wings.iter().enumerate() {
            let (alpha, beta) = self.feet(wing);
            let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
            let (aa, ab, bb) = (dot(alpha, alpha), dot(alpha, beta), dot(beta, beta));
            // (AᵀA)⁻¹ over the root of its determinant, DᵀD likewise.
            let x = 1.0 / (aa * bb - ab * ab).sqrt();
            let of_a = [bb * x, -ab * x, aa * x];
            let (dd, de, ee) = (aa, 0.5 * ab, aa + 0.25 * bb);
            let y = (dd * ee - de * de).sqrt();
            let sum = [of_a[0] + dd / y, of_a[1] + de / y, of_a[2] + ee / y];
            let size = (x * y / (sum[0] * sum[2] - sum[1] * sum[1])).sqrt();
            let s = sum.map(|v| v * size);
            let inverse = 1.0 / (s[0] * s[2] - s[1] * s[1]);
            let t = [s[2] * inverse, -s[1] * inverse, s[0] * inverse];
            let k = 0.5 * c.abs();
            let sign = c.signum();
            let d: [[V; 2]; 3] = std::array::from_fn(|i| {
                [
                    wing.m * alpha[i],
                    self.t * alpha[i] + wing.m * (0.5 * beta[i]),
                ]
            });
            let at = [0, 3, if w == 0 { 9 } else { 6 }];
            for i in 0..3 {
                for j in i..3 {
                    let (ai, aj, bi, bj) = (alpha[i], alpha[j], beta[i], beta[j]);
                    let nn = s[0] * ai * aj + s[1] * (ai * bj + bi * aj) + s[2] * bi * bj;
                    let across = (d[j][0] * ai + d[j][1] * bi) * sign;
                    let back = (d[i][0] * aj + d[i][1] * bj) * sign;
                    let left = d[j][0] * t[0] + d[j][1] * t[1];
                    let right = d[j][0] * t[1] + d[j][1] * t[2];
                    let block = outer(wing.n * (k * nn), wing.n)
                        + outer(d[i][0] * k, left)
                        + outer(d[i][1] * k, right)
                        + outer(wing.n * k, across)
                        + outer(back * k, wing.n);
                    if i == j {
                        add(h, at[i], at[i], &((block + block.transpose()) * 0.5));
                    } else {
                        add_both(h, at[i], at[j], &block);
                    }
                }
            }
        }
    }

    /// Adds the positive semidefinite part of `c ∇²η` of wing `w` to a matrix
    /// of `x0, x1, x3, x4`: that along `α⊗n`, and one of the two eigenvectors in
    /// the plane of `α⊗t` and `β⊗m`.
    pub fn add_second_height_positive(&self, w: usize, c: f64, h: &mut [[f64; 12]; 12]) {
        if c == 0.0 {
            return;
        }
        let wing = &self.wings[w];
        let (alpha, beta) = self.feet(wing);
        let k = c / wing.inverse;
        let square_of = |a: [f64; 3]| a[0] * a[0] + a[1] * a[1] + a[2] * a[2];
        let (aa, bb) = (square_of(alpha), square_of(beta));
        let root = (bb * bb + 4.0 * aa * bb).sqrt();
        let value = 0.5 * (bb - k.signum() * root);
        let weight = -k * value / (aa * bb + value * value);
        let b = bb.sqrt();
        let vector: [V; 3] =
            std::array::from_fn(|i| self.t * (b * alpha[i]) + wing.m * (value / b * beta[i]));
        let normal = k.max(0.0);
        let at = [0, 3, if w == 0 { 9 } else { 6 }];
        for i in 0..3 {
            let own = square(normal * alpha[i] * alpha[i], wing.n) + square(weight, vector[i]);
            add(h, at[i], at[i], &own);
            for j in i + 1..3 {
                let block = square(normal * alpha[i] * alpha[j], wing.n)
                    + outer(vector[i] * weight, vector[j]);
                add_both(h, at[i], at[j], &block);
            }
        }
    }

    /// `α` and `β` of a wing [1/m], by `x0, x1` and the wing's own point.
    #[inline(always)]
    fn feet(&self, wing: &Wing) -> ([f64; 3], [f64; 3]) {
        let a = wing.inverse;
        (
            [(wing.foot - 1.0) * a, -wing.foot * a, a],
            [-self.inverse, self.inverse, 0.0],
        )
    }

    /// The signed angle in [−π, π], zero when the wings are opposite.
    #[inline(always)]
    pub fn angle(&self) -> f64 {
        let [a, b] = &self.wings;
        (-a.m.dot(&b.n)).atan2(a.n.dot(&b.n))
    }

    /// `∇ψ` by `x0, x1, x3, x4`.
    #[inline(always)]
    pub fn gradient(&self) -> [V; 4] {
        let [a, b] = &self.wings;
        let (g4, g3) = (a.n * -a.inverse, b.n * -b.inverse);
        let g1 = g4 * -a.foot + g3 * -b.foot;
        [-(g1 + (g3 + g4)), g1, g3, g4]
    }

    /// Adds `c ∇²ψ` to a matrix of `x0, x1, x3, x4`.
    #[inline(always)]
    pub fn add_second(&self, c: f64, h: &mut [[f64; 12]; 12]) {
        let [a, b] = &self.wings;
        let ba = a.second(self.t, self.inverse, c);
        let bb = b.second(self.t, self.inverse, c);
        let b11 = ba.b11 + bb.b11;
        let b10 = -(b11 + (ba.b1o + bb.b1o));
        let a0 = -(ba.b1o + ba.boo).transpose();
        let b0 = -(bb.b1o + bb.boo).transpose();
        // Row 0 from translation; the sum of symmetric blocks stays symmetric.
        let both = ba.b1o + bb.b1o;
        let b00 = (b11 + (ba.boo + bb.boo)) + (both + both.transpose());
        add(h, 0, 0, &b00);
        add(h, 3, 3, &b11);
        add(h, 6, 6, &bb.boo);
        add(h, 9, 9, &ba.boo);
        add_both(h, 3, 0, &b10);
        add_both(h, 3, 6, &bb.b1o);
        add_both(h, 3, 9, &ba.b1o);
        add_both(h, 6, 0, &b0);
        add_both(h, 9, 0, &a0);
    }
}

/// Blocks `(1,1), (1,o), (o,o)` of a wing.
struct WingBlocks {
    b11: Block,
    b1o: Block,
    boo: Block,
}

impl Wing {
    /// `c (P + Pᵀ)`
    #[inline(always)]
    fn second(&self, t: V, beta: f64, c: f64) -> WingBlocks {
        let alpha = self.inverse;
        let alpha_1 = -self.foot * alpha;
        let nm = symmetric(c, self.n, self.m);
        WingBlocks {
            b11: nm * (alpha_1 * alpha_1 + 0.5 * beta * beta)
                + symmetric(c * beta * alpha_1, self.n, t),
            b1o: nm * (alpha_1 * alpha) + outer(self.n * (c * beta * alpha), t),
            boo: nm * (alpha * alpha),
        }
    }
}

#[inline(always)]
fn add(h: &mut [[f64; 12]; 12], row: usize, column: usize, b: &Block) {
    for i in 0..3 {
        for j in 0..3 {
            h[row + i][column + j] += b[(i, j)];
        }
    }
}

#[inline(always)]
fn add_both(h: &mut [[f64; 12]; 12], row: usize, column: usize, b: &Block) {
    for i in 0..3 {
        for j in 0..3 {
            h[row + i][column + j] += b[(i, j)];
            h[column + j][row + i] += b[(i, j)];
        }
    }
}
