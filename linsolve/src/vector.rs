//! Vector kernels whose results do not depend on the number of threads.
//!
//! Vectors are cut into chunks of a fixed length; chunk results are added in a
//! fixed binary tree. The tree is walked by one thread or by several, the
//! additions are the same.

use crate::Real;

/// Elements of a leaf. 4096 f32 of five vectors fit a 128 KiB share of L2.
pub(crate) const CHUNK: usize = 4096;
/// Elements below which starting tasks costs more than it gains.
pub(crate) const SERIAL: usize = 24_576;

/// Something that can be cut at a multiple of the chunk length.
pub(crate) trait Cut: Sized + Send {
    fn len(&self) -> usize;
    fn cut(self, at: usize) -> (Self, Self);
}

impl<T: Sync> Cut for &[T] {
    fn len(&self) -> usize {
        <[T]>::len(self)
    }
    fn cut(self, at: usize) -> (Self, Self) {
        self.split_at(at)
    }
}

impl<T: Send> Cut for &mut [T] {
    fn len(&self) -> usize {
        <[T]>::len(self)
    }
    fn cut(self, at: usize) -> (Self, Self) {
        self.split_at_mut(at)
    }
}

/// Index of the first element of the piece, for kernels that read neighbours.
pub(crate) struct From(pub usize, pub usize);

impl Cut for From {
    fn len(&self) -> usize {
        self.1
    }
    fn cut(self, at: usize) -> (Self, Self) {
        (From(self.0, at), From(self.0 + at, self.1 - at))
    }
}

macro_rules! cut_tuple {
    ($($v:ident)+) => {
        impl<$($v: Cut),+> Cut for ($($v,)+) {
            fn len(&self) -> usize {
                self.0.len()
            }
            #[allow(non_snake_case)]
            fn cut(self, at: usize) -> (Self, Self) {
                let ($($v,)+) = self;
                $(let $v = $v.cut(at);)+
                (($($v.0,)+), ($($v.1,)+))
            }
        }
    };
}
cut_tuple!(A B);
cut_tuple!(A B C);
cut_tuple!(A B C D);
cut_tuple!(A B C D E);
cut_tuple!(A B C D E F);

/// Sums `leaf` over the chunks of `data` in a fixed tree.
pub(crate) fn tree<S, const K: usize>(
    data: S,
    chunk: usize,
    serial: usize,
    leaf: &(impl Fn(S) -> [f64; K] + Sync),
) -> [f64; K]
where
    S: Cut,
{
    let n = data.len();
    if n <= chunk {
        return leaf(data);
    }
    // the larger half first, always a whole number of chunks
    let (left, right) = data.cut(n.div_ceil(chunk).div_ceil(2) * chunk);
    let (a, b) = if n <= serial {
        (
            tree(left, chunk, serial, leaf),
            tree(right, chunk, serial, leaf),
        )
    } else {
        rayon::join(
            || tree(left, chunk, serial, leaf),
            || tree(right, chunk, serial, leaf),
        )
    };
    std::array::from_fn(|k| a[k] + b[k])
}

/// Precision in which scalar products and norms are added up.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Sums {
    /// In `f64`.
    #[default]
    Double,
    /// In the precision of the vectors, over pieces of a few thousand entries;
    /// what the pieces give is added in `f64`.
    OfVectors,
}

/// Adds `term(k)` for `k < n` in eight interleaved partial sums of precision `A`.
#[inline(always)]
pub(crate) fn lanes<A: Real>(n: usize, term: impl Fn(usize) -> A) -> f64 {
    let mut s = [A::ZERO; 8];
    let whole = n - n % 8;
    let mut k = 0;
    while k < whole {
        for l in 0..8 {
            s[l] += term(k + l);
        }
        k += 8;
    }
    let mut tail = A::ZERO;
    for k in whole..n {
        tail += term(k);
    }
    (((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7])) + tail).to_f64()
}

/// `a` in the precision of sums. A value that goes from single to double and
/// back is left alone by the compiler.
#[inline(always)]
pub(crate) fn to<A: Real, T: Real>(a: T) -> A {
    A::from_f64(a.to_f64())
}

/// Scalar product of one piece, in sums of precision `A`.
#[inline(always)]
pub(crate) fn piece_dot<A: Real, T: Real>(x: &[T], y: &[T]) -> f64 {
    let n = x.len().min(y.len());
    let (x, y) = (&x[..n], &y[..n]);
    lanes(n, |k| to::<A, T>(x[k]) * to::<A, T>(y[k]))
}

/// `x · y`, accumulated in `f64`.
///
/// # Panics
/// If the lengths differ.
pub fn dot<T: Real>(x: &[T], y: &[T]) -> f64 {
    dot_in::<f64, T>(x, y)
}

/// `x · y` in sums of precision `A`.
pub(crate) fn dot_in<A: Real, T: Real>(x: &[T], y: &[T]) -> f64 {
    assert_eq!(x.len(), y.len(), "dot product of unequal lengths");
    tree((x, y), CHUNK, SERIAL, &|(x, y): (&[T], &[T])| {
        [piece_dot::<A, T>(x, y)]
    })[0]
}

/// Euclidean norm, accumulated in `f64`.
pub fn norm<T: Real>(x: &[T]) -> f64 {
    dot(x, x).sqrt()
}

/// `y += a x`.
///
/// # Panics
/// If the lengths differ.
pub fn axpy<T: Real>(a: T, x: &[T], y: &mut [T]) {
    assert_eq!(x.len(), y.len(), "axpy of unequal lengths");
    tree((x, y), CHUNK, SERIAL, &|(x, y): (&[T], &mut [T])| {
        for (y, &x) in y.iter_mut().zip(x) {
            *y = a.fma(x, *y);
        }
        []
    });
}

/// `y = x + a y`.
///
/// # Panics
/// If the lengths differ.
pub fn xpay<T: Real>(x: &[T], a: T, y: &mut [T]) {
    assert_eq!(x.len(), y.len(), "xpay of unequal lengths");
    tree((x, y), CHUNK, SERIAL, &|(x, y): (&[T], &mut [T])| {
        for (y, &x) in y.iter_mut().zip(x) {
            *y = a.fma(*y, x);
        }
        []
    });
}

/// `x += a p`, `r −= a q`, and returns `r · r`: three vectors read once.
pub(crate) fn step<A: Real, T: Real>(a: T, p: &[T], q: &[T], x: &mut [T], r: &mut [T]) -> f64 {
    tree((p, q, x, r), CHUNK, SERIAL, &|(p, q, x, r): (
        &[T],
        &[T],
        &mut [T],
        &mut [T],
    )| {
        for (x, &p) in x.iter_mut().zip(p) {
            *x = a.fma(p, *x);
        }
        for (r, &q) in r.iter_mut().zip(q) {
            *r = (-a).fma(q, *r);
        }
        [piece_dot::<A, T>(r, r)]
    })[0]
}

/// `y = a x` with a change of precision.
pub(crate) fn convert<A: Real, B: Real>(scale: f64, x: &[A], y: &mut [B]) {
    tree((x, y), CHUNK, SERIAL, &|(x, y): (&[A], &mut [B])| {
        for (y, &x) in y.iter_mut().zip(x) {
            *y = B::from_f64(scale * x.to_f64());
        }
        []
    });
}
