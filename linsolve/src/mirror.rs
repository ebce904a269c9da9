//! Where the other half of a symmetric matrix lies.

use crate::Pattern;

/// For every block above the diagonal of a [`Pattern`] the slot of the block
/// below it that it is the transpose of.
#[derive(Debug, Clone)]
pub struct Mirror {
    pub(crate) pattern: u64,
    /// First entry of every row, then their number.
    starts: Vec<u32>,
    below: Vec<u32>,
}

impl Mirror {
    /// The mirror of a pattern.
    pub fn new(pattern: &Pattern) -> Self {
        let n = pattern.points();
        let above = |i: usize| pattern.row(i).end as u32 - pattern.diagonal_slot(i) - 1;
        let mut starts = Vec::with_capacity(n + 1);
        starts.push(0);
        for i in 0..n {
            starts.push(starts[i] + above(i));
        }
        let mut below = vec![0; starts[n] as usize];
        // Rows come in ascending order, so do the columns above the diagonal.
        let mut next = starts.clone();
        for i in 0..n {
            let lower = pattern.row(i).start..pattern.diagonal_slot(i) as usize;
            for slot in lower {
                let j = pattern.all_columns()[slot] as usize;
                below[next[j] as usize] = slot as u32;
                next[j] += 1;
            }
        }
        Self {
            pattern: pattern.id(),
            starts,
            below,
        }
    }

    /// Slots below the diagonal of the blocks above it in row `i`.
    #[inline]
    pub fn of_row(&self, i: usize) -> &[u32] {
        &self.below[self.starts[i] as usize..self.starts[i + 1] as usize]
    }

    /// Heap memory in bytes.
    pub fn heap_bytes(&self) -> usize {
        4 * (self.starts.capacity() + self.below.capacity())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Bsr;
    use std::sync::Arc;

    #[test]
    fn a_lower_half_becomes_symmetric() {
        let groups: [&[u32]; 4] = [&[0, 3, 1], &[3, 1, 4], &[2, 4], &[5]];
        let pattern = Arc::new(Pattern::from_groups(6, groups));
        let mut a = Bsr::<f32>::zeros(Arc::clone(&pattern));
        for i in 0..6u32 {
            for &j in pattern.columns(i as usize).iter().filter(|j| **j <= i) {
                let v = |r: usize, c: usize| f64::from(100 * i + 10 * j) + (3 * r + c) as f64;
                let block = std::array::from_fn(|r| std::array::from_fn(|c| v(r, c)));
                let slot = pattern.slot(i, j).map_or(usize::MAX, |s| s as usize);
                a.add_block(slot, &block, 1.0);
            }
        }
        a.mirror(&Mirror::new(&pattern));
        let mut pairs = 0;
        for i in 0..6 {
            for &j in pattern.columns(i as usize).iter().filter(|j| **j > i) {
                let (Some(above), Some(below)) = (pattern.slot(i, j), pattern.slot(j, i)) else {
                    panic!("the pattern is not symmetric");
                };
                let (u, l) = (a.block(above as usize), a.block(below as usize));
                for r in 0..3 {
                    for c in 0..3 {
                        assert_eq!(u[r][c], l[c][r], "{i} {j}");
                        assert!(u[r][c] != 0.0);
                    }
                }
                pairs += 1;
            }
        }
        assert_eq!(pairs, 6);
    }
}
