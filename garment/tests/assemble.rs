//! Assembly around a body: strains, contact, crossings.

mod common;

use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::math::Vector;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy};
use selvedge_garment::{
    AssembleSettings, GarmentMesh, MeshSettings, Pattern, inside_fraction, preassemble,
};

fn volume(a: [f64; 3], b: [f64; 3], c: [f64; 3], d: [f64; 3]) -> f64 {
    let s = |p: [f64; 3]| [p[0] - a[0], p[1] - a[1], p[2] - a[2]];
    let (b, c, d) = (s(b), s(c), s(d));
    d[0] * (b[1] * c[2] - b[2] * c[1])
        + d[1] * (b[2] * c[0] - b[0] * c[2])
        + d[2] * (b[0] * c[1] - b[1] * c[0])
}

fn pierces(p: [f64; 3], q: [f64; 3], t: [[f64; 3]; 3]) -> bool {
    if (volume(t[0], t[1], t[2], p) > 0.0) == (volume(t[0], t[1], t[2], q) > 0.0) {
        return false;
    }
    let side = [0, 1, 2].map(|k| volume(p, q, t[k], t[(k + 1) % 3]) > 0.0);
    side[0] == side[1] && side[1] == side[2]
}

/// Pairs of triangles without common point that cross.
fn crossings(mesh: &GarmentMesh, x: &[[f64; 3]]) -> usize {
    let corners = |t: usize| mesh.triangles[t].map(|v| x[v as usize]);
    let boxes: Vec<Aabb> = (0..mesh.triangles.len())
        .map(|t| {
            let c = corners(t);
            let pick = |f: fn(f64, f64) -> f64| {
                let v = [0, 1, 2].map(|k| f(f(c[0][k], c[1][k]), c[2][k]));
                Vector::new(v[0], v[1], v[2])
            };
            Aabb::new(pick(f64::min), pick(f64::max))
        })
        .collect();
    let bvh = Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes);
    let mut count = 0;
    for i in 0..boxes.len() {
        for j in bvh.intersect_aabb(&boxes[i]) {
            let j = j as usize;
            let shared = mesh.triangles[i]
                .iter()
                .any(|v| mesh.triangles[j].contains(v));
            if j <= i || shared {
                continue;
            }
            let (a, b) = (corners(i), corners(j));
            let cross = (0..3)
                .any(|k| pierces(a[k], a[(k + 1) % 3], b) || pierces(b[k], b[(k + 1) % 3], a));
            count += usize::from(cross);
        }
    }
    count
}

/// The T-shirt closes around the mannequin: hardly strained, outside, free of
/// crossings, left and right of the arms, and the same bits every time.
#[test]
fn tshirt_closes() {
    let pattern = Pattern::from_json(&common::tshirt()).unwrap();
    let mesh = GarmentMesh::build(&pattern, &MeshSettings::default()).unwrap();
    let settings = AssembleSettings::default();
    let (x, report) = preassemble(&mesh, &common::person, &settings);
    assert!(report.stretch_max < 0.2, "{report:?}");
    assert!(report.compression_max < 0.2, "{report:?}");
    assert!(report.strain_percentiles[1] < 0.02, "{report:?}");
    assert_eq!(report.points_inside, 0);
    assert_eq!(inside_fraction(&x, &common::person), 0.0);
    assert_eq!(crossings(&mesh, &x), 0);
    // The left cuff is around the left arm: its mean lies inside the arm.
    let cuff = &mesh.labels["left_cuff"];
    let mut mean = [0.0; 3];
    for &p in cuff {
        for k in 0..3 {
            mean[k] += x[p as usize][k] / cuff.len() as f64;
        }
    }
    assert!(common::person(mean).0 < 0.0, "cuff around {mean:?}");
    let (again, _) = preassemble(&mesh, &common::person, &settings);
    assert_eq!(x, again);
}

