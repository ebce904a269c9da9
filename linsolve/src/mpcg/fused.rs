//! Vector passes of the iteration, merged where the preconditioner allows; sums
//! are in precision `A`.

use crate::Real;
use crate::preconditioner::{Pointwise, block_times};
use crate::vector::{CHUNK, SERIAL, lanes, piece_dot, to, tree};

/// Points of a leaf.
const POINTS: usize = 1024;

/// `x += a c`, `r −= a q`, `z = P⁻¹ r` in one pass; returns `r·r` and `r·z`.
pub(super) fn advance<A: Real, T: Real>(
    p: Pointwise<'_, T>,
    a: T,
    c: &[T],
    q: &[T],
    x: &mut [T],
    r: &mut [T],
    z: &mut [T],
) -> [f64; 2] {
    match p {
        // z is not written: the caller reads r in its place
        Pointwise::Identity => {
            let rr = crate::vector::step::<A, T>(a, c, q, x, r);
            [rr, rr]
        }
        Pointwise::Diagonal(d) => scaled::<A, T>(d, a, c, q, x, r, z),
        Pointwise::Blocks(blocks, scalars) => {
            let cut = 3 * blocks.len();
            let ((c, cs), (q, qs)) = (c.split_at(cut), q.split_at(cut));
            let (x, xs) = x.split_at_mut(cut);
            let (r, rs) = r.split_at_mut(cut);
            let (z, zs) = z.split_at_mut(cut);
            let points = blockwise::<A, T>(blocks, a, c, q, x, r, z);
            if scalars.is_empty() {
                return points;
            }
            let rest = scaled::<A, T>(scalars, a, cs, qs, xs, rs, zs);
            [points[0] + rest[0], points[1] + rest[1]]
        }
    }
}

fn scaled<A: Real, T: Real>(
    d: &[T],
    a: T,
    c: &[T],
    q: &[T],
    x: &mut [T],
    r: &mut [T],
    z: &mut [T],
) -> [f64; 2] {
    type Piece<'a, T> = (
        &'a [T],
        &'a [T],
        &'a [T],
        &'a mut [T],
        &'a mut [T],
        &'a mut [T],
    );
    tree(
        (d, c, q, x, r, z),
        CHUNK,
        SERIAL,
        &|(d, c, q, x, r, z): Piece<'_, T>| {
            for (x, &c) in x.iter_mut().zip(c) {
                *x = a.fma(c, *x);
            }
            for ((r, &q), (z, &d)) in r.iter_mut().zip(q).zip(z.iter_mut().zip(d)) {
                *r = (-a).fma(q, *r);
                *z = d * *r;
            }
            sums::<A, T>(r, z)
        },
    )
}

fn blockwise<A: Real, T: Real>(
    d: &[[T; 6]],
    a: T,
    c: &[T],
    q: &[T],
    x: &mut [T],
    r: &mut [T],
    z: &mut [T],
) -> [f64; 2] {
    type Piece<'a, T> = (
        &'a [[T; 6]],
        &'a [[T; 3]],
        &'a [[T; 3]],
        &'a mut [[T; 3]],
        &'a mut [[T; 3]],
        &'a mut [[T; 3]],
    );
    let data = (
        d,
        c.as_chunks().0,
        q.as_chunks().0,
        x.as_chunks_mut().0,
        r.as_chunks_mut().0,
        z.as_chunks_mut().0,
    );
    tree(data, POINTS, SERIAL / 3, &|(d, c, q, x, r, z): Piece<
        '_,
        T,
    >| {
        let (x, c) = (x.as_flattened_mut(), c.as_flattened());
        for (x, &c) in x.iter_mut().zip(c) {
            *x = a.fma(c, *x);
        }
        for (r, &q) in r.as_flattened_mut().iter_mut().zip(q.as_flattened()) {
            *r = (-a).fma(q, *r);
        }
        for (z, (d, r)) in z.iter_mut().zip(d.iter().zip(r.iter())) {
            *z = block_times(d, r);
        }
        sums::<A, T>(r.as_flattened(), z.as_flattened())
    })
}

#[inline(always)]
fn sums<A: Real, T: Real>(r: &[T], z: &[T]) -> [f64; 2] {
    [piece_dot::<A, T>(r, r), piece_dot::<A, T>(r, z)]
}

/// `(Σ w_k r_k²)`.
pub(super) fn weighted_square<A: Real, T: Real>(w: &[f64], r: &[T]) -> f64 {
    tree((w, r), CHUNK, SERIAL, &|(w, r): (&[f64], &[T])| {
        let n = w.len().min(r.len());
        let (w, r) = (&w[..n], &r[..n]);
        [lanes(n, |k| {
            let v = to::<A, T>(r[k]);
            A::from_f64(w[k]) * v * v
        })]
    })[0]
}
