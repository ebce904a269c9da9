//! Numbers of the factor, row by row.

use std::sync::atomic::{AtomicBool, Ordering};

use super::compensate::add_packed;
use super::dense;
use super::dropped::Dropped;
use super::plan::Plan;
use crate::{BlockFilter, BorderPattern, Bsr, Real};

/// A matrix to factor.
pub(super) struct Source<'a, T: Real> {
    pub plan: &'a Plan,
    pub points: &'a Bsr<T>,
    pub border: Option<&'a BorderPattern>,
    /// Couplings and scalars' entries by the slots of the border.
    pub values: (&'a [[T; 3]], &'a [T]),
    /// Complete diagonal, filtered.
    pub blocks: &'a [[f64; 9]],
    pub scalars: &'a [f64],
    pub filter: Option<&'a BlockFilter>,
    /// Places whose point or scalars the filter holds; empty without any.
    pub held: &'a [bool],
    /// Diagonal shift, relative.
    pub shift: f64,
    pub beyond: Beyond<'a, T>,
    /// A pivot failed: the parts beside it need not go on.
    pub failed: AtomicBool,
}

/// What becomes of fill beyond the plan.
#[derive(Clone, Copy)]
pub(super) enum Beyond<'a, T> {
    Ignored,
    /// Summed up into compensations.
    Gathered(&'a Dropped),
    /// Made up for by these sums.
    Compensated(&'a Dropped, &'a [T]),
}

/// The row at hand, in double precision.
#[derive(Default)]
pub(super) struct Row {
    pub blocks: Vec<f64>,
    /// First value of the block in every column + 1, 0 where there is none.
    pub at: Vec<u32>,
    pub diagonal: Vec<f64>,
    pub scale: Vec<f64>,
    pub inverse: Vec<f64>,
    pub lost: Vec<f64>,
    /// Square roots of the diagonals of the row and of a column.
    pub units: [Vec<f64>; 2],
    pub roots: [Vec<f64>; 2],
    pub gram: Vec<f64>,
}

