//! Distance field of a scanned person: defects, cost, and error against the
//! exact distance. `cargo run --release --example body_scan -- BODY.obj`

use parry3d_f64::math::Vector;
use parry3d_f64::query::PointQuery;
use parry3d_f64::shape::{TriMesh, TriMeshFlags};
use selvedge_collision::body::{Body, FieldSettings, MeshBody};
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let default = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../shared/data/bodies/mean_all.obj"
    );
    let path = std::env::args()
        .nth(1)
        .unwrap_or_else(|| default.to_owned());
    if !std::path::Path::new(&path).exists() {
        println!("skipped: no {path}");
        return Ok(());
    }
    let (models, _) = tobj::load_obj(
        &path,
        &tobj::LoadOptions {
            triangulate: true,
            ..Default::default()
        },
    )?;
    let mesh = &models[0].mesh;
    let points: Vec<[f64; 3]> = mesh
        .positions
        .as_chunks::<3>()
        .0
        .iter()
        .map(|p| p.map(f64::from))
        .collect();
    let triangles = mesh.indices.as_chunks::<3>().0.to_vec();

    let settings = FieldSettings::default();
    let start = Instant::now();
    let body = MeshBody::build("scan", &points, &triangles, &settings)?;
    println!("{}", body.report());
    println!(
        "built in {:.2} s, {} bricks, {:.1} MB",
        start.elapsed().as_secs_f64(),
        body.field().brick_count(),
        body.field().heap_bytes() as f64 * 1e-6
    );

    // Random points of the band around random triangles.
    let exact = TriMesh::with_flags(
        points
            .iter()
            .map(|p| Vector::new(p[0], p[1], p[2]))
            .collect(),
        triangles.clone(),
        TriMeshFlags::ORIENTED,
    )?;
    let mut seed = 1_u64;
    let mut random = || {
        seed = seed
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1_u64 << 53) as f64
    };
    let mut errors = Vec::new();
    let mut queries = Vec::new();
    let mut other_side = 0;
    for _ in 0..100_000 {
        let t = triangles[(random() * triangles.len() as f64) as usize];
        let base = points[t[0] as usize];
        let p: [f64; 3] = std::array::from_fn(|a| base[a] + 2.0 * settings.band * (random() - 0.5));
        let q = Vector::new(p[0], p[1], p[2]);
        let projection = exact.project_local_point(q, false);
        let d = (projection.point - q).length();
        let signed = if projection.is_inside { -d } else { d };
        if d <= settings.band {
            let found = body.sample(p, 0.0).distance;
            // Pseudo-normals mistake the side in a fold that crosses itself.
            other_side += usize::from((found - signed).abs() > d + 0.5 * settings.voxel);
            errors.push((found - signed).abs().min((found + signed).abs()));
            queries.push(p);
        }
    }
    errors.sort_unstable_by(f64::total_cmp);
    let at = |q: f64| 1e3 * errors[((errors.len() - 1) as f64 * q) as usize];
    println!("{other_side} points on the other side by pseudo-normals");
    println!(
        "error at {} points [mm]: median {:.4}, 99 % {:.3}, 99.9 % {:.3}, largest {:.3}",
        errors.len(),
        at(0.5),
        at(0.99),
        at(0.999),
        at(1.0)
    );
    let start = Instant::now();
    let sum: f64 = queries.iter().map(|p| body.sample(*p, 0.0).distance).sum();
    let each = start.elapsed().as_secs_f64() / queries.len() as f64;
    println!("{:.0} ns per sample (sum {sum:.3})", 1e9 * each);
    // φ is 1-Lipschitz: trilinear values are within half a voxel's diagonal.
    assert!(at(1.0) < 1e3 * 0.5 * 3.0_f64.sqrt() * settings.voxel);
    Ok(())
}
