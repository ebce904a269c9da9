//! Where the blocks of a factor lie, and which updates make it.

use crate::{BorderPattern, Pattern};

/// A target that does not exist.
pub(super) const NONE: u32 = u32::MAX;

/// Lower triangle of node blocks by columns, the diagonal block first.
#[derive(Debug, Clone, Default)]
pub(super) struct Plan {
    /// First unknown of every node in node order, and their number.
    pub first: Vec<u32>,
    /// Blocks of every column; `starts[p]` is the diagonal block.
    pub starts: Vec<u32>,
    pub rows: Vec<u32>,
    /// First value of every block, column by column, and their number.
    pub offsets: Vec<u32>,
    /// For every column and every pair `a ≥ b` of its lower blocks, the block
    /// that `L_a L_bᵀ` updates, or [`NONE`].
    pub targets: Vec<u32>,
    pub target_starts: Vec<usize>,
    /// Where the strictly lower slots of the points' pattern go.
    pub of_points: Vec<Place>,
    /// Where the scalars' slots go: 1×3 with points, single ones.
    pub of_couplings: Vec<Place>,
    pub of_scalars: Vec<Place>,
}

/// Slot of a matrix, first value of a block entry and the distance between its
/// columns.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    pub slot: u32,
    pub at: u32,
    pub stride: u32,
}

impl Plan {
    /// `level` of fill: an entry that elimination makes from entries of levels
    /// `a` and `b` has level `a + b + 1`, and is kept up to `level`.
    pub(super) fn new(points: &Pattern, border: Option<&BorderPattern>, level: usize) -> Self {
        let n = points.points();
        let owned = |p: usize| border.map_or(0..0, |b| b.owned(p));
        let mut plan = Self {
            first: (0..n).map(|p| (3 * p + owned(p).start) as u32).collect(),
            ..Self::default()
        };
        plan.first
            .push((3 * n + border.map_or(0, BorderPattern::scalars)) as u32);
        plan.number(&columns(points, border, level));
        plan.pair();
        for i in 0..n {
            for slot in points.row(i).start..points.diagonal_slot(i) as usize {
                let j = points.all_columns()[slot] as usize;
                plan.of_points.extend(plan.place(slot, i, 0, j, 0));
            }
        }
        let Some(border) = border else {
            return plan;
        };
        let local = |s: usize| 3 + s - border.owned(border.owners()[s] as usize).start;
        for (s, &i) in border.owners().iter().enumerate() {
            let i = i as usize;
            for slot in border.point_row(s) {
                let p = border.point_columns()[slot] as usize;
                let place = if p <= i {
                    plan.place(slot, i, local(s), p, 0)
                } else {
                    // a column of a block instead of a row
                    let place = plan.place(slot, p, 0, i, local(s));
                    place.map(|place| Place { stride: 1, ..place })
                };
                plan.of_couplings.extend(place);
            }
            for slot in border.scalar_row(s) {
                let t = border.scalar_columns()[slot] as usize;
                if t <= s {
                    let j = border.owners()[t] as usize;
                    let place = plan.place(slot, i, local(s), j, local(t));
                    plan.of_scalars.extend(place);
                }
            }
        }
        plan
    }

    /// Number of nodes.
    pub(super) fn nodes(&self) -> usize {
        self.first.len().saturating_sub(1)
    }

    /// Unknowns of a node.
    #[inline(always)]
    pub(super) fn size(&self, node: usize) -> usize {
        (self.first[node + 1] - self.first[node]) as usize
    }

    /// Strictly lower blocks of a column.
    #[inline(always)]
    pub(super) fn below(&self, column: usize) -> std::ops::Range<usize> {
        self.starts[column] as usize + 1..self.starts[column + 1] as usize
    }

    /// Values of a block.
    #[inline(always)]
    pub(super) fn values(&self, block: usize) -> std::ops::Range<usize> {
        self.offsets[block] as usize..self.offsets[block + 1] as usize
    }

