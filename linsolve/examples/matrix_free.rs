//! An operator that stores no matrix: the discrete Laplacian of a ring.

use selvedge_linsolve::{
    LinearOperator, LinsolveError, Mpcg, MpcgSettings, NoFilter, NoPreconditioner,
};

/// `y_i = (2 + m) x_i − x_{i−1} − x_{i+1}`, indices around the ring.
struct Ring {
    n: usize,
    mass: f64,
}

impl LinearOperator<f64> for Ring {
    fn dim(&self) -> usize {
        self.n
    }

    fn apply(&self, x: &[f64], y: &mut [f64]) {
        for i in 0..self.n {
            let (before, after) = (x[(i + self.n - 1) % self.n], x[(i + 1) % self.n]);
            y[i] = (2.0 + self.mass) * x[i] - before - after;
        }
    }
}

fn main() -> Result<(), LinsolveError> {
    let ring = Ring { n: 300, mass: 0.01 };
    // a wave is an eigenvector: the answer is known
    let angle = |i: usize| 2.0 * std::f64::consts::PI * 7.0 * i as f64 / 300.0;
    let eigenvalue = 2.0 + ring.mass - 2.0 * angle(1).cos();
    let mut b: Vec<f64> = (0..ring.n).map(|i| angle(i).cos()).collect();
    b[0] += 1.0; // and a point load, which is not one
    let settings = MpcgSettings {
        tolerance: 1e-12,
        ..MpcgSettings::default()
    };
    let mut solver = Mpcg::new(Box::new(NoPreconditioner), settings);
    let mut x = vec![0.0; ring.n];
    let report = solver.solve_operator(&ring, &b, &NoFilter, &mut x)?;
    // the point load decays as λ^i with λ + 1/λ = 2 + m
    let c = 2.0 + ring.mass;
    let lambda = 0.5 * (c - (c * c - 4.0).sqrt());
    let peak = 1.0 / (1.0 / lambda - lambda) * (1.0 + lambda.powi(300)) / (1.0 - lambda.powi(300));
    let expected = 1.0 / eigenvalue + peak;
    println!(
        "{} iterations, x_0 = {:.12}, exact {expected:.12}",
        report.iterations, x[0]
    );
    assert!(report.converged());
    assert!((x[0] / expected - 1.0).abs() < 1e-10);
    Ok(())
}
