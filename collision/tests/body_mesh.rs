//! Mesh bodies: accuracy against exact distances, sign, continuity, repair.

mod body_support;

use body_support::{Random, add_scaled, cuboid, gradient_error, joined, norm, sphere, sub};
use parry3d_f64::math::Vector;
use parry3d_f64::query::PointQuery;
use parry3d_f64::shape::{TriMesh, TriMeshFlags};
use selvedge_collision::body::{Body, FieldSettings, MeshBody, Shape};
use selvedge_collision::{Aabb, CollisionError};

const SETTINGS: FieldSettings = FieldSettings {
    voxel: 0.005,
    band: 0.015,
};

fn build(mesh: &(Vec<[f64; 3]>, Vec<[u32; 3]>)) -> MeshBody {
    MeshBody::build("test", &mesh.0, &mesh.1, &SETTINGS).unwrap()
}

/// In the band the field follows the exact signed distance of the same
/// triangles (an independent projection with pseudo-normals) within the
/// stated bounds, also on sharp edges.
#[test]
fn band_follows_the_exact_distance() {
    for (mesh, smooth) in [
        (sphere([0.01, -0.02, 0.03], 0.15, 60), true),
        (cuboid([0.0; 3], [0.15, 0.1, 0.07]), false),
    ] {
        let body = build(&mesh);
        assert!(
            body.report().is_clean() && body.report().watertight,
            "{}",
            body.report()
        );
        let points = mesh
            .0
            .iter()
            .map(|p| Vector::new(p[0], p[1], p[2]))
            .collect();
        let exact = TriMesh::with_flags(points, mesh.1.clone(), TriMeshFlags::ORIENTED).unwrap();
        let mut random = Random(1);
        let (mut worst, mut count) = (0.0_f64, 0);
        for _ in 0..40_000 {
            let p = random.point(0.2);
            let q = Vector::new(p[0], p[1], p[2]);
            let projection = exact.project_local_point(q, false);
            let mut d = (projection.point - q).length();
            if projection.is_inside {
                d = -d;
            }
            if d.abs() <= SETTINGS.band {
                worst = worst.max((body.sample(p, 0.0).distance - d).abs());
                count += 1;
            }
        }
        assert!(count > 3000);
        // Triangles of the sphere meet at angles of 3°: a tenth of a millimetre more.
        let h = SETTINGS.voxel;
        let bound = if smooth {
            h * h / 8.0 * 2.0 / 0.13 + 1e-4
        } else {
            0.5 * 3.0_f64.sqrt() * h
        };
        assert!(worst < bound, "{worst:.2e} against {bound:.2e}");
    }
}

/// The gradient is that of the sampled field, in fine cells, coarse cells and
/// beyond the grid; the field is continuous across all of them.
#[test]
fn gradient_and_continuity() {
    let body = build(&sphere([0.0; 3], 0.15, 40));
    let mut random = Random(2);
    let mut kinks = 0;
    for _ in 0..20_000 {
        let p = random.point(0.4);
        // Differences across a cell face see both gradients.
        kinks += usize::from(gradient_error(&body, p, 0.0, 1e-7) > 1e-6);
        let n = norm(body.sample(p, 0.0).normal);
        assert!(n < 4.0);
        let step = add_scaled(p, random.point(1.0), 1e-9);
        let jump = body.sample(step, 0.0).distance - body.sample(p, 0.0).distance;
        assert!(jump.abs() < 1e-8, "{p:?}: jump of {jump:.1e} m");
    }
    assert!(kinks < 20, "{kinks}");
}

/// From deep inside and from far outside, the normal leads to the surface.
#[test]
fn normals_point_outward_everywhere() {
    let body = build(&sphere([0.0; 3], 0.15, 40));
    let mut random = Random(3);
    for _ in 0..20_000 {
        let p = random.point(1.0);
        let r = norm(p);
        if r < 0.03 {
            continue; // the medial point
        }
        let s = body.sample(p, 0.0);
        let outward: f64 = (0..3).map(|i| s.normal[i] * p[i] / r).sum();
        assert!(outward > 0.3, "{p:?} {s:?}");
        if (r - 0.15).abs() > 0.003 {
            assert_eq!(s.distance > 0.0, r > 0.15);
        }
    }
    // From 12 cm deep, descent along the normal reaches the surface.
    let mut p = [0.03, 0.0, 0.0];
    for _ in 0..40 {
        let s = body.sample(p, 0.0);
        p = add_scaled(p, s.normal, -0.5 * s.distance);
    }
    assert!(body.sample(p, 0.0).distance.abs() < 1e-4);
}

/// Three missing triangles are reported with their places and filled; the
/// distance is that of the whole sphere up to the flat patches.
#[test]
fn holes_are_found_and_filled() {
    let (points, mut triangles) = sphere([0.0; 3], 0.15, 40);
    let whole = build(&(points.clone(), triangles.clone()));
    let places: Vec<_> = [2000, 900, 3].map(|t| triangles.swap_remove(t)).into();
    let body = build(&(points.clone(), triangles));
    let report = body.report();
    assert_eq!(
        (report.boundary_edges.len(), report.filled_holes),
        (9, 3),
        "{report}"
    );
    assert!(report.watertight && !report.is_clean());
    let corner = points[places[0][0] as usize];
    assert!(report.boundary_edges.iter().flatten().any(|p| *p == corner));
    assert_eq!(
        body.field(),
        whole.field(),
        "single triangles are put back as they were"
    );
}

