//! Planes through points.

use nalgebra::{DMatrix, Matrix3, Vector3};
use proptest::prelude::*;
use selvedge_yarn_model::plane_normal;

#[test]
fn planes_lines_and_points() {
    let square = [
        [0.0, 0.0, 1.0],
        [1.0, 0.0, 1.0],
        [1.0, 1.0, 1.0],
        [0.0, 1.0, 1.0],
    ];
    let n = plane_normal(&square).unwrap();
    assert_eq!(n.map(f64::abs), [0.0, 0.0, 1.0]);
    let line: Vec<_> = (0..5)
        .map(|k| [k as f64, 2.0 * k as f64, -0.3 * k as f64])
        .collect();
    assert_eq!(plane_normal(&line), None);
    assert_eq!(plane_normal(&[[1.0; 3]; 5]), None);
    assert_eq!(plane_normal(&[[f64::NAN; 3]; 5]), None);
    assert_eq!(plane_normal(&[]), None);
    // A sliver: 1:100, and turned.
    let (s, c) = 0.7_f64.sin_cos();
    let sliver = [[-1.0, 0.01], [-0.3, -0.02], [0.2, 0.02], [1.0, -0.01]];
    let sliver = sliver.map(|[x, y]: [f64; 2]| [c * x - s * s * y, s * x + c * s * y, c * y]);
    let n = plane_normal(&sliver).unwrap();
    for p in &sliver {
        let off: f64 = (0..3).map(|k| n[k] * (p[k] - sliver[0][k])).sum();
        assert!(off.abs() < 1e-13, "{off}");
    }
    // Millimetres far from the origin.
    let far = square.map(|p| p.map(|x| 1e-3 * x + 10.0));
    let n = plane_normal(&far).unwrap();
    assert!((n[2].abs() - 1.0).abs() < 1e-9);
}

/// Second moments of points about their mean.
fn moments_of(points: &[[f64; 3]], mean: Vector3<f64>) -> Matrix3<f64> {
    let about = points.iter().map(|p| Vector3::from(*p) - mean);
    about.map(|d| d * d.transpose()).sum()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    /// Against the singular vectors of an established library.
    #[test]
    fn least_singular_vector(
        points in prop::collection::vec([-1.0..1.0, -1.0..1.0, -0.5..0.5_f64], 4..8),
        scale in -4.0..3.0_f64,
    ) {
        let scale = 10.0_f64.powf(scale);
        let points: Vec<_> = points.iter().map(|p| p.map(|x| scale * x)).collect();
        let mean = points.iter().map(|p| Vector3::from(*p)).sum::<Vector3<f64>>()
            / points.len() as f64;
        let rows = DMatrix::from_fn(points.len(), 3, |i, j| points[i][j] - mean[j]);
        let svd = rows.svd(false, true);
        let v = svd.v_t.unwrap();
        let sigma = svd.singular_values;
        prop_assume!(sigma[1] - sigma[2] > 1e-2 * sigma[0]);
        let n = Vector3::from(plane_normal(&points).unwrap());
        let expected = v.row(2).transpose();
        prop_assert!((n.norm() - 1.0).abs() < 1e-14);
        // The library's singular vectors are good to eight digits where two of
        // the values are close; what makes a vector the least one is not theirs.
        prop_assert!(n.cross(&expected).norm() < 1e-6, "{n} {expected} {sigma}");
        let moments = moments_of(&points, mean);
        let trace = moments.trace();
        let least = n.dot(&(moments * n));
        let residual = (moments * n - n * least).norm() / trace;
        let gap = (sigma[1].powi(2) - sigma[2].powi(2)) / trace;
        prop_assert!(residual < 1e-13 + 1e-15 / gap.powi(2), "{residual:e} {gap:e}");
        prop_assert!(least < sigma[2].powi(2) + 1e-12 * trace, "{least} {sigma}");
    }
}
