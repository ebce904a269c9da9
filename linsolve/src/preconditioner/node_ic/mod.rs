//! Incomplete Cholesky by blocks of points with their scalars.

mod dense;
mod plan;

use super::block_ic::{FIRST_SHIFT, LAST_SHIFT};
use super::{Preconditioner, diagonal::positive_inverse, filtered_diagonal};
use crate::{BlockFilter, ExplicitOperator, Filter, LinearOperator, LinsolveError, Real};
use plan::{NONE, Plan};

/// Node IC: name `"node-ic"`.
///
/// ```text
/// L_ij = (A_ij − Σ_{k<j} L_ik L_jkᵀ) L_jj⁻ᵀ ,    L_ii L_iiᵀ = A_ii − Σ_k L_ik L_ikᵀ
/// ```
/// on *nodes*, a point with its `n` scalars, in blocks of size `3 + n` and in
/// the order of the points. The pattern is the points' pattern with the
/// couplings of scalars by their owners, and fill of two levels or as
/// [`with_fill`](Self::with_fill) says; diagonal blocks are factored exactly.
/// On a chain in its order there is no fill: the factor is exact. Without
/// scalars and fill it is the factor of [`BlockIc`](super::BlockIc).
///
/// In nets of yarns, chains are stiff along their directions alone. What is
/// dropped then spoils pivots, and the shift that mends them outweighs mass and
/// bending: on a knit in steps of 1 ms, levels 0 and 1 need shifts of 1e-2, level 2
/// none.
///
/// Diagonal blocks are complete, off-diagonal blocks of contacts are ignored.
/// A pivot that is not above `1e-12 A_kk` restarts with the diagonal shift
/// `s |A_kk|`, `s = 1e-3` and doubling. The filter enters as `S_i A_ij S_j` and
/// `m̄ (I − S_i)` on the diagonal; fixed scalars get `m̄`.
///
/// Factorisation is in double precision. It and the solve run on one thread: in
/// Cuthill–McKee order the rows that could run together are few.
#[derive(Debug, Clone)]
pub struct NodeIc<T> {
    level: usize,
    plan: Plan,
    pattern: Option<(u64, u64)>,
    /// Off-diagonal blocks at the plan's offsets; diagonal ones are unused.
    factor: Vec<T>,
    /// Packed inverse of every `L_ii`.
    inverses: Vec<T>,
    /// Of scalars without a point.
    scalar_inverse: Vec<T>,
    /// Current vector, node by node.
    vector: Vec<T>,
    shift: f64,
    work: Work,
}

/// Matrix and factor in double precision, kept between updates.
#[derive(Debug, Clone, Default)]
struct Work {
    matrix: Vec<f64>,
    factor: Vec<f64>,
    inverses: Vec<f64>,
    blocks: Vec<[f64; 9]>,
    scalars: Vec<f64>,
}

/// Level of fill by default.
const LEVEL: usize = 2;

impl<T: Real> Default for NodeIc<T> {
    fn default() -> Self {
        Self::with_fill(LEVEL)
    }
}

impl<T: Real> NodeIc<T> {
    /// Fill up to a level: blocks that elimination makes from blocks of levels
    /// `a` and `b` have level `a + b + 1`, those of the matrix 0.
    pub fn with_fill(level: usize) -> Self {
        Self {
            level,
            plan: Plan::default(),
            pattern: None,
            factor: Vec::new(),
            inverses: Vec::new(),
            scalar_inverse: Vec::new(),
            vector: Vec::new(),
            shift: 0.0,
            work: Work::default(),
        }
    }

    /// Diagonal shift of the last update, relative; 0 when none was needed.
    pub fn shift(&self) -> f64 {
        self.shift
    }

    /// Number of node blocks in the factor.
    pub fn block_count(&self) -> usize {
        self.plan.rows.len()
    }
}

impl<T: Real> Preconditioner<T> for NodeIc<T> {
    fn name(&self) -> &str {
        "node-ic"
    }

