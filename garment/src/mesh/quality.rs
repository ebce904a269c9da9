//! Numbers that tell how good a mesh is.

use super::GarmentMesh;
use crate::math::dist2;

/// Counts, angles, lengths and gaps of a garment mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshStats {
    /// Points after welding.
    pub points: usize,
    /// Triangles.
    pub triangles: usize,
    /// Sum of the rest areas [m²].
    pub area: f64,
    /// Smallest angle of a rest triangle [degree].
    pub min_angle_degrees: f64,
    /// Angle below which one in a hundred triangles' smallest angles lies
    /// [degree].
    pub min_angle_first_percentile_degrees: f64,
    /// Mean of the triangles' smallest angles [degree]; 60 is ideal.
    pub min_angle_mean_degrees: f64,
    /// Shortest rest edge [m].
    pub edge_min: f64,
    /// Mean rest edge, each triangle's edges counted [m].
    pub edge_mean: f64,
    /// Longest rest edge [m].
    pub edge_max: f64,
    /// Largest distance between points to be welded, as placed [m].
    pub seam_gap_max: f64,
    /// Mean distance between points to be welded, as placed [m].
    pub seam_gap_mean: f64,
    /// Point pairs welded.
    pub welded_pairs: usize,
    /// Point pairs left open because welding would fold a triangle onto
    /// another; they are in the spring seams.
    pub open_pairs: usize,
    /// Edges shared by more than two triangles.
    pub non_manifold_edges: usize,
    /// Edges whose two triangles face opposite sides.
    pub flipped_edges: usize,
    /// Short edges contracted to a point.
    pub contracted_edges: usize,
}

/// Smallest angle of a triangle [rad].
fn smallest_angle(t: &[[f64; 2]; 3]) -> f64 {
    let mut smallest = f64::MAX;
    for k in 0..3 {
        let (p, q, r) = (t[k], t[(k + 1) % 3], t[(k + 2) % 3]);
        let (a, b) = ([q[0] - p[0], q[1] - p[1]], [r[0] - p[0], r[1] - p[1]]);
        let angle = (a[0] * b[1] - a[1] * b[0]).atan2(a[0] * b[0] + a[1] * b[1]);
        smallest = smallest.min(angle);
    }
    smallest
}

/// Fills in everything that can be read off the rest triangles.
pub(super) fn measure(mesh: &GarmentMesh, stats: &mut MeshStats) {
    stats.points = mesh.points_initial.len();
    stats.triangles = mesh.triangles.len();
    stats.area = (0..mesh.triangles.len()).map(|t| mesh.rest_area(t)).sum();
    let mut angles: Vec<f64> = mesh
        .material
        .iter()
        .map(|t| smallest_angle(t).to_degrees())
        .collect();
    angles.sort_by(f64::total_cmp);
    if let Some(&first) = angles.first() {
        stats.min_angle_degrees = first;
        stats.min_angle_first_percentile_degrees = angles[angles.len() / 100];
        stats.min_angle_mean_degrees = angles.iter().sum::<f64>() / angles.len() as f64;
    }
    stats.edge_min = f64::MAX;
    let mut sum = 0.0;
    for t in &mesh.material {
        for k in 0..3 {
            let l = dist2(t[k], t[(k + 1) % 3]);
            stats.edge_min = stats.edge_min.min(l);
            stats.edge_max = stats.edge_max.max(l);
            sum += l;
        }
    }
    stats.edge_mean = sum / (3 * mesh.material.len()).max(1) as f64;
}
