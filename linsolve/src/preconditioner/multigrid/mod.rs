//! Algebraic multigrid by smoothed aggregation.

mod coarsest;
mod galerkin;
mod graph;
mod level;

use super::{BlockJacobi, Preconditioner, diagonal::positive_inverse, filtered_diagonal};
use crate::small::{self, M3};
use crate::vector::{From, tree};
use crate::{Bsr, ExplicitOperator, Filter, LinearOperator, LinsolveError, Real};
use coarsest::Coarsest;
use galerkin::Transfer;
use graph::Graph;
use level::Level;

/// Points of the coarsest level, which is factorised.
const COARSEST: usize = 40;
/// Points above which an update runs inside the thread pool.
const HAND_OVER: usize = 8192;
/// Levels at most; 2D coarsening divides the points by eight or so.
const LEVELS: usize = 12;

/// One V(1, 1) cycle of smoothed aggregation: name `"multigrid"`.
///
/// ```text
/// x = (D + L)⁻¹ r;   x ← x + P A_c⁻¹ Pᵀ (r − A x);   x ← x + (D + U)⁻¹ (r − A x)
/// A_c = Pᵀ A P,  recursively;   P = (I − ω D_s⁻¹ L_s) T,   ω = 0.8          [Vanek1996]
/// ```
/// * `T` maps every point to its aggregate, a point and its near neighbours.
///   `P` holds one weight \[1\] for x, y and z alike, rows of sum 1: rigid
///   translations are exact.
/// * `L_s`, `D_s`: graph Laplacian of the near neighbours and its diagonal. An
///   edge weighs the fourth power of the number of neighbours that its ends
///   have in common, which on a mesh falls with the distance.
/// * Gauss-Seidel by blocks, colour by colour, forward before and backward
///   after the correction: the cycle is symmetric, and positive definite
///   whenever the matrix is, without an estimate of eigenvalues.
/// * The matrix is the static part with the complete diagonal, filtered to
///   `S A S + m̄ (I − S)`; the off-diagonal blocks of contacts are ignored.
/// * At most 40 points are left on the coarsest level, which is factorised; a
///   graph that no longer coarsens ends with a symmetric sweep.
///
/// Deviations from the source: aggregates and weights come from the pattern,
/// not from the values. They are made once per pattern, an update computes
/// numbers only, and it remembers nothing of earlier matrices: a run that is
/// stopped and continued makes the same iterations. Rotations are not among
/// the coarse motions, positions being unknown here.
///
/// Everything is stored in single precision, scaled by a power of two. When a
/// diagonal block of any level or the coarsest matrix is not positive definite,
/// block Jacobi stands in until the next update
/// ([`fell_back`](Self::fell_back)).
#[derive(Debug, Clone, Default)]
pub struct Multigrid<T> {
    pattern: Option<u64>,
    /// Point of every row of the finest level.
    order: Vec<u32>,
    place: Vec<u32>,
    /// Slots of the lower blocks of the finest level.
    slots: Vec<u32>,
    levels: Vec<Level>,
    transfers: Vec<Transfer>,
    coarsest: Coarsest,
    jacobi: BlockJacobi<T>,
    scalar_inverse: Vec<T>,
    fallback: bool,
    scale: f64,
    diagonal: Vec<M3>,
    scalars: Vec<f64>,
    projected: Vec<(usize, M3)>,
}

impl<T: Real> Multigrid<T> {
    /// Points of every level, the finest first.
    pub fn level_sizes(&self) -> Vec<usize> {
        self.levels.iter().map(Level::rows).collect()
    }

    /// Whether the last matrix was refused and block Jacobi stands in.
    pub fn fell_back(&self) -> bool {
        self.fallback
    }

