//! Statuses, errors, and that nothing but finite numbers comes back.

mod common;

use common::*;
use selvedge_linsolve::*;
use std::sync::Arc;

fn one_point(diagonal: [f64; 3]) -> Bsr<f64> {
    let none: [&[u32]; 0] = [];
    let mut a = Bsr::zeros(Arc::new(Pattern::from_groups(1, none)));
    let [x, y, z] = diagonal;
    a.add_block(0, &[[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]], 1.0);
    a
}

/// No load and nothing prescribed: zero, also from a non-zero guess.
#[test]
fn zero_right_hand_side() {
    let a = one_point([1.0, 2.0, 3.0]);
    let mut x = [1.0, 1.0, 1.0];
    let report = Mpcg::with_tolerance(1e-8)
        .solve(&a, &[0.0; 3], &NoFilter, &mut x)
        .expect("operands fit");
    assert_eq!(
        (report.status, report.iterations),
        (SolveStatus::Converged, 0)
    );
    assert_eq!(x, [0.0; 3]);
    let mut filter = BlockFilter::new();
    filter.fix(0, [4.0, 5.0, 6.0]).expect("finite");
    filter.prescribe(&mut x);
    for solver in SOLVERS {
        let mut solver =
            solver_by_name::<f64>(solver, "none", MpcgSettings::default()).expect("valid");
        let report = solver
            .solve(&a, &[0.0; 3], &filter, &mut x)
            .expect("operands fit");
        assert!(report.converged());
        assert_eq!(x, [4.0, 5.0, 6.0]);
    }
}

/// An indefinite matrix is flagged; in the first iteration the preconditioned
/// residual comes back, scaled by `bᵀP⁻¹b/|pᵀAp|`; Cholesky refuses.
#[test]
fn indefinite() {
    let a = one_point([1.0, -5.0, 1.0]);
    let (b, mut x) = ([1.0, 2.0, 0.0], [0.0; 3]);
    let mut solver = Mpcg::new(Box::new(NoPreconditioner), MpcgSettings::default());
    let report = solver
        .solve(&a, &b, &NoFilter, &mut x)
        .expect("operands fit");
    assert_eq!(
        (report.status, report.iterations),
        (SolveStatus::NegativeCurvature, 0)
    );
    // bᵀb = 5, bᵀAb = −19
    assert!(relative(&x, &[5.0 / 19.0, 10.0 / 19.0, 0.0]) < 1e-15);
    let mut refined =
        solver_by_name::<f64>("refined", "none", MpcgSettings::default()).expect("valid");
    let mut y = [0.0; 3];
    let report = refined
        .solve(&a, &b, &NoFilter, &mut y)
        .expect("operands fit");
    assert_eq!(report.status, SolveStatus::NegativeCurvature);
    assert!(relative(&y, &x) < 1e-6);
    let error = Direct::default()
        .solve(&a, &b, &NoFilter, &mut x)
        .expect_err("indefinite");
    assert!(matches!(error, LinsolveError::Indefinite { .. }), "{error}");
    // later in the iteration the iterate so far is kept
    let mut random = Random(3);
    let (points, groups) = sheet(6, 6);
    let mut a = random_spd::<f64>(&mut random, points, &groups, 0);
    a.stat.add_diagonal(17, -30.0);
    let b = random.vector(3 * points);
    let mut x = vec![0.0; b.len()];
    for p in PRECONDITIONERS {
        x.fill(0.0);
        let mut solver = solver_by_name::<f64>(
            "cg",
            p,
            MpcgSettings {
                tolerance: 1e-10,
                ..MpcgSettings::default()
            },
        )
        .expect("valid");
        match solver.solve(&a, &b, &NoFilter, &mut x) {
            Ok(report) => {
                assert_eq!(
                    report.status,
                    SolveStatus::NegativeCurvature,
                    "{p}: {report:?}"
                );
                assert!(x.iter().all(|v| v.is_finite()) && x.iter().any(|v| *v != 0.0));
            }
            Err(e) => assert!(
                matches!(e, LinsolveError::ShiftExhausted { .. }),
                "{p}: {e}"
            ),
        }
    }
}

