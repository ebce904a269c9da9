//! Incomplete Cholesky by blocks of points with their scalars.

mod compensate;
mod dense;
mod dropped;
mod factor;
mod parts;
mod plan;
mod sweep;

use super::{Preconditioner, diagonal::positive_inverse, filtered_diagonal};
use crate::{ExplicitOperator, Filter, LinearOperator, LinsolveError, Real};
use dropped::Dropped;
use factor::{Beyond, Source, held};
use plan::Plan;
use sweep::Sweep;

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
/// of 2.5e-4 or none. Garments of fine stiff yarn, whose rods lie in separators,
/// would need up to 2e-3.
///
/// Tries have no shift (unless the order is divided), then one of `2.5e-4 |A_kk|`.
/// When a pivot is not above `1e-12 A_kk`, what is dropped gets compensated (Ajiz and
/// Jennings, Int. J. Numer. Meth. Engng 20 (1984), by blocks): a dropped block `F` of
/// row `i` and column `j`, scaled by the diagonals to `F̂`, adds
///
/// ```text
/// (F̂ F̂ᵀ)^½ to D_i ,    (F̂ᵀ F̂)^½ to D_j ,
/// ```
/// and what is factored is the matrix with something semidefinite added that is as
/// directed as the stiffness that is lost. Rows come one after the other and `D_j` long
/// before `i`, so a first factorisation, with the shift of the first try or a larger one,
/// gathers the sums, and a second uses them. Blocks of the first level beyond the pattern
/// count alone: those further out are smaller and cost more than they bring. Should a pivot
/// fail still, there are shifts from 6.25e-5 on, doubling, and above 2e-3 shifts alone.
///
/// Diagonal blocks are complete, off-diagonal blocks of contacts are ignored. The
/// filter enters as `S_i A_ij S_j` and `m̄ (I − S_i)` on the diagonal; fixed scalars
/// get `m̄`.
///
/// Rows are eliminated in double precision and kept in `T`. The points' order is
/// divided where little separates (between the panels of a garment), into parts
/// that do not couple and separators behind them: the parts run together, and the
/// result is the same for any number of threads. The order of the points matters:
/// a knit is to be eliminated as it was knitted (backwards it needs a shift of
/// 8e-3). In an order that is not divided, nodes far behind their first neighbour
/// (rods along the border of a panel) come first.
#[derive(Debug, Clone)]
pub struct NodeIc<T> {
    level: usize,
    plan: Plan,
    pattern: Option<(u64, u64)>,
    /// Rows of the factor at the plan's places.
    factor: Vec<T>,
    /// Of scalars without a point.
    scalar_inverse: Vec<T>,
    /// Current vector, node by node.
    vector: Vec<T>,
    shift: f64,
    /// What is dropped of the first level beyond, and what makes up for it; from the
    /// first failure on.
    dropped: Option<Dropped>,
    compensation: Vec<T>,
    blocks: Vec<[f64; 9]>,
    scalars: Vec<f64>,
}

/// Level of fill by default.
const LEVEL: usize = 2;
/// Shift after one of 0, and the first one where the order is divided: what separates
/// loses most by what is dropped. Iterations grow with its square root.
const FIRST_SHIFT: f64 = 2.5e-4;

/// First shift of a compensated factor that fails.
const COMPENSATED_SHIFT: f64 = FIRST_SHIFT / 4.0;
/// Where compensation needs more than this, shifts alone do as well.
const LAST_COMPENSATED: f64 = 8.0 * FIRST_SHIFT;

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
            scalar_inverse: Vec::new(),
            vector: Vec::new(),
            shift: 0.0,
            dropped: None,
            compensation: Vec::new(),
            blocks: Vec::new(),
            scalars: Vec::new(),
        }
    }

    /// Diagonal shift of the last update, relative; 0 when none was needed.
    pub fn shift(&self) -> f64 {
        self.shift
    }

    /// Number of node blocks in the factor.
    pub fn block_count(&self) -> usize {
        self.plan.columns.len() + self.plan.points.len()
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
        let mean = filtered_diagonal(a, filter, &mut self.blocks, &mut self.scalars)?;
        let (points, border) = (a.static_part(), a.border());
        let pattern = (points.pattern().id(), border.map_or(0, |b| b.id()));
        if self.pattern != Some(pattern) {
            self.plan = Plan::new(points.pattern(), border, self.level);
            self.pattern = Some(pattern);
            let values = self.plan.values.last().map_or(0, |&n| n as usize);
            self.factor = vec![T::ZERO; values];
            self.dropped = None;
        }
        let held = held(&self.plan, filter.as_blocks());
        let tries: &[f64] = if self.plan.parts.len() == 1 {
            &[0.0, FIRST_SHIFT]
        } else {
            &[FIRST_SHIFT]
        };
        let mut source = Source {
            plan: &self.plan,
            points,
            border,
            values: a.border_values(),
            blocks: &self.blocks,
            scalars: &self.scalars,
            filter: filter.as_blocks(),
            held: &held,
            shift: 0.0,
            beyond: Beyond::Ignored,
            failed: false.into(),
        };
        let done = tries.iter().any(|&shift| {
            source.shift = shift;
            source.whole(&mut self.factor, &mut [])
        });
        if !done {
            source.shift = tries[0];
            let dropped: &Dropped = self.dropped.get_or_insert_with(|| {
                Dropped::new(&self.plan, points.pattern(), border, self.level)
            });
            source.compensate(dropped, &mut self.factor, &mut self.compensation)?;
        }
        self.shift = source.shift;
        self.scalar_inverse.clear();
        if border.is_none() {
            let inverse = self.scalars.iter().map(|&d| positive_inverse(d, mean));
            self.scalar_inverse.extend(inverse.map(T::from_f64));
        }
        Ok(())
    }

    fn apply(&mut self, _: &dyn LinearOperator<T>, r: &[T], z: &mut [T]) {
        let plan = &self.plan;
        let sweep = Sweep {
            plan,
            factor: &self.factor,
        };
        let whole = plan.parts.len() - 1;
        self.vector
            .resize(plan.first.last().map_or(0, |&l| l as usize), T::ZERO);
        sweep.forward(whole, r, &mut self.vector);
        sweep.backward(whole, &mut self.vector);
        for i in 0..plan.points.len() {
            let y = &self.vector[plan.first[i] as usize..plan.first[i + 1] as usize];
            let (point, scalars) = plan.unknowns(i);
            z[point].copy_from_slice(&y[..3]);
            z[scalars].copy_from_slice(&y[3..]);
        }
        let cut = z.len() - self.scalar_inverse.len();
        for ((z, &r), &d) in z[cut..].iter_mut().zip(&r[cut..]).zip(&self.scalar_inverse) {
            *z = d * r;
        }
    }

    fn heap_bytes(&self) -> usize {
        let of_t = [
            &self.factor,
            &self.scalar_inverse,
            &self.vector,
            &self.compensation,
        ];
        let of_t: usize = of_t.iter().map(|v| v.capacity()).sum();
        let of_f64 = self.scalars.capacity() + 9 * self.blocks.capacity();
        size_of::<T>() * of_t
            + 8 * of_f64
            + self.plan.heap_bytes()
            + self.dropped.as_ref().map_or(0, Dropped::heap_bytes)
    }
}
