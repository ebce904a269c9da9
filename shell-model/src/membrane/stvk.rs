use std::marker::PhantomData;

use selvedge_energy::{Curvature, EvalPoint, StencilEnergy};

use crate::fabric::MembraneModuli;
use crate::mesh::RestTriangle;
use crate::vec3::{V, blend, dot, node, put, put_transposed, set_node, sub};
use crate::{Damping, DampingKind, ShellMesh};

/// Anisotropic Saint Venant-Kirchhoff membrane on constant-strain triangles,
/// with internal friction by type.
///
/// ```text
/// U = Σ r_ju x_j,  V = Σ r_jv x_j
/// ε = (½(U·U − 1), ½(V·V − 1), U·V),   σ = C ε,   E = ½ A ε·C ε
/// ∇E = A Bᵀ σ,     H = A [ Bᵀ C B + (R S Rᵀ) ⊗ I ]
/// ```
/// \[Volino2009\], \[Pizana2025\]. Friction replaces `σ` by `C (ε + β ε̇)` and `C`
/// in `H` by `C (1 + β/dt)`, see [`Damping`].
///
/// | symbol | is | unit |
/// |---|---|---|
/// | `U, V` | columns of the deformation gradient | 1 |
/// | `r_j` | material gradient of corner `j`'s hat function | 1/m |
/// | `C` | `k_u, k_v, k_s, k_uv` of [`MembraneModuli`] | N/m |
/// | `S` | total stress, elastic and viscous, as a 2×2 matrix | N/m |
/// | `A` | rest area | m² |
/// | `β` | dissipation time of the fabric | s |
///
/// Second derivatives: `Exact` may be indefinite in compression (that is what
/// makes cloth buckle); `Projected` clamps `S` to its tensile part, at least
/// as large as the exact one; `GaussNewton` drops `S`.
///
/// Degenerate cases: everything is polynomial in the positions, so collapsed
/// and inverted triangles are harmless numerically, but this material does
/// not resist inversion: full collapse costs only `k/8` per area and axis.
/// [`MembraneGuard`](crate::MembraneGuard) adds a resistance.
#[derive(Clone, Debug)]
pub struct MembraneStVk<D> {
    stencils: Vec<[u32; 3]>,
    elements: Vec<Element>,
    laws: Vec<Law>,
    damping: PhantomData<D>,
}

#[derive(Clone, Copy, Debug)]
struct Element {
    rest: RestTriangle,
    law: u32,
}

#[derive(Clone, Copy, Debug)]
struct Law {
    moduli: MembraneModuli,
    beta: f64,
}

/// State of one triangle at an evaluation.
struct Stressed {
    u: V,
    v: V,
    /// Total stress `σ_uu, σ_vv, σ_uv`, times the area.
    stress: [f64; 3],
    /// Area times the factor of `C` in the second derivative.
    tangent: f64,
    value: f64,
}

impl<D: Damping> MembraneStVk<D> {
    /// One triangle each, with moduli and dissipation time `β` \[s\] per fabric
    /// of the mesh.
    ///
    /// # Panics
    /// When a triangle's fabric has no law.
    pub fn new(mesh: &ShellMesh, laws: &[(MembraneModuli, f64)]) -> Self {
        assert!(
            mesh.fabric().iter().all(|f| usize::from(*f) < laws.len()),
            "a law per fabric"
        );
        let elements = mesh
            .rest()
            .iter()
            .zip(mesh.fabric())
            .map(|(rest, fabric)| Element {
                rest: *rest,
                law: u32::from(*fabric),
            })
            .collect();
        let laws = laws
            .iter()
            .map(|(moduli, beta)| Law {
                moduli: *moduli,
                beta: *beta,
            })
            .collect();
        Self {
            stencils: mesh.triangles().to_vec(),
            elements,
            laws,
            damping: PhantomData,
        }
    }

