use rayon::prelude::*;

use super::super::CHUNK;
use crate::narrow::PairKind;
use crate::vec3::{Vec3, dot, point, sub};
use crate::{Candidates, CollisionMesh};

/// Room for the rounding of a distance to single precision.
const ROUNDING: f64 = 1e-6;

/// Distances of all candidates where a step starts. No pair comes closer during
/// the step by more than its points move against each other, so that most
/// candidates need not be looked at again: a search has to look farther than
/// the thickness.
#[derive(Clone, Debug, Default)]
pub(super) struct Bounds {
    /// Coordinates of all points [m].
    place: Vec<f64>,
    /// At most the distances there [m], in the order of the candidates.
    least: Vec<f32>,
}

impl Bounds {
    /// Forgets the distances: the candidates are others.
    pub fn clear(&mut self) {
        self.least.clear();
    }

    /// Measures all candidates at `place`, unless that is where they were
    /// measured last.
    pub fn measure(&mut self, mesh: &CollisionMesh, candidates: &Candidates, place: &[f64]) {
        if self.least.len() == candidates.len() && self.place == place {
            return;
        }
        self.place.clear();
        self.place.extend_from_slice(place);
        self.least.resize(candidates.len(), 0.0);
        let (first, second) = self.least.split_at_mut(candidates.vertex_triangle.len());
        let of = |kind: PairKind, nodes: [u32; 4]| {
            let distance = kind.closest(&nodes.map(|n| point(place, n))).distance;
            // NaN is no distance to rely on.
            (distance.abs() * (1.0 - ROUNDING)).max(0.0) as f32
        };
        first
            .par_iter_mut()
            .zip(&candidates.vertex_triangle)
            .with_min_len(CHUNK)
            .for_each(|(least, pair)| {
                *least = of(PairKind::VertexTriangle, mesh.vertex_triangle_nodes(*pair));
            });
        second
            .par_iter_mut()
            .zip(&candidates.edge_edge)
            .with_min_len(CHUNK)
            .for_each(|(least, pair)| {
                *least = of(PairKind::EdgeEdge, mesh.edge_edge_nodes(*pair));
            });
    }

    /// Whether the distances are those at the start of this step.
    pub fn hold(&self, count: usize, q_start: &[f64]) -> bool {
        self.least.len() == count && q_start.starts_with(&self.place)
    }

    /// Whether candidate `i` stays farther apart than `thickness` on the
    /// straight way from the start of the step to `q`.
    #[inline]
    pub fn apart(
        &self,
        i: usize,
        kind: PairKind,
        nodes: &[u32; 4],
        q: &[f64],
        thickness: f64,
    ) -> bool {
        let room = f64::from(self.least[i]) - thickness;
        if !(room > 0.0) {
            return false;
        }
        let moved: [Vec3; 4] = nodes.map(|n| sub(point(q, n), point(&self.place, n)));
        // The gap moves by a mean of the differences of both features.
        let first = match kind {
            PairKind::VertexTriangle => 1,
            PairKind::EdgeEdge => 2,
        };
        let (a, b) = moved.split_at(first);
        a.iter().all(|a| {
            b.iter().all(|b| {
                let d = sub(*a, *b);
                dot(d, d) < room * room
            })
        })
    }

    pub fn heap_bytes(&self) -> usize {
        8 * self.place.capacity() + 4 * self.least.capacity()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What moves together stays apart however far it goes; what closes half
    /// of the gap from both sides does not.
    #[test]
    fn relative_motion_alone_closes_a_gap() {
        let mut q = vec![
            0.2, 0.01, 0.2, //
            0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0,
        ];
        let rest = [[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]];
        let mesh = CollisionMesh::new(4, vec![[1, 2, 3]], &rest, &[], 1e-3).expect("a mesh");
        let candidates = Candidates {
            vertex_triangle: vec![[0, 0]],
            edge_edge: vec![],
        };
        let mut bounds = Bounds::default();
        assert!(!bounds.hold(1, &q));
        bounds.measure(&mesh, &candidates, &q);
        assert!(bounds.hold(1, &q));
        let start = q.clone();
        let nodes = mesh.vertex_triangle_nodes([0, 0]);
        let apart = |q: &[f64]| bounds.apart(0, PairKind::VertexTriangle, &nodes, q, 1e-3);
        q.iter_mut().for_each(|x| *x += 3.0);
        assert!(apart(&q));
        q.copy_from_slice(&start);
        q[1] -= 4.4e-3;
        q[4] += 4.4e-3;
        assert!(apart(&q));
        q[4] += 4e-4;
        assert!(!apart(&q));
        q[4] = f64::NAN;
        assert!(!apart(&q));
        assert!(!bounds.hold(1, &q) && !bounds.hold(2, &start));
    }
}
