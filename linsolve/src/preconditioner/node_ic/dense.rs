//! Kernels of small dense blocks, column by column, sizes known or not.

use crate::Real;

/// `c −= a bᵀ` with `a` of `m × k`, `b` of `n × k`.
#[inline]
pub(super) fn subtract_product<T: Real>(
    c: &mut [f64],
    a: &[f64],
    b: &[T],
    (m, n, k): (usize, usize, usize),
) {
    match (m, n, k) {
        (3, 3, 3) => sized_product::<T, 3, 3, 3>(c, a, b),
        (4, 4, 4) => sized_product::<T, 4, 4, 4>(c, a, b),
        (5, 5, 5) => sized_product::<T, 5, 5, 5>(c, a, b),
        (6, 6, 6) => sized_product::<T, 6, 6, 6>(c, a, b),
        _ => {
            for (a, b) in a.chunks_exact(m).zip(b.chunks_exact(n)) {
                for (c, &b) in c.chunks_exact_mut(m).zip(b) {
                    for (c, &a) in c.iter_mut().zip(a) {
                        *c = Real::fma(-a, b.to_f64(), *c);
                    }
                }
            }
        }
    }
}

#[inline(always)]
fn sized_product<T: Real, const M: usize, const N: usize, const K: usize>(
    c: &mut [f64],
    a: &[f64],
    b: &[T],
) {
    let c = &mut c.as_chunks_mut::<M>().0[..N];
    let (a, b) = (&a.as_chunks::<M>().0[..K], &b.as_chunks::<N>().0[..K]);
    // widened together, not number by number
    let b: [[f64; N]; K] = std::array::from_fn(|k| b[k].map(T::to_f64));
    for c_of in 0..N {
        let mut sum = c[c_of];
        for k in 0..K {
            for r in 0..M {
                sum[r] = Real::fma(-a[k][r], b[k][c_of], sum[r]);
            }
        }
        c[c_of] = sum;
    }
}

/// `s ← s L⁻ᵀ` for `s` of `m × n` from the packed inverse of `L`.
pub(super) fn right_solve<T: Real>(s: &mut [f64], inverse: &[T], m: usize, n: usize) {
    match m {
        3 => sized_solve::<T, 3>(s, inverse, n),
        4 => sized_solve::<T, 4>(s, inverse, n),
        5 => sized_solve::<T, 5>(s, inverse, n),
        6 => sized_solve::<T, 6>(s, inverse, n),
        _ => {
            for c in (0..n).rev() {
                let row = &inverse[c * (c + 1) / 2..][..=c];
                let (before, own) = s.split_at_mut(c * m);
                for r in 0..m {
                    let mut sum = row[c].to_f64() * own[r];
                    for k in 0..c {
                        sum = Real::fma(row[k].to_f64(), before[k * m + r], sum);
                    }
                    own[r] = sum;
                }
            }
        }
    }
}

#[inline(always)]
fn sized_solve<T: Real, const M: usize>(s: &mut [f64], inverse: &[T], n: usize) {
    let s = &mut s.as_chunks_mut::<M>().0[..n];
    for c in (0..n).rev() {
        let row = &inverse[c * (c + 1) / 2..][..=c];
        let own = row[c].to_f64();
        let mut sum = s[c].map(|v| own * v);
        for (l, s) in row.iter().zip(&s[..c]) {
            let l = l.to_f64();
            for r in 0..M {
                sum[r] = Real::fma(l, s[r], sum[r]);
            }
        }
        s[c] = sum;
    }
}

