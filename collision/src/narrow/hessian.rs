//! Exact second derivatives of distances.
//!
//! ```text
//! ∇d = Qᵀ n,   ∇²d = -(QᵀΓ + ΓᵀQ) - d ΓᵀΓ + (1/d) QᵀNQ,     Q = wᵀ ⊗ I
//! ```
//! `Γ` is how the surface tilts, `N` projects on the directions in which the
//! normal turns freely. The solver uses the Gauss-Newton part of the contact
//! energy, which needs none of this; tests and other curvature policies do.

use super::PairKind;
use crate::vec3::{Mat3, Vec3, cross, dot, scale, sub, unit};

/// Distance of a pair of given features with its derivatives.
#[derive(Clone, Debug)]
pub struct DistanceDerivatives {
    /// Distance \[m\], signed for interior pairs.
    pub distance: f64,
    /// Unit normal: gradient of the distance in the gap vector.
    pub normal: [f64; 3],
    /// Weights of the nodes.
    pub weights: [f64; 4],
    /// Second derivative \[1/m\], node by node, `hessian[3 i + k][3 j + l]`.
    pub hessian: [[f64; 12]; 12],
}

impl DistanceDerivatives {
    /// Second derivative of an energy `E(d)` with `E' = slope` and
    /// `E'' = curvature`, \[N\] and [N/m]: `E'' ∇d ∇dᵀ + E' ∇²d`. May be
    /// indefinite.
    pub fn energy_hessian(&self, slope: f64, curvature: f64) -> [[f64; 12]; 12] {
        let g: [f64; 12] = std::array::from_fn(|i| self.weights[i / 3] * self.normal[i % 3]);
        std::array::from_fn(|i| {
            std::array::from_fn(|j| curvature * g[i] * g[j] + slope * self.hessian[i][j])
        })
    }
}

/// Derivatives of an interior pair: of the distance between a vertex and a
/// plane, or two lines. `None` for parallel features.
pub fn interior(kind: PairKind, x: &[[f64; 3]; 4]) -> Option<DistanceDerivatives> {
    let (e1, e2) = kind.plane_edges(x);
    let normal = unit(cross(e1, e2))?;
    let (a, b, c) = (dot(e1, e1), dot(e1, e2), dot(e2, e2));
    let delta = a * c - b * b;
    if !(delta > super::PARALLEL * a * c) {
        return None;
    }
    let dual = |p: f64, e: Vec3, r: f64, f: Vec3| scale(1.0 / delta, sub(scale(p, e), scale(r, f)));
    let (c1, c2) = (dual(c, e1, b, e2), dual(a, e2, b, e1));
    let (weights, distance, tilt1, tilt2) = match kind {
        PairKind::VertexTriangle => {
            let u = sub(x[0], x[1]);
            let (b1, b2) = (dot(c1, u), dot(c2, u));
            let w = [1.0, b1 + b2 - 1.0, -b1, -b2];
            (
                w,
                dot(normal, u),
                [0.0, -1.0, 1.0, 0.0],
                [0.0, -1.0, 0.0, 1.0],
            )
        }
        PairKind::EdgeEdge => {
            let u = sub(x[2], x[0]);
            let (s, t) = (dot(c1, u), -dot(c2, u));
            let w = [1.0 - s, s, t - 1.0, -t];
            (
                w,
                -dot(normal, u),
                [-1.0, 1.0, 0.0, 0.0],
                [0.0, 0.0, -1.0, 1.0],
            )
        }
    };
    let tilt: [Vec3; 4] =
        std::array::from_fn(|i| std::array::from_fn(|k| tilt1[i] * c1[k] + tilt2[i] * c2[k]));
    Some(assemble(distance, normal, weights, tilt, [[0.0; 3]; 3]))
}

/// Derivatives of the distance between point `p` and the line through `x₀ x₁`;
/// node 3 is unused. `None` where the point is on the line or the line has no
/// direction.
pub fn point_line(p: [f64; 3], x0: [f64; 3], x1: [f64; 3]) -> Option<DistanceDerivatives> {
    let e = sub(x1, x0);
    let along = unit(e)?;
    let l2 = dot(e, e);
    let s = dot(sub(p, x0), e) / l2;
    let gap = crate::vec3::axpy(sub(p, x0), -s, e);
    let normal = unit(gap)?;
    let b = cross(along, normal);
    let slope = scale(1.0 / l2, e);
    let tilt = [[0.0; 3], scale(-1.0, slope), slope, [0.0; 3]];
    let free = std::array::from_fn(|i| std::array::from_fn(|j| b[i] * b[j]));
    let weights = [1.0, s - 1.0, -s, 0.0];
    Some(assemble(
        crate::vec3::norm(gap),
        normal,
        weights,
        tilt,
        free,
    ))
}

/// Derivatives of the distance between two points; nodes 2 and 3 are unused.
/// `None` where they coincide.
pub fn point_point(p: [f64; 3], x: [f64; 3]) -> Option<DistanceDerivatives> {
    let gap = sub(p, x);
    let n = unit(gap)?;
    let free =
        std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j)) - n[i] * n[j]));
    let weights = [1.0, -1.0, 0.0, 0.0];
    Some(assemble(
        crate::vec3::norm(gap),
        n,
        weights,
        [[0.0; 3]; 4],
        free,
    ))
}

/// `Γ` is `Σᵢ tiltᵢ ⊗ (n · δxᵢ)`.
fn assemble(
    distance: f64,
    n: Vec3,
    w: [f64; 4],
    tilt: [Vec3; 4],
    free: Mat3,
) -> DistanceDerivatives {
    let turn = if free == [[0.0; 3]; 3] {
        0.0
    } else {
        1.0 / distance
    };
    let mut hessian = [[0.0; 12]; 12];
    for i in 0..4 {
        for j in 0..4 {
            let tilts = dot(tilt[i], tilt[j]);
            for k in 0..3 {
                for l in 0..3 {
                    hessian[3 * i + k][3 * j + l] = -(w[i] * tilt[j][k] * n[l]
                        + n[k] * tilt[i][l] * w[j])
                        - distance * n[k] * tilts * n[l]
                        + turn * w[i] * w[j] * free[k][l];
                }
            }
        }
    }
    DistanceDerivatives {
        distance,
        normal: n,
        weights: w,
        hessian,
    }
}
