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
fn cg_double(
    #[values("none", "diagonal", "block-jacobi", "ic", "block-ic", "chebyshev")] name: &str,
    #[values(0, 60)] contacts: usize,
) {
    let p = preconditioner_by_name(name).expect("valid name");
    solve_and_compare::<f64>(&mut cg(p, 1e-12), contacts, 1e-8, 1.1e-12);
}

#[rstest]
fn cg_single(
    #[values("none", "diagonal", "block-jacobi", "ic", "block-ic", "chebyshev")] name: &str,
    #[values(0, 60)] contacts: usize,
) {
    let p = preconditioner_by_name(name).expect("valid name");
    solve_and_compare::<f32>(&mut cg(p, 1e-5), contacts, 2e-3, 1.1e-5);
}
