//! How close pairs are, and what cloth that changes takes over.

use super::SelfContact;
use super::memory::Memory;
use super::overlap::Overlap;
use super::pass::Pairs;
use super::skin::Skin;
use crate::CollisionError;
use crate::error::check_length;
use crate::narrow::{Closest, PairKind};
use crate::vec3::{combine, point};

impl SelfContact {
    /// By how much the pairs at every point are closer than they keep [m].
    pub(super) fn overlaps(&self, q: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0_f64; self.pairs.mesh.points()];
        self.each_distance(q, |nodes, closest, kept| {
            let depth = kept - closest.distance.abs();
            for (n, w) in nodes.iter().zip(closest.weights) {
                if w != 0.0 && depth > 0.0 {
                    out[*n as usize] = out[*n as usize].max(depth);
                }
            }
        });
        out
    }

    /// Calls `visit(nodes, closest, kept)` for all candidates with the distance
    /// that they keep [m].
    fn each_distance(&self, q: &[f64], mut visit: impl FnMut([u32; 4], &Closest, f64)) {
        let Pairs {
            mesh, candidates, ..
        } = &self.pairs;
        let thickness = self.pairs.potential.thickness();
        let vertex_triangle = &candidates.vertex_triangle;
        let vertex_triangle = vertex_triangle
            .iter()
            .map(|p| (PairKind::VertexTriangle, p));
        let edge_edge = candidates.edge_edge.iter().map(|p| (PairKind::EdgeEdge, p));
        for (kind, pair) in vertex_triangle.chain(edge_edge) {
            let nodes = match kind {
                PairKind::VertexTriangle => mesh.vertex_triangle_nodes(*pair),
                PairKind::EdgeEdge => mesh.edge_edge_nodes(*pair),
            };
            let closest = kind.closest(&nodes.map(|n| point(q, n)));
            visit(nodes, &closest, thickness - mesh.spare(kind, *pair));
        }
    }

    /// By how much the pairs at every point are closer at a place than they keep
    /// \[m\].
    ///
    /// # Errors
    /// Those of [`detect`](crate::ContactSource::detect).
    pub fn depths(&mut self, q: &[f64]) -> Result<Vec<f64>, CollisionError> {
        self.search_at(q)?;
        Ok(self.overlaps(q))
    }

    /// Pairs that are closer at a place than a share of what they keep: the middle
    /// between their closest points \[m\] and their distance \[m\].
    ///
    /// # Errors
    /// Those of [`detect`](crate::ContactSource::detect).
    pub fn closer_than(
        &mut self,
        share: f64,
        q: &[f64],
    ) -> Result<Vec<([f64; 3], f64)>, CollisionError> {
        self.search_at(q)?;
        let mut found = Vec::new();
        self.each_distance(q, |nodes, closest, kept| {
            let distance = closest.distance.abs();
            if distance < share * kept {
                let x = nodes.map(|n| point(q, n));
                let middle = closest.weights.map(|w| 0.5 * w.abs());
                found.push((combine(&middle, &x), distance));
            }
        });
        Ok(found)
    }

    /// Makes the candidates those that touch at a place, until the next detection.
    fn search_at(&mut self, q: &[f64]) -> Result<(), CollisionError> {
        let Pairs {
            mesh,
            potential,
            candidates,
            ..
        } = &mut self.pairs;
        self.skin = Skin::default();
        self.near.clear();
        self.backend
            .detect(mesh, q, q, potential.thickness(), candidates)
    }

    /// A [`history`](crate::ContactSource::history) for cloth that has changed at a time
    /// \[s\], from that of the cloth before.
    ///
    /// Point `i` is what point `from[i]` was. Overlaps go on from what is still
    /// allowed of them, and those that the change made, `fresh[i]` \[m\], part as
    /// those of a start. Sides and anchors are forgotten: the step that follows
    /// takes them as they are then.
    ///
    /// # Errors
    /// [`CollisionError::History`] for a history of something else,
    /// [`CollisionError::Length`] and [`CollisionError::PointOutOfRange`] for
    /// points that do not fit.
    pub fn changed_history(
        &self,
        before: &[f64],
        points_before: usize,
        from: &[u32],
        fresh: &[f64],
        time: f64,
    ) -> Result<Vec<f64>, CollisionError> {
        let points = self.pairs.mesh.points();
        check_length("points before the change", from.len(), points)?;
        check_length("overlaps", fresh.len(), points)?;
        if let Some(index) = from.iter().position(|p| *p as usize >= points_before) {
            return Err(CollisionError::PointOutOfRange {
                what: "changed point",
                index,
                point: from[index],
                points: points_before,
            });
        }
        let (overlap, _) = Overlap::from_numbers(before, points_before)?;
        let mut history = overlap
            .changed(from, fresh, time, self.settings.release)
            .to_numbers();
        history.extend(Skin::default().to_numbers());
        history.extend(Memory::default().to_numbers());
        Ok(history)
    }
}