/// A gap that is no simple loop (two triangles touching at a point are gone,
/// and a flap stands on an edge) leaves the sign to the winding number.
#[test]
fn open_and_non_manifold_meshes_keep_their_sign() {
    let (mut points, mut triangles) = sphere([0.0; 3], 0.15, 30);
    triangles.drain(600..604);
    let [a, b, _] = triangles[100];
    let tip = add_scaled(points[a as usize], points[a as usize], 0.05);
    points.push(tip);
    triangles.push([a, b, points.len() as u32 - 1]);
    let body = build(&(points, triangles));
    assert!(!body.report().non_manifold_edges.is_empty() && !body.report().watertight);
    let mut random = Random(4);
    for _ in 0..5000 {
        let p = random.point(0.25);
        let d = norm(p) - 0.15;
        if d.abs() > 0.006 {
            assert_eq!(body.sample(p, 0.0).distance > 0.0, d > 0.0, "{p:?}");
        }
    }
}

/// Inside-out meshes and single reversed triangles are turned.
#[test]
fn orientation_is_repaired() {
    let mesh = sphere([0.0; 3], 0.15, 24);
    let straight = build(&mesh);
    let mut inverted = mesh.clone();
    inverted.1.iter_mut().for_each(|t| t.swap(0, 2));
    let body = build(&inverted);
    assert!(body.report().inverted);
    assert_eq!(body.report().flipped_triangles, mesh.1.len());
    assert!((body.report().volume - straight.report().volume).abs() < 1e-12);
    assert!(body.sample([0.0; 3], 0.0).distance < -0.1);

    let mut mixed = mesh;
    for t in [5, 77, 300] {
        mixed.1[t].swap(0, 1);
    }
    let body = build(&mixed);
    assert_eq!(
        (
            body.report().inconsistent_edges,
            body.report().flipped_triangles
        ),
        (9, 3)
    );
    assert!(body.report().watertight && !body.report().inverted);
}

/// Points stored once per triangle are welded; triangles that name a point
/// twice and copies are dropped, and the field is the same.
#[test]
fn soup_is_welded() {
    let mesh = sphere([0.0; 3], 0.15, 16);
    let clean = build(&mesh);
    let points: Vec<_> = mesh
        .1
        .iter()
        .flat_map(|t| t.map(|p| mesh.0[p as usize]))
        .collect();
    let mut triangles: Vec<[u32; 3]> = (0..mesh.1.len() as u32)
        .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
        .collect();
    triangles.push([7, 8, 7]);
    triangles.push(triangles[4]);
    let body = build(&(points.clone(), triangles));
    let report = body.report();
    assert_eq!(report.welded_points, points.len() - mesh.0.len());
    assert_eq!(
        (report.degenerate_triangles, report.duplicate_triangles),
        (1, 1)
    );
    assert!(report.watertight);
    let mut random = Random(5);
    for _ in 0..1000 {
        let p = random.point(0.3);
        assert!((body.sample(p, 0.0).distance - clean.sample(p, 0.0).distance).abs() < 1e-6);
    }
}

/// Two spheres that intersect are one body: triangles inside the other are
/// left out, and the depth of their middle is that of the union.
#[test]
fn overlapping_parts_are_joined() {
    let mesh = joined(
        sphere([-0.1, 0.0, 0.0], 0.15, 60),
        sphere([0.1, 0.0, 0.0], 0.15, 60),
    );
    let fine = FieldSettings {
        voxel: 0.005,
        band: 0.12,
    };
    let body = MeshBody::build("pair", &mesh.0, &mesh.1, &fine).unwrap();
    assert!(body.report().hidden_triangles > 1000 && body.report().components == 2);
    // The middle: distance to the intersection circle, less the straddling
    // triangles (diagonals of 11 mm) and half a voxel's diagonal.
    let d = body.sample([0.0; 3], 0.0).distance;
    let circle = (0.15_f64.powi(2) - 0.01).sqrt();
    assert!(
        d < 0.0 && (d + circle).abs() < 0.0111 + 0.0044,
        "{d} against {circle}"
    );
}

