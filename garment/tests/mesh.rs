//! Meshing: areas, seams, quality, darts, cones, chains, determinism.

mod common;

use selvedge_garment::{GarmentMesh, MeshSettings, Pattern, SeamMode, Severity};

fn build(text: &str, h: f64) -> GarmentMesh {
    let settings = MeshSettings {
        edge_length: h,
        ..MeshSettings::default()
    };
    GarmentMesh::build(&Pattern::from_json(text.as_bytes()).unwrap(), &settings).unwrap()
}

fn check_consistent(name: &str, m: &GarmentMesh) {
    assert_eq!(m.triangles.len(), m.material.len());
    assert_eq!(m.triangles.len(), m.panel_of_triangle.len());
    let mut used = vec![false; m.points_initial.len()];
    for (t, corners) in m.triangles.iter().enumerate() {
        assert!(m.rest_area(t) > 0.0, "{name}: triangle {t}");
        for &v in corners {
            used[v as usize] = true;
        }
    }
    assert!(used.iter().all(|&u| u), "{name}: a point without triangle");
    assert_eq!(m.stats.flipped_edges, 0, "{name}");
}

/// All real patterns mesh at 1 cm: areas match the panels, triangles are good,
/// seams are closed, nothing is degenerate.
#[test]
fn real_patterns() {
    for (name, bytes) in common::garments() {
        let pattern = Pattern::from_json(&bytes).unwrap();
        let m = GarmentMesh::build(&pattern, &MeshSettings::default()).unwrap();
        check_consistent(&name, &m);
        let shell = m.to_shell_mesh(|_| 0);
        assert!(shell.is_ok(), "{name}: {:?}", shell.err());
        let s = &m.stats;
        let panels: f64 = m.panels.iter().map(|p| p.area).sum();
        assert!((s.area / panels - 1.0).abs() < 1e-9, "{name}");
        assert!(
            s.min_angle_degrees > 10.0,
            "{name}: {}",
            s.min_angle_degrees
        );
        assert!(s.min_angle_first_percentile_degrees > 30.0, "{name}: {s:?}");
        assert!(s.min_angle_mean_degrees > 55.0, "{name}: {s:?}");
        assert!(s.edge_max < 0.016, "{name}: {s:?}");
        assert_eq!((s.open_pairs, s.non_manifold_edges), (0, 0), "{name}");
        assert!(
            m.findings.iter().all(|f| f.severity == Severity::Note),
            "{name}"
        );
    }
}

/// Coarse and fine meshes of every real pattern exist too.
#[test]
fn other_resolutions() {
    for (name, bytes) in common::garments() {
        let pattern = Pattern::from_json(&bytes).unwrap();
        for h in [0.005, 0.02, 0.04, 0.08] {
            if h < 0.01 && bytes.len() > 20_000 {
                continue; // keep the test short
            }
            let settings = MeshSettings {
                edge_length: h,
                ..MeshSettings::default()
            };
            let m = GarmentMesh::build(&pattern, &settings)
                .unwrap_or_else(|e| panic!("{name} at {h}: {e}"));
            check_consistent(&name, &m);
        }
    }
}

/// The same bits every time.
#[test]
fn deterministic() {
    let p = Pattern::from_json(&common::tshirt()).unwrap();
    let a = GarmentMesh::build(&p, &MeshSettings::default()).unwrap();
    let b = GarmentMesh::build(&p, &MeshSettings::default()).unwrap();
    assert_eq!(a.points_initial, b.points_initial);
    assert_eq!((a.triangles, a.material), (b.triangles, b.material));
}

/// Material coordinates: warp along the panel's y, weft along −x seen from
/// outside, and `from_material` goes back.
#[test]
fn material_axes() {
    let p = Pattern::from_json(&common::tshirt()).unwrap();
    let m = GarmentMesh::build(&p, &MeshSettings::default()).unwrap();
    assert_eq!(m.panels[0].to_material([0.1, 0.3]), [0.3, -0.1]);
    assert_eq!(m.panels[1].side, -1.0); // the back, drawn clockwise
    assert_eq!(m.panels[1].to_material([0.1, 0.3]), [0.3, 0.1]);
    for panel in &m.panels {
        assert_eq!(
            panel.from_material(panel.to_material([0.1, 0.3])),
            [0.1, 0.3]
        );
    }
    // Outside faces away from the body: the front towards +z, the back −z.
    for (t, &panel) in m.panel_of_triangle.iter().enumerate().filter(|x| *x.1 < 2) {
        let [a, b, c] = [0, 1, 2].map(|k| m.corner_placed(t, k));
        let z = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        assert!(if panel == 0 { z > 0.0 } else { z < 0.0 });
    }
}

/// Springs instead of welds: twice the seam points, one spring per pair.
#[test]
fn springs() {
    let p = Pattern::from_json(&common::tshirt()).unwrap();
    let weld = GarmentMesh::build(&p, &MeshSettings::default()).unwrap();
    let settings = MeshSettings {
        seams: SeamMode::Springs,
        ..MeshSettings::default()
    };
    let open = GarmentMesh::build(&p, &settings).unwrap();
    assert_eq!(open.triangles.len(), weld.triangles.len());
    assert_eq!(open.spring_seams.len(), open.stats.open_pairs);
    assert_eq!(open.stats.open_pairs, weld.stats.welded_pairs);
    assert!(open.points_initial.len() > weld.points_initial.len() + 200);
}

