//! Multigrid: cost on growing sheets, symmetry, and systems with little to coarsen.

mod common;

use common::*;
use nalgebra::DMatrix;
use selvedge_linsolve::*;
use std::sync::Arc;

/// A square metre of cloth with `n × n` points: springs of 5000 N/m along the
/// edges of a curved sheet, weak hinges, 0.2 kg/m², a step of 2 ms.
fn cloth(n: usize) -> DualMatrix<f32> {
    let cell = 1.0 / (n - 1) as f64;
    let (t, mut groups) = (triangles(n, n), Vec::new());
    groups.extend(t.iter().map(|t| t.to_vec()));
    groups.extend(hinges(&t).iter().map(|h| h.to_vec()));
    let pattern = Pattern::from_groups(n * n, groups.iter().map(Vec::as_slice));
    let mut a = Bsr::zeros(Arc::new(pattern));
    for i in 0..n * n {
        a.add_diagonal(i, 0.2 * cell * cell);
    }
    let position = |i: u32| {
        let (u, v) = (
            (i as usize % n) as f64 * cell,
            (i as usize / n) as f64 * cell,
        );
        [u, 0.1 * (5.0 * u).sin() * (4.0 * v).cos(), v]
    };
    let mut spring = |i: u32, j: u32, k: f64| {
        let (p, q) = (position(i), position(j));
        let d: [f64; 3] = std::array::from_fn(|k| q[k] - p[k]);
        let length = d.iter().map(|v| v * v).sum::<f64>();
        let block = std::array::from_fn(|r| std::array::from_fn(|c| d[r] * d[c] / length));
        for (r, c, s) in [(i, i, k), (j, j, k), (i, j, -k), (j, i, -k)] {
            let slot = a.pattern().slot(r, c).expect("in a group");
            a.add_block(slot as usize, &block, s);
        }
    };
    for t in &t {
        for e in 0..3 {
            spring(t[e], t[(e + 1) % 3], 5000.0 * 4e-6);
        }
    }
    for h in hinges(&t) {
        spring(h[2], h[3], 1e-2 * 4e-6 / (cell * cell));
    }
    DualMatrix::new(a)
}

fn iterations(a: &DualMatrix<f32>, name: &str) -> usize {
    let settings = MpcgSettings {
        tolerance: 1e-3,
        max_iterations: 3000,
        ..MpcgSettings::default()
    };
    let b = Random(3).vector(a.dim());
    let mut x = vec![0.0; b.len()];
    let mut solver = solver_by_name::<f32>("cg", name, settings).expect("valid");
    let report = solver.solve(a, &b, &NoFilter, &mut x).expect("solvable");
    assert!(report.converged(), "{name} {report:?}");
    report.iterations
}

/// Twice and four times as many points an edge: block Jacobi follows, multigrid
/// does not.
#[test]
fn iterations_hardly_grow() {
    let [small, large] = [21, 81].map(|n| {
        let a = cloth(n);
        (iterations(&a, "block-jacobi"), iterations(&a, "multigrid"))
    });
    assert!(
        large.1 <= small.1 + small.1 / 2 && 2 * large.0 > 5 * small.0 && 8 * large.1 < large.0,
        "{small:?} {large:?}"
    );
}

/// Columns of the applied operator.
fn applied<T: Real>(p: &mut Multigrid<T>, a: &DualMatrix<T>) -> DMatrix<f64> {
    let n = a.dim();
    let mut out = DMatrix::zeros(n, n);
    let (mut r, mut z) = (vec![T::ZERO; n], vec![T::ZERO; n]);
    for k in 0..n {
        r[k] = T::ONE;
        p.apply(a, &r, &mut z);
        r[k] = T::ZERO;
        for (i, z) in z.iter().enumerate() {
            out[(i, k)] = z.to_f64();
        }
    }
    out
}

