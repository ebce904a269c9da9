//! Lower triangle by columns, ordered and analysed.

use crate::error::check_finite;
use crate::small::{self, M3};
use crate::{BlockFilter, BlockLayout, ExplicitOperator, LinsolveError, Real};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::perm::PermRef;
use faer::sparse::linalg::amd;
use faer::sparse::linalg::cholesky::{
    SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};

/// Compressed columns of the scalar lower triangle, made of full node blocks.
///
/// A node is a point (3 unknowns) or a scalar (1).
pub(super) struct Columns {
    pub(super) pattern_id: u64,
    pub(super) layout: BlockLayout,
    pub(super) symbolic: SymbolicCholesky<u32>,
    node_starts: Vec<usize>,
    node_rows: Vec<u32>,
    starts: Vec<u32>,
    rows: Vec<u32>,
    values: Vec<f64>,
    /// Value that each visited entry is added to.
    targets: Vec<u32>,
}

impl std::fmt::Debug for Columns {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Columns")
            .field("pattern_id", &self.pattern_id)
            .field("entries", &self.values.len())
            .finish_non_exhaustive()
    }
}

/// First unknown and number of unknowns of a node.
fn extent(layout: BlockLayout, node: usize) -> (usize, usize) {
    if node < layout.points {
        (3 * node, 3)
    } else {
        (2 * layout.points + node, 1)
    }
}

fn node_of(layout: BlockLayout, unknown: usize) -> usize {
    if unknown < 3 * layout.points {
        unknown / 3
    } else {
        unknown - 2 * layout.points
    }
}

fn failed(reason: impl std::fmt::Debug) -> LinsolveError {
    LinsolveError::Factorisation {
        method: "direct",
        reason: format!("{reason:?}"),
    }
}

impl Columns {
    /// Reads the pattern, orders it and analyses the factor.
    pub(super) fn analyse<T: Real>(a: &dyn ExplicitOperator<T>) -> Result<Self, LinsolveError> {
        let layout = a.layout();
        let nodes = layout.points + layout.scalars;
        // (column, row) of every node block, once
        let mut pairs: Vec<u64> = (0..nodes as u64).map(|i| i << 32 | i).collect();
        let mut last = u64::MAX;
        let mut visited = 0usize;
        a.visit_lower(&mut |i, j, _| {
            let key = (node_of(layout, j) as u64) << 32 | node_of(layout, i) as u64;
            if key != last {
                pairs.push(key);
                last = key;
            }
            visited += 1;
        });
        pairs.sort_unstable();
        pairs.dedup();
        let mut node_starts = vec![0];
        let mut node_rows = Vec::with_capacity(pairs.len());
        for j in 0..nodes as u64 {
            while node_rows.len() < pairs.len() && pairs[node_rows.len()] >> 32 == j {
                node_rows.push(pairs[node_rows.len()] as u32);
            }
            node_starts.push(node_rows.len());
        }
        let (mut starts, mut rows) = (vec![0u32], Vec::new());
        for j in 0..nodes {
            let (first, size) = extent(layout, j);
            for c in 0..size {
                for &i in &node_rows[node_starts[j]..node_starts[j + 1]] {
                    let (row, height) = extent(layout, i as usize);
                    rows.extend(
                        (row..row + height)
                            .filter(|&r| r >= first + c)
                            .map(|r| r as u32),
                    );
                }
                starts.push(u32::try_from(rows.len()).map_err(failed)?);
            }
        }
        let symbolic = symbolic(layout, &node_starts, &node_rows, &starts, &rows)?;
        let mut out = Self {
            pattern_id: a.pattern_id(),
            layout,
            symbolic,
            node_starts,
            node_rows,
            values: vec![0.0; rows.len()],
            starts,
            rows,
            targets: Vec::with_capacity(visited),
        };
        let mut targets = std::mem::take(&mut out.targets);
        a.visit_lower(&mut |i, j, _| targets.push(out.position(i, j)));
        out.targets = targets;
        Ok(out)
    }

    /// Position of entry (i, j), i ≥ j, which is in the pattern.
    fn position(&self, i: usize, j: usize) -> u32 {
        let column = self.starts[j]..self.starts[j + 1];
        let rows = &self.rows[column.start as usize..column.end as usize];
        match rows.binary_search(&(i as u32)) {
            Ok(k) => column.start + k as u32,
            Err(_) => unreachable!("entry ({i}, {j}) was visited when the pattern was read"),
        }
    }

    /// Reads the values.
    pub(super) fn fill<T: Real>(
        &mut self,
        a: &dyn ExplicitOperator<T>,
    ) -> Result<(), LinsolveError> {
        self.values.fill(0.0);
        let mut at = 0;
        a.visit_lower(&mut |_, _, v| {
            if let Some(&t) = self.targets.get(at) {
                self.values[t as usize] += v;
            }
            at += 1;
        });
        if at != self.targets.len() {
            return Err(failed("the operator changed its pattern but not its id"));
        }
        check_finite("matrix", &self.values)
    }

