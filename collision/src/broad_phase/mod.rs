//! Which boxes overlap.

mod brute;
mod bvh;
mod grid;

pub use brute::BruteForce;
pub use bvh::BvhParry;
pub use grid::HashGrid;

use crate::Aabb;

/// Finds overlapping boxes.
///
/// Implement this to bring your own structure, and run
/// [`testing::conformance`](crate::testing::conformance) on it.
pub trait BroadPhase: Send {
    /// Name in reports.
    fn name(&self) -> &str;

    /// Replaces `pairs` by every pair `[i, j]`, `i < j`, of overlapping boxes
    /// (touching counts), each once. The order is free, but must depend on the
    /// boxes of this and earlier calls alone. A box with a NaN or with
    /// `min > max` overlaps nothing; infinite boxes are allowed.
    fn overlaps(&mut self, boxes: &[Aabb], pairs: &mut Vec<[u32; 2]>);

    /// Heap memory held \[bytes\].
    fn heap_bytes(&self) -> usize;
}

impl BroadPhase for Box<dyn BroadPhase> {
    fn name(&self) -> &str {
        (**self).name()
    }

    fn overlaps(&mut self, boxes: &[Aabb], pairs: &mut Vec<[u32; 2]>) {
        (**self).overlaps(boxes, pairs);
    }

    fn heap_bytes(&self) -> usize {
        (**self).heap_bytes()
    }
}
