//! Small networks and comparisons.

use nalgebra::DMatrix;
use selvedge_energy::{Curvature, DofLayout, EnergyBatch, EvalPoint};
use selvedge_yarn_model::{NetworkBuilder, StitchContact, Visit, YarnMaterial, YarnNetwork};
use serde_json::Value;

pub fn oracle(name: &str) -> Value {
    let path = format!("{}/tests/oracles/{name}.json", env!("CARGO_MANIFEST_DIR"));
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// All numbers of a nested array, in order.
pub fn flat(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(items) => items.iter().flat_map(flat).collect(),
        Value::Number(n) => vec![n.as_f64().unwrap()],
        other => panic!("{other}"),
    }
}

pub fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

/// One yarn through points of its own; strand `i` is at point `i`.
pub fn chain(material: YarnMaterial, points: &[[f64; 3]], arcs: &[f64]) -> YarnNetwork {
    let mut builder = NetworkBuilder::new(vec![material]);
    let visits = points.iter().zip(arcs).map(|(p, &arc)| Visit {
        node: builder.node(*p, [p[0], p[1]], [0.0, 0.0, 1.0]),
        layer: 0,
        arc,
        held: false,
    });
    let visits = visits.collect();
    builder.yarn(0, visits);
    builder.build().unwrap()
}

/// `warps × wefts` crossings at a distance; node `i · wefts + j`. `front` says
/// whether the warp passes in front.
pub fn weave(
    material: YarnMaterial,
    [warps, wefts]: [u32; 2],
    distance: f64,
    front: impl Fn(u32, u32) -> bool,
) -> YarnNetwork {
    let mut builder = NetworkBuilder::new(vec![material]);
    for i in 0..warps {
        for j in 0..wefts {
            let flat = [distance * f64::from(i), distance * f64::from(j)];
            builder.node([flat[0], flat[1], 0.0], flat, [0.0, 0.0, 1.0]);
        }
    }
    let visit = |i: u32, j: u32, warp: bool, arc: u32| Visit {
        node: i * wefts + j,
        layer: u8::from(front(i, j) != warp),
        arc: distance * f64::from(arc),
        held: false,
    };
    for i in 0..warps {
        builder.yarn(0, (0..wefts).map(|j| visit(i, j, true, j)).collect());
    }
    for j in 0..wefts {
        builder.yarn(0, (0..warps).map(|i| visit(i, j, false, i)).collect());
    }
    for node in 0..warps * wefts {
        builder.crossing(node);
    }
    builder.build().unwrap()
}

/// One side of a stitch in the flat template with unit pitches. Nodes: A, B,
/// then the neighbours of the child at A and B and of the parent at A and B.
/// `backwards` runs both yarns the other way.
pub fn stitch(material: YarnMaterial, side: i8, purl: bool, backwards: bool) -> YarnNetwork {
    let s = f64::from(side);
    let a = |j: f64, r: f64, s: f64| [j + 0.32 * s, r - 0.1];
    let b = |j: f64, r: f64, s: f64| [j + 0.18 * s, r + 0.1];
    let flat = [
        a(0.0, 0.0, s),
        b(0.0, 0.0, s),
        a(s, 0.0, -s),
        a(0.0, 1.0, s),
        b(0.0, -1.0, s),
        b(0.0, 0.0, -s),
    ];
    let mut builder = NetworkBuilder::new(vec![material]);
    for [x, y] in flat {
        builder.node([x, y, 0.0], [x, y], [0.0, 0.0, 1.0]);
    }
    // Knit: child behind at A and in front at B.
    let layer = |node: u32, child: bool| match node {
        0 => u8::from(child != purl),
        1 => u8::from(child == purl),
        _ => 0,
    };
    let mut yarn = |mut nodes: Vec<u32>, child: bool| {
        if backwards {
            nodes.reverse();
        }
        let visits = nodes.iter().enumerate().map(|(k, &node)| Visit {
            node,
            layer: layer(node, child),
            arc: k as f64,
            held: false,
        });
        builder.yarn(0, visits.collect())
    };
    yarn(vec![2, 0, 1, 3], true);
    yarn(vec![4, 0, 1, 5], false);
    let [dx, dy] = [flat[1][0] - flat[0][0], flat[1][1] - flat[0][1]];
    builder.stitch(StitchContact {
        a: 0,
        b: 1,
        purl,
        side,
        parents: 1,
        rest: dx.hypot(dy),
        row: 0,
        column: 0,
    });
    builder.build().unwrap()
}