    fn update(
        &mut self,
        a: &dyn ExplicitOperator<T>,
        filter: &dyn Filter<T>,
    ) -> Result<(), LinsolveError> {
        let w = &mut self.work;
        let mean = filtered_diagonal(a, filter, &mut w.blocks, &mut w.scalars)?;
        let (points, border) = (a.static_part().pattern(), a.border());
        let pattern = (points.id(), border.map_or(0, |b| b.id()));
        if self.pattern != Some(pattern) {
            self.plan = Plan::new(points, border, self.level);
            self.pattern = Some(pattern);
        }
        w.gather(&self.plan, a, filter.as_blocks());
        self.shift = 0.0;
        while !w.factorise(&self.plan, self.shift) {
            self.shift = (2.0 * self.shift).max(FIRST_SHIFT);
            if self.shift > LAST_SHIFT {
                return Err(LinsolveError::ShiftExhausted {
                    method: "node-ic",
                    shift: LAST_SHIFT,
                });
            }
        }
        let round = |to: &mut Vec<T>, from: &[f64]| {
            to.clear();
            to.extend(from.iter().map(|&v| T::from_f64(v)));
        };
        round(&mut self.factor, &w.factor);
        round(&mut self.inverses, &w.inverses);
        self.scalar_inverse.clear();
        if border.is_none() {
            let inverse = w.scalars.iter().map(|&d| positive_inverse(d, mean));
            self.scalar_inverse.extend(inverse.map(T::from_f64));
        }
        Ok(())
    }

    fn apply(&mut self, _: &dyn LinearOperator<T>, r: &[T], z: &mut [T]) {
        let plan = &self.plan;
        let n = plan.nodes();
        let mut vector = std::mem::take(&mut self.vector);
        vector.resize(plan.first.last().map_or(0, |&l| l as usize), T::ZERO);
        let y = vector.as_mut_slice();
        for p in 0..n {
            let (first, size) = (plan.first[p] as usize, plan.size(p));
            let scalars = first - 3 * p + 3 * n;
            y[first..first + 3].copy_from_slice(&r[3 * p..3 * p + 3]);
            y[first + 3..first + size].copy_from_slice(&r[scalars..scalars + size - 3]);
        }
        let mut at = 0;
        for p in 0..n {
            let (done, rest) = y.split_at_mut(plan.first[p + 1] as usize);
            let own = &mut done[plan.first[p] as usize..];
            let packed = own.len() * (own.len() + 1) / 2;
            dense::lower_times(&self.inverses[at..at + packed], own);
            at += packed;
            for k in plan.below(p) {
                let i = plan.rows[k] as usize;
                let from = (plan.first[i] - plan.first[p + 1]) as usize;
                let other = &mut rest[from..from + plan.size(i)];
                dense::subtract_times(&self.factor[plan.values(k)], own, other);
            }
        }
        for p in (0..n).rev() {
            let (done, rest) = y.split_at_mut(plan.first[p + 1] as usize);
            let own = &mut done[plan.first[p] as usize..];
            for k in plan.below(p) {
                let i = plan.rows[k] as usize;
                let from = (plan.first[i] - plan.first[p + 1]) as usize;
                let other = &rest[from..from + plan.size(i)];
                dense::subtract_transposed(&self.factor[plan.values(k)], other, own);
            }
            let packed = own.len() * (own.len() + 1) / 2;
            at -= packed;
            dense::upper_times(&self.inverses[at..at + packed], own);
        }
        for p in 0..n {
            let (first, size) = (plan.first[p] as usize, plan.size(p));
            let scalars = first - 3 * p + 3 * n;
            z[3 * p..3 * p + 3].copy_from_slice(&y[first..first + 3]);
            z[scalars..scalars + size - 3].copy_from_slice(&y[first + 3..first + size]);
        }
        self.vector = vector;
        let cut = z.len() - self.scalar_inverse.len();
        for ((z, &r), &d) in z[cut..].iter_mut().zip(&r[cut..]).zip(&self.scalar_inverse) {
            *z = d * r;
        }
    }

    fn heap_bytes(&self) -> usize {
        let w = &self.work;
        let of_t = self.factor.capacity()
            + self.inverses.capacity()
            + self.scalar_inverse.capacity()
            + self.vector.capacity();
        let of_f64 = w.matrix.capacity()
            + w.factor.capacity()
            + w.inverses.capacity()
            + w.scalars.capacity()
            + 9 * w.blocks.capacity();
        size_of::<T>() * of_t + 8 * of_f64 + self.plan.heap_bytes()
    }
}