/// What is no body is refused, by name.
#[test]
fn refusals() {
    let (mut points, triangles) = cuboid([0.0; 3], [0.1; 3]);
    let try_build = |p: &[[f64; 3]], t: &[[u32; 3]], s: FieldSettings| {
        MeshBody::build("crate", p, t, &s).map(|_| ()).unwrap_err()
    };
    let flat = try_build(&points, &triangles[..2], SETTINGS);
    assert!(matches!(flat, CollisionError::Body { .. }), "{flat}");
    assert!(matches!(
        try_build(&points, &[], SETTINGS),
        CollisionError::Body { .. }
    ));
    assert!(matches!(
        try_build(&[], &[], SETTINGS),
        CollisionError::Body { .. }
    ));
    let far = try_build(&points, &[[0, 1, 8]], SETTINGS);
    assert!(matches!(
        far,
        CollisionError::PointOutOfRange { point: 8, .. }
    ));
    for (voxel, band) in [(0.0, 0.01), (f64::NAN, 0.01), (0.01, -1.0), (1e-6, 0.01)] {
        let error = try_build(&points, &triangles, FieldSettings { voxel, band });
        assert!(matches!(error, CollisionError::Parameter { .. }), "{error}");
    }
    points[3][1] = f64::INFINITY;
    let error = try_build(&points, &triangles, SETTINGS);
    assert!(matches!(
        error,
        CollisionError::NotFinitePosition { point: 3 }
    ));
}

/// The field has the same bits for any number of threads; bad positions do not panic.
#[test]
fn same_bits_for_any_thread_count() {
    let mesh = sphere([0.0; 3], 0.1, 20);
    let with = |n| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(n)
            .build()
            .unwrap();
        pool.install(|| build(&mesh))
    };
    let one = with(1);
    assert_eq!(one.field(), with(3).field());
    assert!(one.sample([f64::NAN, 0.0, 0.0], 0.0).distance.is_nan());
    assert!(
        !one.sample([f64::INFINITY, 0.0, 0.0], 0.0)
            .distance
            .is_finite()
    );
}

/// A scanned person: closed, and the field follows the exact distance within
/// `√3/2` voxels everywhere, 1.5 mm at 99 % of the points of the band.
#[test]
fn scanned_body() {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../shared/data/bodies/mean_all.obj"
    );
    if !std::path::Path::new(path).exists() {
        println!("skipped: no {path}");
        return;
    }
    let options = tobj::LoadOptions {
        triangulate: true,
        ..Default::default()
    };
    let (models, _) = tobj::load_obj(path, &options).unwrap();
    let mesh = &models[0].mesh;
    let points: Vec<[f64; 3]> = mesh
        .positions
        .as_chunks::<3>()
        .0
        .iter()
        .map(|p| p.map(f64::from))
        .collect();
    let triangles = mesh.indices.as_chunks::<3>().0.to_vec();
    let body = build(&(points.clone(), triangles.clone()));
    let report = body.report();
    assert!(
        report.watertight && report.components == 1 && !report.inverted,
        "{report}"
    );
    // The mouth is filled: cloth pressed against the chin comes out below it.
    assert_eq!(report.filled_cavities, 1, "{report}");
    assert!(body.sample([0.003, 1.54, 0.08], 0.0).distance < -0.03);
    let chin = body.sample([0.003, 1.502, 0.087], 0.0);
    assert!(chin.distance < -0.015 && chin.normal[1] < -0.8, "{chin:?}");
    let mouth = Aabb {
        min: [-0.05, 1.49, 0.0],
        max: [0.05, 1.59, 0.14],
    };
    assert!((0.06..0.08).contains(&report.volume));
    assert!(body.field().heap_bytes() < 20_000_000);

    let exact = TriMesh::new(
        points
            .iter()
            .map(|p| Vector::new(p[0], p[1], p[2]))
            .collect(),
        triangles,
    )
    .unwrap();
    let mut random = Random(6);
    let mut errors = Vec::new();
    while errors.len() < 5000 {
        let base = points[(random.next() * points.len() as f64) as usize];
        let p = add_scaled(base, random.point(1.0), SETTINGS.band);
        if mouth.overlaps(&Aabb::of_points(&[p])) {
            continue;
        }
        let q = Vector::new(p[0], p[1], p[2]);
        let foot = exact.project_local_point(q, false).point;
        let d = norm(sub(p, [foot.x, foot.y, foot.z]));
        if d <= SETTINGS.band {
            let found = body.sample(p, 0.0).distance;
            errors.push((found - d).abs().min((found + d).abs()));
        }
    }
    errors.sort_unstable_by(f64::total_cmp);
    assert!(
        errors[4999] < 0.5 * 3.0_f64.sqrt() * SETTINGS.voxel,
        "{}",
        errors[4999]
    );
    assert!(errors[4950] < 1.5e-3, "{}", errors[4950]);
}

/// A thin wall keeps its two sides.
#[test]
fn thin_wall() {
    let body = build(&cuboid([0.0; 3], [0.1, 0.003, 0.1]));
    let s = body.sample([0.0, 0.01, 0.0], 0.0);
    assert!(
        (s.distance - 0.007).abs() < 1e-3 && s.normal[1] > 0.5,
        "{s:?}"
    );
    let exact = Shape::Box {
        center: [0.0; 3],
        half: [0.1, 0.003, 0.1],
        rounding: 0.0,
        rotation: [0.0; 3],
    };
    let exact = exact.build().unwrap();
    let mut random = Random(7);
    for _ in 0..2000 {
        let p = random.point(0.12);
        let d = exact.sample(p, 0.0).distance;
        if d.abs() < SETTINGS.band {
            assert!((body.sample(p, 0.0).distance - d).abs() < 0.00434);
        }
    }
}