/// Unknowns of a network at rest.
pub fn unknowns(network: &YarnNetwork) -> Vec<f64> {
    let points = network.points.iter().flatten().copied();
    points
        .chain(network.strands.iter().map(|s| s.arc))
        .collect()
}

pub fn layout(network: &YarnNetwork) -> DofLayout {
    DofLayout {
        points: network.nodes(),
        scalars: network.strands.len(),
    }
}

pub fn at<'a>(network: &YarnNetwork, q: &'a [f64], q_start: &'a [f64]) -> EvalPoint<'a> {
    EvalPoint {
        layout: layout(network),
        q,
        q_start,
        dt: 1e-3,
    }
}

/// Value, gradient and second derivative of stencil `e`, which must agree
/// between calls and be symmetric to the last bit.
pub fn evaluate(
    batch: &dyn EnergyBatch,
    at: &EvalPoint<'_>,
    curvature: Curvature,
    e: usize,
) -> (f64, Vec<f64>, Vec<f64>) {
    let m = batch.local_dim();
    let (mut g, mut h) = (vec![f64::NAN; m], vec![f64::NAN; m * m]);
    let value = batch.hessians(at, curvature, e..e + 1, &mut g, &mut h);
    let mut g2 = vec![f64::NAN; m];
    assert_eq!(value, batch.gradients(at, e..e + 1, &mut g2));
    assert_eq!(g, g2);
    let alone = batch.value(at, e..e + 1);
    assert!((alone - value).abs() <= 1e-12 * value.abs().max(1e-30));
    for i in 0..m {
        for j in 0..i {
            let (a, b) = (h[i * m + j], h[j * m + i]);
            assert!(a == b, "symmetry at {i} {j}: {a} {b}");
        }
    }
    (value, g, h)
}

/// Largest difference over the largest entry.
pub fn close(what: &str, a: &[f64], b: &[f64], tolerance: f64) {
    assert_eq!(a.len(), b.len());
    let largest = a.iter().chain(b).fold(0.0_f64, |m, x| m.max(x.abs()));
    for (i, (x, y)) in a.iter().zip(b).enumerate() {
        let error = (x - y).abs();
        assert!(
            error <= tolerance * largest,
            "{what}, entry {i}: {x:e} against {y:e}, largest {largest:e}"
        );
    }
}

/// Smallest eigenvalue over a scale.
pub fn smallest_eigenvalue(h: &[f64], m: usize, scale: f64) -> f64 {
    let eigen = DMatrix::from_row_slice(m, m, h).symmetric_eigenvalues();
    if scale > 0.0 {
        eigen.min() / scale
    } else {
        0.0
    }
}

/// `Projected` is at least `Exact` at every stencil.
pub fn is_above(batch: &dyn EnergyBatch, at: &EvalPoint<'_>) {
    for e in 0..batch.len() {
        let (_, _, exact) = evaluate(batch, at, Curvature::Exact, e);
        let (_, _, projected) = evaluate(batch, at, Curvature::Projected, e);
        let gap: Vec<f64> = projected.iter().zip(&exact).map(|(a, b)| a - b).collect();
        let scale = projected.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let least = smallest_eigenvalue(&gap, batch.local_dim(), scale);
        assert!(least >= -1e-11, "{} {e}: {least:.2e}", batch.name());
    }
}

/// Small deterministic pseudo-random numbers in [-1, 1).
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> f64 {
        // xorshift64*
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        let bits = self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11;
        bits as f64 / (1u64 << 52) as f64 - 1.0
    }

    pub fn shake(&mut self, q: &[f64], by: f64) -> Vec<f64> {
        q.iter().map(|x| x + by * self.next()).collect()
    }
}
