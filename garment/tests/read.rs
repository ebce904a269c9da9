//! Reading patterns: real files, mistakes with their places, noise.

mod common;

use proptest::prelude::*;
use selvedge_garment::pattern::{Curve, Severity, examine};
use selvedge_garment::{GarmentError, Pattern};

/// Every real pattern is read, survives writing and reading, and has no
/// finding worse than a note.
#[test]
fn real_patterns() {
    for (name, bytes) in common::garments() {
        let pattern = Pattern::from_json(&bytes).unwrap_or_else(|e| panic!("{name}: {e}"));
        for f in examine(&pattern) {
            assert!(f.severity == Severity::Note, "{name}: {}", f.message);
        }
        let again = Pattern::from_json(pattern.to_json().as_bytes()).unwrap();
        assert_eq!(again.stitches, pattern.stitches, "{name}");
        assert_eq!(again.panels.len(), pattern.panels.len(), "{name}");
        for (a, b) in again.panels.iter().zip(&pattern.panels) {
            assert_eq!((&a.name, &a.label), (&b.name, &b.label));
            assert_eq!(a.edges.len(), b.edges.len());
            for (p, q) in a.vertices.iter().zip(&b.vertices) {
                assert!((p[0] - q[0]).abs() < 1e-12 && (p[1] - q[1]).abs() < 1e-12);
            }
        }
    }
}

const SQUARE: &str = r#"{"pattern": {"panels": {"front": {
    "vertices": [[0, 0], [30, 0], [30, 40], [0, 40]],
    "edges": [{"endpoints": [0, 1]}, {"endpoints": [1, 2], "curvature": [0.5, 0.1]},
              {"endpoints": [2, 3], "curvature": {"type": "circle", "params": [20, 0, 1]}},
              {"endpoints": [3, 0], "label": "side"}],
    "translation": [0, 100, 20], "rotation": [0, 0, 90]}},
    "stitches": [[{"panel": "front", "edge": 1}, {"panel": "front", "edge": 3}, "right_wrong"]]},
    "properties": {"units_in_meter": 100}}"#;

/// A bare control point, a circle, labels, right_wrong, units and the order
/// of rotation and translation are understood.
#[test]
fn every_form() {
    let p = Pattern::from_json(SQUARE.as_bytes()).unwrap();
    let front = &p.panels[0];
    assert_eq!(
        front.edges[1].curve,
        Curve::Quadratic {
            control: [0.5, 0.1]
        }
    );
    assert_eq!(
        front.edges[2].curve,
        Curve::Circle {
            radius: 0.2,
            large: false,
            right: true
        }
    );
    assert_eq!(front.edges[3].label.as_deref(), Some("side"));
    assert!(p.stitches[0].right_wrong);
    // 90° about z takes (0.3, 0.4) to (−0.4, 0.3); then the translation.
    let placed = front.frame().place(front.vertices[2]);
    for (got, want) in placed.into_iter().zip([-0.4, 1.3, 0.2]) {
        assert!((got - want).abs() < 1e-15, "{placed:?}");
    }
}

/// Intrinsic X, Y, Z: the product Rx Ry Rz, checked on 30°, 40°, 50°.
#[test]
fn euler_order() {
    let mut p = Pattern::from_json(SQUARE.as_bytes())
        .unwrap()
        .panels
        .remove(0);
    p.rotation_degrees = [30.0, 40.0, 50.0];
    let r = p.frame().rotation;
    let (a, b, c) = (30f64.to_radians(), 40f64.to_radians(), 50f64.to_radians());
    let x = [
        [1.0, 0.0, 0.0],
        [0.0, a.cos(), -a.sin()],
        [0.0, a.sin(), a.cos()],
    ];
    let y = [
        [b.cos(), 0.0, b.sin()],
        [0.0, 1.0, 0.0],
        [-b.sin(), 0.0, b.cos()],
    ];
    let z = [
        [c.cos(), -c.sin(), 0.0],
        [c.sin(), c.cos(), 0.0],
        [0.0, 0.0, 1.0],
    ];
    let mul = |p: [[f64; 3]; 3], q: [[f64; 3]; 3]| -> [[f64; 3]; 3] {
        std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| p[i][k] * q[k][j]).sum()))
    };
    let want = mul(mul(x, y), z);
    for i in 0..3 {
        for j in 0..3 {
            assert!((r[i][j] - want[i][j]).abs() < 1e-15);
        }
    }
}