    #[inline(always)]
    fn stressed(&self, e: usize, q: &[f64; 9], at: &EvalPoint<'_>) -> Stressed {
        let Element { rest, law } = &self.elements[e];
        let Law { moduli, beta } = &self.laws[*law as usize];
        let (u, v) = columns(rest, q);
        let strain = green(u, v);
        let elastic = times(moduli, strain);
        let mut value = 0.5 * rest.area * dot(strain, elastic);
        let mut stress = elastic;
        let mut tangent = rest.area;
        if D::KIND != DampingKind::Off {
            let start = at.gather_start::<3, 9>(&[3; 3], &self.stencils[e]);
            let (u0, v0) = columns(rest, &start);
            // Strain increment over the step.
            let change = if D::KIND == DampingKind::Rate {
                let (du, dv) = (sub(u, u0), sub(v, v0));
                [dot(u, du), dot(v, dv), dot(u, dv) + dot(v, du)]
            } else {
                sub(strain, green(u0, v0))
            };
            let time = beta / at.dt;
            let viscous = times(moduli, change);
            if D::KIND == DampingKind::Incremental {
                value += 0.5 * rest.area * time * dot(change, viscous);
            }
            stress = blend(1.0, elastic, time, viscous);
            tangent *= 1.0 + time;
        }
        Stressed {
            u,
            v,
            stress: stress.map(|s| rest.area * s),
            tangent,
            value,
        }
    }
}

impl<D: Damping> StencilEnergy<3, 9> for MembraneStVk<D> {
    const NODE_DIMS: [usize; 3] = [3; 3];

    fn stencils(&self) -> &[[u32; 3]] {
        &self.stencils
    }

    #[inline]
    fn value(&self, e: usize, q: &[f64; 9], at: &EvalPoint<'_>) -> f64 {
        self.stressed(e, q, at).value
    }

    #[inline]
    fn gradient(&self, e: usize, q: &[f64; 9], at: &EvalPoint<'_>, g: &mut [f64; 9]) -> f64 {
        let s = self.stressed(e, q, at);
        write_gradient(&self.elements[e].rest, &s, g);
        s.value
    }

    #[inline]
    fn hessian(
        &self,
        e: usize,
        q: &[f64; 9],
        at: &EvalPoint<'_>,
        curvature: Curvature,
        g: &mut [f64; 9],
        h: &mut [[f64; 9]; 9],
    ) -> f64 {
        let s = self.stressed(e, q, at);
        let Element { rest, law } = &self.elements[e];
        write_gradient(rest, &s, g);
        let geometric = match curvature {
            Curvature::Exact => s.stress,
            Curvature::Projected => tensile(s.stress),
            Curvature::GaussNewton => [0.0; 3],
        };
        write_hessian(rest, &self.laws[*law as usize].moduli, &s, geometric, h);
        s.value
    }

    fn is_conservative(&self) -> bool {
        D::KIND != DampingKind::Rate
    }

    fn heap_bytes(&self) -> usize {
        size_of_val(&self.stencils[..])
            + size_of_val(&self.elements[..])
            + size_of_val(&self.laws[..])
    }
}

#[inline(always)]
pub(super) fn columns(rest: &RestTriangle, q: &[f64; 9]) -> (V, V) {
    let x0 = node(q, 0);
    let (d1, d2) = (sub(node(q, 1), x0), sub(node(q, 2), x0));
    let [a, b, c, d] = rest.inverse;
    (blend(a, d1, c, d2), blend(b, d1, d, d2))
}

/// `ε_uu, ε_vv, γ_uv`
#[inline(always)]
fn green(u: V, v: V) -> [f64; 3] {
    [0.5 * (dot(u, u) - 1.0), 0.5 * (dot(v, v) - 1.0), dot(u, v)]
}

/// `C ε`
#[inline(always)]
fn times(c: &MembraneModuli, e: [f64; 3]) -> [f64; 3] {
    [
        c.warp * e[0] + c.coupling * e[1],
        c.coupling * e[0] + c.weft * e[1],
        c.shear * e[2],
    ]
}

/// The positive part of the symmetric matrix `[[s_0, s_2], [s_2, s_1]]`.
#[inline(always)]
fn tensile(s: [f64; 3]) -> [f64; 3] {
    let mean = 0.5 * (s[0] + s[1]);
    let radius = (0.25 * (s[0] - s[1]) * (s[0] - s[1]) + s[2] * s[2]).sqrt();
    let (low, high) = (mean - radius, mean + radius);
    if high <= 0.0 {
        [0.0; 3]
    } else if low < 0.0 {
        // S⁺ = λ (S − λ' I)/(λ − λ'); here λ > 0 > λ', so the radius is not 0.
        let f = high / (2.0 * radius);
        [f * (s[0] - low), f * (s[1] - low), f * s[2]]
    } else {
        s
    }
}