impl<T: Real> Source<'_, T> {
    /// Factors all parts; see [`part`](Self::part).
    pub(super) fn whole(&self, values: &mut [T], sums: &mut [T]) -> bool {
        self.failed.store(false, Ordering::Relaxed);
        self.part(self.plan.parts.len() - 1, values, sums)
    }

    /// Factors a part of the plan; `values` are its rows', and so are the sums to
    /// gather, if any. False when a pivot is not positive.
    fn part(&self, index: usize, values: &mut [T], sums: &mut [T]) -> bool {
        let plan = self.plan;
        let part = plan.parts[index];
        let origin = plan.values[part.start as usize] as usize;
        if let Some(halves) = part.halves {
            let [left, right] = halves.map(|h| h as usize);
            let cut = plan.values[plan.parts[right].start as usize] as usize - origin;
            let own = plan.values[part.own as usize] as usize - origin;
            let (a, b) = values[..own].split_at_mut(cut);
            let (of_a, of_b) = match self.beyond {
                Beyond::Gathered(dropped) => {
                    let [start, cut, own] = [part.start, plan.parts[right].start, part.own]
                        .map(|place| dropped.first(place as usize));
                    sums[..own - start].split_at_mut(cut - start)
                }
                _ => (&mut [][..], &mut [][..]),
            };
            let (a, b) = rayon::join(|| self.part(left, a, of_a), || self.part(right, b, of_b));
            if !(a && b) {
                return false;
            }
        }
        let mut row = Row {
            at: vec![0; (part.end - part.start) as usize],
            ..Row::default()
        };
        let whole = (part.own as usize..part.end as usize).all(|i| {
            if self.failed.load(Ordering::Relaxed) {
                return false;
            }
            let (done, rest) = values.split_at_mut(plan.values[i] as usize - origin);
            self.row(
                i,
                (part.start as usize, origin),
                (done, rest),
                sums,
                &mut row,
            )
        });
        if !whole {
            self.failed.store(true, Ordering::Relaxed);
        }
        whole
    }

    /// Row `i` from those before it, which begin at a place and a value.
    fn row(
        &self,
        i: usize,
        (start, origin): (usize, usize),
        (done, out): (&[T], &mut [T]),
        sums: &mut [T],
        row: &mut Row,
    ) -> bool {
        let plan = self.plan;
        let m = plan.size(i);
        let columns = plan.row(i);
        let mut length = 0;
        for &k in columns {
            row.at[k as usize - start] = length as u32 + 1;
            length += m * plan.size(k as usize);
        }
        row.blocks.clear();
        row.blocks.resize(length, 0.0);
        row.diagonal.clear();
        row.diagonal.resize(m * m, 0.0);
        self.load(i, start, row);
        row.scale.clear();
        row.scale
            .extend((0..m).map(|k| row.diagonal[k * m + k].abs()));
        for k in 0..m {
            row.diagonal[k * m + k] += self.shift * row.scale[k];
        }
        if let Beyond::Compensated(dropped, sums) = self.beyond {
            add_packed(&mut row.diagonal, m, &sums[dropped.sums(i, 0)]);
        }
        for &k in columns {
            let k = k as usize;
            let n = plan.size(k);
            let (before, rest) = row.blocks.split_at_mut(row.at[k - start] as usize - 1);
            let target = &mut rest[..m * n];
            let inverse = self.eliminate(k, (start, origin), done, (before, &row.at), target);
            dense::right_solve(target, inverse, m, n);
            dense::subtract_product(&mut row.diagonal, target, target, (m, m, n));
        }
        if let Beyond::Gathered(dropped) = self.beyond {
            self.gather(i, (start, origin), done, dropped, sums, row);
        }
        for &k in columns {
            row.at[k as usize - start] = 0;
        }
        row.inverse.clear();
        row.inverse.resize(m * (m + 1) / 2, 0.0);
        if !dense::factorise(&mut row.diagonal, m, &row.scale, &mut row.inverse) {
            return false;
        }
        for (out, &v) in out.iter_mut().zip(row.blocks.iter().chain(&row.inverse)) {
            *out = T::from_f64(v);
        }
        true
    }

    /// `target −= Σ_c L_ic L_kcᵀ` of a row `i` that is known before column `k`, with
    /// the places of its blocks. The packed inverse of `L_kk`.
    #[inline(always)]
    pub(super) fn eliminate<'d>(
        &self,
        k: usize,
        (start, origin): (usize, usize),
        done: &'d [T],
        (before, places): (&[f64], &[u32]),
        target: &mut [f64],
    ) -> &'d [T] {
        let plan = self.plan;
        let n = plan.size(k);
        let m = target.len() / n;
        let mut from = plan.values[k] as usize - origin;
        for &c in plan.row(k) {
            let size = plan.size(c as usize);
            let to = from + n * size;
            if let Some(at) = (places[c as usize - start] as usize).checked_sub(1) {
                let own = &before[at..at + m * size];
                dense::subtract_product(target, own, &done[from..to], (m, n, size));
            }
            from = to;
        }
        &done[from..from + n * (n + 1) / 2]
    }

    /// Row `i` of `S A S + m̄ (I − S)`.
    fn load(&self, i: usize, start: usize, row: &mut Row) {
        let plan = self.plan;
        let m = plan.size(i);
        let p = plan.points[i] as usize;
        let pattern = self.points.pattern();
        let blocks = self.points.blocks();
        for slot in pattern.row(p) {
            let j = plan.places[pattern.all_columns()[slot] as usize] as usize;
            if j < i {
                let at = row.at[j - start] as usize - 1;
                let to = row.blocks[at..].chunks_exact_mut(m);
                for (to, from) in to.zip(blocks[slot].chunks_exact(3)) {
                    for (to, from) in to.iter_mut().zip(from) {
                        *to = from.to_f64();
                    }
                }
            }
        }
        let first = plan.scalars[i] as usize;
        if let Some(border) = self.border {
            self.load_border(i, start, border, row);
        }
        if let Some(filter) = self.filter
            && !self.held.is_empty()
        {
            self.constrain(i, start, filter, row);
        }
        // Last, since these are filtered already and hold the contacts.
        for (k, &v) in self.blocks[p].iter().enumerate() {
            row.diagonal[k % 3 * m + k / 3] = v;
        }
        for k in 3..m {
            row.diagonal[k * m + k] = self.scalars[first + k - 3];
        }
    }

    /// What the scalars of row `i` couple with, and its point with scalars.
    fn load_border(&self, i: usize, start: usize, border: &BorderPattern, row: &mut Row) {
        let plan = self.plan;
        let m = plan.size(i);
        let p = plan.points[i] as usize;
        let (coupling, scalars) = self.values;
        let owner = |s: u32| border.owners()[s as usize] as usize;
        let local = |s: u32| 3 + s as usize - border.owned(owner(s)).start;
        let (entries, at) = (&mut row.blocks, &row.at);
        for s in border.owned(p) {
            let r = local(s as u32);
            for slot in border.point_row(s) {
                let j = plan.places[border.point_columns()[slot] as usize] as usize;
                let to = match j {
                    j if j < i => &mut entries[at[j - start] as usize - 1..],
                    j if j == i => row.diagonal.as_mut_slice(),
                    _ => continue,
                };
                for (k, v) in coupling[slot].iter().enumerate() {
                    to[k * m + r] = v.to_f64();
                }
            }
            for slot in border.scalar_row(s) {
                let t = border.scalar_columns()[slot];
                let j = plan.places[owner(t)] as usize;
                let to = match j {
                    j if j < i => &mut entries[at[j - start] as usize - 1..],
                    j if j == i => row.diagonal.as_mut_slice(),
                    _ => continue,
                };
                to[local(t) * m + r] = scalars[slot].to_f64();
            }
        }
        for &[s, slot] in &border.transposed_entries()[border.transposed_row(p)] {
            let j = plan.places[owner(s)] as usize;
            if j < i {
                // a column of the block
                let from = at[j - start] as usize - 1 + local(s) * m;
                for (k, v) in coupling[slot as usize].iter().enumerate() {
                    entries[from + k] = v.to_f64();
                }
            }
        }
    }

    /// `S_i A_ij S_j` on a row; what belongs to fixed scalars vanishes.
    fn constrain(&self, i: usize, start: usize, filter: &BlockFilter, row: &mut Row) {
        let m = self.plan.size(i);
        for &k in self.plan.row(i) {
            if !(self.held[i] || self.held[k as usize]) {
                continue;
            }
            let at = row.at[k as usize - start] as usize - 1;
            let n = self.plan.size(k as usize);
            self.constrain_block(filter, (i, k as usize), &mut row.blocks[at..at + m * n]);
        }
        if self.held[i] {
            self.constrain_block(filter, (i, i), &mut row.diagonal);
        }
    }

    fn constrain_block(&self, filter: &BlockFilter, (i, j): (usize, usize), block: &mut [f64]) {
        let plan = self.plan;
        let rows = plan.size(i);
        let times = |s: &[f64; 9], v: [f64; 3]| -> [f64; 3] {
            std::array::from_fn(|k| s[3 * k] * v[0] + s[3 * k + 1] * v[1] + s[3 * k + 2] * v[2])
        };
        if let Some(s) = filter.projector(plan.points[i]) {
            for column in block.chunks_exact_mut(rows) {
                let v = times(s, [column[0], column[1], column[2]]);
                column[..3].copy_from_slice(&v);
            }
        }
        if let Some(s) = filter.projector(plan.points[j]) {
            for r in 0..rows {
                let at = [r, rows + r, 2 * rows + r];
                let v = times(s, at.map(|at| block[at]));
                for (at, v) in at.into_iter().zip(v) {
                    block[at] = v;
                }
            }
        }
        let fixed = |place: usize, k: usize| {
            let first = 3 * plan.points.len() + plan.scalars[place] as usize;
            filter.is_scalar_fixed((first + k - 3) as u32)
        };
        for (c, column) in block.chunks_exact_mut(rows).enumerate() {
            let whole = c >= 3 && fixed(j, c);
            for (r, v) in column.iter_mut().enumerate() {
                if whole || (r >= 3 && fixed(i, r)) {
                    *v = 0.0;
                }
            }
        }
    }
}

/// See [`Source::held`].
pub(super) fn held(plan: &Plan, filter: Option<&BlockFilter>) -> Vec<bool> {
    let Some(filter) = filter.filter(|f| !f.is_empty()) else {
        return Vec::new();
    };
    (0..plan.points.len())
        .map(|i| {
            let (_, mut scalars) = plan.unknowns(i);
            filter.projector(plan.points[i]).is_some()
                || scalars.any(|s| filter.is_scalar_fixed(s as u32))
        })
        .collect()
}