/// Factor `L` of the lower triangle of `d`, in place, and its inverse by rows;
/// false when a pivot is not above `1e-12` of its `scale`.
pub(super) fn factorise(d: &mut [f64], n: usize, scale: &[f64], inverse: &mut [f64]) -> bool {
    for i in 0..n {
        for j in 0..=i {
            let mut rest = d[j * n + i];
            for k in 0..j {
                rest -= d[k * n + i] * d[k * n + j];
            }
            if i > j {
                d[j * n + i] = rest / d[j * n + j];
            } else if rest > 1e-12 * scale[i] && rest.is_finite() {
                d[i * n + i] = rest.sqrt();
            } else {
                return false;
            }
        }
    }
    for i in 0..n {
        let own = 1.0 / d[i * n + i];
        for j in 0..i {
            let mut sum = 0.0;
            for k in j..i {
                sum += d[k * n + i] * inverse[k * (k + 1) / 2 + j];
            }
            inverse[i * (i + 1) / 2 + j] = -sum * own;
        }
        inverse[i * (i + 1) / 2 + i] = own;
    }
    true
}

/// `y ← L⁻¹ y` from the packed inverse, for up to any size.
#[inline(always)]
pub(super) fn lower_times<T: Real>(inverse: &[T], y: &mut [T]) {
    for i in (0..y.len()).rev() {
        let row = &inverse[i * (i + 1) / 2..][..=i];
        let mut sum = T::ZERO;
        for (l, y) in row.iter().zip(&*y) {
            sum = l.fma(*y, sum);
        }
        y[i] = sum;
    }
}

/// `y ← L⁻ᵀ y`.
#[inline(always)]
pub(super) fn upper_times<T: Real>(inverse: &[T], y: &mut [T]) {
    let n = y.len();
    for i in 0..n {
        let mut sum = T::ZERO;
        for k in i..n {
            sum = inverse[k * (k + 1) / 2 + i].fma(y[k], sum);
        }
        y[i] = sum;
    }
}

/// `y −= a x` for `a` of `m × n`.
#[inline(always)]
pub(super) fn subtract_times<T: Real>(a: &[T], x: &[T], y: &mut [T]) {
    match (y.len(), x.len()) {
        (3, 3) => sized_times::<T, 3, 3>(a, x, y),
        (4, 4) => sized_times::<T, 4, 4>(a, x, y),
        (5, 5) => sized_times::<T, 5, 5>(a, x, y),
        (6, 6) => sized_times::<T, 6, 6>(a, x, y),
        (m, _) => {
            for (a, &x) in a.chunks_exact(m).zip(x) {
                for (y, &a) in y.iter_mut().zip(a) {
                    *y = (-a).fma(x, *y);
                }
            }
        }
    }
}

#[inline(always)]
fn sized_times<T: Real, const M: usize, const N: usize>(a: &[T], x: &[T], y: &mut [T]) {
    let (a, y) = (&a.as_chunks::<M>().0[..N], &mut y[..M]);
    let mut sum: [T; M] = std::array::from_fn(|r| y[r]);
    for c in 0..N {
        for r in 0..M {
            sum[r] = (-a[c][r]).fma(x[c], sum[r]);
        }
    }
    y.copy_from_slice(&sum);
}

/// `y −= aᵀ x` for `a` of `m × n`.
#[inline(always)]
pub(super) fn subtract_transposed<T: Real>(a: &[T], x: &[T], y: &mut [T]) {
    match (x.len(), y.len()) {
        (3, 3) => sized_transposed::<T, 3, 3>(a, x, y),
        (4, 4) => sized_transposed::<T, 4, 4>(a, x, y),
        (5, 5) => sized_transposed::<T, 5, 5>(a, x, y),
        (6, 6) => sized_transposed::<T, 6, 6>(a, x, y),
        (m, _) => {
            for (a, y) in a.chunks_exact(m).zip(y) {
                for (&a, &x) in a.iter().zip(x) {
                    *y = (-a).fma(x, *y);
                }
            }
        }
    }
}

#[inline(always)]
fn sized_transposed<T: Real, const M: usize, const N: usize>(a: &[T], x: &[T], y: &mut [T]) {
    let (a, x) = (&a.as_chunks::<M>().0[..N], &x[..M]);
    for c in 0..N {
        let mut sum = y[c];
        for r in 0..M {
            sum = (-a[c][r]).fma(x[r], sum);
        }
        y[c] = sum;
    }
}
