//! Solves with a block triangular factor.

use crate::Real;
use crate::bsr::row_product;
use crate::vector::{From, tree};
use std::ops::Range;

/// Rows of a level below which the levels are walked by one thread in natural
/// order: starting tasks for so few rows costs more than they do.
const WIDE: usize = 1024;
const ROWS: usize = 256;

/// Columns of a block, padded to the width of a vector instruction.
pub(super) type Columns = [[f64; 4]; 3];

/// `(L Lᵀ)⁻¹` for a block lower triangular `L`, both triangles stored by rows
/// in processing order.
///
/// Rows are processed by depth of dependence. Even where a level is too narrow
/// for several threads, its rows do not wait for each other in the processor.
#[derive(Debug, Clone, Default)]
pub(super) struct Triangular<T> {
    lower: Rows<T>,
    upper: Rows<T>,
    /// Of every block of `upper`, the one of `lower` it is the transpose of.
    mirror: Vec<u32>,
    /// Inverse of `L_ii`, packed lower.
    diagonal: Vec<[T; 6]>,
    /// Point of each processed row.
    order: Vec<u32>,
    /// Empty when one thread walks all rows.
    levels: Vec<Range<usize>>,
    work: Vec<[T; 3]>,
}

#[derive(Debug, Clone, Default)]
struct Rows<T> {
    starts: Vec<usize>,
    columns: Vec<u32>,
    blocks: Vec<[T; 9]>,
}

impl<T: Real> Rows<T> {
    #[inline(always)]
    fn product(&self, i: usize, x: &[[T; 3]]) -> [T; 3] {
        let row = self.starts[i]..self.starts[i + 1];
        row_product(&self.columns[row.clone()], &self.blocks[row], x)
    }

    fn heap_bytes(&self) -> usize {
        8 * self.starts.capacity()
            + 4 * self.columns.capacity()
            + size_of::<[T; 9]>() * self.blocks.capacity()
    }
}

impl<T: Real> Triangular<T> {
    /// Order and pattern from strictly lower rows (`starts`, `columns`, by point).
    pub(super) fn analyse(&mut self, starts: &[usize], columns: &[u32]) {
        let n = starts.len() - 1;
        self.schedule(starts, columns);
        let mut place = vec![0u32; n];
        for (new, &old) in self.order.iter().enumerate() {
            place[old as usize] = new as u32;
        }
        // first block of every point's row in processing order
        let mut first = vec![0; n];
        let (lower, upper) = (&mut self.lower, &mut self.upper);
        lower.starts.clear();
        lower.columns.clear();
        lower.starts.push(0);
        for &i in &self.order {
            let i = i as usize;
            first[i] = lower.columns.len();
            let row = columns[starts[i]..starts[i + 1]].iter();
            lower.columns.extend(row.map(|&j| place[j as usize]));
            lower.starts.push(lower.columns.len());
        }
        // transposed by counting; rows are visited in natural order so that
        // the order of a sum does not depend on the schedule
        upper.starts.clear();
        upper.starts.resize(n + 1, 0);
        for &j in columns {
            upper.starts[place[j as usize] as usize + 1] += 1;
        }
        for i in 0..n {
            upper.starts[i + 1] += upper.starts[i];
        }
        upper.columns.clear();
        upper.columns.resize(columns.len(), 0);
        self.mirror.clear();
        self.mirror.resize(columns.len(), 0);
        let mut fill = upper.starts.clone();
        for i in 0..n {
            for k in starts[i]..starts[i + 1] {
                let at = &mut fill[place[columns[k] as usize] as usize];
                upper.columns[*at] = place[i];
                self.mirror[*at] = (first[i] + k - starts[i]) as u32;
                *at += 1;
            }
        }
        for rows in [lower, upper] {
            rows.blocks.clear();
            rows.blocks.resize(columns.len(), [T::ZERO; 9]);
        }
        self.diagonal.clear();
        self.diagonal.resize(n, [T::ZERO; 6]);
        self.work.clear();
        self.work.resize(n, [T::ZERO; 3]);
    }

    /// Point of each row in processing order.
    pub(super) fn order(&self) -> &[u32] {
        &self.order
    }

