use crate::{Aabb, BroadPhase};

/// Tests every pair: the oracle of the other broad phases, and the fastest one
/// below some thirty boxes.
#[derive(Clone, Copy, Debug, Default)]
pub struct BruteForce;

impl BroadPhase for BruteForce {
    fn name(&self) -> &str {
        "brute-force"
    }

    fn overlaps(&mut self, boxes: &[Aabb], pairs: &mut Vec<[u32; 2]>) {
        pairs.clear();
        for (j, b) in boxes.iter().enumerate() {
            for (i, a) in boxes[..j].iter().enumerate() {
                if a.overlaps(b) && !a.is_empty() && !b.is_empty() {
                    pairs.push([i as u32, j as u32]);
                }
            }
        }
    }

    fn heap_bytes(&self) -> usize {
        0
    }
}
