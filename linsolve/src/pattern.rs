//! The static sparsity pattern of 3×3 blocks.

use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// Rows handled together by one task; fixed, so results do not depend on the
/// number of threads.
pub(crate) const ROW_CHUNK: usize = 1024;

/// Symmetric pattern of 3×3 blocks in compressed rows.
///
/// Columns of a row ascend, the diagonal is always present, both triangles are
/// stored. Built once per mesh; a stencil looks its slots up once and keeps
/// them.
#[derive(Debug, Clone)]
pub struct Pattern {
    offsets: Vec<u32>,
    columns: Vec<u32>,
    diagonal: Vec<u32>,
    bandwidth: usize,
    id: u64,
}

pub(crate) fn fresh_id() -> u64 {
    static NEXT: AtomicU64 = AtomicU64::new(1);
    NEXT.fetch_add(1, Relaxed)
}

impl Pattern {
    /// Pattern in which every pair of points inside a group is a block.
    ///
    /// A group is the points of one stencil (2 for a spring, 3 for a triangle,
    /// 4 for a hinge). Points without a group get their diagonal block alone.
    ///
    /// # Panics
    /// If a group names a point ≥ `points`, or the pattern needs 2³² blocks.
    pub fn from_groups<'a>(points: usize, groups: impl IntoIterator<Item = &'a [u32]>) -> Self {
        let (mut starts, mut nodes) = (vec![0usize], Vec::new());
        for group in groups {
            nodes.extend_from_slice(group);
            starts.push(nodes.len());
        }
        // incidence lists point → groups, by counting
        let mut first = vec![0usize; points + 1];
        for &p in &nodes {
            assert!(
                (p as usize) < points,
                "group names point {p} of {points} points"
            );
            first[p as usize + 1] += 1;
        }
        for i in 0..points {
            first[i + 1] += first[i];
        }
        let mut fill = first.clone();
        let mut incident = vec![0u32; nodes.len()];
        for g in 0..starts.len() - 1 {
            for &p in &nodes[starts[g]..starts[g + 1]] {
                incident[fill[p as usize]] = g as u32;
                fill[p as usize] += 1;
            }
        }
        let rows: Vec<Vec<u32>> = (0..points.div_ceil(ROW_CHUNK))
            .into_par_iter()
            .map(|chunk| {
                let range = chunk * ROW_CHUNK..((chunk + 1) * ROW_CHUNK).min(points);
                // one list for the chunk: each row's length, then its columns
                let (mut out, mut row) = (Vec::new(), Vec::new());
                for i in range {
                    row.clear();
                    row.push(i as u32);
                    for &g in &incident[first[i]..first[i + 1]] {
                        let g = g as usize;
                        row.extend_from_slice(&nodes[starts[g]..starts[g + 1]]);
                    }
                    row.sort_unstable();
                    row.dedup();
                    out.push(row.len() as u32);
                    out.extend_from_slice(&row);
                }
                out
            })
            .collect();
        let mut offsets = vec![0u32];
        let mut columns = Vec::new();
        for chunk in rows {
            let mut at = 0;
            while at < chunk.len() {
                let len = chunk[at] as usize;
                columns.extend_from_slice(&chunk[at + 1..at + 1 + len]);
                offsets.push(u32::try_from(columns.len()).expect("fewer than 2^32 blocks"));
                at += 1 + len;
            }
        }
        Self::from_rows(offsets, columns)
    }

    /// Pattern from compressed rows that already satisfy the invariants.
    pub(crate) fn from_rows(offsets: Vec<u32>, columns: Vec<u32>) -> Self {
        let points = offsets.len() - 1;
        let mut bandwidth = 0;
        let diagonal = (0..points)
            .map(|i| {
                let row = &columns[offsets[i] as usize..offsets[i + 1] as usize];
                let last = row.last().map_or(i, |&j| j as usize);
                bandwidth = bandwidth.max(last.saturating_sub(i));
                match row.binary_search(&(i as u32)) {
                    Ok(k) => offsets[i] + k as u32,
                    Err(_) => unreachable!("row {i} lost its diagonal"),
                }
            })
            .collect();
        Self {
            offsets,
            columns,
            diagonal,
            bandwidth,
            id: fresh_id(),
        }
    }

    /// Number of points (block rows).
    pub fn points(&self) -> usize {
        self.diagonal.len()
    }

    /// Number of stored blocks, both triangles.
    pub fn block_count(&self) -> usize {
        self.columns.len()
    }

    /// Slots of row `i`.
    #[inline]
    pub fn row(&self, i: usize) -> Range<usize> {
        self.offsets[i] as usize..self.offsets[i + 1] as usize
    }

    /// Columns of row `i`, ascending.
    #[inline]
    pub fn columns(&self, i: usize) -> &[u32] {
        &self.columns[self.row(i)]
    }

    /// Column of every slot.
    pub fn all_columns(&self) -> &[u32] {
        &self.columns
    }

    /// Row offsets, `points + 1` of them.
    pub fn offsets(&self) -> &[u32] {
        &self.offsets
    }

    /// Slot of block (i, j), or `None` when it is not in the pattern.
    pub fn slot(&self, i: u32, j: u32) -> Option<u32> {
        if i as usize >= self.points() {
            return None;
        }
        let row = self.columns(i as usize);
        row.binary_search(&j)
            .ok()
            .map(|k| self.offsets[i as usize] + k as u32)
    }

    /// Slot of the diagonal block of point `i`.
    #[inline]
    pub fn diagonal_slot(&self, i: usize) -> u32 {
        self.diagonal[i]
    }

    /// Largest |i − j| over the blocks (0 for a block-diagonal matrix).
    pub fn bandwidth(&self) -> usize {
        self.bandwidth
    }

    /// Identity of this pattern: equal ids mean equal patterns, within a process.
    pub fn id(&self) -> u64 {
        self.id
    }

    /// Heap memory in bytes.
    pub fn heap_bytes(&self) -> usize {
        4 * (self.offsets.capacity() + self.columns.capacity() + self.diagonal.capacity())
    }
}
