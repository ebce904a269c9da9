//! Discrete fundamental forms of a sheet.
//!
//! ```text
//! I = FᵀF,   II = −Σ_i θ_i η_i g_i g_iᵀ
//! ```
//! over the three edges of a triangle: `θ_i` hinge angle \[rad\], `η_i` height of
//! corner `i` over the edge opposite to it \[m\], `g_i` material gradient of its
//! hat function [1/m] ([Sperl2020, eq. 33-36], rewritten with `Fᵀ t_i = −2 A
//! g_i`). `II = −n_,α · a_β` is negative where the surface bulges along its
//! normal. Exact for a cylinder over equilateral triangles. An edge without a
//! neighbour contributes nothing, so triangles on the boundary show too little.

use crate::bending::{Floors, HingeFrame};
use crate::mesh::{NONE, RestTriangle, ShellMesh};
use crate::vec3::{V, add, scale};

/// Metric `I` \[1\] and curvature `II` [1/m] of a triangle, as
/// `(uu, vv, uv)`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FundamentalForms {
    /// First form.
    pub first: [f64; 3],
    /// Second form.
    pub second: [f64; 3],
}

impl FundamentalForms {
    /// Eigenvalues of the shape operator `I⁻¹ II` [1/m], the larger first;
    /// zero for a collapsed triangle.
    pub fn principal_curvatures(&self) -> [f64; 2] {
        let ([a, c, b], [l, n, m]) = (self.first, self.second);
        let det = a * c - b * b;
        if det <= 0.0 {
            return [0.0; 2];
        }
        let mean = 0.5 * (l * c - 2.0 * m * b + n * a) / det;
        let gauss = (l * n - m * m) / det;
        let radius = (mean * mean - gauss).max(0.0).sqrt();
        [mean + radius, mean - radius]
    }
}

const FLOORS: Floors = [f64::MIN_POSITIVE; 3];

/// Nodes of the hinge over the side opposite corner `i`, in the numbering of
/// [`triangle_forms`].
const fn hinge_nodes(i: usize) -> [usize; 4] {
    [(i + 1) % 3, (i + 2) % 3, i, 3 + i]
}

fn hinge(x: &[V; 6], i: usize) -> Option<HingeFrame> {
    let mut q = [0.0; 12];
    for (k, n) in hinge_nodes(i).into_iter().enumerate() {
        q[3 * k..3 * k + 3].copy_from_slice(&x[n]);
    }
    HingeFrame::new(&q, &FLOORS)
}

/// Forms of the triangle `x[0..3]`, whose neighbour across the side opposite
/// corner `i` has its far corner at `x[3 + i]` if `flaps[i]`.
pub fn triangle_forms(
    x: &[[f64; 3]; 6],
    flaps: [bool; 3],
    rest: &RestTriangle,
) -> FundamentalForms {
    forms(x, flaps, rest, |_, _, _| {})
}

/// [`triangle_forms`] and the derivative of `II` with respect to the six
/// points, `[uu, vv, uv][3 node + axis]` [1/m²].
pub fn triangle_forms_derivative(
    x: &[[f64; 3]; 6],
    flaps: [bool; 3],
    rest: &RestTriangle,
    derivative: &mut [[f64; 18]; 3],
) -> FundamentalForms {
    *derivative = [[0.0; 18]; 3];
    forms(x, flaps, rest, |i, frame, weights| {
        // d(θ η) = η ∇θ + θ a ⊗ m
        let [wing, _] = &frame.wings;
        let (angle, height) = (frame.angle(), 1.0 / wing.inverse_height);
        let gradient = frame.gradient();
        let lever = [-(1.0 - wing.foot), -wing.foot, 1.0, 0.0];
        for (k, n) in hinge_nodes(i).into_iter().enumerate() {
            let d = add(scale(height, gradient[k]), scale(angle * lever[k], wing.m));
            for (row, w) in derivative.iter_mut().zip(weights) {
                for a in 0..3 {
                    row[3 * n + a] -= w * d[a];
                }
            }
        }
    })
}

fn forms(
    x: &[V; 6],
    flaps: [bool; 3],
    rest: &RestTriangle,
    mut each: impl FnMut(usize, &HingeFrame, [f64; 3]),
) -> FundamentalForms {
    let [u, v] = rest.columns(&[x[0], x[1], x[2]]);
    let first = [
        crate::vec3::dot(u, u),
        crate::vec3::dot(v, v),
        crate::vec3::dot(u, v),
    ];
    let mut second = [0.0; 3];
    for (i, [gu, gv]) in rest.gradients().into_iter().enumerate() {
        if !flaps[i] {
            continue;
        }
        let Some(frame) = hinge(x, i) else { continue };
        let weights = [gu * gu, gv * gv, gu * gv];
        let s = -frame.angle() / frame.wings[0].inverse_height;
        for (out, w) in second.iter_mut().zip(weights) {
            *out += s * w;
        }
        each(i, &frame, weights);
    }
    FundamentalForms { first, second }
}

/// Forms of every triangle of a mesh at flat positions `q` \[m\].
///
/// # Panics
/// When `q` is shorter than the mesh's points.
pub fn mesh_forms(mesh: &ShellMesh, q: &[f64]) -> Vec<FundamentalForms> {
    let (points, _) = q.as_chunks::<3>();
    let one = |t: usize| {
        let triangle = mesh.triangles()[t];
        let mut x = [[0.0; 3]; 6];
        let mut flaps = [false; 3];
        for (i, (p, n)) in triangle.into_iter().zip(mesh.neighbours(t)).enumerate() {
            x[i] = points[p as usize];
            if n != NONE {
                let far = mesh.triangles()[n as usize]
                    .into_iter()
                    .find(|p| !triangle.contains(p));
                if let Some(far) = far {
                    x[3 + i] = points[far as usize];
                    flaps[i] = true;
                }
            }
        }
        triangle_forms(&x, flaps, &mesh.rest()[t])
    };
    (0..mesh.triangles().len()).map(one).collect()
}

/// Angle of every hinge of a mesh at flat positions `q` \[rad\], in (−π, π];
/// zero for a degenerate one. For rest angles of curved rest shapes.
///
/// # Panics
/// When `q` is shorter than the mesh's points.
pub fn hinge_angles(mesh: &ShellMesh, q: &[f64]) -> Vec<f64> {
    let angle = |points: [u32; 4]| {
        let mut local = [0.0; 12];
        for (k, p) in points.into_iter().enumerate() {
            local[3 * k..3 * k + 3].copy_from_slice(&q[3 * p as usize..3 * p as usize + 3]);
        }
        HingeFrame::new(&local, &FLOORS).map_or(0.0, |f| f.angle())
    };
    mesh.hinges().iter().map(|h| angle(h.points)).collect()
}