/// The limit of iterations is reported with the true residual.
#[test]
fn iteration_limit_reports_the_true_residual() {
    let mut random = Random(5);
    let (points, groups) = sheet(9, 9);
    let a = random_spd::<f64>(&mut random, points, &groups, 30);
    let b = random.vector(3 * points);
    for limit in [0, 1, 7] {
        let mut x = vec![0.0; b.len()];
        let settings = MpcgSettings {
            tolerance: 1e-14,
            max_iterations: limit,
            ..MpcgSettings::default()
        };
        let report = Mpcg::new(Box::new(BlockJacobi::default()), settings)
            .solve(&a, &b, &NoFilter, &mut x)
            .expect("operands fit");
        assert_eq!(
            (report.status, report.iterations),
            (SolveStatus::IterationLimit, limit)
        );
        let mut r = vec![0.0; b.len()];
        a.apply(&x, &mut r);
        axpy(-1.0, &b, &mut r);
        assert!((norm(&r) / report.residual - 1.0).abs() < 1e-10);
        assert!((norm(&r) / norm(&b) / report.relative_residual - 1.0).abs() < 1e-10);
    }
}

/// A tolerance beyond single precision stagnates instead of claiming success,
/// and refinement reaches it (ill-conditioned: κ ≈ 1e6).
#[test]
fn precision_is_exhausted_honestly() {
    let mut random = Random(11);
    let (points, groups) = sheet(12, 12);
    let a = random_spd_of_mass::<f64>(&mut random, points, &groups, 0, 1e-5);
    let mut single = DualMatrix::new(Bsr::<f32>::zeros(Arc::clone(a.stat.pattern())));
    single.stat.copy_from(&a.stat);
    let b = random.vector(3 * points);
    let mut x = vec![0.0; b.len()];
    let settings = MpcgSettings {
        tolerance: 1e-12,
        max_iterations: 20_000,
        ..MpcgSettings::default()
    };
    let report = Mpcg::<f32>::new(Box::new(BlockJacobi::default()), settings.clone())
        .solve(&single, &b, &NoFilter, &mut x)
        .expect("operands fit");
    assert_ne!(report.status, SolveStatus::Converged, "{report:?}");
    assert!(report.relative_residual < 1e-4, "{report:?}");
    x.fill(0.0);
    let inner = MpcgSettings {
        tolerance: 1e-4,
        max_iterations: 20_000,
        ..MpcgSettings::default()
    };
    let mut refined = Refined::new(Mpcg::new(Box::new(BlockJacobi::default()), inner), 1e-10);
    let report = refined
        .solve(&a, &b, &NoFilter, &mut x)
        .expect("operands fit");
    assert!(
        report.converged() && refined.passes() <= 5,
        "{} {report:?}",
        refined.passes()
    );
}

/// Tiny and huge units: masses of 1e-9 kg and loads of 1e-30 N s in single precision.
#[test]
fn scales_do_not_underflow() {
    for scale in [1e-30, 1e-12, 1e20] {
        let mut random = Random(4);
        let (points, groups) = sheet(5, 5);
        let mut a = random_spd::<f32>(&mut random, points, &groups, 12);
        let b = random.vector(3 * points);
        let mut x = vec![0.0; b.len()];
        let load: Vec<f64> = b.iter().map(|v| v * scale).collect();
        for v in a.stat.values_mut() {
            *v *= 1e-9;
        }
        a.dynamic.clear();
        let m = dense(&a);
        let report = Mpcg::with_tolerance(1e-5)
            .solve(&a, &load, &NoFilter, &mut x)
            .expect("operands fit");
        assert!(report.converged(), "{scale:e} {report:?}");
        let expected = m
            .cholesky()
            .expect("definite")
            .solve(&nalgebra::DVector::from_vec(load));
        assert!(relative(&x, expected.as_slice()) < 1e-2);
    }
}