    fn analyse(&mut self, a: &Bsr<T>) {
        let pattern = a.pattern();
        self.levels.clear();
        self.transfers.clear();
        let mut graph = Graph::of_pattern(pattern);
        let (mut fine, order) = Level::new(&graph);
        self.place = vec![0; order.len()];
        for (new, &old) in order.iter().enumerate() {
            self.place[old as usize] = new as u32;
        }
        self.slots.clear();
        for (i, &old) in order.iter().enumerate() {
            for k in fine.lower.starts[i]..fine.lower.starts[i + 1] {
                let j = order[fine.lower.columns[k as usize] as usize];
                self.slots.push(pattern.slot(old, j).unwrap_or(0));
            }
        }
        self.order = order.clone();
        let mut order = order;
        while fine.rows() > COARSEST && self.levels.len() + 1 < LEVELS {
            let (p, count) = graph.interpolation();
            if count == 0 || 10 * count > 8 * fine.rows() {
                break;
            }
            graph = graph.coarse(&p, count);
            let (coarse, next) = Level::new(&graph);
            let mut place = vec![0; count];
            for (new, &old) in next.iter().enumerate() {
                place[old as usize] = new as u32;
            }
            let transfer = Transfer::new(&fine, &coarse, p.permuted(&order, &place));
            self.levels.push(std::mem::replace(&mut fine, coarse));
            self.transfers.push(transfer);
            order = next;
        }
        let small = fine.rows() <= COARSEST;
        self.coarsest = Coarsest::new(if small { fine.rows() } else { 0 });
        self.levels.push(fine);
        self.pattern = Some(pattern.id());
    }

    /// Values of the finest level: `S A S + m̄ (I − S)`, scaled to order 1.
    fn gather(&mut self, a: &Bsr<T>) {
        let Some(level) = self.levels.first_mut() else {
            return;
        };
        let blocks = a.blocks();
        let scale = self.scale;
        tree(
            (self.slots.as_slice(), level.lower.blocks.as_mut_slice()),
            4096,
            8192,
            &|(slots, out): (&[u32], &mut [[f32; 9]])| {
                for (&s, out) in slots.iter().zip(out) {
                    *out = blocks[s as usize].map(|v| (scale * v.to_f64()) as f32);
                }
                []
            },
        );
        for (d, &i) in level.diagonal.iter_mut().zip(&self.order) {
            let m = &self.diagonal[i as usize];
            *d = std::array::from_fn(|k| (scale * m[3 * (k % 3) + k / 3]) as f32);
        }
        for (i, s) in &self.projected {
            let row = self.place[*i] as usize;
            let (l, u) = (&mut level.lower, &level.upper);
            for k in l.starts[row] as usize..l.starts[row + 1] as usize {
                l.blocks[k] = times(s, &l.blocks[k], true);
            }
            for k in u.starts[row] as usize..u.starts[row + 1] as usize {
                let k = level.mirror[k] as usize;
                l.blocks[k] = times(s, &l.blocks[k], false);
            }
        }
    }

    /// False when the matrix is not positive definite.
    fn fill(&mut self, a: &Bsr<T>) -> bool {
        self.gather(a);
        let last = self.levels.len() - 1;
        for k in 0..last {
            let (fine, coarse) = self.levels.split_at_mut(k + 1);
            if !fine[k].finish() {
                return false;
            }
            self.transfers[k].product(&fine[k], &mut coarse[0]);
            // columns that the filter emptied
            for d in &mut coarse[0].diagonal {
                let shift = 1e-6 * (d[0] + d[4] + d[8]).max(f32::MIN_POSITIVE);
                for e in [0, 4, 8] {
                    d[e] += shift;
                }
            }
        }
        let small = self.levels[last].rows() <= COARSEST;
        if small {
            self.coarsest.factorise(&self.levels[last])
        } else {
            self.levels[last].finish()
        }
    }

