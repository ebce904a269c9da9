//! Angle of a direction in the plane.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use crate::lanes::Lanes;

/// `tan(π/8)`
const FOLD: f64 = 0.414_213_562_373_095_05;
/// What `π/4` in double precision is short of `π/4`.
const REST: f64 = 3.061_616_997_868_383e-17;

/// Coefficients of `P` and `Q`, the highest power first.
const P: [f64; 5] = [
    -8.750_608_600_031_904e-1,
    -1.615_753_718_733_365e1,
    -7.500_855_792_314_705e1,
    -1.228_866_684_490_136_2e2,
    -6.485_021_904_942_025e1,
];
const Q: [f64; 5] = [
    2.485_846_490_142_306_3e1,
    1.650_270_098_316_988_5e2,
    4.328_810_604_912_903e2,
    4.853_903_996_359_137e2,
    1.945_506_571_482_614e2,
];

/// `atan2(y, x)` within 3 units in the last place, for finite arguments not
/// both zero (zero for those); with the same bits on every machine.
///
/// `t = |y|/|x|` or its inverse is folded to `|z| ≤ tan(π/8)` by
/// `atan t = π/4 + atan((t − 1)/(t + 1))`; there `atan z = z + z³ P(z²)/Q(z²)`
/// with the coefficients of Moshier's Cephes library. Unlike the library's
/// function it takes four angles at a time and does not ask for the sign of
/// a zero.
#[inline(always)]
pub(super) fn arctangent<S: Lanes>(y: S, x: S) -> S {
    let s = S::splat;
    let (b, a) = (y.abs(), x.abs());
    let n = b.greater(a, a, b);
    let d = b.greater(a, b, a);
    let d = d.greater(s(0.0), d, d + s(f64::MIN_POSITIVE));
    let limit = s(FOLD) * d;
    let z = n.greater(limit, n - d, n) / n.greater(limit, n + d, d);
    let z2 = z * z;
    let p = P[1..].iter().fold(s(P[0]), |p, c| p * z2 + s(*c));
    let q = Q.iter().fold(s(1.0), |q, c| q * z2 + s(*c));
    let r = z + z * (z2 * p / q);
    let r = n.greater(limit, s(FRAC_PI_4) + (r + s(REST)), r);
    let r = b.greater(a, s(FRAC_PI_2) - (r - s(2.0 * REST)), r);
    let r = s(0.0).greater(x, s(PI) - (r - s(4.0 * REST)), r);
    r.signed_as(y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use wide::f64x4;

    #[test]
    fn the_library_agrees() {
        let mut worst = 0.0f64;
        for k in 0..200_000 {
            let turn = PI * (f64::from(k) / 100_000.0 - 1.0);
            for size in [1e-150, 1e-9, 1.0, 3e7, 1e150] {
                let (y, x) = (size * turn.sin(), size * turn.cos());
                let exact = y.atan2(x);
                let units = (arctangent(y, x) - exact).abs() / (exact.abs() * f64::EPSILON);
                worst = worst.max(units);
            }
        }
        assert!(worst < 3.0, "{worst} units in the last place");
    }

    #[test]
    fn small_angles_keep_their_digits() {
        for k in -300..0 {
            let y = 1.37 * 10f64.powi(k);
            let error = (arctangent(y, 0.9) - y.atan2(0.9)).abs();
            assert!(error <= 3.0 * f64::EPSILON * y, "{y:e}: {error:e}");
        }
    }

    #[test]
    fn axes_and_not_a_number() {
        for (y, x) in [(0.0, 1.0), (0.0, -1.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 0.0)] {
            let (ours, theirs) = (arctangent(y, x), y.atan2(x));
            assert!((ours - theirs).abs() <= 4e-16, "{y} {x}: {ours} {theirs}");
        }
        assert!(arctangent(f64::NAN, 1.0).is_nan() && arctangent(1.0, f64::NAN).is_nan());
    }

    #[test]
    fn four_at_a_time_are_the_same_bits() {
        let points = [(0.3, -0.2), (-1e-9, 0.7), (2.0, 1.9), (-0.4, -5.0)];
        let y = f64x4::new(points.map(|p| p.0));
        let x = f64x4::new(points.map(|p| p.1));
        assert_eq!(
            arctangent(y, x).to_array(),
            points.map(|(y, x)| arctangent(y, x))
        );
    }
}