    pub(super) fn matrix(&self) -> SparseColMatRef<'_, u32, f64> {
        let n = self.layout.dim();
        SparseColMatRef::new(
            SymbolicSparseColMatRef::new_checked(n, n, &self.starts, None, &self.rows),
            &self.values,
        )
    }

    /// `y = A x` from the lower triangle.
    pub(super) fn product(&self, x: &[f64], y: &mut [f64]) {
        y.fill(0.0);
        for j in 0..x.len() {
            let column = self.starts[j] as usize..self.starts[j + 1] as usize;
            let mut sum = 0.0;
            for k in column {
                let (i, v) = (self.rows[k] as usize, self.values[k]);
                y[i] += v * x[j];
                if i != j {
                    sum += v * x[i];
                }
            }
            y[j] += sum;
        }
    }

    /// `A ← S A S + m̄ (I − S)` in place.
    pub(super) fn filter(&mut self, filter: &BlockFilter) {
        let n = self.layout.dim();
        let trace: f64 = (0..n).map(|j| self.values[self.starts[j] as usize]).sum();
        let mean = match trace / n.max(1) as f64 {
            m if m > 0.0 => m,
            _ => 1.0,
        };
        let mut projectors: Vec<Option<&M3>> = vec![None; self.node_starts.len() - 1];
        for (i, s) in filter.iter() {
            projectors[i] = Some(s);
        }
        for &place in filter.fixed_scalars() {
            projectors[place as usize - 2 * self.layout.points] = Some(&[0.0; 9]);
        }
        for j in 0..projectors.len() {
            let (first, width) = extent(self.layout, j);
            let mut offset = 0; // of the block below the first row of the node
            for &i in &self.node_rows[self.node_starts[j]..self.node_starts[j + 1]] {
                let i = i as usize;
                let height = extent(self.layout, i).1;
                if projectors[i].is_some() || projectors[j].is_some() {
                    let at = |r: usize, c: usize| {
                        // a column starts c rows below the first row of the node
                        self.starts[first + c] as usize + offset + r - c
                    };
                    let mut block = [0.0; 9];
                    for c in 0..width {
                        for r in if i == j { c } else { 0 }..height {
                            block[3 * r + c] = self.values[at(r, c)];
                            if i == j {
                                block[3 * c + r] = block[3 * r + c];
                            }
                        }
                    }
                    let one = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
                    let new = if i == j {
                        small::filtered_diagonal(&block, projectors[i].unwrap_or(&one), mean)
                    } else {
                        let left = small::product(projectors[i].unwrap_or(&one), &block);
                        small::product(&left, projectors[j].unwrap_or(&one))
                    };
                    let starts = &self.starts;
                    for c in 0..width {
                        for r in if i == j { c } else { 0 }..height {
                            let at = starts[first + c] as usize + offset + r - c;
                            self.values[at] = new[3 * r + c];
                        }
                    }
                }
                offset += height;
            }
        }
    }

    pub(super) fn heap_bytes(&self) -> usize {
        8 * (self.values.capacity() + self.node_starts.capacity())
            + 4 * (self.starts.capacity()
                + self.rows.capacity()
                + self.node_rows.capacity()
                + self.targets.capacity())
    }
}

/// Orders the nodes by minimum degree and analyses the scalar matrix with that.
fn symbolic(
    layout: BlockLayout,
    node_starts: &[usize],
    node_rows: &[u32],
    starts: &[u32],
    rows: &[u32],
) -> Result<SymbolicCholesky<u32>, LinsolveError> {
    let nodes = node_starts.len() - 1;
    let starts_u32: Vec<u32> = node_starts.iter().map(|&s| s as u32).collect();
    let graph = SymbolicSparseColMatRef::new_checked(nodes, nodes, &starts_u32, None, node_rows);
    let need = amd::order_maybe_unsorted_scratch::<u32>(nodes, node_rows.len());
    let mut buffer = MemBuffer::try_new(need).map_err(failed)?;
    let (mut order, mut place) = (vec![0u32; nodes], vec![0u32; nodes]);
    amd::order_maybe_unsorted(
        &mut order,
        &mut place,
        graph,
        amd::Control::default(),
        MemStack::new(&mut buffer),
    )
    .map_err(failed)?;
    let n = layout.dim();
    let mut forward = Vec::with_capacity(n);
    for &node in &order {
        let (first, size) = extent(layout, node as usize);
        forward.extend((first..first + size).map(|k| k as u32));
    }
    let mut inverse = vec![0u32; n];
    for (new, &old) in forward.iter().enumerate() {
        inverse[old as usize] = new as u32;
    }
    factorize_symbolic_cholesky(
        SymbolicSparseColMatRef::new_checked(n, n, starts, None, rows),
        faer::Side::Lower,
        SymmetricOrdering::Custom(PermRef::new_checked(&forward, &inverse, n)),
        Default::default(),
    )
    .map_err(failed)
}