    /// Blocks and inverted diagonal factors, both in processing order.
    pub(super) fn set(&mut self, blocks: &[Columns], diagonal: &[[f64; 6]]) {
        for (to, b) in self.lower.blocks.iter_mut().zip(blocks) {
            *to = std::array::from_fn(|e| T::from_f64(b[e / 3][e % 3]));
        }
        for (to, &k) in self.upper.blocks.iter_mut().zip(&self.mirror) {
            let b = &blocks[k as usize];
            *to = std::array::from_fn(|e| T::from_f64(b[e % 3][e / 3]));
        }
        for (to, d) in self.diagonal.iter_mut().zip(diagonal) {
            *to = d.map(T::from_f64);
        }
    }

    /// Rows of equal depth of dependence are independent.
    fn schedule(&mut self, starts: &[usize], columns: &[u32]) {
        let n = starts.len() - 1;
        let mut level = vec![0u32; n];
        for i in 0..n {
            let below = columns[starts[i]..starts[i + 1]].iter();
            level[i] = below.map(|&j| level[j as usize] + 1).max().unwrap_or(0);
        }
        let count = level.iter().max().map_or(0, |&m| m as usize + 1);
        self.order.clear();
        self.levels.clear();
        self.order.extend(0..n as u32);
        self.order.sort_by_key(|&i| level[i as usize]);
        if n < WIDE * count {
            return;
        }
        let mut start = 0;
        while start < n {
            let l = level[self.order[start] as usize];
            let end = start + self.order[start..].partition_point(|&i| level[i as usize] == l);
            self.levels.push(start..end);
            start = end;
        }
    }

    /// `z = (L Lᵀ)⁻¹ r` on the points.
    pub(super) fn solve(&mut self, r: &[T], z: &mut [T]) {
        let (r, z) = (r.as_chunks::<3>().0, z.as_chunks_mut::<3>().0);
        let n = self.diagonal.len();
        let mut work = std::mem::take(&mut self.work);
        let y = work.as_mut_slice();
        if self.levels.is_empty() {
            for i in 0..n {
                y[i] = self.forward(i, &r[self.order[i] as usize], y);
            }
            for i in (0..n).rev() {
                y[i] = self.backward(i, &y[i], y);
            }
        } else {
            for level in &self.levels {
                let (done, rest) = y.split_at_mut(level.start);
                self.level(&mut rest[..level.len()], level.start, |i, _| {
                    self.forward(i, &r[self.order[i] as usize], done)
                });
            }
            for level in self.levels.iter().rev() {
                let (rest, done) = y.split_at_mut(level.end);
                // columns count from the first row: shift them by the cut
                let cut = level.end;
                self.level(&mut rest[level.start..], level.start, |i, own| {
                    self.backward_from(i, own, done, cut)
                });
            }
        }
        for (y, &i) in y.iter().zip(&self.order) {
            z[i as usize] = *y;
        }
        self.work = work;
    }

    fn level(
        &self,
        rows: &mut [[T; 3]],
        first: usize,
        row: impl Fn(usize, &[T; 3]) -> [T; 3] + Sync,
    ) {
        let n = rows.len();
        tree((From(first, n), rows), ROWS, 2 * ROWS, &|(from, rows): (
            From,
            &mut [[T; 3]],
        )| {
            for (k, y) in rows.iter_mut().enumerate() {
                *y = row(from.0 + k, y);
            }
            []
        });
    }

    /// `L_ii⁻¹ (r − Σ L_ij y_j)`.
    #[inline(always)]
    fn forward(&self, i: usize, r: &[T; 3], y: &[[T; 3]]) -> [T; 3] {
        let s = self.lower.product(i, y);
        let (a, b, c) = (r[0] - s[0], r[1] - s[1], r[2] - s[2]);
        let d = &self.diagonal[i];
        [
            d[0] * a,
            d[1] * a + d[2] * b,
            d[3] * a + d[4] * b + d[5] * c,
        ]
    }

    /// `L_ii⁻ᵀ (y − Σ L_kiᵀ z_k)`.
    #[inline(always)]
    fn backward(&self, i: usize, y: &[T; 3], z: &[[T; 3]]) -> [T; 3] {
        self.finish(i, y, self.upper.product(i, z))
    }

