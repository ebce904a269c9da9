//! Cavities of mesh bodies that cloth cannot enter.

mod body_support;

use body_support::{Random, cuboid, joined, sphere};
use selvedge_collision::Body;
use selvedge_collision::body::{FieldSettings, MeshBody, Shape};
use std::f64::consts::PI;

const SETTINGS: FieldSettings = FieldSettings {
    voxel: 0.005,
    band: 0.015,
};
/// Outer radius and half height of a jar.
const RADIUS: f64 = 0.06;
const HALF: f64 = 0.06;

type Mesh = (Vec<[f64; 3]>, Vec<[u32; 3]>);

/// A round jar around y with a ball of a cavity (radius 25 mm, at the origin)
/// and a neck of radius `neck` to its top.
fn jar(neck: f64) -> Mesh {
    const AROUND: usize = 48;
    let mut profile: Vec<[f64; 2]> = Vec::new();
    let mut line = |to: [f64; 2], pieces: usize| {
        let from = *profile.last().unwrap_or(&to);
        for n in 1..=pieces {
            let t = n as f64 / pieces as f64;
            profile.push([0, 1].map(|k| from[k] + t * (to[k] - from[k])));
        }
    };
    line([0.0, -HALF], 1);
    line([RADIUS, -HALF], 8);
    line([RADIUS, HALF], 16);
    line([neck, HALF], 8);
    let opening = (neck / 0.025_f64).asin();
    line([neck, 0.025 * opening.cos()], 8);
    for n in 1..=16 {
        let a = opening + (PI - opening) * n as f64 / 16.0;
        line([0.025 * a.sin().max(0.0), 0.025 * a.cos()], 1);
    }
    let last = profile.len() - 1;
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    for [r, y] in &profile[1..last] {
        for j in 0..AROUND {
            let turn = 2.0 * PI * j as f64 / AROUND as f64;
            points.push([r * turn.cos(), *y, r * turn.sin()]);
        }
    }
    let at = |i: usize, j: usize| (i * AROUND + j % AROUND) as u32;
    for j in 0..AROUND {
        for i in 0..last - 2 {
            let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
            triangles.extend([[a, c, b], [a, d, c]]);
        }
        let ends = points.len() as u32;
        triangles.push([ends, at(0, j), at(0, j + 1)]);
        triangles.push([ends + 1, at(last - 2, j + 1), at(last - 2, j)]);
    }
    points.push([0.0, -HALF, 0.0]);
    points.push([0.0, -0.025, 0.0]);
    (points, triangles)
}

fn build(mesh: &Mesh) -> MeshBody {
    MeshBody::build("jar", &mesh.0, &mesh.1, &SETTINGS).unwrap()
}

/// With a narrow neck the jar is a solid cylinder with a crack: cloth in its
/// wall, nearer to the cavity, is pushed out.
#[test]
fn narrow_necks_are_closed() {
    let body = build(&jar(0.0015));
    let report = body.report();
    assert!(
        report.watertight && report.hidden_triangles == 0,
        "{report}"
    );
    assert_eq!(report.filled_cavities, 1);
    assert!(report.to_string().contains("1 cavities filled"), "{report}");
    // 8 mm under the cavity, 27 mm above the bottom.
    let wall = body.sample([0.004, -0.033, 0.002], 0.0);
    assert!(wall.distance < -0.02 && wall.normal[1] < -0.8, "{wall:?}");

    let solid = Shape::Cylinder {
        a: [0.0, -HALF, 0.0],
        b: [0.0, HALF, 0.0],
        radius: RADIUS,
        rounding: 0.0,
    };
    let solid = solid.build().unwrap();
    let mut random = Random(3);
    for _ in 0..20_000 {
        let p = random.point(0.075);
        // The walls of the neck stay part of the surface.
        let radius = p[0].hypot(p[2]);
        let to_neck = radius.hypot((0.025 - p[1]).max(0.0)) - 0.0015;
        let exact = solid.sample(p, 0.0).distance.max(-to_neck.max(0.0));
        let found = body.sample(p, 0.0).distance;
        let in_neck = radius < 0.012 && p[1] > 0.01;
        // Coarse cells, deep inside: the ridge of the distance lies in them.
        let bound = if exact > -0.012 { 0.0045 } else { 0.0175 };
        assert!(
            in_neck || (found - exact).abs() < bound,
            "{p:?}: {found} {exact}"
        );
        // What is well inside is inside.
        assert!(exact > -0.009 || found < 0.0, "{p:?}: {found} {exact}");
    }
}

/// Cloth may go through a wide neck and be in a large room; a dent is no cavity.
#[test]
fn what_cloth_can_enter_stays_open() {
    let body = build(&jar(0.01));
    assert_eq!(body.report().filled_cavities, 0);
    assert!(body.sample([0.0; 3], 0.0).distance > 0.01);

    let mut room = cuboid([0.0; 3], [0.09; 3]);
    room.1.iter_mut().for_each(|t| t.swap(1, 2));
    let room = build(&joined(cuboid([0.0; 3], [0.11; 3]), room));
    assert_eq!(room.report().filled_cavities, 0);
    assert!(room.sample([0.0; 3], 0.0).distance > 0.05);

    let ball = build(&sphere([0.0; 3], 0.06, 30));
    assert!(ball.report().is_clean());
}

/// A closed void of the size of a mouth is filled.
#[test]
fn closed_voids_are_filled() {
    let mut void = sphere([0.0; 3], 0.03, 24);
    void.1.iter_mut().for_each(|t| t.swap(1, 2));
    let body = build(&joined(cuboid([0.0; 3], [0.05; 3]), void));
    assert_eq!(body.report().filled_cavities, 1, "{}", body.report());
    assert!(body.sample([0.0; 3], 0.0).distance < -0.03);
    let wall = body.sample([0.002, 0.001, -0.038], 0.0);
    assert!((wall.distance + 0.012).abs() < 1e-3, "{wall:?}");
    assert!(wall.normal[2] < -0.99, "{wall:?}");
}