/// The cycle is symmetric, positive definite, and never overshoots the inverse
/// of the matrix it is made for: Gauss-Seidel and Galerkin guarantee it.
#[test]
fn cycle_is_symmetric_and_definite() {
    let mut random = Random(8);
    let (points, groups) = sheet(13, 11);
    for constrained in [false, true] {
        let a = random_spd_of_mass::<f64>(&mut random, points, &groups, 0, 1e-2);
        let filter = if constrained {
            random_filter(&mut random, points)
        } else {
            BlockFilter::new()
        };
        let mut p = Multigrid::default();
        p.update(&a, &filter).expect("definite");
        assert!(
            !p.fell_back() && p.level_sizes().len() > 1,
            "{:?}",
            p.level_sizes()
        );
        let b = applied(&mut p, &a);
        let asymmetry = (&b - b.transpose()).amax() / b.amax();
        assert!(asymmetry < 1e-5, "{asymmetry:e}");
        let s = dense_filter(&filter, a.dim());
        let m = dense(&a);
        let mean = m.trace() / a.dim() as f64;
        let m = &s * m * &s + (DMatrix::identity(a.dim(), a.dim()) - &s) * mean;
        // Lᵀ B L has the eigenvalues of B A
        let l = m.cholesky().expect("definite").l();
        let values = (l.transpose() * (&b + b.transpose()) * 0.5 * &l).symmetric_eigenvalues();
        assert!(
            values.min() > 0.02 && values.max() < 1.001,
            "{} {}",
            values.min(),
            values.max()
        );
    }
}

fn solves<T: Real>(a: &DualMatrix<T>, filter: &BlockFilter, tolerance: f64) {
    let b = Random(4).vector(a.dim());
    let settings = MpcgSettings {
        tolerance,
        ..MpcgSettings::default()
    };
    let mut x = vec![0.0; b.len()];
    let mut s = Mpcg::new(Box::new(Multigrid::<T>::default()), settings);
    let report = s.solve(a, &b, filter, &mut x).expect("solvable");
    assert!(report.converged(), "{report:?}");
    let z = vec![0.0; b.len()];
    let expected = reference(&dense(a), &b, &dense_filter(filter, b.len()), &z);
    assert!(relative(&x, expected.as_slice()) < 100.0 * tolerance);
}

/// One point, no coupling, separate pieces, everything pinned, and a piece that
/// may only move in a plane.
#[test]
fn little_to_coarsen() {
    let mut random = Random(21);
    let none = BlockFilter::new();
    for points in [1, 500] {
        solves(&random_spd::<f64>(&mut random, points, &[], 0), &none, 1e-9);
    }
    // 60 separate squares of hinged triangles
    let groups: Vec<Vec<u32>> = (0..60u32).map(|k| (4 * k..4 * k + 4).collect()).collect();
    let a = random_spd::<f64>(&mut random, 240, &groups, 0);
    solves(&a, &none, 1e-9);
    let (points, groups) = sheet(12, 10);
    let mut a = random_spd::<f64>(&mut random, points, &groups, 30);
    let (mut pinned, mut flat) = (BlockFilter::new(), BlockFilter::new());
    for i in 0..points as u32 {
        pinned.fix(i, [0.0; 3]).expect("valid");
        flat.constrain(i, [0.0, 0.6, 0.8], 0.0).expect("valid");
    }
    solves(&a, &pinned, 1e-9);
    solves(&a, &flat, 1e-9);
    // the pattern has couplings, the values have none
    let diagonal: Vec<f64> = (0..points).map(|i| 1.0 + i as f64).collect();
    a.stat.fill_zero();
    for (i, d) in diagonal.iter().enumerate() {
        a.stat.add_diagonal(i, *d);
    }
    solves(&a, &none, 1e-9);
    // a point that touches all others
    let star: Vec<Vec<u32>> = (1..300u32).map(|k| vec![0, k]).collect();
    solves(&random_spd::<f32>(&mut random, 300, &star, 0), &none, 1e-4);
}

/// A block that is not positive definite, on any level, makes block Jacobi
/// stand in until the next matrix.
#[test]
fn indefinite_blocks_fall_back() {
    let mut random = Random(9);
    let (points, groups) = sheet(15, 12);
    let mut a = random_spd::<f64>(&mut random, points, &groups, 0);
    let (mut p, mut jacobi) = (Multigrid::default(), BlockJacobi::default());
    a.stat.add_diagonal(40, -60.0);
    p.update(&a, &NoFilter).expect("finite");
    jacobi.update(&a, &NoFilter).expect("finite");
    assert!(p.fell_back());
    let r = random.vector(a.dim());
    let (mut y, mut z) = (r.clone(), r.clone());
    p.apply(&a, &r, &mut y);
    jacobi.apply(&a, &r, &mut z);
    assert_eq!(y, z);
    a.stat.add_diagonal(40, 60.0);
    p.update(&a, &NoFilter).expect("finite");
    assert!(!p.fell_back());
}

