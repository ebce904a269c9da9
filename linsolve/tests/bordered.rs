//! Matrices of points and scalars: products, and every solver against dense algebra.

mod common;

use common::*;
use nalgebra::{DMatrix, DVector};
use rstest::rstest;
use selvedge_linsolve::*;
use std::sync::Arc;

/// Stencils of a chain of yarns: two points with a scalar each, three in a row,
/// and points alone.
fn stencils(points: usize, scalars: usize) -> Vec<(Vec<u32>, Vec<usize>)> {
    let mut out = Vec::new();
    let owner = |s: usize| (s * points / scalars) as u32;
    for s in 0..scalars - 1 {
        let t = s + 1;
        out.push((
            vec![owner(s), s as u32, owner(t), t as u32],
            vec![3, 1, 3, 1],
        ));
        if s + 2 < scalars {
            out.push((vec![s as u32, s as u32 + 2], vec![1, 1]));
        }
    }
    for p in 0..points - 3 {
        out.push((vec![p as u32, p as u32 + 3], vec![3, 3]));
    }
    out
}

/// Random SPD matrix on the stencils, mass on the diagonal.
fn random_bordered<T: Real>(
    random: &mut Random,
    points: usize,
    scalars: usize,
    contacts: usize,
) -> BorderedMatrix<T> {
    let owners: Vec<u32> = (0..scalars)
        .map(|s| (s * points / scalars) as u32)
        .collect();
    let stencils = stencils(points, scalars);
    let of_points: Vec<Vec<u32>> = stencils
        .iter()
        .map(|(n, d)| {
            n.iter()
                .zip(d)
                .filter(|x| *x.1 == 3)
                .map(|x| *x.0)
                .collect()
        })
        .collect();
    let pattern = Pattern::from_groups(points, of_points.iter().map(Vec::as_slice));
    let groups = stencils.iter().map(|(n, d)| (n.as_slice(), d.as_slice()));
    let border = Arc::new(BorderPattern::from_groups(points, owners, groups));
    let pattern = Arc::new(pattern);
    let mut a = BorderedMatrix::zeros(Bsr::zeros(Arc::clone(&pattern)), Arc::clone(&border));
    for i in 0..points {
        a.points.stat.add_diagonal(i, 0.4 + 0.3 * random.unit());
    }
    let (_, coupling, single) = a.values_mut();
    for s in 0..scalars as u32 {
        let slot = border.scalar_slot(s, s).expect("diagonal");
        single[slot as usize] += T::from_f64(0.3);
    }
    let mut blocks = Vec::new();
    for (nodes, dims) in &stencils {
        let m: usize = dims.iter().sum();
        let g = DMatrix::from_fn(m, m, |_, _| random.unit());
        let k = &g * g.transpose();
        let mut row = 0;
        for (&i, &di) in nodes.iter().zip(dims) {
            let mut column = 0;
            for (&j, &dj) in nodes.iter().zip(dims) {
                let at = |r: usize, c: usize| k[(row + r, column + c)];
                match (di, dj) {
                    (3, 3) => {
                        let slot = pattern.slot(i, j).expect("in the pattern");
                        let block: [[f64; 3]; 3] =
                            std::array::from_fn(|r| std::array::from_fn(|c| at(r, c)));
                        blocks.push((slot, block));
                    }
                    (1, 3) => {
                        let slot = border.point_slot(i, j).expect("in the pattern") as usize;
                        for c in 0..3 {
                            coupling[3 * slot + c] += T::from_f64(at(0, c));
                        }
                    }
                    (1, 1) => {
                        let slot = border.scalar_slot(i, j).expect("in the pattern");
                        single[slot as usize] += T::from_f64(at(0, 0));
                    }
                    _ => {}
                }
                column += dj;
            }
            row += di;
        }
    }
    for (slot, block) in blocks {
        a.points.stat.add_block(slot as usize, &block, 1.0);
    }
    a.points.dynamic = random_contacts(random, points, contacts);
    a
}

fn filter(random: &mut Random, points: usize, scalars: usize) -> BlockFilter {
    let mut filter = random_filter(random, points);
    for _ in 0..scalars / 5 {
        filter.fix_scalar((3 * points + random.below(scalars)) as u32);
    }
    filter
}

fn projector(filter: &BlockFilter, n: usize) -> DMatrix<f64> {
    let mut s = dense_filter(filter, n);
    for &k in filter.fixed_scalars() {
        s[(k as usize, k as usize)] = 0.0;
    }
    s
}