/// Bad data is an error, not a panic and not a NaN.
#[test]
fn bad_data() {
    let a = one_point([1.0, 1.0, 1.0]);
    let mut x = [0.0; 3];
    for p in PRECONDITIONERS {
        for solver in SOLVERS {
            let mut solver =
                solver_by_name::<f64>(solver, p, MpcgSettings::default()).expect("valid");
            let e = solver
                .solve(&a, &[0.0; 2], &NoFilter, &mut x)
                .expect_err("short");
            assert!(matches!(e, LinsolveError::DimensionMismatch { .. }));
            let e = solver
                .solve(&a, &[0.0, f64::NAN, 0.0], &NoFilter, &mut x)
                .expect_err("NaN");
            assert!(matches!(e, LinsolveError::NotFinite { index: 1, .. }));
            // a matrix with NaN: an error or a flag, and x stays finite
            let bad = one_point([1.0, f64::NAN, 1.0]);
            let end = solver.solve(&bad, &[1.0; 3], &NoFilter, &mut x);
            assert!(!end.is_ok_and(|r| r.converged()), "{p}");
            assert!(x.iter().all(|v| v.is_finite()));
            // a zero matrix has no curvature
            let zero = one_point([0.0; 3]);
            let end = solver.solve(&zero, &[1.0; 3], &NoFilter, &mut x);
            assert!(!end.is_ok_and(|r| r.converged()), "{p}");
            assert!(x.iter().all(|v| v.is_finite()));
            x = [0.0; 3];
        }
    }
    let mut filter = BlockFilter::new();
    assert!(filter.constrain(0, [0.0; 3], 1.0).is_err());
    assert!(filter.constrain(0, [0.0, f64::NAN, 0.0], 1.0).is_err());
    assert!(filter.constrain(0, [0.0, 1.0, 0.0], f64::INFINITY).is_err());
    assert!(
        filter.is_empty(),
        "a refused constraint leaves nothing behind"
    );
}

/// Unknown names list the valid ones.
#[test]
fn names() {
    let Err(e) = preconditioner_by_name::<f32>("jacobi") else {
        panic!("no such name")
    };
    let text = e.to_string();
    assert!(PRECONDITIONERS.iter().all(|n| text.contains(n)), "{text}");
    for n in PRECONDITIONERS {
        assert_eq!(preconditioner_by_name::<f64>(n).expect("valid").name(), n);
    }
    for n in SOLVERS {
        let s = solver_by_name::<f64>(n, "none", MpcgSettings::default()).expect("valid");
        assert_eq!(s.name(), n);
    }
    let Err(e) = solver_by_name::<f32>("refined", "none", MpcgSettings::default()) else {
        panic!("f64 only")
    };
    assert!(!e.to_string().contains("cg, direct, refined"), "{e}");
}

/// The three stop norms stop where they say.
#[test]
fn stop_norms() {
    let mut random = Random(6);
    let (points, groups) = sheet(8, 8);
    let a = random_spd::<f64>(&mut random, points, &groups, 0);
    let b = random.vector(3 * points);
    let weights: Arc<[f64]> = (0..b.len())
        .map(|k| if k % 3 == 1 { 1e4 } else { 1e-4 })
        .collect();
    for norm in [
        StopNorm::Euclidean,
        StopNorm::Weighted(Arc::clone(&weights)),
        StopNorm::Preconditioned,
    ] {
        for p in ["none", "block-jacobi", "block-ic"] {
            let settings = MpcgSettings {
                tolerance: 1e-6,
                norm: norm.clone(),
                ..MpcgSettings::default()
            };
            let mut solver = solver_by_name::<f64>("cg", p, settings).expect("valid");
            let mut x = vec![0.0; b.len()];
            let report = solver
                .solve(&a, &b, &NoFilter, &mut x)
                .expect("operands fit");
            assert!(report.converged() && report.stop_ratio <= 1.1, "{report:?}");
            if let StopNorm::Weighted(w) = &norm {
                let mut r = vec![0.0; b.len()];
                a.apply(&x, &mut r);
                axpy(-1.0, &b, &mut r);
                let weigh = |v: &[f64]| {
                    v.iter()
                        .zip(w.iter())
                        .map(|(v, w)| w * v * v)
                        .sum::<f64>()
                        .sqrt()
                };
                assert!(weigh(&r) <= 1.1e-6 * weigh(&b));
            }
        }
    }
}

