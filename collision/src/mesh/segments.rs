//! Meshes of segments alone: yarns, cords.

use std::collections::BTreeMap;

use super::neighbours::Neighbours;
use super::patches::Patches;
use super::{CollisionMesh, check_count, check_element, check_positive, exclusions::Exclusions};
use crate::narrow::PairKind;
use crate::vec3::{Vec3, cross, norm, point, unit};
use crate::{BvhParry, Candidates, CollisionBackend, CollisionError, ProximityBackend};

/// A straight piece of yarn between two points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Its ends.
    pub ends: [u32; 2],
    /// Length at rest \[m\].
    pub length: f64,
    /// Radius of the yarn \[m\].
    pub radius: f64,
}

/// Pairs of segments that never touch beside those that share a point: what
/// stitches, crossings and seams join keeps its distance by itself. A way runs
/// along segments, by their lengths at rest.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Joined<'a> {
    /// Length of the way between two segments below which they never touch \[m\].
    pub near: f64,
    /// The same for segments that lie closer than they keep where the yarns are
    /// laid \[m\]: borders, stitches that are knitted together.
    pub near_laid: f64,
    /// Where they are laid: `x y z` of every point \[m\]; empty if nowhere.
    pub laid: &'a [f64],
}

impl CollisionMesh {
    /// A mesh of segments and no triangles, for contact between yarns.
    ///
    /// Two segments keep the sum of their radii between their middle lines; the
    /// [`thickness`](Self::thickness) is twice the largest radius. Excluded are
    /// pairs that share a point or are [`Joined`]. Segments that follow each other
    /// along a yarn should follow each other in the list. Of several between the
    /// same points the thickest counts.
    ///
    /// # Errors
    /// [`CollisionError::PointOutOfRange`] and [`CollisionError::RepeatedPoint`]
    /// for a bad index, [`CollisionError::Parameter`] for a length or a radius
    /// that is not positive and finite or a way that is negative or not finite,
    /// [`CollisionError::TooMany`] beyond 2³⁰ points or segments,
    /// [`CollisionError::Length`] and [`CollisionError::NotFinitePosition`] for bad
    /// positions.
    pub fn from_segments(
        points: usize,
        segments: &[Segment],
        joined: Joined<'_>,
    ) -> Result<Self, CollisionError> {
        check_count("points", points)?;
        check_count("segments", segments.len())?;
        for (index, s) in segments.iter().enumerate() {
            check_element("segment", index, &s.ends, points)?;
            check_positive("length of a segment", s.length)?;
            check_positive("radius", s.radius)?;
        }
        check_way(joined.near)?;
        check_way(joined.near_laid)?;
        let segments = single(segments);
        let edges: Vec<[u32; 2]> = segments.iter().map(|s| s.ends).collect();
        let lengths: Vec<f64> = segments.iter().map(|s| s.length).collect();
        let largest = segments.iter().map(|s| s.radius).fold(0.0, f64::max);
        let thickness = if segments.is_empty() {
            1.0
        } else {
            2.0 * largest
        };
        check_positive("thickness", thickness)?;
        let uniform = segments.iter().all(|s| s.radius == largest);
        let mut exclusions = Exclusions::new(points, &[], &edges, &[], &[], 0.0);
        exclusions.near = Neighbours::within(points, &edges, &lengths, joined.near, |_| true);
        let edge_area = segments.iter().map(|s| 2.0 * s.radius * s.length);
        let edge_area: Vec<f32> = edge_area.map(|a| a as f32).collect();
        let mut point_area = vec![0.0; points];
        for (ends, area) in edges.iter().zip(&edge_area) {
            ends.iter()
                .for_each(|p| point_area[*p as usize] += 0.5 * area);
        }
        let mut mesh = Self {
            points,
            triangles: Vec::new(),
            patches: Patches::of_edges(&edges),
            exclusions,
            components: Vec::new(),
            around_start: Vec::new(),
            around: Vec::new(),
            point_area,
            edge_area,
            edge_radius: match uniform {
                true => Vec::new(),
                false => segments.iter().map(|s| s.radius as f32).collect(),
            },
            edges,
            shortest_edge: lengths.iter().copied().fold(f64::INFINITY, f64::min),
            thickness,
        };
        if !joined.laid.is_empty() {
            mesh.exclude_laid(joined.laid, &lengths, joined.near_laid)?;
        }
        Ok(mesh)
    }

    /// Excludes segments that lie closer than they keep and are joined by a way
    /// shorter than `near` [m].
    fn exclude_laid(
        &mut self,
        laid: &[f64],
        lengths: &[f64],
        near: f64,
    ) -> Result<(), CollisionError> {
        let mut close = Candidates::default();
        let mut search = ProximityBackend::new(BvhParry::new());
        search.detect(self, laid, laid, self.thickness, &mut close)?;
        let mut pairs = close.edge_edge;
        pairs.retain(|p| {
            let x = self.edge_edge_nodes(*p).map(|n| point(laid, n));
            let kept = self.thickness - self.spare(PairKind::EdgeEdge, *p);
            PairKind::EdgeEdge.closest(&x).distance.abs() < kept
        });
        let mut involved = vec![false; self.points];
        for node in pairs.iter().flat_map(|p| self.edge_edge_nodes(*p)) {
            involved[node as usize] = true;
        }
        let wanted = |p: u32| involved[p as usize];
        let ways = Neighbours::within(self.points, &self.edges, lengths, near, wanted);
        pairs.retain(|p| {
            let [a, b] = p.map(|e| self.edges[e as usize]);
            ways.join(a, b)
        });
        self.exclusions.add_edges(pairs.into_iter());
        Ok(())
    }
}

fn check_way(near: f64) -> Result<(), CollisionError> {
    if near >= 0.0 && near.is_finite() {
        return Ok(());
    }
    Err(CollisionError::Parameter {
        name: "way between segments",
        value: near,
        requirement: "finite and not negative",
    })
}

/// One segment between two points: the thickest of several, and the shortest way.
fn single(segments: &[Segment]) -> Vec<Segment> {
    let mut place = BTreeMap::new();
    let mut out: Vec<Segment> = Vec::with_capacity(segments.len());
    for s in segments {
        let [a, b] = s.ends;
        let at = *place.entry([a.min(b), a.max(b)]).or_insert(out.len());
        match out.get_mut(at) {
            Some(known) => {
                known.radius = known.radius.max(s.radius);
                known.length = known.length.min(s.length);
            }
            None => out.push(*s),
        }
    }
    out
}

/// A unit vector across two directions. Pairs of two yarns agree on it where both
/// run on without a sharp turn.
pub(super) fn across(a: Vec3, b: Vec3) -> Vec3 {
    let any = || {
        let least = (0..3).min_by(|i, j| a[*i].abs().total_cmp(&a[*j].abs()));
        let axis = std::array::from_fn(|k| f64::from(u8::from(Some(k) == least)));
        unit(cross(a, axis))
    };
    let n = cross(a, b);
    let parallel = norm(n) <= 1e-6 * norm(a) * norm(b);
    let n = if parallel { None } else { unit(n) };
    n.or_else(any).unwrap_or([0.0, 0.0, 1.0])
}
