//! A broad phase of one's own: sort and sweep along one axis, checked by the
//! public suite and used for self-contact.

use selvedge_collision::testing::conformance;
use selvedge_collision::{
    Aabb, BroadPhase, BvhParry, Candidates, CollisionBackend, CollisionMesh, ProximityBackend,
};

/// Sorts boxes by their lower x and tests each against those that begin before
/// it ends.
#[derive(Default)]
struct SortAndSweep {
    order: Vec<u32>,
}

impl BroadPhase for SortAndSweep {
    fn name(&self) -> &str {
        "sort-and-sweep"
    }

    fn overlaps(&mut self, boxes: &[Aabb], pairs: &mut Vec<[u32; 2]>) {
        pairs.clear();
        self.order.clear();
        // NaN and inside-out boxes overlap nothing.
        let proper = |b: &Aabb| (0..3).all(|k| b.min[k] <= b.max[k]);
        self.order
            .extend((0..boxes.len() as u32).filter(|i| proper(&boxes[*i as usize])));
        self.order
            .sort_by(|a, b| boxes[*a as usize].min[0].total_cmp(&boxes[*b as usize].min[0]));
        for (n, &a) in self.order.iter().enumerate() {
            let first = boxes[a as usize];
            for &b in &self.order[n + 1..] {
                if boxes[b as usize].min[0] > first.max[0] {
                    break;
                }
                if first.overlaps(&boxes[b as usize]) {
                    pairs.push([a.min(b), a.max(b)]);
                }
            }
        }
    }

    fn heap_bytes(&self) -> usize {
        4 * self.order.capacity()
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    conformance(&mut SortAndSweep::default(), 7, 200)?;
    println!("sort-and-sweep conforms");

    // Two crossing strips of 20 triangles each.
    let mut q = Vec::new();
    let mut triangles = Vec::new();
    for strip in 0..2 {
        for i in 0..11 {
            for j in 0..2 {
                let (u, v) = (0.01 * f64::from(i) - 0.05, 0.01 * f64::from(j) - 0.005);
                q.extend(if strip == 0 {
                    [u, v, 0.0]
                } else {
                    [v, u, 8e-4]
                });
            }
        }
        for i in (22 * strip..22 * strip + 20).step_by(2) {
            triangles.extend([[i, i + 2, i + 3], [i, i + 3, i + 1]]);
        }
    }
    let mesh = CollisionMesh::from_positions(&q, triangles, &[], 1e-3)?;
    let (mut own, mut tree) = (Candidates::default(), Candidates::default());
    ProximityBackend::new(SortAndSweep::default()).detect(&mesh, &q, &q, 1.2e-3, &mut own)?;
    ProximityBackend::new(BvhParry::new()).detect(&mesh, &q, &q, 1.2e-3, &mut tree)?;
    println!(
        "{} vertex-triangle and {} edge-edge candidates",
        own.vertex_triangle.len(),
        own.edge_edge.len()
    );
    assert!(!own.edge_edge.is_empty());
    assert_eq!(own, tree, "candidates do not depend on the broad phase");
    Ok(())
}
