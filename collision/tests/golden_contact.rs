//! Closest points, distances and their derivatives against golden vectors.

use selvedge_collision::narrow::{self, PairKind, closest_point_triangle, hessian};
use selvedge_collision::{ContactPotential, ContactQuadratic, ContactStiffness};
use serde_json::Value;

fn golden() -> Value {
    serde_json::from_str(include_str!("golden/contact.json")).unwrap()
}

fn floats(v: &Value) -> Vec<f64> {
    match v {
        Value::Array(a) => a.iter().flat_map(floats).collect(),
        v => vec![v.as_f64().unwrap()],
    }
}

fn points(v: &Value) -> Vec<[f64; 3]> {
    floats(v).as_chunks::<3>().0.to_vec()
}

fn assert_close(what: &str, found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len(), "{what}");
    let scale = expected.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
    for (f, e) in found.iter().zip(expected) {
        assert!(
            (f - e).abs() <= tolerance * scale,
            "{what}: {f:e} instead of {e:e}"
        );
    }
}

/// Distance, normal, weights, energy, force and exact second derivative of all
/// four kinds of feature pairs.
#[test]
fn pairs() {
    let golden = golden();
    let mut second_derivatives = 0;
    for (n, p) in golden["pairs"].as_array().unwrap().iter().enumerate() {
        let kind = p["kind"].as_str().unwrap();
        let x = points(&p["x"]);
        let what = format!("{kind} {n}");
        let four = || [x[0], x[1], x[2], x[3]];
        let d = match kind {
            "VF" => hessian::interior(PairKind::VertexTriangle, &four()),
            "EE" => hessian::interior(PairKind::EdgeEdge, &four()),
            "PE" => hessian::point_line(x[0], x[1], x[2]),
            _ => hessian::point_point(x[0], x[1]),
        }
        .unwrap();
        let m = x.len();
        let signed = p["d_signed"].as_f64().unwrap();
        assert_close(&what, &[d.distance], &[signed], 1e-10);
        assert_close(&what, &d.normal, &floats(&p["n"]), 1e-10);
        assert_close(&what, &d.weights[..m], &floats(&p["weights"]), 1e-10);

        // The closest-point search meets the same numbers.
        if m == 4 {
            let kind = if kind == "VF" {
                PairKind::VertexTriangle
            } else {
                PairKind::EdgeEdge
            };
            let c = kind.closest(&four());
            assert!(c.interior);
            assert_close(&what, &[c.distance], &[signed], 1e-10);
            assert_close(&what, &c.weights, &floats(&p["weights"]), 1e-10);
        }

        let potential = ContactQuadratic {
            thickness: p["delta"].as_f64().unwrap(),
            stiffness: ContactStiffness::PerPair(p["k_c"].as_f64().unwrap()),
            cap: 2.0,
        };
        let r = potential.evaluate(signed.abs(), 0.0);
        assert_close(&what, &[r.energy], &[p["energy"].as_f64().unwrap()], 1e-10);
        let sign = signed.signum();
        let gradient: Vec<f64> = (0..3 * m)
            .map(|i| -r.force * sign * d.weights[i / 3] * d.normal[i % 3])
            .collect();
        assert_close(&what, &gradient, &floats(&p["gradient"]), 1e-10);
        if let Some(h) = p.get("hessian") {
            let exact = d.energy_hessian(-r.force * sign, r.curvature);
            let found: Vec<f64> = exact[..3 * m]
                .iter()
                .flat_map(|r| r[..3 * m].to_vec())
                .collect();
            assert_close(&what, &found, &floats(h), 1e-10);
            second_derivatives += 1;
        }
    }
    assert_eq!(second_derivatives, 12);
}

/// Closest points of triangles, degenerate ones among them.
#[test]
fn closest_points() {
    for (n, c) in golden()["closest_point_triangle"]
        .as_array()
        .unwrap()
        .iter()
        .enumerate()
    {
        let (p, t) = (points(&c["p"])[0], points(&c["tri"]));
        let found = closest_point_triangle(&[p, t[0], t[1], t[2]]);
        let place = |w: &[f64]| -> [f64; 3] {
            std::array::from_fn(|k| (0..3).map(|i| w[i] * t[i][k]).sum())
        };
        let expected = place(&floats(&c["bary"]));
        let w = found.weights.map(|w| -w);
        for (a, b) in place(&w[1..]).iter().zip(expected) {
            assert!((a - b).abs() < 1e-12, "case {n}");
        }
        assert_eq!(found.interior, c["feature"] == "F", "case {n}");
        let distance = c["distance"].as_f64().unwrap();
        assert!((found.distance.abs() - distance).abs() < 1e-12, "case {n}");
    }
}

/// Edge against edge agrees with a search over both parameters, for crossing,
/// parallel, collinear and collapsed edges.
#[test]
fn closest_edges() {
    let edges: [[[f64; 3]; 4]; 7] = [
        [
            [0.0, 0.0, 0.1],
            [1.0, 0.0, 0.1],
            [0.5, -1.0, 0.0],
            [0.4, 1.0, 0.0],
        ],
        [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.2, 0.1, 0.0],
            [1.3, 0.1, 0.0],
        ],
        [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [2.0, 0.0, 0.0],
            [3.0, 0.0, 0.0],
        ],
        [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.3, 0.4, 0.5],
            [0.3, 0.4, 0.5],
        ],
        [[0.0; 3], [0.0; 3], [0.0; 3], [0.0; 3]],
        [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1e-3, 0.0],
            [1.0, 1e-3, 1e-9],
        ],
        [
            [0.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [3.0, -1.0, 0.2],
            [2.0, 4.0, 0.7],
        ],
    ];
    for x in edges {
        let c = narrow::closest_edge_edge(&x);
        let at = |s: f64, a: [f64; 3], b: [f64; 3]| -> [f64; 3] {
            std::array::from_fn(|k| a[k] + s * (b[k] - a[k]))
        };
        let mut best = f64::INFINITY;
        for i in 0..=200 {
            for j in 0..=200 {
                let (a, b) = (
                    at(i as f64 / 200.0, x[0], x[1]),
                    at(j as f64 / 200.0, x[2], x[3]),
                );
                best = best.min((0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt());
            }
        }
        let d = c.distance.abs();
        assert!(
            d <= best + 1e-12 && d >= best - 0.02,
            "{x:?}: {d} against {best}"
        );
        let gap: [f64; 3] = std::array::from_fn(|k| (0..4).map(|i| c.weights[i] * x[i][k]).sum());
        let size = gap.iter().map(|g| g * g).sum::<f64>().sqrt();
        assert!(
            (size - d).abs() < 1e-8,
            "{x:?}: the weights give {size}, not {d}"
        );
        assert!(c.weights.iter().sum::<f64>().abs() < 1e-15);
    }
}
