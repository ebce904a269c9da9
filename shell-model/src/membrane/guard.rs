use selvedge_energy::{Curvature, EvalPoint, StencilEnergy};

use super::stvk::columns;
use crate::ShellMesh;
use crate::mesh::RestTriangle;
use crate::vec3::{Block, V, blend, cross, dot, norm, outer, scale, set_node, skew};

/// Below this area ratio the direction that would open the triangle is noise.
const NO_DIRECTION: f64 = 1e-6;

/// One-sided resistance of nearly collapsed triangles.
///
/// ```text
/// E = ½ A k_J (J_0 − J)²  for J < J_0,   J = |U × V|
/// ```
/// `J` is the ratio of present to rest area \[1\], `k_J` in [N/m]. Deviation
/// from a smooth energy: below `J = 10⁻⁶` force and curvature are dropped,
/// since the normal is then undefined. `Projected` bounds the exact second
/// derivative from above; `GaussNewton` is `A k_J ∇J ∇Jᵀ`.
#[derive(Clone, Debug)]
pub struct MembraneGuard {
    stencils: Vec<[u32; 3]>,
    elements: Vec<(RestTriangle, f64)>,
    onset: f64,
}

struct Closing {
    u: V,
    v: V,
    normal: V,
    ratio: f64,
    /// `A k_J`
    stiffness: f64,
    /// `J_0 − J`
    depth: f64,
}

impl MembraneGuard {
    /// Area ratio `J_0` at which the guard sets in, by default \[1\].
    pub const ONSET: f64 = 0.1;

    /// A guard of stiffness `k_J` [N/m] per fabric, acting below the area
    /// ratio `onset`.
    ///
    /// # Panics
    /// When a triangle's fabric has no stiffness.
    pub fn new(mesh: &ShellMesh, stiffness: &[f64], onset: f64) -> Self {
        let elements = mesh
            .rest()
            .iter()
            .zip(mesh.fabric())
            .map(|(rest, fabric)| (*rest, stiffness[usize::from(*fabric)]))
            .collect();
        Self {
            stencils: mesh.triangles().to_vec(),
            elements,
            onset,
        }
    }

    #[inline]
    fn closing(&self, e: usize, q: &[f64; 9]) -> Option<Closing> {
        let (rest, k) = &self.elements[e];
        let (u, v) = columns(rest, q);
        let area = cross(u, v);
        let ratio = norm(area);
        (ratio < self.onset).then(|| Closing {
            u,
            v,
            normal: scale(1.0 / ratio, area),
            ratio,
            stiffness: rest.area * k,
            depth: self.onset - ratio,
        })
    }
}

impl Closing {
    fn value(&self) -> f64 {
        0.5 * self.stiffness * self.depth * self.depth
    }

    /// `∂J/∂U, ∂J/∂V`
    fn slopes(&self) -> [V; 2] {
        [cross(self.v, self.normal), cross(self.normal, self.u)]
    }

    /// Second derivative with respect to `(U, V)`, times the area.
    fn second(&self, curvature: Curvature) -> [[Block; 2]; 2] {
        let [a, b] = self.slopes();
        let k = self.stiffness;
        let mut h = [[[[0.0; 3]; 3]; 2]; 2];
        let slopes = [a, b];
        for i in 0..2 {
            for j in 0..2 {
                h[i][j] = outer(scale(k, slopes[i]), slopes[j]);
            }
        }
        if curvature == Curvature::GaussNewton {
            return h;
        }
        // −k (J_0 − J) ∇²J. The second derivative of the cross product gives
        // [[0, −N], [N, 0]] with N = [n]×, whose positive part is
        // ½ [[P, N'], [N'ᵀ, P]] with P = I − nnᵀ; the rotation of the normal
        // gives a negative part, left out when projected.
        let c = k * self.depth;
        let n = self.normal;
        let twist = skew(n);
        let exact = curvature == Curvature::Exact;
        for i in 0..3 {
            for j in 0..3 {
                let plane = if i == j { 1.0 } else { 0.0 } - n[i] * n[j];
                let t = if exact {
                    c * twist[i][j]
                } else {
                    0.5 * c * twist[i][j]
                };
                h[0][1][i][j] += t;
                h[1][0][i][j] -= t;
                if !exact {
                    h[0][0][i][j] += 0.5 * c * plane;
                    h[1][1][i][j] += 0.5 * c * plane;
                }
            }
        }
        if exact {
            // ∇²J also holds |P d(U×V)|²/J, where d(U×V) = dU×V + U×dV; along
            // n it has no part, so only the normal parts of dU and dV count.
            let in_plane = [self.v, scale(-1.0, self.u)].map(|w| cross(w, n));
            for i in 0..2 {
                for j in 0..2 {
                    let f = c / self.ratio * dot(in_plane[i], in_plane[j]);
                    for a in 0..3 {
                        for b in 0..3 {
                            h[i][j][a][b] -= f * n[a] * n[b];
                        }
                    }
                }
            }
        }
        h
    }
}

impl StencilEnergy<3, 9> for MembraneGuard {
    const NODE_DIMS: [usize; 3] = [3; 3];

    fn stencils(&self) -> &[[u32; 3]] {
        &self.stencils
    }

    fn value(&self, e: usize, q: &[f64; 9], _: &EvalPoint<'_>) -> f64 {
        self.closing(e, q).map_or(0.0, |c| c.value())
    }

    fn gradient(&self, e: usize, q: &[f64; 9], _: &EvalPoint<'_>, g: &mut [f64; 9]) -> f64 {
        *g = [0.0; 9];
        let Some(closing) = self.closing(e, q) else {
            return 0.0;
        };
        if closing.ratio >= NO_DIRECTION {
            let [a, b] = closing.slopes();
            let f = -closing.stiffness * closing.depth;
            let gradients = self.elements[e].0.gradients();
            for (i, [ru, rv]) in gradients.into_iter().enumerate() {
                set_node(g, i, blend(f * ru, a, f * rv, b));
            }
        }
        closing.value()
    }

    fn hessian(
        &self,
        e: usize,
        q: &[f64; 9],
        at: &EvalPoint<'_>,
        curvature: Curvature,
        g: &mut [f64; 9],
        h: &mut [[f64; 9]; 9],
    ) -> f64 {
        *h = [[0.0; 9]; 9];
        let value = self.gradient(e, q, at, g);
        let Some(closing) = self.closing(e, q) else {
            return value;
        };
        if closing.ratio < NO_DIRECTION {
            return value;
        }
        let second = closing.second(curvature);
        let r = self.elements[e].0.gradients();
        for i in 0..3 {
            for j in 0..3 {
                for a in 0..3 {
                    for b in 0..3 {
                        let mut sum = 0.0;
                        for k in 0..2 {
                            for l in 0..2 {
                                sum += r[i][k] * r[j][l] * second[k][l][a][b];
                            }
                        }
                        h[3 * i + a][3 * j + b] = sum;
                    }
                }
            }
        }
        // Symmetric to the last bit.
        for i in 0..9 {
            for j in 0..i {
                h[i][j] = h[j][i];
            }
        }
        value
    }

    fn heap_bytes(&self) -> usize {
        size_of_val(&self.stencils[..]) + size_of_val(&self.elements[..])
    }
}
