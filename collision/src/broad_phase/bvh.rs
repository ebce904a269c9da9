use parry3d_f64::bounding_volume::Aabb as ParryAabb;
use parry3d_f64::math::Vector;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy, BvhWorkspace};

use crate::{Aabb, BroadPhase};

/// Coordinates beyond this stand for infinity: their products stay finite.
const FAR: f64 = 1e50;

/// Leaf area, relative to that at the last build, from which a refitted tree
/// is built anew.
const WORN: f64 = 2.0;

/// Binary tree of boxes (from `parry3d-f64`), refitted from call to call.
///
/// It is built anew when the number of boxes changes, or when the sum of their
/// areas has doubled or halved since the last build. Pairs come in the order
/// of the traversal, which depends on the tree and so on earlier calls.
#[derive(Default)]
pub struct BvhParry {
    tree: Bvh,
    workspace: BvhWorkspace,
    leaves: usize,
    area: f64,
    builds: usize,
}

impl BvhParry {
    /// An empty tree.
    pub fn new() -> Self {
        Self::default()
    }

    /// How often the tree has been built from nothing.
    pub fn build_count(&self) -> usize {
        self.builds
    }
}

impl BroadPhase for BvhParry {
    fn name(&self) -> &str {
        "bvh"
    }

    fn overlaps(&mut self, boxes: &[Aabb], pairs: &mut Vec<[u32; 2]>) {
        pairs.clear();
        let mut area = 0.0;
        let mut special = false;
        for b in boxes {
            let ordinary = b.is_finite() && !b.is_empty();
            special |= !ordinary;
            if ordinary {
                area += b.half_area();
            }
        }
        // A swarm of point-like boxes has no area: any later one is a growth.
        let worn = area > WORN * self.area || WORN * area < self.area;
        if boxes.len() != self.leaves || worn || self.builds == 0 {
            self.tree = Bvh::from_iter(
                BvhBuildStrategy::Binned,
                boxes.iter().map(to_parry).enumerate(),
            );
            self.leaves = boxes.len();
            self.area = area;
            self.builds += 1;
        } else {
            for (i, b) in boxes.iter().enumerate() {
                self.tree
                    .insert_or_update_partially(to_parry(b), i as u32, 0.0);
            }
            self.tree.refit_without_opt();
        }
        // A box of a special value is represented by a stand-in.
        self.tree
            .traverse_bvtt_single_tree::<false>(&mut self.workspace, &mut |a, b| {
                let pair = [a.min(b), a.max(b)];
                let meet = || {
                    let [i, j] = pair.map(|i| &boxes[i as usize]);
                    !i.is_empty() && !j.is_empty() && i.overlaps(j)
                };
                if !special || meet() {
                    pairs.push(pair);
                }
            });
    }

    fn heap_bytes(&self) -> usize {
        self.tree.heap_memory_size()
    }
}

fn to_parry(b: &Aabb) -> ParryAabb {
    let corner = |c: [f64; 3]| Vector::new(c[0], c[1], c[2]);
    if b.is_finite() {
        // An empty box keeps its place, with its corners in order.
        let low = std::array::from_fn(|i| b.min[i].min(b.max[i]));
        let high = std::array::from_fn(|i| b.max[i].max(b.min[i]));
        return ParryAabb::new(corner(low), corner(high));
    }
    let clamp = |c: f64| if c.is_nan() { 0.0 } else { c.clamp(-FAR, FAR) };
    let low = std::array::from_fn(|i| clamp(b.min[i]).min(clamp(b.max[i])));
    let high = std::array::from_fn(|i| clamp(b.max[i]).max(clamp(b.min[i])));
    ParryAabb::new(corner(low), corner(high))
}
