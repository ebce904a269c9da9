//! One system, every solver and preconditioner by name, static and contact part.

use selvedge_linsolve::{
    Bsr, DualMatrix, LinsolveError, MpcgSettings, NoFilter, PRECONDITIONERS, Pattern, SOLVERS,
    preconditioner_by_name, solver_by_name,
};
use std::sync::Arc;

fn main() -> Result<(), LinsolveError> {
    // two strips of 40 points, held together by contacts between them
    let n = 80;
    let links: Vec<[u32; 2]> = (1..n).filter(|&i| i != 40).map(|i| [i - 1, i]).collect();
    let pattern = Arc::new(Pattern::from_groups(
        n as usize,
        links.iter().map(|l| &l[..]),
    ));
    let mut stat = Bsr::<f64>::zeros(Arc::clone(&pattern));
    let k = [[40.0, 3.0, 0.0], [3.0, 9.0, 1.0], [0.0, 1.0, 1.0]];
    for i in 0..n as usize {
        stat.add_diagonal(i, 0.01);
    }
    for &[i, j] in &links {
        for (r, c, sign) in [(i, i, 1.0), (j, j, 1.0), (i, j, -1.0), (j, i, -1.0)] {
            if let Some(slot) = pattern.slot(r, c) {
                stat.add_block(slot as usize, &k, sign);
            }
        }
    }
    let mut a = DualMatrix::new(stat);
    let nodes: Vec<[u32; 4]> = (0..39).map(|i| [i, i + 1, i + 40, i + 41]).collect();
    let weights = vec![[0.5, 0.5, -0.4, -0.6]; nodes.len()];
    let blocks = vec![[[0.0; 3], [0.0; 3], [0.0, 0.0, 25.0]]; nodes.len()];
    a.dynamic
        .rebuild(n as usize, &nodes, &weights, &blocks, 1.0);

    let b: Vec<f64> = (0..3 * n).map(|u| f64::from(u % 7) - 3.0).collect();
    let mut first: Option<Vec<f64>> = None;
    for solver in SOLVERS {
        for preconditioner in PRECONDITIONERS {
            let settings = MpcgSettings {
                tolerance: 1e-10,
                max_iterations: 2000,
                ..MpcgSettings::default()
            };
            let mut s = solver_by_name(solver, preconditioner, settings)?;
            let mut x = vec![0.0; b.len()];
            let report = s.solve(&a, &b, &NoFilter, &mut x)?;
            println!(
                "{solver:>8} {preconditioner:>13}: {:4} iterations, {:.1e}",
                report.iterations, report.relative_residual
            );
            assert!(report.converged());
            let reference = first.get_or_insert_with(|| x.clone());
            let size = reference.iter().fold(0.0f64, |m, v| m.max(v.abs()));
            assert!(
                x.iter()
                    .zip(reference)
                    .all(|(x, y)| (x - *y).abs() < 1e-6 * size)
            );
        }
    }
    // a typing mistake names the choices
    if let Err(e) = preconditioner_by_name::<f64>("block-jakobi") {
        println!("{e}");
    }
    Ok(())
}