/// The product is that of the dense matrix, and `x · A x` comes with it.
#[rstest]
fn product(#[values(0, 30)] contacts: usize) {
    let mut random = Random(3);
    for (points, scalars) in [(4, 3), (30, 60), (1500, 4000)] {
        let a = random_bordered::<f64>(&mut random, points, scalars, contacts);
        let n = 3 * points + scalars;
        let x = random.vector(n);
        let mut y = vec![f64::NAN; n];
        let dot = a.apply_dot(&x, &mut y, Sums::Double);
        let mut expected = DVector::zeros(n);
        a.visit_lower(&mut |i, j, v| {
            expected[i] += v * x[j];
            if i != j {
                expected[j] += v * x[i];
            }
        });
        assert!(relative(&y, expected.as_slice()) < 1e-13);
        let direct: f64 = x.iter().zip(&y).map(|(x, y)| x * y).sum();
        assert!((dot - direct).abs() < 1e-11 * direct.abs());
    }
}

fn solve_and_compare<T: Real>(solver: &mut dyn LinearSolver<T>, contacts: usize, tolerance: f64) {
    let mut random = Random(99);
    for (points, scalars) in [(4, 2), (40, 80), (60, 30)] {
        let a = random_bordered::<T>(&mut random, points, scalars, contacts);
        let (m, n) = (dense(&a), 3 * points + scalars);
        let b = random.vector(n);
        for filter in [BlockFilter::new(), filter(&mut random, points, scalars)] {
            let mut x = vec![0.0; n];
            let expected = reference(&m, &b, &projector(&filter, n), &x);
            let report = solver.solve(&a, &b, &filter, &mut x).expect("solvable");
            assert_eq!(report.status, SolveStatus::Converged, "{report:?}");
            let error = relative(&x, expected.as_slice());
            assert!(
                error < tolerance,
                "{points} {scalars}: {error:e} {report:?}"
            );
        }
    }
}

#[rstest]
fn solvers(#[values(0, 40)] contacts: usize) {
    for name in PRECONDITIONERS {
        let settings = |tolerance| MpcgSettings {
            tolerance,
            max_iterations: 5000,
            ..MpcgSettings::default()
        };
        let p = preconditioner_by_name(name).expect("valid name");
        solve_and_compare::<f64>(&mut Mpcg::new(p, settings(1e-12)), contacts, 1e-7);
        let p = preconditioner_by_name(name).expect("valid name");
        solve_and_compare::<f32>(&mut Mpcg::new(p, settings(1e-5)), contacts, 5e-3);
    }
    solve_and_compare::<f64>(&mut Direct::default(), contacts, 1e-8);
}

/// Blocks that hold the scalars of a point solve a matrix without couplings
/// between points at once; blocks of points alone do not.
#[test]
fn nodes_in_one_block() {
    let mut random = Random(8);
    let (points, scalars) = (50, 120);
    let owners: Vec<u32> = (0..scalars)
        .map(|s| (s * points / scalars) as u32)
        .collect();
    let none = std::iter::empty::<(&[u32], &[usize])>();
    let border = Arc::new(BorderPattern::from_groups(points, owners, none));
    let pattern = Arc::new(Pattern::from_groups(points, std::iter::empty()));
    let mut a = BorderedMatrix::<f64>::zeros(Bsr::zeros(pattern), Arc::clone(&border));
    let (_, coupling, single) = a.values_mut();
    coupling.iter_mut().for_each(|c| *c = random.unit());
    for s in 0..scalars as u32 {
        single[border.scalar_slot(s, s).expect("diagonal") as usize] = 9.0;
    }
    for i in 0..points {
        a.points.stat.add_diagonal(i, 3.0);
    }
    let b = random.vector(3 * points + scalars);
    let count = |name: &str| {
        let p = preconditioner_by_name(name).expect("valid name");
        let mut x = vec![0.0; b.len()];
        let settings = MpcgSettings {
            tolerance: 1e-10,
            ..MpcgSettings::default()
        };
        let report = Mpcg::new(p, settings)
            .solve(&a, &b, &NoFilter, &mut x)
            .expect("solvable");
        assert!(report.converged());
        report.iterations
    };
    assert_eq!(count("node-jacobi"), 1);
    assert_eq!(count("node-ic"), 1);
    assert!(count("block-jacobi") > 5);
}

/// The same bits for any number of threads.
#[test]
fn threads_do_not_matter() {
    let mut random = Random(21);
    let (points, scalars) = (30_000, 60_000);
    let a = random_bordered::<f64>(&mut random, points, scalars, 500);
    let b = random.vector(3 * points + scalars);
    let solve = |name: &str, threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("pool");
        pool.install(|| {
            let p = preconditioner_by_name(name).expect("valid name");
            let settings = MpcgSettings {
                tolerance: 1e-6,
                ..MpcgSettings::default()
            };
            let mut x = vec![0.0; b.len()];
            Mpcg::new(p, settings)
                .solve(&a, &b, &NoFilter, &mut x)
                .expect("solvable");
            x
        })
    };
    for name in ["node-jacobi", "node-ic"] {
        let one = solve(name, 1);
        assert!(one.iter().all(|x| x.is_finite()));
        assert!(one == solve(name, 2), "{name}");
        assert!(one == solve(name, 4), "{name}");
    }
}