    /// One V-cycle from 0 on level `k`, right-hand side and result inside.
    fn cycle(&mut self, k: usize) {
        if k + 1 == self.levels.len() {
            let level = &mut self.levels[k];
            if level.rows() <= COARSEST {
                self.coarsest.solve(&level.b, &mut level.x);
            } else {
                level.forward();
                level.backward();
            }
            return;
        }
        self.levels[k].forward();
        let (fine, coarse) = self.levels.split_at_mut(k + 1);
        self.transfers[k].restrict(&fine[k].r, &mut coarse[0].b);
        self.cycle(k + 1);
        let (fine, coarse) = self.levels.split_at_mut(k + 1);
        self.transfers[k].prolong(&coarse[0].x, &mut fine[k].x);
        self.levels[k].backward();
    }
}

/// `S B` or `B S` of a column-major block, `S` symmetric.
fn times(s: &M3, b: &[f32; 9], left: bool) -> [f32; 9] {
    let b = b.map(f64::from);
    // row-major, b is the transpose
    let out = if left {
        small::product(&b, s)
    } else {
        small::product(s, &b)
    };
    out.map(|v| v as f32)
}

impl<T: Real> Preconditioner<T> for Multigrid<T> {
    fn name(&self) -> &str {
        "multigrid"
    }

    fn update(
        &mut self,
        a: &dyn ExplicitOperator<T>,
        filter: &dyn Filter<T>,
    ) -> Result<(), LinsolveError> {
        let stat = a.static_part();
        let mean = filtered_diagonal(a, filter, &mut self.diagonal, &mut self.scalars)?;
        if self.pattern != Some(stat.pattern().id()) {
            self.analyse(stat);
        }
        self.scalar_inverse.clear();
        let inverse = self.scalars.iter().map(|&d| positive_inverse(d, mean));
        self.scalar_inverse.extend(inverse.map(T::from_f64));
        self.scale = (-mean.log2().floor()).clamp(-1000.0, 1000.0).exp2();
        self.projected.clear();
        if let Some(filter) = filter.as_blocks() {
            self.projected.extend(filter.iter().map(|(i, s)| (i, *s)));
        }
        self.fallback = if self.order.len() <= HAND_OVER {
            !self.fill(stat)
        } else {
            // one hand-over to the thread pool instead of one for each kernel
            rayon::scope(|_| !self.fill(stat))
        };
        if self.fallback {
            self.jacobi.update(a, filter)?;
        }
        Ok(())
    }

    fn apply(&mut self, a: &dyn LinearOperator<T>, r: &[T], z: &mut [T]) {
        if self.fallback {
            return self.jacobi.apply(a, r, z);
        }
        let points = r.as_chunks::<3>().0;
        let order = &self.order;
        level::rows(0, &mut self.levels[0].b, &|i, _| {
            points[order[i] as usize].map(|v| v.to_f64() as f32)
        });
        self.cycle(0);
        let (x, place, scale) = (&self.levels[0].x, &self.place, self.scale);
        let (z, zs) = z.split_at_mut(3 * place.len());
        let rest = self.scalar_inverse.iter().zip(&r[z.len()..]);
        for (z, (&d, &r)) in zs.iter_mut().zip(rest) {
            *z = d * r;
        }
        let z = z.as_chunks_mut::<3>().0;
        let n = z.len();
        tree((From(0, n), z), 1024, 8192, &|(from, z): (
            From,
            &mut [[T; 3]],
        )| {
            for (k, z) in z.iter_mut().enumerate() {
                let x = &x[place[from.0 + k] as usize];
                *z = x.map(|v| T::from_f64(scale * f64::from(v)));
            }
            []
        });
    }

    fn heap_bytes(&self) -> usize {
        self.levels.iter().map(Level::heap_bytes).sum::<usize>()
            + self
                .transfers
                .iter()
                .map(Transfer::heap_bytes)
                .sum::<usize>()
            + self.coarsest.heap_bytes()
            + self.jacobi.heap_bytes()
            + 4 * (self.order.capacity() + self.place.capacity() + self.slots.capacity())
            + 72 * self.diagonal.capacity()
            + 80 * self.projected.capacity()
            + 8 * self.scalars.capacity()
            + size_of::<T>() * self.scalar_inverse.capacity()
    }
}