#[inline(always)]
fn write_gradient(rest: &RestTriangle, s: &Stressed, g: &mut [f64; 9]) {
    let [suu, svv, suv] = s.stress;
    // Columns of the first Piola-Kirchhoff stress, times the area.
    let (p, r) = (blend(suu, s.u, suv, s.v), blend(suv, s.u, svv, s.v));
    let [a, b, c, d] = rest.inverse;
    let (g1, g2) = (blend(a, p, b, r), blend(c, p, d, r));
    set_node(g, 1, g1);
    set_node(g, 2, g2);
    set_node(g, 0, [-g1[0] - g2[0], -g1[1] - g2[1], -g1[2] - g2[2]]);
}

/// `H_ij = r_iu r_ju K_uu + r_iv r_jv K_vv + r_iu r_jv K_uv + r_iv r_ju K_uvᵀ`
/// with three blocks per triangle,
///
/// ```text
/// K_uu = A (k_u UUᵀ + k_s VVᵀ + S_uu I)
/// K_vv = A (k_v VVᵀ + k_s UUᵀ + S_vv I)
/// K_uv = A (k_uv UVᵀ + k_s VUᵀ + S_uv I)
/// ```
/// Corner 0 follows because a translation does nothing.
#[inline(always)]
fn write_hessian(
    rest: &RestTriangle,
    c: &MembraneModuli,
    s: &Stressed,
    geometric: [f64; 3],
    h: &mut [[f64; 9]; 9],
) {
    let (ku, kv, ks, kuv) = (
        s.tangent * c.warp,
        s.tangent * c.weft,
        s.tangent * c.shear,
        s.tangent * c.coupling,
    );
    let [a, b, cc, d] = rest.inverse;
    let (u, v) = (s.u, s.v);
    let mut h11 = [[0.0; 3]; 3];
    let mut h22 = [[0.0; 3]; 3];
    let mut h12 = [[0.0; 3]; 3];
    let (aa, bb, ab2) = (a * a, b * b, a * b);
    let (ccc, ddd, cd2) = (cc * cc, d * d, cc * d);
    let (ac, bd, ad, bc) = (a * cc, b * d, a * d, b * cc);
    for i in 0..3 {
        for j in 0..3 {
            let (uu, vv) = (u[i] * u[j], v[i] * v[j]);
            let (uv, vu) = (u[i] * v[j], v[i] * u[j]);
            let one = if i == j { 1.0 } else { 0.0 };
            let kuu = ku * uu + ks * vv + geometric[0] * one;
            let kvv = kv * vv + ks * uu + geometric[1] * one;
            let kuv_ij = kuv * uv + ks * vu + geometric[2] * one;
            let kuv_ji = kuv * vu + ks * uv + geometric[2] * one;
            let both = kuv_ij + kuv_ji;
            h11[i][j] = aa * kuu + bb * kvv + ab2 * both;
            h22[i][j] = ccc * kuu + ddd * kvv + cd2 * both;
            h12[i][j] = ac * kuu + bd * kvv + ad * kuv_ij + bc * kuv_ji;
        }
    }
    let mut h01 = [[0.0; 3]; 3];
    let mut h02 = [[0.0; 3]; 3];
    let mut h00 = [[0.0; 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            h01[i][j] = -(h11[i][j] + h12[j][i]);
            h02[i][j] = -(h12[i][j] + h22[i][j]);
            h00[i][j] = (h11[i][j] + h22[i][j]) + (h12[i][j] + h12[j][i]);
        }
    }
    put(h, 0, 0, &h00);
    put(h, 0, 1, &h01);
    put(h, 0, 2, &h02);
    put_transposed(h, 1, 0, &h01);
    put(h, 1, 1, &h11);
    put(h, 1, 2, &h12);
    put_transposed(h, 2, 0, &h02);
    put_transposed(h, 2, 1, &h12);
    put(h, 2, 2, &h22);
}
