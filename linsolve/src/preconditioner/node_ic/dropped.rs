//! Fill beyond a factor's pattern, and what its pivots are to be compensated with.

use std::ops::Range;

use super::plan::{Plan, fill, neighbours};
use crate::{BorderPattern, Pattern};

/// Strictly lower blocks of the first level that a plan does not keep, by rows.
#[derive(Debug, Clone)]
pub(super) struct Dropped {
    starts: Vec<u32>,
    columns: Vec<u32>,
    /// First number of every place's compensation, lower triangles packed by rows,
    /// and their number.
    packed: Vec<u32>,
}

impl Dropped {
    /// Of a plan with fill up to `level`.
    pub(super) fn new(
        plan: &Plan,
        points: &Pattern,
        border: Option<&BorderPattern>,
        level: usize,
    ) -> Self {
        let mut of = Self {
            starts: vec![0],
            columns: Vec::new(),
            packed: vec![0],
        };
        let (adjacent, beyond) = (neighbours(points, border), level.saturating_add(1));
        let mut numbers = 0;
        fill(&adjacent, plan, beyond, |i, row| {
            let dropped = row.iter().filter(|&&(_, l)| l as usize == beyond);
            of.columns.extend(dropped.map(|&(k, _)| k));
            of.starts.push(of.columns.len() as u32);
            numbers += plan.size(i) * (plan.size(i) + 1) / 2;
            of.packed.push(numbers as u32);
        });
        of.columns.shrink_to_fit();
        of
    }

    /// Columns of what is dropped of a row.
    #[inline(always)]
    pub(super) fn row(&self, place: usize) -> &[u32] {
        &self.columns[self.starts[place] as usize..self.starts[place + 1] as usize]
    }

    /// First number of a place's compensation; of the place behind the last their
    /// number.
    #[inline(always)]
    pub(super) fn first(&self, place: usize) -> usize {
        self.packed[place] as usize
    }

    /// Where a place's compensation lies among those from a place `start` on.
    #[inline(always)]
    pub(super) fn sums(&self, place: usize, start: usize) -> Range<usize> {
        let start = self.first(start);
        self.first(place) - start..self.first(place + 1) - start
    }

    pub(super) fn heap_bytes(&self) -> usize {
        let words = [&self.starts, &self.columns, &self.packed];
        4 * words.iter().map(|w| w.capacity()).sum::<usize>()
    }
}

/// Lower triangles, packed by rows, of what makes up for a dropped block `f` of
/// `m × n`: `(f fᵀ)^½` for its row and `(fᵀ f)^½` for its column, nearly.
///
/// With `H = f fᵀ / |f|²` the root is `|f| (3 H − H²) / 2`: one step of Newton and
/// Schulz for the polar factor, exact where `f` has rank one. Stiff chains leave little
/// else; of two equal singular values it finds 0.88, of three 0.77.
pub(super) fn roots(f: &[f64], m: usize, gram: &mut Vec<f64>, out: &mut [Vec<f64>; 2]) {
    let n = f.len() / m;
    let entry = |r: usize, c: usize| f[c * m + r];
    let square = f.iter().map(|v| v * v).sum();
    let [of_row, of_column] = out;
    root(of_row, m, square, gram, |r, s| {
        (0..n).map(|c| entry(r, c) * entry(s, c)).sum()
    });
    root(of_column, n, square, gram, |c, d| {
        (0..m).map(|r| entry(r, c) * entry(r, d)).sum()
    });
}

/// `|f| (3 H − H²) / 2` of `H = product / |f|²`, by the square `|f|²`.
fn root(
    out: &mut Vec<f64>,
    size: usize,
    square: f64,
    gram: &mut Vec<f64>,
    product: impl Fn(usize, usize) -> f64,
) {
    out.clear();
    if square == 0.0 {
        out.resize(size * (size + 1) / 2, 0.0);
        return;
    }
    gram.clear();
    gram.resize(size * size, 0.0);
    for r in 0..size {
        for s in 0..=r {
            let v = product(r, s) / square;
            gram[r * size + s] = v;
            gram[s * size + r] = v;
        }
    }
    let half = 0.5 * square.sqrt();
    for (r, a) in gram.chunks_exact(size).enumerate() {
        for (s, b) in gram.chunks_exact(size).take(r + 1).enumerate() {
            let squared: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
            out.push(half * (3.0 * a[s] - squared));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use nalgebra::{Matrix3, Matrix3x4, SVector, Vector3, Vector4};

    /// Exact for rank one; of rank two with equal singular values 0.88 of them.
    #[test]
    fn roots_of_low_rank() {
        let (u, v) = (
            Vector3::new(0.6, 0.0, 0.8),
            Vector4::new(0.5, -0.5, 0.5, 0.5),
        );
        let both = |f: &Matrix3x4<f64>| {
            let mut out = [Vec::new(), Vec::new()];
            roots(f.as_slice(), 3, &mut Vec::new(), &mut out);
            out
        };
        fn packed<const N: usize>(u: SVector<f64, N>, value: f64) -> Vec<f64> {
            let entries = (0..N).flat_map(|r| (0..=r).map(move |s| (r, s)));
            entries.map(|(r, s)| value * u[r] * u[s]).collect()
        }
        let [a, b] = both(&(-7.0 * u * v.transpose()));
        assert_relative_eq!(a[..], packed(u, 7.0)[..], epsilon = 1e-14);
        assert_relative_eq!(b[..], packed(v, 7.0)[..], epsilon = 1e-14);

        let (w, x) = (
            Vector3::new(0.0, 1.0, 0.0),
            Vector4::new(0.5, 0.5, 0.5, -0.5),
        );
        let [a, _] = both(&(u * v.transpose() + w * x.transpose()));
        let share = (3.0 / 2.0f64.sqrt() - 1.0 / 8.0f64.sqrt()) / 2.0;
        assert_relative_eq!(share, 0.884, epsilon = 1e-3);
        let expected = (u * u.transpose() + w * w.transpose()) * share;
        let lower =
            |m: &Matrix3<f64>| [(0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2)].map(|at| m[at]);
        assert_relative_eq!(a[..], lower(&expected)[..], epsilon = 1e-14);
        assert_eq!(both(&Matrix3x4::zeros()), [vec![0.0; 6], vec![0.0; 10]]);
    }
}
