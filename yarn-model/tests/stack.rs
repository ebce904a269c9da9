//! Compression of stacks, against an independent implementation checked with
//! scipy's non-negative least squares.

use proptest::prelude::*;
use selvedge_yarn_model::{StackRule, stack_compression};
use serde_json::Value;

fn vectors(value: &Value) -> Vec<[f64; 3]> {
    serde_json::from_value(value.clone()).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    serde_json::from_value(value.clone()).unwrap()
}

fn compression(normals: &[[f64; 3]], forces: &[[f64; 3]], rule: StackRule) -> Vec<f64> {
    let mut lambda = vec![f64::NAN; normals.len()];
    stack_compression(normals, forces, rule, &mut lambda);
    lambda
}

fn close(what: &str, found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len());
    for (f, e) in found.iter().zip(expected) {
        assert!((f - e).abs() <= tolerance, "{what}: {found:?} {expected:?}");
    }
}

fn oracle() -> Value {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/oracles/stack.json");
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

#[test]
fn golden() {
    let oracle = oracle();
    let mut differ = 0;
    for (k, sample) in oracle["samples"].as_array().unwrap().iter().enumerate() {
        let (n, f) = (vectors(&sample["normals"]), vectors(&sample["F"]));
        let (exact, closed) = (
            compression(&n, &f, StackRule::Exact),
            compression(&n, &f, StackRule::ClosedForm),
        );
        let name = format!("sample {k}");
        close(&name, &exact, &numbers(&sample["lambda_nnls"]), 1e-14);
        let expected = numbers(&sample["lambda_closed_form"]);
        close(&name, &closed, &expected, 1e-14);
        differ += usize::from(exact.iter().zip(&closed).any(|(a, b)| (a - b).abs() > 1e-9));
    }
    assert_eq!(
        oracle["closed_form_differs_from_nnls_in"],
        Value::from(differ)
    );
}

/// Forces that give `b = (0, −1, 4)`, where the closed form is not the minimum.
#[test]
fn counterexample() {
    let normals = [[0.0, 0.0, 1.0]; 2];
    let forces = [0.0, -1.0, 4.0].map(|z| [0.0, 0.0, z]);
    let example = &oracle()["counterexample"];
    let exact = compression(&normals, &forces, StackRule::Exact);
    close("exact", &exact, &numbers(&example["nnls"]), 1e-15);
    let closed = compression(&normals, &forces, StackRule::ClosedForm);
    close("closed form", &closed, &numbers(&example["closed"]), 1e-15);
}

#[test]
fn pressed_stacks_transmit_the_force() {
    for n in 1..10 {
        let mut forces = vec![[0.0; 3]; n];
        forces[0][1] += 0.03;
        forces[n - 1][1] -= 0.03;
        let normals = vec![[0.0, 1.0, 0.0]; n - 1];
        for rule in [StackRule::Exact, StackRule::ClosedForm] {
            let found = compression(&normals, &forces, rule);
            close("pressed", &found, &vec![0.03; n - 1], 1e-14);
        }
    }
}

#[test]
fn folded_normals_and_nan_give_finite_compressions() {
    let z = |z: f64| [0.0, 0.0, z];
    for n in [3, 5, 7] {
        let normals: Vec<_> = (0..n - 1)
            .map(|i| z(if i % 2 == 0 { 1.0 } else { -1.0 }))
            .collect();
        let forces: Vec<_> = (0..n).map(|i| z(i as f64 - 1.3)).collect();
        for rule in [StackRule::Exact, StackRule::ClosedForm] {
            let found = compression(&normals, &forces, rule);
            assert!(
                found.iter().all(|l| l.is_finite() && *l >= 0.0),
                "{found:?}"
            );
        }
        let nan = vec![[f64::NAN; 3]; n];
        for rule in [StackRule::Exact, StackRule::ClosedForm] {
            let found = compression(&normals, &nan, rule);
            assert!(found.iter().all(|l| *l >= 0.0), "{found:?}");
        }
    }
}

/// `AᵀA` and `−Aᵀb` from the definition.
fn system(normals: &[[f64; 3]], forces: &[[f64; 3]]) -> (Vec<Vec<f64>>, Vec<f64>) {
    let (n, m) = (forces.len(), normals.len());
    let dot = |a: [f64; 3], b: [f64; 3]| (0..3).map(|k| a[k] * b[k]).sum::<f64>();
    let mut a = vec![vec![0.0; m]; n];
    let mut b = vec![0.0; n];
    for i in 0..n {
        let (before, after) = (normals[i.max(1) - 1], normals[i.min(m - 1)]);
        let sum: [f64; 3] = std::array::from_fn(|k| before[k] + after[k]);
        let u = sum.map(|s| s / dot(sum, sum).sqrt());
        b[i] = dot(u, forces[i]);
        if i > 0 {
            a[i][i - 1] += dot(u, before);
        }
        if i < m {
            a[i][i] -= dot(u, after);
        }
    }
    let column = |i: usize, j: usize| (0..n).map(|k| a[k][i] * a[k][j]).sum::<f64>();
    let matrix = (0..m).map(|i| (0..m).map(|j| column(i, j)).collect());
    let target = (0..m).map(|i| -(0..n).map(|k| a[k][i] * b[k]).sum::<f64>());
    (matrix.collect(), target.collect())
}

fn unit() -> impl Strategy<Value = [f64; 3]> {
    [-0.5..0.5, -0.5..0.5_f64].prop_map(|[x, y]| {
        let l = (x * x + y * y + 1.0_f64).sqrt();
        [x / l, y / l, 1.0 / l]
    })
}

proptest! {
    /// The conditions of optimality, which are sufficient: λ ≥ 0, and the
    /// slope of the squared residual is zero where λ > 0, not negative
    /// elsewhere. Covers enumeration and growing sets.
    #[test]
    fn optimal(
        (normals, forces) in (1usize..12).prop_flat_map(|m| (
            prop::collection::vec(unit(), m),
            prop::collection::vec([-1.0..1.0, -1.0..1.0, -1.0..1.0_f64], m + 1),
        ))
    ) {
        let lambda = compression(&normals, &forces, StackRule::Exact);
        let (matrix, target) = system(&normals, &forces);
        for i in 0..lambda.len() {
            let slope = (0..lambda.len()).map(|j| matrix[i][j] * lambda[j]).sum::<f64>() - target[i];
            prop_assert!(lambda[i] >= 0.0);
            prop_assert!(slope >= -1e-11, "{lambda:?} {slope}");
            prop_assert!(lambda[i] == 0.0 || slope.abs() < 1e-11, "{lambda:?} {slope}");
        }
    }
}
