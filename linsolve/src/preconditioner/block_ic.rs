//! Incomplete Cholesky without fill, by 3×3 blocks.

use super::triangular::{Columns, Triangular};
use super::{Preconditioner, diagonal::positive_inverse, filtered_diagonal, shift};
use crate::small::{self, M3};
use crate::{Bsr, ExplicitOperator, Filter, LinearOperator, LinsolveError, Pattern, Real};
use wide::f64x4;

/// Block IC(0): name `"block-ic"`.
///
/// ```text
/// L_ij = (A_ij − Σ_{k<j} L_ik L_jkᵀ) L_jj⁻ᵀ ,    L_ii L_iiᵀ = A_ii − Σ_k L_ik L_ikᵀ
/// ```
/// on the lower pattern of the static part, with the complete diagonal; the
/// off-diagonal blocks of contacts are ignored. A pivot that is not above
/// `1e-12 max diag A_ii` restarts with the diagonal shift `s |diag A_ii|`,
/// `s = 1e-3` and doubling; while `s = 0`, `(L Lᵀ)_ij = A_ij` on the pattern.
/// The filter enters as `S_i A_ij S_j` and `m̄ (I − S_i)` on the diagonal.
///
/// The solve runs level by level, in parallel where levels are wide; a sheet in
/// Cuthill–McKee order has narrow ones and is solved by one thread. Everything
/// that depends on the pattern alone is kept while the pattern stays.
#[derive(Debug, Clone, Default)]
pub struct BlockIc<T> {
    factor: Triangular<T>,
    scalar_inverse: Vec<T>,
    shift: f64,
    work: Work,
}

/// Plan for a pattern, rows and factor in double precision, kept between
/// updates. Rows are in the processing order of the solve.
#[derive(Debug, Clone, Default)]
struct Work {
    pattern: Option<u64>,
    /// Point of every row, and row of every point.
    order: Vec<u32>,
    place: Vec<u32>,
    /// Strictly lower rows: row and slot of every block.
    starts: Vec<u32>,
    columns: Vec<u32>,
    slots: Vec<u32>,
    /// For every block (i, j): pairs of blocks (i, k), (j, k).
    pairs: Vec<(u32, u32)>,
    pair_starts: Vec<u32>,
    blocks: Vec<Columns>,
    factor: Vec<Columns>,
    diagonal: Vec<M3>,
    /// Packed `L_ii` and its inverse.
    pivots: Vec<[f64; 6]>,
    inverses: Vec<[f64; 6]>,
    scalars: Vec<f64>,
}

impl<T: Real> BlockIc<T> {
    /// Diagonal shift of the last update, relative; 0 when none was needed.
    pub fn shift(&self) -> f64 {
        self.shift
    }

    /// Blocks `(i, j, L_ij)` of the last factor, row-major, diagonal last in
    /// each row.
    pub fn factor_blocks(&self) -> Vec<(usize, usize, [f64; 9])> {
        let w = &self.work;
        let mut out = Vec::new();
        for (i, &row) in w.place.iter().enumerate() {
            let row = row as usize;
            for k in w.starts[row] as usize..w.starts[row + 1] as usize {
                let j = w.order[w.columns[k] as usize] as usize;
                out.push((i, j, rows(&w.factor[k])));
            }
            let l = &w.pivots[row];
            let full = [l[0], 0.0, 0.0, l[1], l[2], 0.0, l[3], l[4], l[5]];
            out.push((i, i, full));
        }
        out
    }
}

impl<T: Real> Preconditioner<T> for BlockIc<T> {
    fn name(&self) -> &str {
        "block-ic"
    }

    fn update(
        &mut self,
        a: &dyn ExplicitOperator<T>,
        filter: &dyn Filter<T>,
    ) -> Result<(), LinsolveError> {
        let w = &mut self.work;
        let mean = filtered_diagonal(a, filter, &mut w.diagonal, &mut w.scalars)?;
        let stat = a.static_part();
        if w.pattern != Some(stat.pattern().id()) {
            w.analyse(stat.pattern(), &mut self.factor);
        }
        w.gather(stat, filter);
        self.shift = 0.0;
        while !w.factorise(self.shift) {
            self.shift = shift::larger(self.shift, shift::FIRST, "block-ic")?;
        }
        self.factor.set(&w.factor, &w.inverses);
        self.scalar_inverse.clear();
        let inverse = w.scalars.iter().map(|&d| positive_inverse(d, mean));
        self.scalar_inverse.extend(inverse.map(T::from_f64));
        Ok(())
    }

    fn apply(&mut self, _: &dyn LinearOperator<T>, r: &[T], z: &mut [T]) {
        let cut = 3 * self.work.pivots.len();
        self.factor.solve(&r[..cut], &mut z[..cut]);
        for (z, (&d, &r)) in z[cut..]
            .iter_mut()
            .zip(self.scalar_inverse.iter().zip(&r[cut..]))
        {
            *z = d * r;
        }
    }

    fn heap_bytes(&self) -> usize {
        let w = &self.work;
        self.factor.heap_bytes()
            + size_of::<T>() * self.scalar_inverse.capacity()
            + 8 * (w.pairs.capacity() + w.scalars.capacity())
            + 4 * (w.order.capacity() + w.place.capacity() + w.starts.capacity())
            + 4 * (w.columns.capacity() + w.slots.capacity() + w.pair_starts.capacity())
            + 96 * (w.blocks.capacity() + w.factor.capacity())
            + 72 * w.diagonal.capacity()
            + 48 * (w.pivots.capacity() + w.inverses.capacity())
    }
}