/// Grid of unit springs of condition 1e6, whose smoothest mode is the uniform one.
fn weakly_held_grid(n: u32) -> Bsr<f64> {
    let at = |i: u32, j: u32| j * n + i;
    let mut groups: Vec<[u32; 2]> = Vec::new();
    for j in 0..n {
        for i in 0..n - 1 {
            groups.push([at(i, j), at(i + 1, j)]);
            groups.push([at(j, i), at(j, i + 1)]);
        }
    }
    let points = (n * n) as usize;
    let pattern = Pattern::from_groups(points, groups.iter().map(|g| &g[..]));
    let mut a = Bsr::<f64>::zeros(Arc::new(pattern));
    let pattern = a.pattern().clone();
    let unit = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for [p, q] in &groups {
        for (i, j, s) in [(p, p, 1.0), (q, q, 1.0), (p, q, -1.0), (q, p, -1.0)] {
            let slot = pattern.slot(*i, *j).expect("springs made the pattern");
            a.add_block(slot as usize, &unit, s);
        }
    }
    for i in 0..points {
        a.add_diagonal(i, 8e-6);
    }
    a
}

type Make = fn() -> Box<dyn Preconditioner<f32>>;

/// Iterating below the floor of single precision must not spoil what was
/// reached: the residual stays near the floor, κ · 6e-8, and refinement gets on.
#[test]
fn iterations_below_the_floor_keep_the_best() {
    let a = weakly_held_grid(24);
    let mut single = DualMatrix::new(Bsr::<f32>::zeros(Arc::clone(a.pattern())));
    single.stat.copy_from(&a);
    let b: Vec<f64> = (0..a.dim())
        .map(|k| ((k * k) as f64 * 0.37).sin())
        .collect();
    let settings = |tolerance| MpcgSettings {
        tolerance,
        max_iterations: 5000,
        ..MpcgSettings::default()
    };
    let make: [Make; 3] = [
        || Box::new(BlockIc::default()),
        || Box::new(BlockJacobi::default()),
        || Box::new(Multigrid::default()),
    ];
    for make in make {
        for tolerance in [1e-4, 1e-5, 1e-6] {
            let mut x = vec![0.0; b.len()];
            let report = Mpcg::<f32>::new(make(), settings(tolerance))
                .solve(&single, &b, &NoFilter, &mut x)
                .expect("operands fit");
            assert_eq!(report.status, SolveStatus::Stagnated, "{report:?}");
            assert!(report.relative_residual < 6e-3, "{report:?}");
            let mut refined = Refined::new(Mpcg::new(make(), settings(tolerance)), 1e-10);
            x.fill(0.0);
            let report = refined
                .solve(&a, &b, &NoFilter, &mut x)
                .expect("operands fit");
            let passes = refined.passes();
            assert!(report.converged() && passes <= 5, "{passes} {report:?}");
        }
    }
}

/// What the chosen preconditioner does not bring to the tolerance in half of
/// the iterations, incomplete factorisation does in the other half; a second
/// solve gives the same bits.
#[test]
fn a_weak_preconditioner_is_rescued() {
    let a = weakly_held_grid(24);
    let b: Vec<f64> = (0..a.dim()).map(|k| (k as f64 * 0.37).sin()).collect();
    let settings = MpcgSettings {
        tolerance: 1e-8,
        max_iterations: 110,
        ..MpcgSettings::default()
    };
    let mut x = vec![0.0; b.len()];
    let alone = Mpcg::<f64>::new(Box::new(BlockJacobi::default()), settings.clone())
        .solve(&a, &b, &NoFilter, &mut x)
        .expect("operands fit");
    assert_eq!(alone.status, SolveStatus::IterationLimit, "{alone:?}");
    let mut solver =
        solver_by_name::<f64>("cg", "block-jacobi", settings.clone()).expect("valid names");
    let mut runs = Vec::new();
    for _ in 0..2 {
        x.fill(0.0);
        let report = solver.solve(&a, &b, &NoFilter, &mut x).expect("it fits");
        assert!(report.converged(), "{report:?}");
        assert_eq!(report.solver, "cg, rescued");
        assert!((56..=110).contains(&report.iterations), "{report:?}");
        runs.push(x.clone());
    }
    assert_eq!(runs[0], runs[1]);
}
