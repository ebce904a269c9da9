//! 3×3 helpers.

/// Row-major 3×3.
pub(crate) type M3 = [f64; 9];

/// Lower Cholesky factor of a symmetric block, `[l00, l10, l11, l20, l21, l22]`;
/// `None` when a pivot is not above `floor`.
pub(crate) fn cholesky(a: &M3, floor: f64) -> Option<[f64; 6]> {
    let root = |p: f64| (p > floor && p.is_finite()).then(|| p.sqrt());
    let l00 = root(a[0])?;
    let l10 = 0.5 * (a[3] + a[1]) / l00;
    let l11 = root(a[4] - l10 * l10)?;
    let l20 = 0.5 * (a[6] + a[2]) / l00;
    let l21 = (0.5 * (a[7] + a[5]) - l20 * l10) / l11;
    let l22 = root(a[8] - l20 * l20 - l21 * l21)?;
    Some([l00, l10, l11, l20, l21, l22])
}

/// Inverse of `L Lᵀ`, as xx, xy, xz, yy, yz, zz.
pub(crate) fn inverse(l: &[f64; 6]) -> [f64; 6] {
    let m = invert_lower(l);
    [
        m[0] * m[0] + m[1] * m[1] + m[3] * m[3],
        m[1] * m[2] + m[3] * m[4],
        m[3] * m[5],
        m[2] * m[2] + m[4] * m[4],
        m[4] * m[5],
        m[5] * m[5],
    ]
}

/// Inverse of a lower triangular block in the same packing.
pub(crate) fn invert_lower(l: &[f64; 6]) -> [f64; 6] {
    let (a, c, f) = (1.0 / l[0], 1.0 / l[2], 1.0 / l[5]);
    let b = -l[1] * a * c;
    let e = -l[4] * c * f;
    [a, b, c, -(l[3] * a + l[4] * b) * f, e, f]
}

/// `S A S + m (I − S)` of one diagonal block, `m` the mean of its diagonal.
pub(crate) fn filtered_diagonal(a: &M3, s: &M3, m: f64) -> M3 {
    let sas = product(&product(s, a), s);
    std::array::from_fn(|k| {
        let one = f64::from(u8::from(k % 4 == 0));
        sas[k] + m * (one - s[k])
    })
}

pub(crate) fn product(a: &M3, b: &M3) -> M3 {
    std::array::from_fn(|k| {
        let (r, c) = (k / 3, k % 3);
        a[3 * r] * b[c] + a[3 * r + 1] * b[3 + c] + a[3 * r + 2] * b[6 + c]
    })
}

pub(crate) fn trace(a: &M3) -> f64 {
    a[0] + a[4] + a[8]
}