impl Work {
    /// Slots, order and the pairs of the factorisation.
    fn analyse<T: Real>(&mut self, pattern: &Pattern, factor: &mut Triangular<T>) {
        let n = pattern.points();
        let (mut starts, mut columns, mut slots) = (vec![0], Vec::new(), Vec::new());
        for i in 0..n {
            for slot in pattern.row(i).start..pattern.diagonal_slot(i) as usize {
                columns.push(pattern.all_columns()[slot]);
                slots.push(slot as u32);
            }
            starts.push(columns.len());
        }
        factor.analyse(&starts, &columns);
        self.order.clear();
        self.order.extend_from_slice(factor.order());
        self.place.resize(n, 0);
        for (new, &old) in self.order.iter().enumerate() {
            self.place[old as usize] = new as u32;
        }
        let lists = [
            &mut self.starts,
            &mut self.columns,
            &mut self.slots,
            &mut self.pair_starts,
        ];
        for list in lists {
            list.clear();
        }
        self.pairs.clear();
        self.starts.push(0);
        self.pair_starts.push(0);
        for &i in &self.order {
            let row = starts[i as usize]..starts[i as usize + 1];
            let own = self.columns.len();
            for k in row.clone() {
                let j = columns[k] as usize;
                // the row of j is complete: it comes earlier
                let other = self.starts[self.place[j] as usize] as usize;
                let (mut p, mut q) = (row.start, starts[j]);
                while p < k && q < starts[j + 1] {
                    match columns[p].cmp(&columns[q]) {
                        std::cmp::Ordering::Less => p += 1,
                        std::cmp::Ordering::Greater => q += 1,
                        std::cmp::Ordering::Equal => {
                            let (p_at, q_at) = (own + p - row.start, other + q - starts[j]);
                            self.pairs.push((p_at as u32, q_at as u32));
                            p += 1;
                            q += 1;
                        }
                    }
                }
                self.pair_starts.push(self.pairs.len() as u32);
            }
            for k in row {
                self.columns.push(self.place[columns[k] as usize]);
                self.slots.push(slots[k]);
            }
            self.starts.push(self.columns.len() as u32);
        }
        self.pattern = Some(pattern.id());
    }

    /// Strictly lower rows of `S A S` and its diagonal, in processing order.
    fn gather<T: Real>(&mut self, a: &Bsr<T>, filter: &dyn Filter<T>) {
        let blocks = a.blocks();
        self.blocks.resize(self.slots.len(), Columns::default());
        for (to, &slot) in self.blocks.iter_mut().zip(&self.slots) {
            let b = blocks[slot as usize].map(T::to_f64);
            *to = [
                [b[0], b[1], b[2], 0.0],
                [b[3], b[4], b[5], 0.0],
                [b[6], b[7], b[8], 0.0],
            ];
        }
        let Some(filter) = filter.as_blocks() else {
            return;
        };
        for (i, s) in filter.iter() {
            let row = self.place[i] as usize;
            for k in self.starts[row] as usize..self.starts[row + 1] as usize {
                self.blocks[k] = columns(&small::product(s, &rows(&self.blocks[k])));
            }
        }
        if filter.is_empty() {
            return;
        }
        for (block, &j) in self.blocks.iter_mut().zip(&self.columns) {
            if let Some(s) = filter.projector(self.order[j as usize]) {
                *block = columns(&small::product(&rows(block), s));
            }
        }
    }

    /// False when a pivot is not positive.
    fn factorise(&mut self, shift: f64) -> bool {
        self.factor.resize(self.blocks.len(), Columns::default());
        self.pivots.clear();
        self.inverses.clear();
        for (i, &point) in self.order.iter().enumerate() {
            let row = self.starts[i] as usize..self.starts[i + 1] as usize;
            let mut d = self.diagonal[point as usize];
            let top = d[0].abs().max(d[4].abs()).max(d[8].abs());
            for k in [0, 4, 8] {
                d[k] += shift * d[k].abs();
            }
            let mut d = columns(&d).map(f64x4::new);
            for at in row {
                let mut s = self.blocks[at].map(f64x4::new);
                let pairs = self.pair_starts[at] as usize..self.pair_starts[at + 1] as usize;
                for &(p, q) in &self.pairs[pairs] {
                    subtract_product(&mut s, &self.factor[p as usize], &self.factor[q as usize]);
                }
                let l = right_solve(&s, &self.inverses[self.columns[at] as usize]);
                let l = l.map(f64x4::to_array);
                subtract_product(&mut d, &l, &l);
                self.factor[at] = l;
            }
            match small::cholesky(&rows(&d.map(f64x4::to_array)), 1e-12 * top) {
                Some(l) => {
                    self.inverses.push(small::invert_lower(&l));
                    self.pivots.push(l);
                }
                None => return false,
            }
        }
        true
    }
}

fn columns(b: &M3) -> Columns {
    [0, 1, 2].map(|c| [b[c], b[3 + c], b[6 + c], 0.0])
}

fn rows(b: &Columns) -> M3 {
    std::array::from_fn(|k| b[k % 3][k / 3])
}

/// `s −= a bᵀ`.
#[inline(always)]
fn subtract_product(s: &mut [f64x4; 3], a: &Columns, b: &Columns) {
    for k in 0..3 {
        let column = f64x4::new(a[k]);
        for c in 0..3 {
            s[c] = column.mul_neg_add(f64x4::splat(b[k][c]), s[c]);
        }
    }
}

/// `s L⁻ᵀ` from the packed inverse of `L`.
#[inline(always)]
fn right_solve(s: &[f64x4; 3], inverse: &[f64; 6]) -> [f64x4; 3] {
    let [a, b, c, d, e, f] = inverse.map(f64x4::splat);
    [
        a * s[0],
        b.mul_add(s[0], c * s[1]),
        d.mul_add(s[0], e.mul_add(s[1], f * s[2])),
    ]
}