impl Work {
    /// Lower node blocks of `S A S + m̄ (I − S)`, the diagonal ones full below.
    fn gather<T: Real>(
        &mut self,
        plan: &Plan,
        a: &dyn ExplicitOperator<T>,
        filter: Option<&BlockFilter>,
    ) {
        self.matrix.clear();
        let values = plan.offsets.last().map_or(0, |&l| l as usize);
        self.matrix.resize(values, 0.0);
        let m = &mut self.matrix;
        let blocks = a.static_part().blocks();
        for place in &plan.of_points {
            let (block, stride) = (&blocks[place.slot as usize], place.stride as usize);
            for (c, column) in block.chunks_exact(3).enumerate() {
                for (r, &v) in column.iter().enumerate() {
                    m[place.at as usize + c * stride + r] = v.to_f64();
                }
            }
        }
        let (couplings, scalars) = a.border_values();
        for place in &plan.of_couplings {
            for (c, v) in couplings[place.slot as usize].iter().enumerate() {
                m[place.at as usize + c * place.stride as usize] = v.to_f64();
            }
        }
        for place in &plan.of_scalars {
            m[place.at as usize] = scalars[place.slot as usize].to_f64();
        }
        if let Some(filter) = filter.filter(|f| !f.is_empty()) {
            constrain(m, plan, filter);
        }
        // Last, since these are filtered already and hold the contacts.
        for (p, block) in self.blocks.iter().enumerate() {
            let (n, at) = (plan.size(p), plan.offsets[plan.starts[p] as usize] as usize);
            for (k, &v) in block.iter().enumerate() {
                m[at + k % 3 * n + k / 3] = v;
            }
            let first = plan.first[p] as usize - 3 * p;
            for k in 3..n {
                m[at + k * n + k] = self.scalars[first + k - 3];
            }
        }
    }

    /// False when a pivot is not positive.
    fn factorise(&mut self, plan: &Plan, shift: f64) -> bool {
        self.factor.clone_from(&self.matrix);
        self.inverses.clear();
        let mut scale = Vec::new();
        for p in 0..plan.nodes() {
            let n = plan.size(p);
            let at = plan.offsets[plan.starts[p] as usize] as usize;
            scale.clear();
            scale.extend((0..n).map(|k| self.matrix[at + k * n + k].abs()));
            let diagonal = &mut self.factor[at..at + n * n];
            for k in 0..n {
                diagonal[k * n + k] += shift * scale[k];
            }
            let first = self.inverses.len();
            self.inverses.resize(first + n * (n + 1) / 2, 0.0);
            let inverse = &mut self.inverses[first..];
            if !dense::factorise(diagonal, n, &scale, inverse) {
                return false;
            }
            let below = plan.below(p);
            for k in below.clone() {
                let m = plan.size(plan.rows[k] as usize);
                dense::right_solve(&mut self.factor[plan.values(k)], inverse, m, n);
            }
            // Columns lie one after the other: those to update are behind.
            let cut = plan.offsets[below.end] as usize;
            let (done, rest) = self.factor.split_at_mut(cut);
            let mut targets = plan.targets[plan.target_starts[p]..].iter();
            for a in below.clone() {
                for (b, &target) in (below.start..=a).zip(&mut targets) {
                    if target == NONE {
                        continue;
                    }
                    let sizes = [a, b].map(|k| plan.size(plan.rows[k] as usize));
                    let to = plan.values(target as usize);
                    dense::subtract_product(
                        &mut rest[to.start - cut..to.end - cut],
                        &done[plan.values(a)],
                        &done[plan.values(b)],
                        (sizes[0], sizes[1], n),
                    );
                }
            }
        }
        true
    }
}

/// `S_i A_ij S_j` on all blocks; rows and columns of fixed scalars vanish.
fn constrain(m: &mut [f64], plan: &Plan, filter: &BlockFilter) {
    let nodes = plan.nodes();
    let fixed: Vec<Vec<usize>> = (0..nodes)
        .map(|p| {
            let first = 3 * nodes + plan.first[p] as usize - 3 * p;
            let all = 3..plan.size(p);
            all.filter(|k| filter.is_scalar_fixed((first + k - 3) as u32))
                .collect()
        })
        .collect();
    let times = |s: &[f64; 9], v: [f64; 3]| -> [f64; 3] {
        std::array::from_fn(|k| s[3 * k] * v[0] + s[3 * k + 1] * v[1] + s[3 * k + 2] * v[2])
    };
    for p in 0..nodes {
        let of_column = filter.projector(p as u32);
        for k in plan.starts[p] as usize..plan.starts[p + 1] as usize {
            let i = plan.rows[k] as usize;
            let rows = plan.size(i);
            let block = &mut m[plan.values(k)];
            if let Some(s) = filter.projector(i as u32) {
                for column in block.chunks_exact_mut(rows) {
                    let v = times(s, [column[0], column[1], column[2]]);
                    column[..3].copy_from_slice(&v);
                }
            }
            if let Some(s) = of_column {
                for r in 0..rows {
                    let at = [r, rows + r, 2 * rows + r];
                    let v = times(s, at.map(|at| block[at]));
                    for (at, v) in at.into_iter().zip(v) {
                        block[at] = v;
                    }
                }
            }
            for &r in &fixed[i] {
                block
                    .iter_mut()
                    .skip(r)
                    .step_by(rows)
                    .for_each(|v| *v = 0.0);
            }
            for &c in &fixed[p] {
                block[c * rows..(c + 1) * rows].fill(0.0);
            }
        }
    }
}
