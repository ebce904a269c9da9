use selvedge_energy::Curvature;

use crate::vec3::{Block, V, outer, perpendicular, square, symmetric};

/// Sine below which the direction of a folded pair is faded out.
const MIN_SIN: f64 = 1e-4;

/// Weight of the tangential against the normal direction in the bound of
/// `t nᵀ + n tᵀ`, see [`Angle::blocks`].
const TANGENTIAL: f64 = 4.0;

/// Angle `φ` in [0, π] between two vectors `p` and `r`, with derivatives in
/// the frames of both.
///
/// ```text
/// m = t_p × t_r/|t_p × t_r|,   n = m × t
/// ∂φ/∂p = −n_p/|p|,   ∂φ/∂r = n_r/|r|
/// φ_pp =  (t_p n_pᵀ + n_p t_pᵀ + cot φ m mᵀ)/|p|²
/// φ_rr = (−t_r n_rᵀ − n_r t_rᵀ + cot φ m mᵀ)/|r|²
/// φ_pr = −m mᵀ/(sin φ |p| |r|)
/// ```
/// These are the derivatives of spec formulas in `cos φ` without their
/// cancellation near 0. Where `sin φ < 1e-4` and the energy has a slope, the
/// direction `n` fades out linearly.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Angle {
    pub angle: f64,
    p: Arm,
    r: Arm,
    m: V,
    cos: f64,
    /// `sin φ`, not below [`MIN_SIN`] where the direction fades.
    sin: f64,
    /// Factor of the gradient, 1 but for faded directions.
    fade: f64,
}

#[derive(Clone, Copy, Debug)]
struct Arm {
    t: V,
    n: V,
    inverse: f64,
}

/// Second derivatives by the two vectors.
pub(crate) struct AngleBlocks {
    pub pp: Block,
    pub pr: Block,
    pub rr: Block,
}

impl Angle {
    /// `None` when a vector is shorter than `floor`. `EVEN` says that the
    /// energy is an even function of the angle, smooth where it vanishes.
    #[inline(always)]
    pub fn new<const EVEN: bool>(p: V, r: V, floor: f64) -> Option<Self> {
        let (lp, lr) = (p.norm(), r.norm());
        if lp <= floor || lr <= floor {
            return None;
        }
        let (ip, ir) = (1.0 / lp, 1.0 / lr);
        let (tp, tr) = (p * ip, r * ir);
        let cross = tp.cross(&tr);
        let true_sin = cross.norm();
        let cos = tp.dot(&tr);
        let m = if true_sin == 0.0 {
            perpendicular(tp)
        } else {
            cross / true_sin
        };
        let faded = true_sin < MIN_SIN && !(EVEN && cos > 0.0);
        let (sin, fade) = match faded {
            true => (MIN_SIN, true_sin / MIN_SIN),
            false => (true_sin, 1.0),
        };
        Some(Self {
            angle: true_sin.atan2(cos),
            p: Arm {
                t: tp,
                n: m.cross(&tp),
                inverse: ip,
            },
            r: Arm {
                t: tr,
                n: m.cross(&tr),
                inverse: ir,
            },
            m,
            cos,
            sin,
            fade,
        })
    }

    /// `∂φ/∂p` and `∂φ/∂r` [rad/m].
    #[inline(always)]
    pub fn gradient(&self) -> [V; 2] {
        [
            self.p.n * (-self.fade * self.p.inverse),
            self.r.n * (self.fade * self.r.inverse),
        ]
    }

    /// `E'' ∇φ ∇φᵀ + E' ∇²φ` from `E'` and `E'' ≥ 0`.
    ///
    /// The second part splits into the plane of the vectors and its normal.
    /// Along `m`, in units of the lengths, it is `E'/sin φ [cos φ, −1; −1,
    /// cos φ]` with eigenvectors `(1, ∓1)` and eigenvalues `E' cot(φ/2)` and
    /// `−E' tan(φ/2)`; only the positive one is kept. In the plane,
    /// `c (t nᵀ + n tᵀ) ≤ ½ |c| (λ t tᵀ + n nᵀ/λ + sign(c) (t nᵀ + n tᵀ))` for
    /// every λ. That is the nearest semidefinite matrix for λ = 1; λ = 4 moves
    /// the excess to the direction of the yarn, which stretching holds much
    /// stiffer.
    #[inline(always)]
    pub fn blocks(&self, slope: f64, bend: f64, curvature: Curvature) -> AngleBlocks {
        let (p, r) = (&self.p, &self.r);
        // E'/sin φ; its limit at 0 is E'' for an even function.
        let ratio = if self.sin > 0.0 {
            slope / self.sin
        } else {
            bend
        };
        let tilt = slope * self.fade;
        let (mut same, mut other) = (ratio * self.cos, -ratio);
        let mut normal = bend * self.fade * self.fade;
        let cross = normal;
        let mut tangent = 0.0;
        let mut mixed = tilt;
        if curvature != Curvature::Exact {
            let apart = (ratio * (self.cos + 1.0)).max(0.0);
            let together = (ratio * (self.cos - 1.0)).max(0.0);
            same = 0.5 * (apart + together);
            other = 0.5 * (together - apart);
            if curvature == Curvature::Projected {
                normal += 0.5 / TANGENTIAL * tilt.abs();
                tangent = 0.5 * TANGENTIAL * tilt.abs();
                mixed *= 0.5;
            } else {
                mixed = 0.0;
            }
        }
        let diagonal = |arm: &Arm, sign: f64| {
            let s = arm.inverse * arm.inverse;
            let mut b = square(s * normal, arm.n) + square(s * same, self.m);
            if mixed != 0.0 {
                b += symmetric(sign * s * mixed, arm.t, arm.n);
            }
            if tangent != 0.0 {
                b += square(s * tangent, arm.t);
            }
            b
        };
        let s = p.inverse * r.inverse;
        AngleBlocks {
            pp: diagonal(p, 1.0),
            rr: diagonal(r, -1.0),
            pr: outer(p.n * (-s * cross), r.n) + square(s * other, self.m),
        }
    }
}