    fn number(&mut self, columns: &[Vec<u32>]) {
        self.starts.push(0);
        self.offsets.push(0);
        let mut at = 0;
        for (p, column) in columns.iter().enumerate() {
            for &i in column {
                self.rows.push(i);
                at += self.size(i as usize) * self.size(p);
                self.offsets
                    .push(u32::try_from(at).expect("fewer than 2^32 values"));
            }
            self.starts.push(self.rows.len() as u32);
        }
    }

    fn pair(&mut self) {
        self.target_starts.push(0);
        for p in 0..self.nodes() {
            for a in self.below(p) {
                for b in self.below(p).start..=a {
                    let found = self.block(self.rows[a], self.rows[b] as usize);
                    self.targets.push(found.unwrap_or(NONE));
                }
            }
            self.target_starts.push(self.targets.len());
        }
    }

    fn block(&self, row: u32, column: usize) -> Option<u32> {
        let from = self.starts[column];
        let rows = &self.rows[from as usize..self.starts[column + 1] as usize];
        rows.binary_search(&row).ok().map(|k| from + k as u32)
    }

    fn place(&self, slot: usize, i: usize, r: usize, j: usize, c: usize) -> Option<Place> {
        let block = self.block(i as u32, j)?;
        let stride = self.size(i);
        Some(Place {
            slot: slot as u32,
            at: self.offsets[block as usize] + (c * stride + r) as u32,
            stride: stride as u32,
        })
    }

    pub(super) fn heap_bytes(&self) -> usize {
        let places = [&self.of_points, &self.of_couplings, &self.of_scalars];
        let words = [
            &self.first,
            &self.starts,
            &self.rows,
            &self.offsets,
            &self.targets,
        ];
        12 * places.iter().map(|p| p.capacity()).sum::<usize>()
            + 4 * words.iter().map(|w| w.capacity()).sum::<usize>()
            + 8 * self.target_starts.capacity()
    }
}

/// Rows of every column of the lower triangle, the diagonal first.
fn columns(points: &Pattern, border: Option<&BorderPattern>, level: usize) -> Vec<Vec<u32>> {
    let n = points.points();
    // strictly lower rows: the 3×3 pattern and the scalars' couplings by owner
    let mut rows: Vec<Vec<u32>> = (0..n)
        .map(|i| {
            let below = points.row(i).start..points.diagonal_slot(i) as usize;
            points.all_columns()[below].to_vec()
        })
        .collect();
    if let Some(border) = border {
        for (s, &i) in border.owners().iter().enumerate() {
            let of_points = &border.point_columns()[border.point_row(s)];
            let of_scalars = &border.scalar_columns()[border.scalar_row(s)];
            let owners = of_scalars.iter().map(|&t| border.owners()[t as usize]);
            for j in of_points.iter().copied().chain(owners) {
                if i != j {
                    rows[i.max(j) as usize].push(i.min(j));
                }
            }
        }
    }
    let mut out: Vec<Vec<u32>> = (0..n as u32).map(|p| vec![p]).collect();
    let mut levels: Vec<Vec<usize>> = vec![vec![0]; n];
    let mut of = vec![usize::MAX; n];
    for i in 0..n {
        let mut row: std::collections::BTreeSet<u32> = rows[i].iter().copied().collect();
        for &j in &row {
            of[j as usize] = 0;
        }
        let mut next = row.first().copied();
        while let Some(k) = next {
            let above = of[k as usize];
            if level > 0 {
                // later rows of column k are not there yet: all are below i
                for (&j, &l) in out[k as usize][1..].iter().zip(&levels[k as usize][1..]) {
                    let made = above + l + 1;
                    if made <= level && made < of[j as usize] {
                        of[j as usize] = made;
                        row.insert(j);
                    }
                }
            }
            next = row.range(k + 1..).next().copied();
        }
        for &j in &row {
            out[j as usize].push(i as u32);
            levels[j as usize].push(of[j as usize]);
            of[j as usize] = usize::MAX;
        }
    }
    out
}
