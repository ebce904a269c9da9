//! The coarse matrix `Pᵀ A P`, numerically from a plan made once.

use super::graph::Weights;
use super::level::{Level, rows};

/// Rows of a leaf of the recursion over rows, and rows for one thread.
const ROWS: usize = 256;
const SERIAL: usize = 8192;

type Block = [f32; 9];

/// Interpolation `P` (scalar weights, the same for x, y, z) between two levels
/// and the plan of the triple product: `Q = A P` by rows, then `Pᵀ Q`.
#[derive(Debug, Clone, Default)]
pub(super) struct Transfer {
    p: Weights,
    pt: Weights,
    q_starts: Vec<u32>,
    q: Vec<Block>,
    /// For each block of a row (diagonal, lower, upper) and each weight of its
    /// column: the block of the row of `Q`.
    spread: Vec<u32>,
    /// First entry of `spread` of every row.
    spread_starts: Vec<u32>,
    /// For each weight of `Pᵀ`: pairs (block of `Q`, target), the diagonal
    /// being target 0 and the lower blocks those behind.
    collect: Vec<(u32, u32)>,
    collect_starts: Vec<u32>,
}

impl Transfer {
    /// Plan for rows in the orders of both levels.
    pub fn new(fine: &Level, coarse: &Level, p: Weights) -> Self {
        let m = coarse.rows();
        let mut out = Self {
            pt: p.transposed(m),
            p,
            ..Self::default()
        };
        out.q_starts.push(0);
        out.spread_starts.push(0);
        let mut q_columns: Vec<u32> = Vec::new();
        let mut row: Vec<u32> = Vec::new();
        for neighbours in neighbours(fine) {
            row.clear();
            for &j in &neighbours {
                row.extend(out.p.row(j as usize).map(|e| e.0));
            }
            row.sort_unstable();
            row.dedup();
            for &j in &neighbours {
                for (c, _) in out.p.row(j as usize) {
                    out.spread.push(row.partition_point(|&k| k < c) as u32);
                }
            }
            q_columns.extend_from_slice(&row);
            out.q_starts.push(q_columns.len() as u32);
            out.spread_starts.push(out.spread.len() as u32);
        }
        out.q = vec![[0.0; 9]; q_columns.len()];
        out.collect_starts.push(0);
        for i in 0..m {
            let first = coarse.lower.starts[i];
            let columns =
                &coarse.lower.columns[first as usize..coarse.lower.starts[i + 1] as usize];
            for (fine, _) in out.pt.row(i) {
                for k in out.q_starts[fine as usize]..out.q_starts[fine as usize + 1] {
                    let c = q_columns[k as usize];
                    if c as usize == i {
                        out.collect.push((k, 0));
                    } else if let Ok(at) = columns.binary_search(&c) {
                        out.collect.push((k, at as u32 + 1));
                    }
                }
                out.collect_starts.push(out.collect.len() as u32);
            }
        }
        out
    }

    /// Lower half and diagonal of the coarse matrix.
    pub fn product(&mut self, fine: &Level, coarse: &mut Level) {
        let Self {
            p,
            pt,
            q_starts,
            q,
            spread,
            spread_starts,
            collect,
            collect_starts,
        } = self;
        let mut none = vec![(); fine.rows()];
        by_rows(0, q_starts, q, &mut none, &|i, row, _| {
            row.fill([0.0; 9]);
            let targets = &spread[spread_starts[i] as usize..spread_starts[i + 1] as usize];
            let mut at = 0;
            let mut put = |block: &Block, j: usize| {
                let weights = &p.weights[p.starts[j] as usize..p.starts[j + 1] as usize];
                for (&t, &w) in targets[at..].iter().zip(weights) {
                    add(&mut row[t as usize], w, block);
                }
                at += weights.len();
            };
            put(&fine.diagonal[i], i);
            let (l, u) = (&fine.lower, &fine.upper);
            for k in l.starts[i] as usize..l.starts[i + 1] as usize {
                put(&l.blocks[k], l.columns[k] as usize);
            }
            let end = fine.colour_end(i);
            for k in u.starts[i] as usize..u.starts[i + 1] as usize {
                put(&u.blocks[k], u.columns[k] as usize + end);
            }
        });
        let q = &*q;
        let Level {
            lower, diagonal, ..
        } = coarse;
        by_rows(
            0,
            &lower.starts,
            &mut lower.blocks,
            diagonal,
            &|i, row, diagonal| {
                row.fill([0.0; 9]);
                *diagonal = [0.0; 9];
                for k in pt.starts[i] as usize..pt.starts[i + 1] as usize {
                    let w = pt.weights[k];
                    let pairs = collect_starts[k] as usize..collect_starts[k + 1] as usize;
                    for &(from, to) in &collect[pairs] {
                        let to = match to {
                            0 => &mut *diagonal,
                            t => &mut row[t as usize - 1],
                        };
                        add(to, w, &q[from as usize]);
                    }
                }
            },
        );
    }

