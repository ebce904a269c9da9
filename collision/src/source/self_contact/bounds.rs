use rayon::prelude::*;

use super::super::CHUNK;
use crate::narrow::PairKind;
use crate::vec3::point;
use crate::{Candidates, CollisionMesh};

/// Room for the rounding of a distance to single precision.
const ROUNDING: f64 = 1e-6;

/// At most the distances of all candidates where a step starts. No pair comes
/// closer during the step by more than its points move against each other, so
/// that most candidates need not be looked at again: a search has to look
/// farther than the thickness.
#[derive(Clone, Debug, Default)]
pub(super) struct Bounds {
    /// Coordinates of all points [m].
    place: Vec<f64>,
    /// Bounds of the distances there [m], in the order of the candidates.
    least: Vec<f32>,
}

impl Bounds {
    /// Takes over what a search at `place` found.
    pub fn take(&mut self, candidates: &mut Candidates, place: &[f64]) {
        self.place.clear();
        self.place.extend_from_slice(place);
        std::mem::swap(&mut self.least, &mut candidates.least);
        candidates.least.clear();
    }

    /// Moves on to another place. Bounds fall by what the points of a pair have
    /// moved against each other, and pairs left with less than `enough` [m] are
    /// measured.
    pub fn advance(
        &mut self,
        mesh: &CollisionMesh,
        candidates: &Candidates,
        place: &[f64],
        enough: f32,
        moves: &mut Moves,
    ) {
        let known = self.least.len() == candidates.len() && self.place.len() == place.len();
        if known && self.place == place {
            return;
        }
        if !known {
            // A back-end without bounds.
            self.least.clear();
            self.least.resize(candidates.len(), f32::NEG_INFINITY);
            self.place.clear();
            self.place.extend_from_slice(place);
        }
        moves.take(&self.place, place);
        self.place.copy_from_slice(place);
        let (first, second) = self.least.split_at_mut(candidates.vertex_triangle.len());
        let update = |least: &mut f32, kind: PairKind, nodes: [u32; 4]| {
            let left = *least - moves.largest(kind, &nodes);
            *least = if left > enough {
                left
            } else {
                let distance = kind.closest(&nodes.map(|n| point(place, n))).distance;
                // NaN is no distance to rely on.
                (distance.abs() * (1.0 - ROUNDING)).max(0.0) as f32
            };
        };
        first
            .par_iter_mut()
            .zip(&candidates.vertex_triangle)
            .with_min_len(CHUNK)
            .for_each(|(least, pair)| {
                let nodes = mesh.vertex_triangle_nodes(*pair);
                update(least, PairKind::VertexTriangle, nodes);
            });
        second
            .par_iter_mut()
            .zip(&candidates.edge_edge)
            .with_min_len(CHUNK)
            .for_each(|(least, pair)| {
                update(least, PairKind::EdgeEdge, mesh.edge_edge_nodes(*pair));
            });
    }

    /// Whether the distances are those at the start of this step.
    fn hold(&self, count: usize, q_start: &[f64]) -> bool {
        !self.place.is_empty() && self.least.len() == count && q_start.starts_with(&self.place)
    }

    /// Whether candidate `i` stays farther apart than `thickness` on the
    /// straight way from the start of the step to where `moves` lead.
    #[inline]
    pub fn apart(
        &self,
        i: usize,
        kind: PairKind,
        nodes: &[u32; 4],
        moves: &Moves,
        thickness: f32,
    ) -> bool {
        let room = self.least[i] - thickness - moves.slack;
        if !(room > 0.0) {
            return false;
        }
        moves.square(kind, nodes) < room * room
    }

    pub fn heap_bytes(&self) -> usize {
        8 * self.place.capacity() + 4 * self.least.capacity()
    }
}

/// How far the points have gone from one place to another [m]: single precision
/// for what is gathered for every candidate.
#[derive(Clone, Debug, Default)]
pub(super) struct Moves {
    moved: Vec<[f32; 3]>,
    /// Bound on the rounding of a difference of two of them.
    slack: f32,
}

impl Moves {
    /// Takes the ways to `q`; `None` where the bounds are not those of the step
    /// that begins at `q_start`.
    pub fn from_start(
        &mut self,
        bounds: &Bounds,
        count: usize,
        q_start: &[f64],
        q: &[f64],
    ) -> Option<&Self> {
        if !bounds.hold(count, q_start) {
            return None;
        }
        self.take(&bounds.place, q);
        Some(self)
    }

    fn take(&mut self, from: &[f64], to: &[f64]) {
        let (from, _) = from.as_chunks::<3>();
        let (to, _) = to.as_chunks::<3>();
        let mut largest = 0.0_f32;
        self.moved.clear();
        self.moved.extend(from.iter().zip(to).map(|(a, b)| {
            let moved = [0, 1, 2].map(|k| (b[k] - a[k]) as f32);
            for m in moved {
                largest = largest.max(m.abs());
            }
            moved
        }));
        // Each coordinate is rounded twice, and there are three.
        self.slack = 8.0 * f32::EPSILON * largest;
    }

    pub fn ways(&self) -> &[[f32; 3]] {
        &self.moved
    }

    pub fn slack(&self) -> f32 {
        self.slack
    }

    /// Square of the largest way of a point of one feature against one of the
    /// other; the gap moves by a mean of these. NaN where a way is.
    #[inline]
    fn square(&self, kind: PairKind, nodes: &[u32; 4]) -> f32 {
        let [a, b, c, d] = nodes.map(|n| self.moved[n as usize]);
        let apart = |a: [f32; 3], b: [f32; 3]| {
            let d = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
            d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
        };
        // `f32::max` drops a NaN, a sum does not.
        let most = |a: f32, b: f32| if a > b || a.is_nan() { a } else { b };
        match kind {
            PairKind::VertexTriangle => most(most(apart(a, b), apart(a, c)), apart(a, d)),
            PairKind::EdgeEdge => most(
                most(apart(a, c), apart(a, d)),
                most(apart(b, c), apart(b, d)),
            ),
        }
    }

    /// At most by how much a pair has come closer [m].
    #[inline]
    fn largest(&self, kind: PairKind, nodes: &[u32; 4]) -> f32 {
        self.square(kind, nodes).sqrt() * (1.0 + 2.0 * f32::EPSILON) + self.slack
    }

    pub fn heap_bytes(&self) -> usize {
        12 * self.moved.capacity()
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
            least: vec![],
        };
        let mut bounds = Bounds::default();
        let mut moves = Moves::default();
        assert!(moves.from_start(&bounds, 1, &q, &q).is_none());
        bounds.advance(&mesh, &candidates, &q, 1e-3, &mut moves);
        let start = q.clone();
        let nodes = mesh.vertex_triangle_nodes([0, 0]);
        let mut apart = |q: &[f64]| {
            let moves = moves.from_start(&bounds, 1, &start, q).expect("bounds");
            bounds.apart(0, PairKind::VertexTriangle, &nodes, moves, 1e-3)
        };
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
        assert!(moves.from_start(&bounds, 1, &q, &q).is_none());
        assert!(moves.from_start(&bounds, 2, &start, &q).is_none());
    }
}
