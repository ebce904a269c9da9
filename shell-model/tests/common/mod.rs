//! Helpers of the behaviour tests.
#![allow(dead_code)]

use nalgebra::DMatrix;
use selvedge_energy::{Curvature, DofLayout, EnergyBatch, EvalPoint};
use selvedge_shell_model::{BendingRigidity, Fabric, MembraneModuli, ShellMesh};
use serde_json::Value;

pub fn golden(name: &str) -> Value {
    let path = format!("{}/tests/golden/{name}.json", env!("CARGO_MANIFEST_DIR"));
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

pub fn triangle(x: &[f64]) -> ShellMesh {
    let corners = [[x[0], x[1]], [x[2], x[3]], [x[4], x[5]]];
    ShellMesh::new(3, vec![[0, 1, 2]], vec![corners], vec![0]).unwrap()
}

pub fn moduli(c: &[f64]) -> MembraneModuli {
    MembraneModuli {
        warp: c[0],
        weft: c[4],
        shear: c[8],
        coupling: c[1],
    }
}

pub fn fabric() -> Fabric {
    Fabric::new(
        "test",
        0.2,
        MembraneModuli {
            warp: 2000.0,
            weft: 1500.0,
            shear: 50.0,
            coupling: 100.0,
        },
        BendingRigidity {
            warp: 2e-5,
            weft: 1.5e-5,
            bias: 1e-5,
        },
    )
    .unwrap()
}

pub fn at<'a>(q: &'a [f64], q_start: &'a [f64], dt: f64) -> EvalPoint<'a> {
    EvalPoint {
        layout: DofLayout::points(q.len() / 3),
        q,
        q_start,
        dt,
    }
}

/// Value, gradient and second derivative of stencil `e`.
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
    assert_eq!(
        value,
        batch.gradients(at, e..e + 1, &mut g2),
        "value of gradients and hessians"
    );
    assert_eq!(g, g2, "gradients of both calls");
    for i in 0..m {
        for j in 0..i {
            assert_eq!(
                h[i * m + j].to_bits(),
                h[j * m + i].to_bits(),
                "symmetry at {i} {j}"
            );
        }
    }
    (value, g, h)
}

/// Largest difference over the largest entry.
pub fn relative(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let largest = a.iter().chain(b).fold(0.0_f64, |m, x| m.max(x.abs()));
    let error = a.iter().zip(b).fold(0.0_f64, |m, (x, y)| {
        let d = (x - y).abs();
        if d.is_nan() { f64::INFINITY } else { m.max(d) }
    });
    if largest > 0.0 { error / largest } else { 0.0 }
}

pub fn close(what: &str, a: &[f64], b: &[f64], tolerance: f64) {
    let error = relative(a, b);
    assert!(
        error <= tolerance,
        "{what}: relative error {error:.2e} above {tolerance:.0e}"
    );
}

/// Smallest eigenvalue over the largest absolute one.
pub fn smallest_eigenvalue(h: &[f64], m: usize) -> f64 {
    let eigen = DMatrix::from_row_slice(m, m, h).symmetric_eigenvalues();
    if eigen.amax() > 0.0 {
        eigen.min() / eigen.amax()
    } else {
        0.0
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
}
