//! Poisson's equation on the unit square: three independent components of one
//! block system, compared with the exact solution.

use selvedge_linsolve::{
    Bsr, LinearSolver, LinsolveError, MpcgSettings, NoFilter, PRECONDITIONERS, Pattern,
    solver_by_name,
};
use std::sync::Arc;

fn main() -> Result<(), LinsolveError> {
    let n = 63; // inner points on a side
    let h = 1.0 / (n + 1) as f64;
    let at = |i: usize, j: usize| (j * n + i) as u32;
    let mut edges = Vec::new();
    for j in 0..n {
        for i in 0..n {
            if i + 1 < n {
                edges.push([at(i, j), at(i + 1, j)]);
            }
            if j + 1 < n {
                edges.push([at(i, j), at(i, j + 1)]);
            }
        }
    }
    let pattern = Arc::new(Pattern::from_groups(n * n, edges.iter().map(|e| &e[..])));
    let mut a = Bsr::<f64>::zeros(Arc::clone(&pattern));
    let one = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for i in 0..n * n {
        a.add_diagonal(i, 4.0);
        for slot in pattern.row(i) {
            if slot != pattern.diagonal_slot(i) as usize {
                a.add_block(slot, &one, -1.0);
            }
        }
    }
    // −Δu = f with u = k x(1 − x) y(1 − y), k = 1, 2, 3 in the three components;
    // second differences of it are exact
    let exact = |p: usize, k: usize| {
        let (x, y) = ((p % n + 1) as f64 * h, (p / n + 1) as f64 * h);
        (k + 1) as f64 * x * (1.0 - x) * y * (1.0 - y)
    };
    let b: Vec<f64> = (0..3 * n * n)
        .map(|u| {
            let (x, y) = ((u / 3 % n + 1) as f64 * h, (u / 3 / n + 1) as f64 * h);
            (u % 3 + 1) as f64 * 2.0 * h * h * (x * (1.0 - x) + y * (1.0 - y))
        })
        .collect();
    println!("{} unknowns, {} blocks", b.len(), pattern.block_count());
    for name in PRECONDITIONERS {
        let settings = MpcgSettings {
            tolerance: 1e-10,
            ..MpcgSettings::default()
        };
        let mut solver: Box<dyn LinearSolver<f64>> = solver_by_name("cg", name, settings)?;
        let mut x = vec![0.0; b.len()];
        let report = solver.solve(&a, &b, &NoFilter, &mut x)?;
        let error = (0..x.len()).fold(0.0f64, |m, u| m.max((x[u] - exact(u / 3, u % 3)).abs()));
        println!(
            "{name:>13}: {:3} iterations, largest error {error:.2e}",
            report.iterations
        );
        assert!(report.converged());
        assert!(error < 1e-8);
    }
    Ok(())
}