    /// `b_c = Pᵀ r`.
    pub fn restrict(&self, r: &[[f32; 3]], b: &mut [[f32; 3]]) {
        let pt = &self.pt;
        rows(0, b, &|i, _| weighted(pt, i, r, [0.0; 3]));
    }

    /// `x += P x_c`.
    pub fn prolong(&self, coarse: &[[f32; 3]], x: &mut [[f32; 3]]) {
        let p = &self.p;
        rows(0, x, &|i, x| weighted(p, i, coarse, *x));
    }

    pub fn heap_bytes(&self) -> usize {
        self.p.heap_bytes()
            + self.pt.heap_bytes()
            + 36 * self.q.capacity()
            + 4 * (self.q_starts.capacity()
                + self.spread.capacity()
                + self.spread_starts.capacity()
                + self.collect_starts.capacity())
            + 8 * self.collect.capacity()
    }
}

/// The point itself, then its lower and upper neighbours, of every row.
fn neighbours(level: &Level) -> impl Iterator<Item = Vec<u32>> + '_ {
    (0..level.rows()).map(|i| {
        let (l, u) = (&level.lower, &level.upper);
        let end = level.colour_end(i) as u32;
        let mut out = vec![i as u32];
        out.extend(&l.columns[l.starts[i] as usize..l.starts[i + 1] as usize]);
        let upper = &u.columns[u.starts[i] as usize..u.starts[i + 1] as usize];
        out.extend(upper.iter().map(|j| j + end));
        out
    })
}

#[inline(always)]
fn weighted(m: &Weights, i: usize, x: &[[f32; 3]], mut sum: [f32; 3]) -> [f32; 3] {
    let row = m.starts[i] as usize..m.starts[i + 1] as usize;
    for (&j, &w) in m.columns[row.clone()].iter().zip(&m.weights[row]) {
        let x = &x[j as usize];
        for k in 0..3 {
            sum[k] = w.mul_add(x[k], sum[k]);
        }
    }
    sum
}

#[inline(always)]
fn add(to: &mut Block, w: f32, from: &Block) {
    for k in 0..9 {
        to[k] = w.mul_add(from[k], to[k]);
    }
}

/// `f(row, its blocks, its item)` for rows `first..`, blocks cut at `starts`;
/// in parallel by halves.
fn by_rows<D: Send>(
    first: usize,
    starts: &[u32],
    blocks: &mut [Block],
    items: &mut [D],
    f: &(impl Fn(usize, &mut [Block], &mut D) + Sync),
) {
    let n = items.len();
    if n <= ROWS {
        let mut rest = blocks;
        for (k, item) in items.iter_mut().enumerate() {
            let (row, after) = rest.split_at_mut((starts[k + 1] - starts[k]) as usize);
            f(first + k, row, item);
            rest = after;
        }
        return;
    }
    let half = n / 2;
    let (left, right) = blocks.split_at_mut((starts[half] - starts[0]) as usize);
    let (a, b) = items.split_at_mut(half);
    let mut low = || by_rows(first, &starts[..=half], left, a, f);
    let mut high = || by_rows(first + half, &starts[half..], right, b, f);
    if n <= SERIAL {
        low();
        high();
    } else {
        rayon::join(low, high);
    }
}
