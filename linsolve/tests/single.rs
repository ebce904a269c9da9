//! Solves in single precision throughout: matrix, preconditioner, vectors, sums.

mod common;

use common::*;
use rstest::rstest;
use selvedge_linsolve::*;
use std::sync::Arc;

fn single(name: &str, tolerance: f64, max_iterations: usize) -> Mpcg<f32> {
    let settings = MpcgSettings {
        tolerance,
        max_iterations,
        sums: Sums::OfVectors,
        ..MpcgSettings::default()
    };
    Mpcg::new(preconditioner_by_name(name).expect("valid name"), settings)
}

fn rounded(a: &DualMatrix<f64>) -> DualMatrix<f32> {
    let mut out = DualMatrix::new(Bsr::zeros(Arc::clone(a.stat.pattern())));
    out.stat.copy_from(&a.stat);
    out.dynamic.copy_from(&a.dynamic);
    out
}

/// The same matrix, every block pushed.
fn reassembled(a: &DualMatrix<f64>) -> ReassembledMatrix<f32> {
    let points = a.stat.pattern().points();
    let m = dense(a);
    let mut out = ReassembledMatrix::new(points);
    for i in 0..points {
        for j in 0..points {
            let block = std::array::from_fn(|r| std::array::from_fn(|c| m[(3 * i + r, 3 * j + c)]));
            if block != [[0.0; 3]; 3] {
                out.push_block(i, j, &block);
            }
        }
    }
    out.compress();
    out
}

/// Both storages, with and without pins, within 1e-4 of the direct solution in
/// double precision.
#[test]
fn agrees_with_direct() {
    let mut random = Random(91);
    let (points, groups) = sheet(13, 9);
    let a = random_spd::<f64>(&mut random, points, &groups, 60);
    let b = random.vector(3 * points);
    let mut pins = BlockFilter::new();
    for i in [0, 5, 40] {
        pins.fix(i, [0.0; 3]).expect("finite");
    }
    pins.constrain(7, [1.0, 2.0, 3.0], 0.0).expect("finite");
    let (dual, compressed) = (rounded(&a), reassembled(&a));
    let both: [&dyn ExplicitOperator<f32>; 2] = [&dual, &compressed];
    for filter in [BlockFilter::new(), pins] {
        let mut expected = vec![0.0; b.len()];
        let report = Direct::new(1e-12)
            .solve(&a, &b, &filter, &mut expected)
            .expect("definite");
        assert!(report.converged(), "{report:?}");
        for (name, a) in PRECONDITIONERS.iter().flat_map(|n| both.map(|a| (n, a))) {
            let mut x = vec![0.0; b.len()];
            let report = single(name, 1e-5, 2000)
                .solve(a, &b, &filter, &mut x)
                .expect("solvable");
            assert!(report.converged(), "{name}: {report:?}");
            let error = relative(&x, &expected);
            assert!(error < 1e-4, "{name}: {error:e}");
        }
    }
}

/// A tolerance that the precision cannot reach ends early as `Stagnated`, with
/// the iterate whose residual is reported, and near what can be reached.
#[rstest]
fn stagnates(#[values(1e-2, 1e-5)] mass: f64) {
    let mut random = Random(11);
    let (points, groups) = sheet(12, 12);
    let a = random_spd_of_mass::<f64>(&mut random, points, &groups, 0, mass);
    let a = rounded(&a);
    let b = random.vector(3 * points);
    for name in PRECONDITIONERS {
        let mut x = vec![0.0; b.len()];
        let report = single(name, 1e-12, 20_000)
            .solve(&a, &b, &NoFilter, &mut x)
            .expect("operands fit");
        assert_eq!(report.status, SolveStatus::Stagnated, "{name}: {report:?}");
        assert!(report.iterations < 10_000, "{name}: {report:?}");
        assert!(report.relative_residual < 1e-3, "{name}: {report:?}");
        // against the residual in double precision of the same rounded matrix
        let mut r = dense(&a) * nalgebra::DVector::from_row_slice(&x);
        r -= nalgebra::DVector::from_row_slice(&b);
        let true_residual = r.norm() / norm(&b);
        assert!(
            true_residual < 2.0 * report.relative_residual
                && report.relative_residual < 2.0 * true_residual + 1e-6,
            "{name}: {true_residual:e} {report:?}"
        );
    }
}

/// Stopped anywhere, no later iterate that was looked at is worse: more
/// iterations never return a larger residual once rounding leads.
#[test]
fn best_iterate_comes_back() {
    let mut random = Random(3);
    let (points, groups) = sheet(12, 12);
    let a = random_spd_of_mass::<f64>(&mut random, points, &groups, 0, 1e-5);
    let a = rounded(&a);
    let b = random.vector(3 * points);
    let run = |limit: usize| {
        let mut x = vec![0.0; b.len()];
        single("block-jacobi", 0.0, limit)
            .solve(&a, &b, &NoFilter, &mut x)
            .expect("operands fit")
    };
    let end = run(20_000);
    assert_eq!(end.status, SolveStatus::Stagnated, "{end:?}");
    for limit in [end.iterations - 1, end.iterations, 2 * end.iterations] {
        let report = run(limit);
        assert_ne!(report.status, SolveStatus::Converged);
        assert!(
            report.relative_residual >= end.relative_residual,
            "{limit}: {report:?}, {end:?}"
        );
    }
}

/// The same bits on one and two threads, of an answer and of a stagnation.
#[test]
fn bits_do_not_depend_on_threads() {
    let solve = |threads: usize, tolerance: f64| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a small pool");
        pool.install(|| {
            let mut random = Random(12);
            let (points, groups) = sheet(150, 90);
            let b = random.vector(3 * points);
            let a = random_spd::<f32>(&mut random, points, &groups, 3000);
            let mut pins = BlockFilter::new();
            pins.fix(11, [0.0; 3]).expect("finite");
            PRECONDITIONERS.map(|name| {
                let mut x = vec![0.0; b.len()];
                let report = single(name, tolerance, 500)
                    .solve(&a, &b, &pins, &mut x)
                    .expect("solvable");
                let x: Vec<u64> = x.iter().map(|v| v.to_bits()).collect();
                (x, report)
            })
        })
    };
    for tolerance in [1e-5, 1e-12] {
        let one = solve(1, tolerance);
        assert!(one == solve(2, tolerance));
        for (_, report) in &one {
            let status = if tolerance == 1e-5 {
                SolveStatus::Converged
            } else {
                SolveStatus::Stagnated
            };
            assert_eq!(report.status, status, "{report:?}");
        }
    }
}
