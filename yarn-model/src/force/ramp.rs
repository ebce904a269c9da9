/// Factor by which the tangent stiffness of a jammed angle exceeds the free
/// one [Cirio2017: three orders of magnitude].
pub(crate) const JAM_FACTOR: f64 = 1000.0;

/// Jamming ramp `Q(x; w)` with its first two derivatives: convex, twice
/// continuously differentiable, zero for `x ≤ 0`.
///
/// ```text
/// t = x/w
/// Q   = w² (t⁴/4 − t⁵/10)        0 < x < w
///     = 0.15 w² + ½ w (x − w) + ½ (x − w)²        x ≥ w
/// Q'  = w (t³ − t⁴/2),   x − w/2
/// Q'' = 3 t² − 2 t³,     1
/// ```
/// `2 Q Q'' ≥ Q'²`, so that `√Q` is convex too.
#[inline(always)]
pub(crate) fn ramp(x: f64, width: f64) -> [f64; 3] {
    if x <= 0.0 {
        return [0.0; 3];
    }
    if x < width {
        let t = x / width;
        let t2 = t * t;
        let t3 = t2 * t;
        return [
            width * width * t2 * t2 * (0.25 - 0.1 * t),
            width * t3 * (1.0 - 0.5 * t),
            t2 * (3.0 - 2.0 * t),
        ];
    }
    let past = x - width;
    [
        0.15 * width * width + 0.5 * past * (width + past),
        x - 0.5 * width,
        1.0,
    ]
}

#[cfg(test)]
mod tests {
    use super::ramp;

    #[test]
    fn continuous_convex_and_consistent() {
        let w = 0.26;
        for i in -20..200 {
            let x = 0.01 * f64::from(i) + 0.003;
            let h = 1e-5;
            let [q, q1, q2] = ramp(x, w);
            let (plus, minus) = (ramp(x + h, w), ramp(x - h, w));
            assert!(((plus[0] - minus[0]) / (2.0 * h) - q1).abs() < 1e-8, "{x}");
            assert!(((plus[1] - minus[1]) / (2.0 * h) - q2).abs() < 1e-6, "{x}");
            assert!(q >= 0.0 && q1 >= 0.0 && q2 >= 0.0);
            assert!(2.0 * q * q2 >= q1 * q1 * (1.0 - 1e-12), "{x}");
        }
        for (a, b) in ramp(w * (1.0 - 1e-14), w).iter().zip(ramp(w, w)) {
            assert!((a - b).abs() < 1e-13);
        }
    }
}
