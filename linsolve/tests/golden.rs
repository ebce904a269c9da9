//! Against vectors computed independently (numpy), in `tests/golden`.

mod common;

use common::*;
use nalgebra::{DMatrix, DVector};
use selvedge_linsolve::*;
use serde_json::Value;
use std::sync::Arc;

fn load(text: &str) -> Value {
    serde_json::from_str(text).expect("golden file is JSON")
}

fn numbers(v: &Value) -> Vec<f64> {
    match v.as_array() {
        Some(list) => list.iter().flat_map(numbers).collect(),
        None => vec![v.as_f64().expect("a number")],
    }
}

struct Block {
    i: u32,
    j: u32,
    rows: [[f64; 3]; 3],
}

fn blocks(v: &Value) -> Vec<Block> {
    let list = v.as_array().expect("a list of blocks");
    list.iter()
        .map(|b| {
            let v = numbers(&b["v"]);
            Block {
                i: b["i"].as_u64().expect("row") as u32,
                j: b["j"].as_u64().expect("column") as u32,
                rows: std::array::from_fn(|r| std::array::from_fn(|c| v[3 * r + c])),
            }
        })
        .collect()
}

fn cloth_patch() -> (Value, Bsr<f64>) {
    let golden = load(include_str!("golden/block_ic.json"));
    let blocks = blocks(&golden["blocks"]);
    let pairs: Vec<[u32; 2]> = blocks.iter().map(|b| [b.i, b.j]).collect();
    let points = pairs
        .iter()
        .map(|p| p[0] as usize + 1)
        .max()
        .expect("blocks");
    let pattern = Arc::new(Pattern::from_groups(points, pairs.iter().map(|p| &p[..])));
    assert_eq!(pattern.block_count(), blocks.len());
    let mut a = Bsr::zeros(Arc::clone(&pattern));
    for b in &blocks {
        let slot = pattern.slot(b.i, b.j).expect("in the pattern");
        a.add_block(slot as usize, &b.rows, 1.0);
    }
    (golden, a)
}

/// The incomplete factor and its action on the 16-node patch.
#[test]
fn block_incomplete_cholesky() {
    let (golden, a) = cloth_patch();
    let mut p = BlockIc::<f64>::default();
    p.update(&a, &NoFilter).expect("definite");
    assert_eq!(p.shift(), golden["shift"].as_f64().expect("number"));
    let expected = blocks(&golden["L_blocks"]);
    let factor = p.factor_blocks();
    assert_eq!(factor.len(), expected.len());
    for b in &expected {
        let found = factor
            .iter()
            .find(|f| f.0 == b.i as usize && f.1 == b.j as usize)
            .expect("block of the factor");
        assert!(relative(&found.2, b.rows.as_flattened()) < 1e-11);
    }
    let r = numbers(&golden["r"]);
    let mut z = vec![0.0; r.len()];
    p.apply(&a, &r, &mut z);
    assert!(relative(&z, &numbers(&golden["z_blockIC0"])) < 1e-11);
}

/// Without a shift `L Lᵀ` reproduces `A` on the pattern.
#[test]
fn incomplete_factor_reproduces_the_pattern() {
    let (_, a) = cloth_patch();
    let mut p = BlockIc::<f64>::default();
    p.update(&a, &NoFilter).expect("definite");
    let n = a.dim();
    let mut l = DMatrix::<f64>::zeros(n, n);
    for (i, j, b) in p.factor_blocks() {
        for k in 0..9 {
            l[(3 * i + k / 3, 3 * j + k % 3)] = b[k];
        }
    }
    let (product, full) = (&l * l.transpose(), dense(&a));
    for i in 0..n / 3 {
        for &j in a.pattern().columns(i) {
            for k in 0..9 {
                let at = (3 * i + k / 3, 3 * j as usize + k % 3);
                assert!((product[at] - full[at]).abs() < 1e-13 * full.amax());
            }
        }
    }
}

/// Every solver finds the solution of the patch.
#[test]
fn solution_of_the_patch() {
    let (golden, a) = cloth_patch();
    let (b, expected) = (numbers(&golden["r"]), numbers(&golden["x"]));
    for solver in SOLVERS {
        let settings = MpcgSettings {
            tolerance: 1e-12,
            ..MpcgSettings::default()
        };
        let mut solver = solver_by_name::<f64>(solver, "block-jacobi", settings).expect("valid");
        let mut x = vec![0.0; b.len()];
        let report = solver.solve(&a, &b, &NoFilter, &mut x).expect("solvable");
        assert!(report.converged(), "{report:?}");
        assert!(relative(&x, &expected) < 1e-9, "{report:?}");
    }
}