/// Levels and colours large enough for several threads give the same bits.
#[test]
fn bits_do_not_depend_on_threads() {
    let a = cloth(160);
    let b = Random(6).vector(a.dim());
    let r: Vec<f32> = b.iter().map(|v| *v as f32).collect();
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("a small pool").install(|| {
            let mut p = Multigrid::<f32>::default();
            p.update(&a, &NoFilter).expect("definite");
            let mut z = r.clone();
            p.apply(&a, &r, &mut z);
            assert!(!p.fell_back());
            z.iter().map(|v| v.to_bits()).collect::<Vec<_>>()
        })
    };
    let one = run(1);
    assert!(run(2) == one && run(4) == one);
}

/// The same object serves another mesh, and the first one again, bit for bit.
#[test]
fn follows_the_pattern() {
    let mut random = Random(10);
    let mut p = Multigrid::<f32>::default();
    let systems: Vec<_> = [(14, 9), (20, 17)]
        .iter()
        .map(|&(w, h)| {
            let (points, groups) = sheet(w, h);
            random_spd::<f32>(&mut random, points, &groups, 5)
        })
        .collect();
    let mut results = Vec::new();
    for k in [0, 1, 0] {
        let a = &systems[k];
        p.update(a, &NoFilter).expect("definite");
        let r: Vec<f32> = Random(2)
            .vector(a.dim())
            .iter()
            .map(|v| *v as f32)
            .collect();
        let mut z = r.clone();
        p.apply(a, &r, &mut z);
        results.push(z);
    }
    assert_eq!(results[0], results[2]);
}

/// Block Jacobi below the limit, multigrid above it, to the last bit, and the matrix of
/// the last update alone decides.
#[test]
fn stiffness_decides() {
    let n = 30;
    let a = cloth(n);
    let cell = 1.0 / (n - 1) as f64;
    let masses: Arc<[f64]> = vec![0.2 * cell * cell; n * n].into();
    let mut blocks = vec![[0.0; 9]; n * n];
    a.diagonal_blocks(&mut blocks);
    let traces: f64 = blocks.iter().map(|b| b[0] + b[4] + b[8]).sum();
    let root = (traces / (3.0 * masses.iter().sum::<f64>())).sqrt();
    let r: Vec<f32> = (Random(5).vector(a.dim()).iter())
        .map(|v| *v as f32)
        .collect();
    let apply = |p: &mut dyn Preconditioner<f32>| {
        p.update(&a, &NoFilter).expect("finite");
        let mut z = vec![0.0; r.len()];
        p.apply(&a, &r, &mut z);
        (z, p.pointwise().is_some())
    };
    let strong = || Box::new(Multigrid::default());
    let of = |limit: f64| ByStiffness::new(masses.clone(), limit, strong());
    assert_eq!(
        apply(&mut of(1.01 * root)),
        apply(&mut BlockJacobi::default())
    );
    let mut above = of(0.99 * root);
    assert_eq!(apply(&mut above), apply(&mut Multigrid::default()));
    // a matrix of masses alone is not stiff
    let groups: [&[u32]; 0] = [];
    let mut light = Bsr::zeros(Arc::new(Pattern::from_groups(n * n, groups)));
    for (i, &m) in masses.iter().enumerate() {
        light.add_diagonal(i, m);
    }
    let light = DualMatrix::<f32>::new(light);
    above.update(&light, &NoFilter).expect("finite");
    assert!(above.pointwise().is_some());
    assert_eq!(apply(&mut above), apply(&mut Multigrid::default()));
}

/// Masses of another mesh are refused.
#[test]
fn stiffness_needs_every_mass() {
    let masses: Arc<[f64]> = vec![1e-3; 5].into();
    let mut chosen = ByStiffness::<f32>::new(masses, 1.0, Box::new(Multigrid::default()));
    assert!(chosen.update(&cloth(3), &NoFilter).is_err());
}
