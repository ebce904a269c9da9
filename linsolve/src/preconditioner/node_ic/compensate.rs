//! A factorisation that makes up for the fill it drops.

use super::super::shift;
use super::dropped::{Dropped, roots};
use super::factor::{Beyond, Row, Source};
use super::{COMPENSATED_SHIFT, FIRST_SHIFT, LAST_COMPENSATED};
use crate::{LinsolveError, Real};

impl<'a, T: Real> Source<'a, T> {
    /// Factors the whole after all tries failed: gathers what is dropped into `sums`, from
    /// the shift at hand on, and makes up for it. Leaves the shift that it took.
    ///
    /// # Errors
    /// [`LinsolveError::ShiftExhausted`].
    pub(super) fn compensate(
        &mut self,
        dropped: &'a Dropped,
        factor: &mut [T],
        sums: &'a mut Vec<T>,
    ) -> Result<(), LinsolveError> {
        self.beyond = Beyond::Gathered(dropped);
        let mut gathered = false;
        while !gathered && self.shift <= LAST_COMPENSATED {
            sums.clear();
            sums.resize(dropped.first(self.plan.points.len()), T::ZERO);
            gathered = self.whole(factor, sums);
            if !gathered {
                self.larger_shift(FIRST_SHIFT)?;
            }
        }
        if gathered {
            self.beyond = Beyond::Compensated(dropped, sums);
            self.shift = 0.0;
            while self.shift <= LAST_COMPENSATED {
                if self.whole(factor, &mut []) {
                    return Ok(());
                }
                self.larger_shift(COMPENSATED_SHIFT)?;
            }
        }
        self.beyond = Beyond::Ignored;
        self.shift = 2.0 * FIRST_SHIFT;
        while !self.whole(factor, &mut []) {
            self.larger_shift(FIRST_SHIFT)?;
        }
        Ok(())
    }

    /// Twice the shift, and `first` after none.
    fn larger_shift(&mut self, first: f64) -> Result<(), LinsolveError> {
        self.shift = shift::larger(self.shift, first, "node-ic")?;
        Ok(())
    }

    /// What row `i` loses, into the sums of its part and onto its own diagonal.
    pub(super) fn gather(
        &self,
        i: usize,
        (start, origin): (usize, usize),
        done: &[T],
        dropped: &Dropped,
        sums: &mut [T],
        row: &mut Row,
    ) {
        let m = self.plan.size(i);
        let [own, other] = &mut row.units;
        self.units(i, own);
        for &k in dropped.row(i) {
            let k = k as usize;
            let n = self.plan.size(k);
            self.units(k, other);
            row.lost.clear();
            row.lost.resize(m * n, 0.0);
            let known = (&row.blocks[..], &row.at[..]);
            self.eliminate(k, (start, origin), done, known, &mut row.lost);
            for (column, unit) in row.lost.chunks_exact_mut(m).zip(&*other) {
                for (v, own) in column.iter_mut().zip(&*own) {
                    *v /= own * unit;
                }
            }
            roots(&row.lost, m, &mut row.gram, &mut row.roots);
            for (place, root, units) in [(i, 0, &*own), (k, 1, &*other)] {
                let root = &mut row.roots[root];
                let mut packed = root.iter_mut();
                for (r, a) in units.iter().enumerate() {
                    for (b, v) in units[..=r].iter().zip(packed.by_ref()) {
                        *v *= a * b;
                    }
                }
                for (sum, &v) in sums[dropped.sums(place, start)].iter_mut().zip(&*root) {
                    *sum += T::from_f64(v);
                }
            }
            add_packed(&mut row.diagonal, m, &row.roots[0]);
        }
    }

    /// Square roots of the diagonal of a place, in a point of its mean: the same in
    /// every frame.
    fn units(&self, place: usize, out: &mut Vec<f64>) {
        let b = &self.blocks[self.plan.points[place] as usize];
        let point = ((b[0] + b[4] + b[8]) / 3.0).abs();
        let first = self.plan.scalars[place] as usize;
        let scalars = &self.scalars[first..first + self.plan.size(place) - 3];
        let all = [point; 3]
            .into_iter()
            .chain(scalars.iter().map(|d| d.abs()));
        out.clear();
        out.extend(all.map(|d| d.max(f64::MIN_POSITIVE).sqrt()));
    }
}

/// Adds a lower triangle packed by rows to one by columns.
pub(super) fn add_packed<T: Real>(diagonal: &mut [f64], size: usize, packed: &[T]) {
    let mut packed = packed.iter();
    for r in 0..size {
        for (c, v) in packed.by_ref().take(r + 1).enumerate() {
            diagonal[c * size + r] += v.to_f64();
        }
    }
}
