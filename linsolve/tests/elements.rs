//! Matrices that stay stencil by stencil.

mod common;

use common::*;
use rstest::rstest;
use selvedge_linsolve::*;
use std::sync::Arc;

/// Random stencils of two kinds with symmetric positive definite matrices, and
/// what they add up to.
fn both<T: Real>(points: usize, count: usize) -> (ElementMatrix<T>, BorderedMatrix<T>) {
    let mut random = Random(77);
    let owners: Vec<u32> = (0..2 * points).map(|s| s as u32 / 2).collect();
    let kinds: [&[usize]; 2] = [&[3, 3, 1, 1, 1], &[1, 3, 3, 3]];
    let mut nodes = [Vec::new(), Vec::new()];
    for k in 0..count {
        let p = |i: usize| ((k * points / count + i) % points) as u32;
        nodes[0].extend([p(0), p(3), 2 * p(0), 2 * p(3) + 1, 2 * p(0) + 1]);
        nodes[1].extend([2 * p(5), p(5), p(1), p(2)]);
    }
    let groups: Vec<ElementGroup<'_>> = std::iter::zip(kinds, &nodes)
        .map(|(dims, nodes)| ElementGroup { dims, nodes })
        .collect();
    let mut free = ElementMatrix::zeros(points, &owners, &groups, 16);
    let stencils: Vec<(&[u32], &[usize])> = groups
        .iter()
        .flat_map(|g| g.nodes.chunks_exact(g.dims.len()).map(|n| (n, g.dims)))
        .collect();
    let of_points: Vec<Vec<u32>> = stencils
        .iter()
        .map(|(n, d)| {
            let pairs = n.iter().zip(*d);
            pairs.filter(|(_, d)| **d == 3).map(|(n, _)| *n).collect()
        })
        .collect();
    let pattern = Pattern::from_groups(points, of_points.iter().map(Vec::as_slice));
    let border = BorderPattern::from_groups(points, owners.clone(), stencils.iter().copied());
    let border = Arc::new(border);
    let mut put = BorderedMatrix::zeros(Bsr::zeros(Arc::new(pattern)), Arc::clone(&border));
    for i in 0..points {
        free.own.stat.add_diagonal(i, 1.0);
        put.points.stat.add_diagonal(i, 1.0);
    }
    for s in 0..owners.len() {
        free.own_scalars[s] = T::ONE;
        let slot = border.scalar_slot(s as u32, s as u32).expect("diagonal");
        put.values_mut().2[slot as usize] += T::ONE;
    }
    for (g, group) in groups.iter().enumerate() {
        let m: usize = group.dims.iter().sum();
        for (e, nodes) in group.nodes.chunks_exact(group.dims.len()).enumerate() {
            let a: Vec<f64> = (0..m * m).map(|_| random.unit()).collect();
            let h = |i: usize, j: usize| (0..m).map(|k| a[i * m + k] * a[j * m + k]).sum::<f64>();
            let values = free.values_mut(g);
            let mut at = e * (m * (m + 1) / 2);
            for i in 0..m {
                for j in 0..=i {
                    values.triangles[at] = T::from_f64(h(i, j));
                    at += 1;
                }
            }
            let first = |k: usize| group.dims[..k].iter().sum::<usize>();
            for (x, &i) in nodes.iter().enumerate() {
                for (y, &j) in nodes.iter().enumerate() {
                    let (r, c) = (first(x), first(y));
                    match (group.dims[x], group.dims[y]) {
                        (3, 3) => {
                            let block =
                                std::array::from_fn(|a| std::array::from_fn(|b| h(r + a, c + b)));
                            let slot = put.points.stat.pattern().slot(i, j).expect("in it");
                            put.points.stat.add_block(slot as usize, &block, 1.0);
                            if i == j {
                                let values = free.values_mut(g);
                                SharedValues::new(values.blocks).add_block(i as usize, &block, 1.0);
                            }
                        }
                        (1, 3) => {
                            let slot = border.point_slot(i, j).expect("in it") as usize;
                            for k in 0..3 {
                                put.values_mut().1[3 * slot + k] += T::from_f64(h(r, c + k));
                                if owners[i as usize] == j {
                                    free.values_mut(g).coupling[3 * i as usize + k] +=
                                        T::from_f64(h(r, c + k));
                                }
                            }
                        }
                        (1, 1) => {
                            let slot = border.scalar_slot(i, j).expect("in it") as usize;
                            put.values_mut().2[slot] += T::from_f64(h(r, c));
                            let own = free.values_mut(g);
                            if owners[i as usize] == owners[j as usize] {
                                let slot = own.border.scalar_slot(i, j).expect("own");
                                own.scalars[slot as usize] += T::from_f64(h(r, c));
                            }
                        }
                        _ => {}
                    }
                }
            }
        }
    }
    (free, put)
}

fn product<T: Real>(a: &dyn LinearOperator<T>, x: &[T]) -> Vec<f64> {
    let mut y = vec![T::ZERO; x.len()];
    a.apply(x, &mut y);
    y.into_iter().map(T::to_f64).collect()
}

/// The product of the sum, to rounding.
#[rstest]
#[case(3, 1)]
#[case(700, 1500)]
fn the_same_product(#[case] points: usize, #[case] count: usize) {
    let points = points.max(8);
    let (free, put) = both::<f64>(points, count);
    let x = Random(5).vector(5 * points);
    assert!(relative(&product(&free, &x), &product(&put, &x)) < 1e-12);
    let (free, put) = both::<f32>(points, count);
    let x: Vec<f32> = x.iter().map(|&x| x as f32).collect();
    assert!(relative(&product(&free, &x), &product(&put, &x)) < 1e-6);
}

/// The same bits for any number of threads.
#[test]
fn threads_do_not_matter() {
    let (free, _) = both::<f32>(3000, 9000);
    let x: Vec<f32> = Random(5).vector(15_000).iter().map(|&x| x as f32).collect();
    let of = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("pool").install(|| product(&free, &x))
    };
    let one = of(1);
    assert!(one.iter().any(|y| *y != 0.0));
    assert!(one == of(2) && one == of(4));
}

/// What preconditioners and direct solvers read is that of the sum.
#[test]
fn the_same_solves() {
    let points = 60;
    let (free, put) = both::<f64>(points, 150);
    let b = Random(9).vector(5 * points);
    let mut filter = BlockFilter::new();
    filter.fix(3, [0.0; 3]).expect("finite");
    filter.fix_scalar((3 * points + 40) as u32);
    for name in ["none", "diagonal", "block-jacobi", "node-jacobi"] {
        let solve = |a: &dyn ExplicitOperator<f64>| {
            let settings = MpcgSettings {
                tolerance: 1e-11,
                max_iterations: 3000,
                ..MpcgSettings::default()
            };
            let mut x = vec![0.0; b.len()];
            let report = Mpcg::new(preconditioner_by_name(name).expect("valid"), settings)
                .solve(a, &b, &filter, &mut x)
                .expect("solvable");
            assert!(report.converged(), "{name}: {report:?}");
            (x, report.iterations)
        };
        let ((x, m), (y, n)) = (solve(&free), solve(&put));
        assert!(relative(&x, &y) < 1e-8, "{name}");
        assert!(m.abs_diff(n) <= 2 + n / 50, "{name}: {m} and {n}");
    }
    let (mut x, mut y) = (vec![0.0; b.len()], vec![0.0; b.len()]);
    let mut direct = Direct::default();
    direct.solve(&free, &b, &filter, &mut x).expect("definite");
    direct.solve(&put, &b, &filter, &mut y).expect("definite");
    assert!(relative(&x, &y) < 1e-9);
}
