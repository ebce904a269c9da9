//! How much a sheet is stretched, for reports and tests.

use crate::ShellMesh;

/// Positions are one `[x, y, z]` per point of the mesh, flat, as in the
/// unknowns of a simulation (which may hold more after them).
fn corners(q: &[f64], t: &[u32; 3]) -> [[f64; 3]; 3] {
    t.map(|p| std::array::from_fn(|a| q[3 * p as usize + a]))
}

/// Principal stretches `s_1 ≥ s_2 ≥ 0` of every triangle \[1\]: the singular
/// values of the deformation gradient.
///
/// # Panics
/// When `q` is shorter than the mesh's points.
pub fn principal_stretches(mesh: &ShellMesh, q: &[f64]) -> Vec<[f64; 2]> {
    let stretch = |(t, rest): (&[u32; 3], &crate::RestTriangle)| {
        let [u, v] = rest.columns(&corners(q, t));
        let (uu, vv) = (crate::vec3::dot(u, u), crate::vec3::dot(v, v));
        let uv = crate::vec3::dot(u, v);
        let high = (0.5 * (uu + vv) + (0.5 * (uu - vv)).hypot(uv)).sqrt();
        // Through the area ratio: no cancellation in the smaller one.
        let area = crate::vec3::norm(crate::vec3::cross(u, v));
        [high, if high > 0.0 { area / high } else { 0.0 }]
    };
    mesh.triangles()
        .iter()
        .zip(mesh.rest())
        .map(stretch)
        .collect()
}

/// Strain of the edges against their material lengths.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EdgeStrain {
    /// `max |l/l̄ − 1|` \[1\].
    pub max_abs: f64,
    /// `mean |l/l̄ − 1|` \[1\].
    pub mean_abs: f64,
    /// Index of the edge with the largest one.
    pub worst: usize,
}

/// Statistics of `|l/l̄ − 1|` over all edges; zeros for a mesh without edges.
///
/// # Panics
/// When `q` is shorter than the mesh's points.
pub fn edge_strain(mesh: &ShellMesh, q: &[f64]) -> EdgeStrain {
    let mut out = EdgeStrain::default();
    let mut sum = 0.0;
    for (i, edge) in mesh.edges().iter().enumerate() {
        let [a, b] = edge.points.map(|p| 3 * p as usize);
        let d = [q[b] - q[a], q[b + 1] - q[a + 1], q[b + 2] - q[a + 2]];
        let strain = (crate::vec3::norm(d) / mesh.rest_length(edge) - 1.0).abs();
        sum += strain;
        // NaN wins, so that it is seen.
        if strain > out.max_abs || strain.is_nan() {
            out.max_abs = strain;
            out.worst = i;
        }
    }
    out.mean_abs = sum / mesh.edges().len().max(1) as f64;
    out
}