    #[inline(always)]
    fn backward_from(&self, i: usize, y: &[T; 3], z: &[[T; 3]], cut: usize) -> [T; 3] {
        let mut s = [T::ZERO; 3];
        for k in self.upper.starts[i]..self.upper.starts[i + 1] {
            let (m, x) = (
                &self.upper.blocks[k],
                &z[self.upper.columns[k] as usize - cut],
            );
            for r in 0..3 {
                s[r] += m[r] * x[0] + m[3 + r] * x[1] + m[6 + r] * x[2];
            }
        }
        self.finish(i, y, s)
    }

    #[inline(always)]
    fn finish(&self, i: usize, y: &[T; 3], s: [T; 3]) -> [T; 3] {
        let (a, b, c) = (y[0] - s[0], y[1] - s[1], y[2] - s[2]);
        let d = &self.diagonal[i];
        [
            d[0] * a + d[1] * b + d[3] * c,
            d[2] * b + d[4] * c,
            d[5] * c,
        ]
    }

    /// Levels walked in parallel; 0 when natural order is used.
    #[cfg(test)]
    pub(super) fn level_count(&self) -> usize {
        self.levels.len()
    }

    pub(super) fn heap_bytes(&self) -> usize {
        self.lower.heap_bytes()
            + self.upper.heap_bytes()
            + size_of::<[T; 6]>() * self.diagonal.capacity()
            + size_of::<[T; 3]>() * self.work.capacity()
            + 4 * (self.order.capacity() + self.mirror.capacity())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wide forest is solved level by level, in parallel, and reproduces the
    /// right-hand side.
    #[test]
    fn levels_solve_the_same_system() {
        // three generations, each row hanging on one or two of the one before
        let (n, wide) = (3 * 4000usize, 4000usize);
        let (mut starts, mut columns, mut blocks) = (vec![0], Vec::new(), Vec::new());
        let number = |k: usize| ((k * 7919 + 13) % 101) as f64 / 101.0 - 0.5;
        for i in 0..n {
            if i >= wide {
                let mut parents = vec![(i - wide) as u32, (i - wide) as u32 / 2 * 2];
                parents.sort_unstable();
                parents.dedup();
                for p in parents {
                    columns.push(p);
                    blocks.push(std::array::from_fn(|k| number(9 * i + k + p as usize)));
                }
            }
            starts.push(columns.len());
        }
        let diagonal: Vec<[f64; 6]> = (0..n)
            .map(|i| [1.0, number(i), 2.0, 0.3, number(i + 5), 1.5])
            .collect();
        let mut t = Triangular::<f64>::default();
        t.analyse(&starts, &columns);
        // generations are levels: the processing order is the natural one
        assert!(t.order().iter().enumerate().all(|(k, &i)| k == i as usize));
        let pad = |b: &[f64; 9]| [0, 1, 2].map(|c| [b[c], b[3 + c], b[6 + c], 0.0]);
        let padded: Vec<Columns> = blocks.iter().map(pad).collect();
        t.set(&padded, &diagonal);
        assert!(t.level_count() >= 3, "{}", t.level_count());
        let r: Vec<f64> = (0..3 * n).map(number).collect();
        let mut z = vec![0.0; 3 * n];
        t.solve(&r, &mut z);
        // the same by plain substitution
        let mut y = vec![[0.0; 3]; n];
        for i in 0..n {
            let mut s = [r[3 * i], r[3 * i + 1], r[3 * i + 2]];
            for k in starts[i]..starts[i + 1] {
                for e in 0..9 {
                    s[e / 3] -= blocks[k][e] * y[columns[k] as usize][e % 3];
                }
            }
            let d = &diagonal[i];
            y[i] = [
                d[0] * s[0],
                d[1] * s[0] + d[2] * s[1],
                d[3] * s[0] + d[4] * s[1] + d[5] * s[2],
            ];
        }
        for i in (0..n).rev() {
            let (s, d) = (y[i], &diagonal[i]);
            y[i] = [
                d[0] * s[0] + d[1] * s[1] + d[3] * s[2],
                d[2] * s[1] + d[4] * s[2],
                d[5] * s[2],
            ];
            for k in starts[i]..starts[i + 1] {
                for e in 0..9 {
                    let v = blocks[k][e] * y[i][e / 3];
                    y[columns[k] as usize][e % 3] -= v;
                }
            }
        }
        for (a, b) in z.iter().zip(y.as_flattened()) {
            assert!((a - b).abs() < 1e-12 * (1.0 + b.abs()), "{a} {b}");
        }
    }
}
