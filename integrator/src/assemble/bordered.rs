//! Slots of stencils of points and scalars.

use std::ops::Range;

use selvedge_linsolve::{BorderPattern, Pattern, Real};

use super::work::{LocalMatrices, Stencils};
use crate::sink::Sink;

/// Patterns of a matrix with scalars.
#[derive(Clone, Copy)]
pub(crate) struct Patterns<'a> {
    pub(crate) points: &'a Pattern,
    pub(crate) border: &'a BorderPattern,
}

/// Values of a matrix with scalars: points' blocks, couplings, scalars' entries.
pub(crate) struct Values<'a, T> {
    pub(crate) blocks: &'a mut [T],
    pub(crate) coupling: &'a mut [T],
    pub(crate) scalars: &'a mut [T],
}

impl<T> Values<'_, T> {
    pub(super) fn each_mut(&mut self) -> [&mut [T]; 3] {
        [self.blocks, self.coupling, self.scalars]
    }
}

/// The points that each stencil touches, scalars by their owners; all stencils
/// have the same number of nodes.
pub(super) fn touched(stencils: &impl Stencils, owners: &[u32]) -> Vec<u32> {
    let dims = stencils.dims();
    let mut out = Vec::with_capacity(stencils.count() * dims.len());
    for e in 0..stencils.count() {
        for (&node, &dim) in stencils.stencil(e).iter().zip(dims) {
            out.push(if dim == 3 {
                node
            } else {
                owners[node as usize]
            });
        }
    }
    out
}

/// Slots of the pairs of every stencil in the order of [`BorderedBlocks`]: points'
/// blocks, couplings by rows of scalars, scalars' entries.
///
/// A slot is kept as its distance from the first one of its row: one byte where
/// all rows are that short.
#[derive(Default)]
pub(super) struct Slots {
    near: Vec<u8>,
    far: Vec<u32>,
}

impl Slots {
    pub(super) fn new(stencils: &impl Stencils, patterns: Patterns<'_>) -> Self {
        let dims = stencils.dims();
        let mut all = Self {
            near: Vec::with_capacity(stencils.count() * slots_each(dims)),
            far: Vec::new(),
        };
        for e in 0..stencils.count() {
            let nodes = stencils.stencil(e);
            for (&i, &di) in nodes.iter().zip(dims) {
                for (&j, &dj) in nodes.iter().zip(dims) {
                    let slot = match (di, dj) {
                        (3, 3) => patterns.points.slot(i, j),
                        (3, _) => continue,
                        (_, 3) => patterns.border.point_slot(i, j),
                        _ => patterns.border.scalar_slot(i, j),
                    };
                    // The patterns are built from these very stencils.
                    let slot = slot.expect("every pair of a stencil is in the patterns");
                    all.push(slot - patterns.first(i, di, dj));
                }
            }
        }
        all
    }

    fn push(&mut self, distance: u32) {
        if self.far.is_empty() {
            if let Ok(near) = distance.try_into() {
                return self.near.push(near);
            }
            self.far.extend(self.near.iter().map(|&d| u32::from(d)));
            self.near = Vec::new();
        }
        self.far.push(distance);
    }

    #[inline(always)]
    fn at(&self, k: usize) -> u32 {
        match self.near.get(k) {
            Some(&d) => u32::from(d),
            None => self.far[k],
        }
    }

    pub(super) fn heap_bytes(&self) -> usize {
        self.near.capacity() + 4 * self.far.capacity()
    }
}

impl Patterns<'_> {
    /// First slot of a node's row of blocks, couplings or scalars' entries.
    #[inline(always)]
    fn first(&self, node: u32, dim: usize, other: usize) -> u32 {
        let first = match (dim, other) {
            (3, _) => return self.points.offsets()[node as usize],
            (_, 3) => self.border.point_row(node as usize).start,
            _ => self.border.scalar_row(node as usize).start,
        };
        first as u32
    }
}

