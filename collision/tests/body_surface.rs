//! Triangles extracted from bodies.

mod body_support;

use selvedge_collision::Aabb;
use selvedge_collision::body::{
    Body, FieldSettings, MeshBody, Shape, mannequin, surface_mesh, surface_mesh_in,
};

/// A sphere's mesh is closed, consistent, outward, of genus 0, on the sphere.
#[test]
fn sphere_is_closed_and_on_the_surface() {
    let radius = 0.2;
    let ball = Shape::Sphere {
        center: [0.3, 0.1, 0.0],
        radius,
    }
    .build()
    .unwrap();
    let (points, triangles) = surface_mesh(&ball, 0.0, 0.011).unwrap();
    for p in &points {
        assert!(ball.sample(*p, 0.0).distance.abs() < 1e-12);
    }
    let body = MeshBody::build("ball", &points, &triangles, &FieldSettings::default()).unwrap();
    let report = body.report();
    assert!(
        report.is_clean() && report.watertight && report.components == 1,
        "{report}"
    );
    assert_eq!(points.len() as i64 - triangles.len() as i64 / 2, 2, "Euler");
    let exact = 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
    assert!(
        (report.volume / exact - 1.0).abs() < 0.005,
        "{}",
        report.volume / exact
    );
}

/// The mannequin's mesh is closed and within a micrometre of its surface.
#[test]
fn mannequin_mesh() {
    let body = mannequin().build().unwrap();
    let (points, triangles) = surface_mesh(&body, 0.0, 0.015).unwrap();
    let off = points
        .iter()
        .map(|p| body.sample(*p, 0.0).distance.abs())
        .fold(0.0, f64::max);
    assert!(off < 1e-5, "{off:.1e}");
    let mut edges: Vec<[u32; 2]> = triangles
        .iter()
        .flat_map(|t| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]])
        .collect();
    edges.sort_unstable();
    let twins = edges
        .iter()
        .filter(|e| edges.binary_search(&[e[1], e[0]]).is_ok())
        .count();
    assert_eq!(twins, edges.len(), "every edge has its opposite");
}

/// A plane needs a region and is cut by it; bad cells are refused.
#[test]
fn regions_and_refusals() {
    let floor = Shape::Plane {
        point: [0.0, 0.013, 0.0],
        normal: [0.0, 1.0, 0.0],
    }
    .build()
    .unwrap();
    assert!(surface_mesh(&floor, 0.0, 0.05).is_err());
    let region = Aabb {
        min: [-0.5; 3],
        max: [0.5; 3],
    };
    let (points, triangles) = surface_mesh_in(&floor, 0.0, 0.05, &region).unwrap();
    assert!(points.iter().all(|p| (p[1] - 0.013).abs() < 1e-15) && triangles.len() > 600);
    for t in &triangles {
        let [a, b, c] = t.map(|i| points[i as usize]);
        let up = (b[2] - a[2]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[2] - a[2]);
        assert!(up > 0.0, "seen from outside");
    }
    for cell in [0.0, -1.0, f64::NAN, 1e-9] {
        assert!(surface_mesh_in(&floor, 0.0, cell, &region).is_err());
    }
}