/// Mistakes are named with their JSON path and the nearest valid name.
#[test]
fn mistakes() {
    let read = |from: &str, to: &str| {
        assert!(SQUARE.contains(from), "{from}");
        Pattern::from_json(SQUARE.replacen(from, to, 1).as_bytes())
            .unwrap_err()
            .to_string()
    };
    let e = read(
        r#"{"panel": "front", "edge": 1}"#,
        r#"{"panel": "frnt", "edge": 1}"#,
    );
    assert!(
        e.contains("$.pattern.stitches[0][0].panel") && e.contains("`front`"),
        "{e}"
    );
    let e = read(r#""edge": 3"#, r#""edge": 4"#);
    assert!(e.contains("no edge 4") && e.contains("0 to 3"), "{e}");
    let e = read(r#""circle""#, r#""circel""#);
    assert!(
        e.contains("edges[2].curvature.type") && e.contains("did you mean `circle`"),
        "{e}"
    );
    let e = read(r#"[3, 0]"#, r#"[3, 9]"#);
    assert!(e.contains("no vertex 9"), "{e}");
    let e = read(r#"[30, 40]"#, r#"[30, "40"]"#);
    assert!(e.contains("vertices[2][1]: expected a number"), "{e}");
    let e = read(r#""vertices""#, r#""vertexes""#);
    assert!(e.contains("`vertices` is missing"), "{e}");
    let broken = SQUARE.replacen("\"edges\": [", "\"edges\": [,", 1);
    match Pattern::from_json(broken.as_bytes()) {
        Err(GarmentError::Json {
            line: 3, column, ..
        }) => assert!(column > 0),
        other => panic!("{other:?}"),
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    /// Changed, cut or duplicated bytes of a valid file never panic, neither
    /// in the reader nor, when they are still a pattern, in doctor and mesher.
    #[test]
    fn noise_never_panics(
        edits in prop::collection::vec((0usize..20_000, any::<u8>(), 0u8..4), 1..6),
    ) {
        let mut bytes = common::tshirt();
        for (at, value, kind) in edits {
            let at = at % bytes.len().max(1);
            match kind {
                0 => bytes[at] = value,
                1 => bytes[at] = b"0123456789.-e[]{},"[value as usize % 18],
                2 => { bytes.insert(at, b"0123456789.-e"[value as usize % 13]); }
                _ => { bytes.remove(at); }
            }
        }
        if let Ok(pattern) = Pattern::from_json(&bytes) {
            let _ = examine(&pattern);
            // Changed units make huge garments: mesh all sizes with few points.
            let size = pattern.bounds().map_or(1.0, |(low, high)| {
                (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max)
            });
            let settings = selvedge_garment::MeshSettings {
                edge_length: (size / 30.0).clamp(0.01, 1.0),
                ..Default::default()
            };
            if let Ok(mesh) = selvedge_garment::GarmentMesh::build(&pattern, &settings) {
                prop_assert!(mesh.points_initial.iter().flatten().all(|x| x.is_finite()));
            }
        }
    }

    /// Truncated files are refused, not survived.
    #[test]
    fn truncation(part in 0.0f64..0.999) {
        let bytes = common::tshirt();
        let cut = (bytes.len() as f64 * part) as usize;
        prop_assert!(Pattern::from_json(&bytes[..cut]).is_err());
    }

    /// Random bytes are refused.
    #[test]
    fn random_bytes(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        prop_assert!(Pattern::from_json(&bytes).is_err());
    }
}
