//! One formula for one stencil and for four at a time.

use std::ops::{Add, Div, Mul, Neg, Sub};

use wide::f64x4;

/// A number, or four of them that are treated alike.
///
/// Every operation rounds once and alike for both, so that four stencils at a
/// time give the bits of one at a time.
pub(crate) trait Lanes:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// The same number everywhere.
    fn splat(v: f64) -> Self;
    fn sqrt(self) -> Self;
    fn abs(self) -> Self;
    /// To the nearest whole number, ties to even.
    fn round(self) -> Self;
    /// Where `self > than` the first, else the second.
    fn greater(self, than: Self, yes: Self, no: Self) -> Self;
    /// Whether any number is at most its limit.
    fn any_at_most(self, limit: Self) -> bool;
    /// `f` of every number.
    fn each<const K: usize>(self, f: impl Fn(f64) -> [f64; K]) -> [Self; K];

    /// `self ≥ 0` with the sign of `s`.
    #[inline(always)]
    fn signed_as(self, s: Self) -> Self {
        Self::splat(0.0).greater(s, -self, self)
    }
}

impl Lanes for f64 {
    #[inline(always)]
    fn splat(v: f64) -> Self {
        v
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.sqrt()
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.abs()
    }
    #[inline(always)]
    fn round(self) -> Self {
        self.round_ties_even()
    }
    #[inline(always)]
    fn greater(self, than: Self, yes: Self, no: Self) -> Self {
        if self > than { yes } else { no }
    }
    #[inline(always)]
    fn any_at_most(self, limit: Self) -> bool {
        self <= limit
    }
    #[inline(always)]
    fn each<const K: usize>(self, f: impl Fn(f64) -> [f64; K]) -> [Self; K] {
        f(self)
    }
}

impl Lanes for f64x4 {
    #[inline(always)]
    fn splat(v: f64) -> Self {
        f64x4::splat(v)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.sqrt()
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.abs()
    }
    #[inline(always)]
    fn round(self) -> Self {
        self.round_ties_even()
    }
    #[inline(always)]
    fn greater(self, than: Self, yes: Self, no: Self) -> Self {
        self.simd_gt(than).bitselect(yes, no)
    }
    #[inline(always)]
    fn any_at_most(self, limit: Self) -> bool {
        self.simd_le(limit).any()
    }
    #[inline(always)]
    fn each<const K: usize>(self, f: impl Fn(f64) -> [f64; K]) -> [Self; K] {
        let [a, b, c, d] = self.to_array();
        let (a, b, c, d) = (f(a), f(b), f(c), f(d));
        let mut out = [f64x4::ZERO; K];
        for k in 0..K {
            out[k] = f64x4::new([a[k], b[k], c[k], d[k]]);
        }
        out
    }
}

/// `N` numbers of each of four stencils, stencil by stencil, as lanes.
#[inline(always)]
pub(crate) fn together<const N: usize>(of: [&[f64; N]; 4]) -> [f64x4; N] {
    let mut out = [f64x4::ZERO; N];
    for k in 0..N {
        out[k] = f64x4::new([of[0][k], of[1][k], of[2][k], of[3][k]]);
    }
    out
}

/// Lanes back to `N` numbers of each of four stencils; `N` a multiple of 4.
#[inline(always)]
pub(crate) fn apart<const N: usize>(lanes: &[f64x4; N], to: [&mut [f64; N]; 4]) {
    let [a, b, c, d] = to;
    for k in (0..N).step_by(4) {
        let four = f64x4::transpose([lanes[k], lanes[k + 1], lanes[k + 2], lanes[k + 3]]);
        a[k..k + 4].copy_from_slice(&four[0].to_array());
        b[k..k + 4].copy_from_slice(&four[1].to_array());
        c[k..k + 4].copy_from_slice(&four[2].to_array());
        d[k..k + 4].copy_from_slice(&four[3].to_array());
    }
}
