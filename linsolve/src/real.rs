//! The two precisions, sealed.

use crate::{LinearSolver, Mpcg, MpcgSettings, Preconditioner, Refined};
use std::fmt::{Debug, Display};
use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering::Relaxed};
use wide::{f32x4, f64x4};
use zerocopy::{FromBytes, IntoBytes};

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// Precision of a matrix and of the vectors inside a solver: `f32` or `f64`.
///
/// Sums over many unknowns are accumulated in `f64`, unless a solver is told
/// otherwise ([`Sums`](crate::Sums)).
pub trait Real:
    sealed::Sealed
    + Copy
    + Default
    + Debug
    + Display
    + PartialOrd
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + DivAssign
    + Sum
    + faer::traits::RealField
{
    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;
    /// Distance from 1 to the next number.
    const EPSILON: Self;
    /// Name used in scene files and reports: `"f32"` or `"f64"`.
    const NAME: &'static str;
    /// Unsigned atomic of the same size, for [`SharedValues`](crate::SharedValues).
    type Atomic: Sync;

    /// Rounds to this precision.
    fn from_f64(v: f64) -> Self;
    /// Widens to `f64`, exactly.
    fn to_f64(self) -> f64;
    /// Square root.
    fn square_root(self) -> Self;
    /// `self · b + c`, with one rounding where the target has the instruction.
    fn fma(self, b: Self, c: Self) -> Self;
    /// Whether neither NaN nor infinite.
    fn finite(self) -> bool;

    /// Whether a matrix of this precision can be refined from a lower one.
    #[doc(hidden)]
    fn refined_exists() -> bool {
        false
    }
    #[doc(hidden)]
    fn refined(
        _: Box<dyn Preconditioner<f32>>,
        _: MpcgSettings,
    ) -> Option<Box<dyn LinearSolver<Self>>> {
        None
    }
    #[doc(hidden)]
    fn as_atomics(values: &mut [Self]) -> &[Self::Atomic];
    /// `Σ_j A_j x_j` over column-major blocks.
    #[doc(hidden)]
    fn row_product(columns: &[u32], blocks: &[[Self; 9]], x: &[[Self; 3]]) -> [Self; 3];
    #[doc(hidden)]
    fn add_exclusive(slot: &Self::Atomic, v: Self);
    #[doc(hidden)]
    fn copy_exclusive(from: &Self::Atomic, to: &Self::Atomic);
    #[doc(hidden)]
    fn add_contended(slot: &Self::Atomic, v: Self);
}

macro_rules! real {
    ($t:ident, $bits:ident, $atomic:ident, $lanes:ident, { $($more:item)* }) => {
        impl Real for $t {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const EPSILON: Self = $t::EPSILON;
            const NAME: &'static str = stringify!($t);
            $($more)*
            type Atomic = $atomic;

            #[inline(always)]
            fn from_f64(v: f64) -> Self {
                v as $t
            }
            #[inline(always)]
            fn to_f64(self) -> f64 {
                self as f64
            }
            #[inline(always)]
            fn square_root(self) -> Self {
                self.sqrt()
            }
            #[inline(always)]
            fn fma(self, b: Self, c: Self) -> Self {
                // without the instruction `mul_add` is a slow library call
                if cfg!(any(target_feature = "fma", target_arch = "aarch64")) {
                    self.mul_add(b, c)
                } else {
                    self * b + c
                }
            }
            #[inline(always)]
            fn finite(self) -> bool {
                self.is_finite()
            }

            fn as_atomics(values: &mut [Self]) -> &[Self::Atomic] {
                // Same size; alignment is verified by the call. It cannot fail
                // on targets whose float and integer of this size align alike,
                // which are all with 64-bit atomics and a 64-bit pointer.
                match <[$atomic]>::mut_from_bytes(values.as_mut_bytes()) {
                    Ok(atomics) => atomics,
                    Err(_) => unreachable!("atomics need a stricter alignment than the floats"),
                }
            }
            // Each column of a block is loaded as four lanes: the first two with
            // the following entry as an unused fourth lane, the last one shifted
            // by one, so that no load leaves the block. Explicit lanes, since the
            // compiler narrows arrays of four with an unused entry to two and
            // one; six independent sums hide the latency.
            #[inline(always)]
            fn row_product(columns: &[u32], blocks: &[[$t; 9]], x: &[[$t; 3]]) -> [$t; 3] {
                // copied as one array: single entries would be shuffled together
                #[inline(always)]
                fn four(m: &[$t; 9], at: usize) -> $lanes {
                    let mut lanes = [0.0; 4];
                    lanes.copy_from_slice(&m[at..at + 4]);
                    $lanes::new(lanes)
                }
                let (mut a, mut b, mut c) = ($lanes::ZERO, $lanes::ZERO, $lanes::ZERO);
                let (mut d, mut e, mut f) = (a, b, c);
                let (pairs, last) = blocks.as_chunks::<2>();
                let (places, rest) = columns.as_chunks::<2>();
                for ([m, n], &[i, j]) in pairs.iter().zip(places) {
                    let (x, y) = (&x[i as usize], &x[j as usize]);
                    a = four(m, 0).mul_add($lanes::splat(x[0]), a);
                    d = four(n, 0).mul_add($lanes::splat(y[0]), d);
                    b = four(m, 3).mul_add($lanes::splat(x[1]), b);
                    e = four(n, 3).mul_add($lanes::splat(y[1]), e);
                    c = four(m, 5).mul_add($lanes::splat(x[2]), c);
                    f = four(n, 5).mul_add($lanes::splat(y[2]), f);
                }
                if let ([m], [j]) = (last, rest) {
                    let x = &x[*j as usize];
                    a = four(m, 0).mul_add($lanes::splat(x[0]), a);
                    b = four(m, 3).mul_add($lanes::splat(x[1]), b);
                    c = four(m, 5).mul_add($lanes::splat(x[2]), c);
                }
                let (a, b, c) = (a + d, b + e, c + f);
                let (s, c) = ((a + b).to_array(), c.to_array());
                [s[0] + c[1], s[1] + c[2], s[2] + c[3]]
            }
            #[inline(always)]
            fn add_exclusive(slot: &Self::Atomic, v: Self) {
                slot.store(($t::from_bits(slot.load(Relaxed)) + v).to_bits(), Relaxed);
            }
            #[inline(always)]
            fn copy_exclusive(from: &Self::Atomic, to: &Self::Atomic) {
                to.store(from.load(Relaxed), Relaxed);
            }
            #[inline(always)]
            fn add_contended(slot: &Self::Atomic, v: Self) {
                let mut old: $bits = slot.load(Relaxed);
                loop {
                    let new = ($t::from_bits(old) + v).to_bits();
                    match slot.compare_exchange_weak(old, new, Relaxed, Relaxed) {
                        Ok(_) => return,
                        Err(seen) => old = seen,
                    }
                }
            }
        }
    };
}

real!(f32, u32, AtomicU32, f32x4, {});
real!(f64, u64, AtomicU64, f64x4, {
    fn refined_exists() -> bool {
        true
    }
    fn refined(
        preconditioner: Box<dyn Preconditioner<f32>>,
        settings: MpcgSettings,
    ) -> Option<Box<dyn LinearSolver<f64>>> {
        let tolerance = settings.tolerance;
        let inner = MpcgSettings {
            tolerance: 1e-3,
            ..settings
        };
        Some(Box::new(Refined::new(
            Mpcg::new(preconditioner, inner),
            tolerance,
        )))
    }
});
