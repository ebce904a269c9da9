//! Solves with the triangles of the factor.

use super::dense;
use super::plan::Plan;
use crate::Real;

/// A factor: the values of a plan's rows.
#[derive(Clone, Copy)]
pub(super) struct Sweep<'a, T> {
    pub plan: &'a Plan,
    pub factor: &'a [T],
}

impl<T: Real> Sweep<'_, T> {
    /// `y ← L⁻¹ r` for the places of a part.
    pub(super) fn forward(&self, index: usize, r: &[T], y: &mut [T]) {
        let plan = self.plan;
        let part = plan.parts[index];
        if let Some([left, right]) = part.halves {
            let (a, b) = self.halves(index, y);
            rayon::join(
                || self.forward(left as usize, r, a),
                || self.forward(right as usize, r, b),
            );
        }
        let origin = plan.first[part.start as usize] as usize;
        for i in part.own as usize..part.end as usize {
            let (done, rest) = y.split_at_mut(plan.first[i] as usize - origin);
            let own = &mut rest[..plan.size(i)];
            let (point, scalars) = plan.unknowns(i);
            own[..3].copy_from_slice(&r[point]);
            own[3..].copy_from_slice(&r[scalars]);
            let mut at = plan.values[i] as usize;
            for &k in plan.row(i) {
                let n = plan.size(k as usize);
                let from = plan.first[k as usize] as usize - origin;
                let to = at + own.len() * n;
                dense::subtract_times(&self.factor[at..to], &done[from..from + n], own);
                at = to;
            }
            dense::lower_times(&self.factor[at..], own);
        }
    }

    /// `y ← L⁻ᵀ y` for the places of a part.
    pub(super) fn backward(&self, index: usize, y: &mut [T]) {
        let plan = self.plan;
        let part = plan.parts[index];
        let origin = plan.first[part.start as usize] as usize;
        for i in (part.own as usize..part.end as usize).rev() {
            let (rest, own) = y.split_at_mut(plan.first[i] as usize - origin);
            let own = &mut own[..plan.size(i)];
            let m = own.len();
            let inverse = plan.values[i + 1] as usize - m * (m + 1) / 2;
            dense::upper_times(&self.factor[inverse..], own);
            // from the last block to the first: memory is read in one direction
            let mut at = inverse;
            for &k in plan.row(i).iter().rev() {
                let n = plan.size(k as usize);
                let from = plan.first[k as usize] as usize - origin;
                let blocks = &self.factor[at - m * n..at];
                at -= m * n;
                dense::subtract_transposed(blocks, own, &mut rest[from..from + n]);
            }
        }
        if let Some([left, right]) = part.halves {
            let (a, b) = self.halves(index, y);
            rayon::join(
                || self.backward(left as usize, a),
                || self.backward(right as usize, b),
            );
        }
    }

    /// The vectors of a divided part's halves.
    fn halves<'y>(&self, index: usize, y: &'y mut [T]) -> (&'y mut [T], &'y mut [T]) {
        let plan = self.plan;
        let part = plan.parts[index];
        let first = |place: u32| plan.first[place as usize] as usize;
        let cut = part
            .halves
            .map_or(part.own, |h| plan.parts[h[1] as usize].start);
        let origin = first(part.start);
        y[..first(part.own) - origin].split_at_mut(first(cut) - origin)
    }
}