/// Slots that one stencil takes in [`Slots`].
fn slots_each(dims: &[usize]) -> usize {
    let points = dims.iter().filter(|d| **d == 3).count();
    let scalars = dims.len() - points;
    points * points + scalars * dims.len()
}

/// Points' blocks, couplings and scalars' entries of one matrix, with the slots
/// of the stencils in them.
#[derive(Clone)]
pub(super) struct BorderedBlocks<'a, S> {
    pub(super) patterns: Patterns<'a>,
    pub(super) slots: &'a Slots,
    pub(super) values: [S; 3],
}

impl<T: Real, S: Sink<T>> LocalMatrices<T> for BorderedBlocks<'_, S> {
    fn add(&mut self, stencils: &impl Stencils, range: Range<usize>, local: &[f64], scale: f64) {
        let (patterns, slots) = (self.patterns, self.slots);
        let [blocks, coupling, scalars] = &mut self.values;
        let dims = stencils.dims();
        let m: usize = dims.iter().sum();
        let each = slots_each(dims);
        for (e, h) in range.zip(local.chunks_exact(m * m)) {
            let nodes = stencils.stencil(e);
            let mut at_slot = e * each;
            let mut slot = |first: u32| {
                at_slot += 1;
                (first + slots.at(at_slot - 1)) as usize
            };
            let mut row = 0;
            for (&i, &di) in nodes.iter().zip(dims) {
                let of_points = patterns.first(i, di, 3);
                let of_scalars = patterns.first(i, di, 1);
                let mut column = 0;
                for &dj in dims {
                    let at = row * m + column;
                    match (di, dj) {
                        (3, 3) => {
                            let line = |r: usize| {
                                let from = at + r * m;
                                [h[from], h[from + 1], h[from + 2]]
                            };
                            let block = [line(0), line(1), line(2)];
                            blocks.add_block(slot(of_points), &block, scale);
                        }
                        (3, _) => {}
                        (_, 3) => {
                            let line = [h[at], h[at + 1], h[at + 2]];
                            coupling.add_point(slot(of_points), &line, scale);
                        }
                        _ => scalars.add_value(slot(of_scalars), h[at], scale),
                    }
                    column += dj;
                }
                row += di;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A star: point and scalar 0 couple with all others.
    struct Star(Vec<[u32; 4]>);

    impl Stencils for Star {
        fn count(&self) -> usize {
            self.0.len()
        }
        fn dims(&self) -> &[usize] {
            &[3, 3, 1, 1]
        }
        fn stencil(&self, e: usize) -> &[u32] {
            &self.0[e]
        }
    }

    /// Slots come back whether their rows are short or long.
    #[test]
    fn slots_of_short_and_long_rows() {
        for points in [5, 256, 257, 600] {
            let star = Star((1..points).map(|p| [0, p, 0, p]).collect());
            let pattern = Pattern::from_groups(points as usize, star.0.iter().map(|s| &s[..2]));
            let groups = star.0.iter().map(|s| (&s[..], star.dims()));
            let owners = (0..points).collect();
            let border = BorderPattern::from_groups(points as usize, owners, groups);
            let patterns = Patterns {
                points: &pattern,
                border: &border,
            };
            let slots = Slots::new(&star, patterns);
            assert_eq!(slots.far.is_empty(), points <= 256);
            assert!(slots.near.is_empty() != slots.far.is_empty());
            let each = slots_each(star.dims());
            for (e, &[i, j, s, t]) in star.0.iter().enumerate() {
                let at = |k: usize, node, dim, other| {
                    patterns.first(node, dim, other) + slots.at(e * each + k)
                };
                assert_eq!(Some(at(1, i, 3, 3)), pattern.slot(i, j));
                assert_eq!(Some(at(2, j, 3, 3)), pattern.slot(j, i));
                assert_eq!(Some(at(5, s, 1, 3)), border.point_slot(s, j));
                assert_eq!(Some(at(7, s, 1, 1)), border.scalar_slot(s, t));
                assert_eq!(Some(at(10, t, 1, 1)), border.scalar_slot(t, s));
            }
        }
    }
}