/// Pin, plane and line with prescribed values on a dense 24 × 24 system.
#[test]
fn filtered_system() {
    let golden = load(include_str!("golden/filter_smw.json"));
    let pin = &golden["pin"];
    let (m, b, z) = (numbers(&pin["A"]), numbers(&pin["b"]), numbers(&pin["z"]));
    let n = b.len();
    let all: Vec<u32> = (0..n as u32 / 3).collect();
    let pattern = Arc::new(Pattern::from_groups(n / 3, [&all[..]]));
    let mut a = Bsr::<f64>::zeros(Arc::clone(&pattern));
    for i in 0..n / 3 {
        for j in 0..n / 3 {
            let block =
                std::array::from_fn(|r| std::array::from_fn(|c| m[(3 * i + r) * n + 3 * j + c]));
            let slot = pattern.slot(i as u32, j as u32).expect("full pattern");
            a.add_block(slot as usize, &block, 1.0);
        }
    }
    let mut filter = BlockFilter::new();
    let p = [1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0];
    filter.fix(0, [z[0], z[1], z[2]]).expect("valid");
    filter.constrain(1, p, 0.5).expect("valid");
    filter.constrain(2, p, 0.0).expect("valid");
    filter.constrain(2, [2.0, 1.0, -2.0], 0.0).expect("valid");
    let s = DMatrix::from_fn(n, n, |r, c| {
        let block = numbers(&pin["S_blocks"][r / 3]);
        if r / 3 == c / 3 {
            block[3 * (r % 3) + c % 3]
        } else {
            0.0
        }
    });
    assert!((dense_filter(&filter, n) - s).amax() < 1e-14);
    let mut prescribed = vec![0.0; n];
    filter.prescribe(&mut prescribed);
    assert!(relative(&prescribed, &z) < 1e-14);
    let expected = numbers(&pin["x"]);
    for solver in SOLVERS {
        for p in PRECONDITIONERS {
            let settings = MpcgSettings {
                tolerance: 1e-11,
                ..MpcgSettings::default()
            };
            let mut solver = solver_by_name::<f64>(solver, p, settings).expect("valid");
            let mut x = prescribed.clone();
            let report = solver.solve(&a, &b, &filter, &mut x).expect("solvable");
            assert!(report.converged(), "{p}: {report:?}");
            assert!(relative(&x, &expected) < 1e-8, "{p}: {report:?}");
        }
    }
}

/// A filter and a preconditioner that are not made of point blocks: the
/// enriched mass system of yarns inside triangles, one coordinate.
struct Enriched {
    a: DMatrix<f64>,
}

impl LinearOperator<f64> for Enriched {
    fn dim(&self) -> usize {
        self.a.nrows()
    }
    fn apply(&self, x: &[f64], y: &mut [f64]) {
        y.copy_from_slice((&self.a * DVector::from_row_slice(x)).as_slice());
    }
}

struct Projection(DMatrix<f64>);

impl Filter<f64> for Projection {
    fn project(&self, v: &mut [f64]) {
        let w = &self.0 * DVector::from_row_slice(v);
        v.copy_from_slice(w.as_slice());
    }
}

#[test]
fn enriched_system_through_own_operator_and_filter() {
    let golden = load(include_str!("golden/filter_smw.json"));
    let e = &golden["enriched"];
    let (mv, mp) = (numbers(&e["Mv_diag"]), numbers(&e["Mp_diag"]));
    let (nv, ny) = (mv.len(), mp.len());
    let b = DMatrix::from_row_slice(ny, nv, &numbers(&e["B"]));
    let k = DMatrix::from_row_slice(ny, ny, &numbers(&e["K_yarn"]));
    let h = e["h"].as_f64().expect("number");
    let weights = DMatrix::from_diagonal(&DVector::from_vec(mp));
    let n = nv + ny;
    let mut j = DMatrix::zeros(ny, n);
    j.columns_mut(0, nv).copy_from(&b);
    j.columns_mut(nv, ny).copy_from(&DMatrix::identity(ny, ny));
    let mut a = j.transpose() * (&weights + h * h * k) * &j;
    for i in 0..nv {
        a[(i, i)] += mv[i];
    }
    let gram = (b.transpose() * &b)
        .cholesky()
        .expect("full rank")
        .inverse();
    let mut s = DMatrix::identity(n, n);
    let f = DMatrix::identity(ny, ny) - &b * gram * b.transpose();
    s.view_mut((nv, nv), (ny, ny)).copy_from(&f);
    let settings = MpcgSettings {
        tolerance: 1e-12,
        ..MpcgSettings::default()
    };
    let mut solver = Mpcg::new(Box::new(NoPreconditioner), settings);
    let mut x = vec![0.0; n];
    let report = solver
        .solve_operator(&Enriched { a }, &numbers(&e["b"]), &Projection(s), &mut x)
        .expect("operands fit");
    assert!(report.converged(), "{report:?}");
    let error = relative(&x, &numbers(&e["mpcg_solution"]));
    assert!(error < 1e-8, "{error:e} {report:?}");
}
