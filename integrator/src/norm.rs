use rayon::prelude::*;

use crate::ResidualNorm;

/// Points a parallel reduction takes at once; fixed, so that sums do not
/// depend on the number of threads.
const CHUNK: usize = 4096;

/// The point with the largest velocity error `|f_i| / m_i`, and that [m/s]; the
/// first of equals.
pub(crate) fn worst_point(f: &[f64], masses: &[f64]) -> (usize, f64) {
    let (f, _) = f.as_chunks::<3>();
    let mut worst = (0, 0.0);
    for (i, (f, m)) in f.iter().zip(masses).enumerate() {
        let error = (f[0] * f[0] + f[1] * f[1] + f[2] * f[2]).sqrt() / m;
        // NaN is the worst of all.
        if error > worst.1 || error.is_nan() {
            worst = (i, error);
        }
    }
    worst
}

/// Norm of a residual [N·s]: m/s for the mass norm, N·s as printed.
///
/// Scalars count like the other components: `scalars` holds their masses.
pub(crate) fn residual_norm(norm: ResidualNorm, f: &[f64], masses: &[f64], scalars: &[f64]) -> f64 {
    let (f, of_scalars) = f.split_at(3 * masses.len());
    let (f, _) = f.as_chunks::<3>();
    let square = |f: &[f64; 3]| f[0] * f[0] + f[1] * f[1] + f[2] * f[2];
    let partial: Vec<[f64; 2]> = f
        .par_chunks(CHUNK)
        .zip(masses.par_chunks(CHUNK))
        .map(|(f, m)| {
            let mut sum = [0.0; 2];
            for (f, m) in f.iter().zip(m) {
                match norm {
                    ResidualNorm::Mass => sum[0] += square(f) / m,
                    ResidualNorm::Paper => sum[0] += square(f),
                }
                sum[1] += m;
            }
            sum
        })
        .collect();
    let rest: Vec<[f64; 2]> = of_scalars
        .par_chunks(CHUNK)
        .zip(scalars.par_chunks(CHUNK))
        .map(|(f, m)| {
            let squares = f.iter().zip(m);
            match norm {
                ResidualNorm::Mass => [squares.map(|(f, m)| f * f / m).sum(), 0.0],
                ResidualNorm::Paper => [squares.map(|(f, _)| f * f).sum(), 0.0],
            }
        })
        .collect();
    let (mut sum, mut mass) = (0.0, 0.0);
    for [s, m] in partial.into_iter().chain(rest) {
        sum += s;
        mass += m;
    }
    match norm {
        ResidualNorm::Mass if mass > 0.0 => (sum / mass).sqrt(),
        _ => sum.sqrt(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A light point beside a heavy one is hidden by the norm, not by the worst.
    #[test]
    fn a_light_point_is_seen() {
        let (f, masses) = ([1e-9, 0.0, 0.0, 1e-8, 0.0, 0.0], [1e-3, 1e-9]);
        assert!(residual_norm(ResidualNorm::Mass, &f, &masses, &[]) < 1e-2);
        assert_eq!(worst_point(&f, &masses).0, 1);
        assert!((worst_point(&f, &masses).1 - 10.0).abs() < 1e-12);
        assert!(worst_point(&[f64::NAN, 0.0, 0.0], &[1.0]).1.is_nan());
    }
}
