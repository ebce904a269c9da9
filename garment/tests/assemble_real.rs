//! Assembly of the real patterns around the scanned body they were drawn for.
//!
//! Several of these randomly sampled garments are tighter than the body
//! (cuffs of 17 cm around a forearm of 25 cm, of 23 cm around a thigh of
//! 60 cm): their largest strains are the pattern's, not the assembly's.

mod common;

use parry3d_f64::math::Vector;
use parry3d_f64::query::PointQuery;
use parry3d_f64::shape::{TriMesh, TriMeshFlags};
use selvedge_garment::{AssembleSettings, GarmentMesh, MeshSettings, Pattern, preassemble};

fn body(name: &str) -> Option<TriMesh> {
    let path = common::shared("bodies")?.join(name);
    let options = tobj::LoadOptions {
        triangulate: true,
        single_index: true,
        ..Default::default()
    };
    let (models, _) = tobj::load_obj(path, &options).unwrap();
    let mesh = &models[0].mesh;
    let points = mesh
        .positions
        .chunks_exact(3)
        .map(|p| Vector::new(f64::from(p[0]), f64::from(p[1]), f64::from(p[2])))
        .collect();
    let triangles = mesh
        .indices
        .chunks_exact(3)
        .map(|t| [t[0], t[1], t[2]])
        .collect();
    let flags = TriMeshFlags::ORIENTED | TriMeshFlags::MERGE_DUPLICATE_VERTICES;
    Some(TriMesh::with_flags(points, triangles, flags).unwrap())
}

fn field(mesh: &TriMesh, p: [f64; 3]) -> (f64, [f64; 3]) {
    let p = Vector::new(p[0], p[1], p[2]);
    let nearest = mesh.project_local_point(p, false);
    let d = p - nearest.point;
    let length = d.length();
    let sign = if nearest.is_inside { -1.0 } else { 1.0 };
    let g = d * (sign / length.max(1e-12));
    (sign * length, [g.x, g.y, g.z])
}

/// Every pattern closes: no point is left inside the body, half of all edges
/// are within 5 % and nine in ten within 20 % of their rest length.
#[test]
fn every_pattern_closes() {
    let (Some(standing), Some(apart)) = (body("mean_all.obj"), body("mean_all_apart.obj")) else {
        return;
    };
    for (name, bytes) in common::garments() {
        let pattern = Pattern::from_json(&bytes).unwrap();
        let settings = MeshSettings {
            edge_length: 0.02,
            ..MeshSettings::default()
        };
        let mesh = GarmentMesh::build(&pattern, &settings).unwrap();
        let trousers = pattern.panels.iter().any(|p| p.name.starts_with("pant_"));
        let body = if trousers { &apart } else { &standing };
        let sdf = |p: [f64; 3]| field(body, p);
        let (x, r) = preassemble(&mesh, &sdf, &AssembleSettings::default());
        println!(
            "{name}: {} points, stretch max {:.2}, |strain| p50 {:.3} p90 {:.3} p99 {:.3}",
            x.len(),
            r.stretch_max,
            r.strain_percentiles[0],
            r.strain_percentiles[1],
            r.strain_percentiles[2],
        );
        assert!(x.iter().flatten().all(|c| c.is_finite()), "{name}");
        assert_eq!(r.points_inside, 0, "{name}: {r:?}");
        assert!(r.strain_percentiles[0] < 0.05, "{name}: {r:?}");
        assert!(r.strain_percentiles[1] < 0.20, "{name}: {r:?}");
    }
}
