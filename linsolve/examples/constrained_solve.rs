//! A chain of masses with a prescribed end, a point on a plane and one on a line.

use selvedge_linsolve::{BlockFilter, Bsr, Direct, LinearSolver, LinsolveError, Mpcg, Pattern};
use std::sync::Arc;

fn main() -> Result<(), LinsolveError> {
    let n = 20;
    let links: Vec<[u32; 2]> = (1..n as u32).map(|i| [i - 1, i]).collect();
    let pattern = Arc::new(Pattern::from_groups(n, links.iter().map(|l| &l[..])));
    let mut a = Bsr::<f64>::zeros(Arc::clone(&pattern));
    let k = [[9.0, 1.0, 0.0], [1.0, 4.0, 0.5], [0.0, 0.5, 2.0]];
    for i in 0..n {
        a.add_diagonal(i, 0.1);
    }
    for &[i, j] in &links {
        for (r, c, sign) in [(i, i, 1.0), (j, j, 1.0), (i, j, -1.0), (j, i, -1.0)] {
            if let Some(slot) = pattern.slot(r, c) {
                a.add_block(slot as usize, &k, sign);
            }
        }
    }
    let b: Vec<f64> = (0..3 * n)
        .map(|u| if u % 3 == 1 { -0.01 } else { 0.0 })
        .collect();

    let mut filter = BlockFilter::new();
    filter.fix(0, [0.5, 0.0, 0.0])?; // moved end
    filter.constrain(9, [0.0, 3.0, 4.0], 0.02)?; // on a moving plane
    filter.line(19, [1.0, 1.0, 0.0])?; // free along one direction
    // the plane again, elsewhere: a contradiction is reported, not hidden
    let violation = filter.constrain(9, [0.0, 0.6, 0.8], 0.05)?;
    println!("contradiction at point 9: {violation:.3}");
    assert!((violation - 0.03).abs() < 1e-12);

    let mut x = vec![0.0; b.len()];
    filter.prescribe(&mut x);
    let mut y = x.clone();
    let report = Mpcg::with_tolerance(1e-12).solve(&a, &b, &filter, &mut x)?;
    Direct::default().solve(&a, &b, &filter, &mut y)?;
    println!(
        "{} iterations, residual {:.1e}",
        report.iterations, report.relative_residual
    );
    let difference = x
        .iter()
        .zip(&y)
        .fold(0.0f64, |m, (x, y)| m.max((x - y).abs()));
    println!(
        "x_0 = {:?}, x_19 = {:.6?}, direct differs by {difference:.1e}",
        &x[..3],
        &x[57..]
    );
    assert_eq!(&x[..3], &[0.5, 0.0, 0.0]);
    assert!((0.6 * x[28] + 0.8 * x[29] - 0.02).abs() < 1e-14);
    assert!((x[57] - x[58]).abs() < 1e-14 && x[59].abs() < 1e-14);
    assert!(difference < 1e-10);
    Ok(())
}
