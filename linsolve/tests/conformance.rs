//! Every solver with every preconditioner and precision against dense algebra.

mod common;

use common::*;
use rstest::rstest;
use selvedge_linsolve::*;

fn solve_and_compare<T: Real>(
    solver: &mut dyn LinearSolver<T>,
    contacts: usize,
    tolerance: f64,
    residual: f64,
) {
    let mut random = Random(20_240_406);
    for (w, h) in [(1, 1), (4, 5), (12, 9)] {
        let (points, groups) = if w == 1 { (1, vec![]) } else { sheet(w, h) };
        let a = random_spd::<T>(&mut random, points, &groups, contacts.min(4 * points));
        let m = dense(&a);
        let b = random.vector(3 * points);
        for constrained in [false, true] {
            let filter = if constrained {
                random_filter(&mut random, points)
            } else {
                BlockFilter::new()
            };
            for warm in [false, true] {
                let mut x = if warm {
                    random.vector(b.len())
                } else {
                    vec![0.0; b.len()]
                };
                filter.prescribe(&mut x);
                let mut z = x.clone();
                Filter::<f64>::project(&filter, &mut z);
                let z: Vec<f64> = x.iter().zip(&z).map(|(x, s)| x - s).collect();
                let expected = reference(&m, &b, &dense_filter(&filter, b.len()), &z);
                let report = solver.solve(&a, &b, &filter, &mut x).expect("solvable");
                assert_eq!(report.status, SolveStatus::Converged, "{report:?}");
                assert!(report.relative_residual <= residual, "{report:?}");
                let error = relative(&x, expected.as_slice());
                assert!(
                    error < tolerance,
                    "{w}x{h} {constrained} {warm}: {error:e} {report:?}"
                );
            }
        }
    }
}

fn cg<T: Real>(preconditioner: Box<dyn Preconditioner<T>>, tolerance: f64) -> Mpcg<T> {
    let settings = MpcgSettings {
        tolerance,
        max_iterations: 5000,
        ..MpcgSettings::default()
    };
    Mpcg::new(preconditioner, settings)
}

#[rstest]
fn cg_double(#[values(0, 60)] contacts: usize) {
    for name in PRECONDITIONERS {
        let p = preconditioner_by_name(name).expect("valid name");
        solve_and_compare::<f64>(&mut cg(p, 1e-12), contacts, 1e-8, 1.1e-12);
    }
}

#[rstest]
fn cg_single(#[values(0, 60)] contacts: usize) {
    for name in PRECONDITIONERS {
        let p = preconditioner_by_name(name).expect("valid name");
        solve_and_compare::<f32>(&mut cg(p, 1e-5), contacts, 2e-3, 1.1e-5);
    }
}

#[rstest]
fn direct_double(#[values(0, 60)] contacts: usize) {
    solve_and_compare::<f64>(&mut Direct::default(), contacts, 1e-9, 1e-10);
}

/// The direct solver reads a matrix in single precision without adding to its
/// rounding.
#[rstest]
fn direct_on_single(#[values(0, 60)] contacts: usize) {
    solve_and_compare::<f32>(&mut Direct::default(), contacts, 1e-9, 1e-10);
}

#[rstest]
fn refined(#[values(0, 60)] contacts: usize) {
    for name in PRECONDITIONERS {
        let settings = MpcgSettings {
            tolerance: 1e-11,
            max_iterations: 5000,
            ..MpcgSettings::default()
        };
        let mut solver = solver_by_name::<f64>("refined", name, settings).expect("valid name");
        solve_and_compare::<f64>(&mut *solver, contacts, 1e-7, 1e-11);
    }
}

/// Symbolic work is reused while the pattern stays, and redone when contacts
/// or the mesh change.
#[test]
fn direct_follows_the_pattern() {
    let mut random = Random(77);
    let mut solver = Direct::default();
    let mut lengths = Vec::new();
    for (size, contacts) in [(6, 0), (6, 0), (6, 20), (6, 20), (9, 3), (6, 0)] {
        let (points, groups) = sheet(size, 6);
        let mut a = random_spd::<f64>(&mut random, points, &groups, contacts);
        for _ in 0..2 {
            let b = random.vector(3 * points);
            let mut x = vec![0.0; b.len()];
            let report = solver.solve(&a, &b, &NoFilter, &mut x).expect("definite");
            assert!(report.converged(), "{report:?}");
            let m = dense(&a);
            let expected = m
                .cholesky()
                .expect("definite")
                .solve(&nalgebra::DVector::from_vec(b));
            assert!(relative(&x, expected.as_slice()) < 1e-9);
            a.stat.add_diagonal(1, 3.0);
        }
        lengths.push(solver.factor_len());
    }
    assert!(lengths[2] > lengths[1] && lengths[4] > lengths[0]);
    assert_eq!(lengths[0], lengths[5]);
}

/// Iteration counts fall in the expected order on a stiff sheet.
#[test]
fn preconditioners_pay() {
    let mut random = Random(5);
    let (points, groups) = sheet(20, 20);
    let a = random_spd_of_mass::<f64>(&mut random, points, &groups, 0, 1e-3);
    let b = random.vector(3 * points);
    let count = |name: &str| {
        let p = preconditioner_by_name(name).expect("valid name");
        let mut x = vec![0.0; b.len()];
        let report = cg(p, 1e-6)
            .solve(&a, &b, &NoFilter, &mut x)
            .expect("solvable");
        assert!(report.converged());
        report.iterations
    };
    let [none, jacobi, chebyshev, ic] =
        ["none", "block-jacobi", "chebyshev", "block-ic"].map(count);
    assert!(
        jacobi < none && chebyshev < jacobi && 2 * ic < jacobi,
        "{none} {jacobi} {chebyshev} {ic}"
    );
}

/// Where all blocks are full, scalar and block incomplete Cholesky are one
/// factor; a matrix without positive pivots gets a shift.
#[test]
fn incomplete_factors_agree() {
    let mut random = Random(31);
    let (points, groups) = sheet(9, 7);
    let mut a = random_spd::<f64>(&mut random, points, &groups, 40);
    for weaken in [0.0, -0.2, -2.0] {
        a.stat.add_diagonal(30, weaken);
        let (mut scalar, mut block) = (ScalarIc::default(), BlockIc::default());
        scalar.update(&a, &NoFilter).expect("shift suffices");
        block.update(&a, &NoFilter).expect("shift suffices");
        assert_eq!(scalar.shift(), block.shift());
        let r = random.vector(3 * points);
        let (mut y, mut z) = (r.clone(), r.clone());
        scalar.apply(&a, &r, &mut y);
        block.apply(&a, &r, &mut z);
        assert!(relative(&y, &z) < 1e-9);
        assert!(dot(&r, &z) > 0.0);
    }
    a.stat.add_diagonal(30, -50.0);
    let mut block = BlockIc::default();
    let shifted = block.update(&a, &NoFilter).is_ok().then(|| block.shift());
    assert!(shifted.is_none_or(|s| s > 0.0), "{shifted:?}");
}