/// The front of a tube around a column, a layer further out than the back,
/// keeps its larger clearance; a setting of zeros is none.
#[test]
fn layers_keep_their_distance() {
    let tube = r#"{"pattern": {"panels": {
        "front": {"vertices": [[0, 0], [36, 0], [36, 20], [0, 20]],
            "edges": [{"endpoints": [0, 1]}, {"endpoints": [1, 2]},
                      {"endpoints": [2, 3]}, {"endpoints": [3, 0]}],
            "translation": [-18, 0, 13], "rotation": [0, 0, 0]},
        "back": {"vertices": [[0, 0], [36, 0], [36, 20], [0, 20]],
            "edges": [{"endpoints": [0, 1]}, {"endpoints": [1, 2]},
                      {"endpoints": [2, 3]}, {"endpoints": [3, 0]}],
            "translation": [18, 0, -13], "rotation": [0, 180, 0]}},
        "stitches": [[{"panel": "front", "edge": 3}, {"panel": "back", "edge": 1}],
                     [{"panel": "front", "edge": 1}, {"panel": "back", "edge": 3}]]},
        "properties": {"units_in_meter": 100}}"#;
    let pattern = Pattern::from_json(tube.as_bytes()).unwrap();
    let mesh = GarmentMesh::build(&pattern, &MeshSettings::default()).unwrap();
    let column = |p: [f64; 3]| {
        let r = p[0].hypot(p[2]);
        (r - 0.1, [p[0] / r, 0.0, p[2] / r])
    };
    let assemble = |front: f64| {
        let panel_clearance = mesh.panels.iter().map(|p| match p.name.as_str() {
            "front" => front,
            _ => 0.0,
        });
        let settings = AssembleSettings {
            panel_clearance: panel_clearance.collect(),
            target_strain: 1e-3,
            ..AssembleSettings::default()
        };
        preassemble(&mesh, &column, &settings).0
    };
    let nearest = |x: &[[f64; 3]], name: &str| {
        let of_panel = mesh.triangles.iter().zip(&mesh.panel_of_triangle);
        of_panel
            .filter(|(_, p)| mesh.panels[**p as usize].name == name)
            .flat_map(|(t, _)| t.map(|p| column(x[p as usize]).0))
            .fold(f64::MAX, f64::min)
    };
    let x = assemble(0.01);
    println!(
        "front {}, back {}",
        nearest(&x, "front"),
        nearest(&x, "back")
    );
    assert!(nearest(&x, "front") > 0.0149 && nearest(&x, "back") > 0.0049);
    let plain = preassemble(
        &mesh,
        &column,
        &AssembleSettings {
            target_strain: 1e-3,
            ..AssembleSettings::default()
        },
    );
    assert_eq!(assemble(0.0), plain.0);
}

/// A flat square far from any body stays as it is.
#[test]
fn nothing_to_do() {
    let square = r#"{"pattern": {"panels": {"square": {
        "vertices": [[0, 0], [30, 0], [30, 30], [0, 30]],
        "edges": [{"endpoints": [0, 1]}, {"endpoints": [1, 2]},
                  {"endpoints": [2, 3]}, {"endpoints": [3, 0]}]}}}}"#;
    let pattern = Pattern::from_json(square.as_bytes()).unwrap();
    let mesh = GarmentMesh::build(&pattern, &MeshSettings::default()).unwrap();
    let nowhere = |_: [f64; 3]| (1e3, [0.0, 1.0, 0.0]);
    let (x, report) = preassemble(&mesh, &nowhere, &AssembleSettings::default());
    assert!(report.stretch_max < 1e-9, "{report:?}");
    for (a, b) in x.iter().zip(&mesh.points_initial) {
        assert!((0..3).all(|k| (a[k] - b[k]).abs() < 1e-9));
    }
}

/// A field that is not finite anywhere does not spread into the positions.
#[test]
fn broken_field() {
    let pattern = Pattern::from_json(&common::tshirt()).unwrap();
    let settings = MeshSettings {
        edge_length: 0.03,
        ..MeshSettings::default()
    };
    let mesh = GarmentMesh::build(&pattern, &settings).unwrap();
    let broken = |_: [f64; 3]| (f64::NAN, [f64::NAN; 3]);
    let (x, _) = preassemble(&mesh, &broken, &AssembleSettings::default());
    assert!(x.iter().flatten().all(|c| c.is_finite()));
}