fn panel(name: &str, vertices: &str, edges: usize, z: f64) -> String {
    let list: Vec<String> = (0..edges)
        .map(|i| format!(r#"{{"endpoints": [{i}, {}]}}"#, (i + 1) % edges))
        .collect();
    format!(
        r#""{name}": {{"vertices": {vertices}, "edges": [{}], "translation": [0, 0, {z}]}}"#,
        list.join(",")
    )
}

fn pattern(panels: &[String], stitches: &[(&str, u32, &str, u32, bool)]) -> String {
    let s: Vec<String> = stitches
        .iter()
        .map(|(p, i, q, j, rw)| {
            let flip = if *rw { r#", "right_wrong""# } else { "" };
            format!(r#"[{{"panel": "{p}", "edge": {i}}}, {{"panel": "{q}", "edge": {j}}}{flip}]"#)
        })
        .collect();
    format!(
        r#"{{"pattern": {{"panels": {{{}}}, "stitches": [{}]}}}}"#,
        panels.join(","),
        s.join(",")
    )
}

/// A dart closes up to its tip.
#[test]
fn dart() {
    let p = panel(
        "p",
        "[[0,0],[12,0],[15,12],[18,0],[30,0],[30,30],[0,30]]",
        7,
        0.0,
    );
    let m = build(&pattern(&[p], &[("p", 1, "p", 2, false)]), 0.01);
    check_consistent("dart", &m);
    assert_eq!((m.stats.open_pairs, m.stats.non_manifold_edges), (0, 0));
    assert_eq!(m.stats.welded_pairs, 13);
}

/// A square folded over its corner is a cone: at most two pairs at its tip stay
/// open, the rest closes and nothing is degenerate.
#[test]
fn cone() {
    let p = panel("p", "[[0,0],[20,0],[20,20],[0,20]]", 4, 0.0);
    let m = build(&pattern(&[p], &[("p", 0, "p", 3, false)]), 0.01);
    check_consistent("cone", &m);
    for t in &m.triangles {
        assert!(t[0] != t[1] && t[1] != t[2] && t[2] != t[0]);
    }
    assert_eq!(m.stats.non_manifold_edges, 0);
    assert!(m.stats.open_pairs <= 2, "{:?}", m.stats);
}

/// A cushion, sewn all around, is a closed surface: V − E + F = 2.
#[test]
fn cushion() {
    let square = "[[0,0],[20,0],[20,20],[0,20]]";
    let turned = "[[0,0],[0,20],[20,20],[20,0]]";
    let p = [panel("a", square, 4, 5.0), panel("b", turned, 4, -5.0)];
    let s = [
        ("a", 0, "b", 3, false),
        ("a", 1, "b", 2, false),
        ("a", 2, "b", 1, false),
        ("a", 3, "b", 0, false),
    ];
    for h in [0.01, 0.05, 0.1] {
        let m = build(&pattern(&p, &s), h);
        check_consistent("cushion", &m);
        let (v, f) = (m.points_initial.len() as i64, m.triangles.len() as i64);
        assert_eq!(f % 2, 0);
        assert_eq!(v - 3 * f / 2 + f, 2, "h = {h}: {:?}", m.stats);
        assert_eq!((m.stats.open_pairs, m.stats.non_manifold_edges), (0, 0));
    }
}

/// One long edge sewn to two short ones is divided between them.
#[test]
fn chain() {
    let p = [
        panel("band", "[[0,0],[30,0],[30,5],[0,5]]", 4, 0.0),
        panel("left", "[[0,6],[10,6],[10,20],[0,20]]", 4, 0.0),
        panel("right", "[[11,6],[31,6],[31,20],[11,20]]", 4, 0.0),
    ];
    let s = [
        ("band", 2, "left", 0, false),
        ("right", 0, "band", 2, false),
        ("left", 1, "right", 3, false),
    ];
    let m = build(&pattern(&p, &s), 0.01);
    check_consistent("chain", &m);
    assert_eq!((m.stats.open_pairs, m.stats.non_manifold_edges), (0, 0));
    // 30 pieces on the long edge, 14 on the side: all welded.
    let pairs: usize = m.seam_lines.iter().map(|l| l.points.len()).sum();
    assert_eq!(pairs, 11 + 21 + 15);
    assert_eq!(m.stats.welded_pairs, pairs);
    // The long edge's inner junction is one point of three panels.
    assert!(m.stats.seam_gap_max < 0.015, "{}", m.stats.seam_gap_max);
}

/// Three layers in one seam share their points; the edges are reported.
#[test]
fn three_layers() {
    let square = "[[0,0],[20,0],[20,20],[0,20]]";
    let p = [
        panel("a", square, 4, 0.0),
        panel("b", square, 4, 1.0),
        panel("c", square, 4, 2.0),
    ];
    let s = [("a", 0, "b", 0, true), ("b", 0, "c", 0, true)];
    let m = build(&pattern(&p, &s), 0.01);
    assert_eq!(m.stats.non_manifold_edges, 20);
    assert_eq!(m.stats.welded_pairs, 42);
}

/// A folded collar (right side to wrong side) is turned over so that
/// triangles face one side; a Möbius band cannot be and is reported.
#[test]
fn orientation() {
    let strip = "[[0,0],[60,0],[60,5],[0,5]]";
    let p = [panel("a", strip, 4, 5.0), panel("b", strip, 4, -5.0)];
    let m = build(&pattern(&p, &[("a", 2, "b", 2, true)]), 0.01);
    check_consistent("collar", &m);
    assert_eq!(m.panels[0].side * m.panels[1].side, -1.0);
    assert!(m.findings.is_empty());

    let one = [panel("a", strip, 4, 0.0)];
    let ring = build(&pattern(&one, &[("a", 1, "a", 3, false)]), 0.01);
    assert!(ring.findings.is_empty());
    let band = build(&pattern(&one, &[("a", 1, "a", 3, true)]), 0.01);
    assert!(
        band.findings[0].message.contains("no outside"),
        "{:?}",
        band.findings
    );
    assert_eq!(band.stats.flipped_edges, 5);
}
