//! What is recorded of yarns that leave their contacts.

use selvedge_record::YarnPaths;
use selvedge_yarn_model::topology::Change;
use selvedge_yarn_model::{NONE, StrandPaths, YarnNetwork, strand_centres};

use super::geometry::Geometry;

/// The passages of yarns through the contacts that they begin in.
///
/// Where contacts break, points come and go; the passages of the yarns as the
/// scene begins stay, and every one of them is a point of the recording: the
/// centre line of its own yarn, so that yarns which lie on each other in one
/// point are drawn beside each other. A passage that was taken out lies on the
/// straight line between those beside it.
#[derive(Clone, Debug)]
pub struct Passages {
    paths: YarnPaths,
    /// First and last point of every yarn at the start, in the scene's order.
    ends: Vec<[u32; 2]>,
    /// Passage of every strand.
    of_strand: Vec<u32>,
    /// Point of the start, in the solver's order, that every point was.
    from: Vec<u32>,
}

impl Passages {
    /// All passages of a scene as it begins.
    pub(super) fn new(geometry: &Geometry) -> Self {
        let base = geometry.yarn_paths();
        let count = base.points.len() as u32;
        let network = geometry.yarns.as_ref().map(|y| &y.network);
        let mut of_strand = vec![NONE; count as usize];
        let strands = network.into_iter().flat_map(visits);
        for (passage, strand) in (0..).zip(strands) {
            of_strand[strand as usize] = passage;
        }
        Self {
            ends: geometry.yarn_ends(),
            paths: YarnPaths {
                points: (0..count).collect(),
                layers: vec![0; count as usize],
                sides: Vec::new(),
                ..base
            },
            of_strand,
            from: (0..geometry.order.len() as u32).collect(),
        }
    }

    /// Ways of the yarns over the passages.
    pub fn paths(&self) -> &YarnPaths {
        &self.paths
    }

    /// Values of the points of the start, for the points that they have become.
    pub fn points<V: Copy>(&self, start: &[V]) -> Vec<V> {
        self.from.iter().map(|p| start[*p as usize]).collect()
    }

    /// After a change of the network.
    pub(super) fn changed(&self, change: &Change) -> Self {
        let strand = |s: &u32| match *s {
            NONE => NONE,
            s => self.of_strand[s as usize],
        };
        Self {
            of_strand: change.strand_from.iter().map(strand).collect(),
            from: self.points_of(change),
            ..self.clone()
        }
    }

    fn points_of(&self, change: &Change) -> Vec<u32> {
        let of = change.node_from.iter().map(|n| self.from[*n as usize]);
        of.collect()
    }

    /// Values of strands for every passage; `between` gives that of a passage
    /// taken out, from those beside it and how far it is from the first [1].
    fn spread<V: Copy>(
        &self,
        values: impl Iterator<Item = (u32, V)>,
        between: impl Fn(V, V, f64) -> V,
    ) -> Vec<V> {
        let mut known: Vec<Option<V>> = vec![None; self.paths.points.len()];
        for (strand, value) in values {
            if let Some(place) = known.get_mut(self.of_strand[strand as usize] as usize) {
                *place = Some(value);
            }
        }
        let arcs = &self.paths.arcs;
        let mut all = Vec::with_capacity(known.len());
        let mut last: Option<(usize, V)> = None;
        let mut k = 0;
        while k < known.len() {
            if let Some(value) = known[k] {
                last = Some((k, value));
                all.push(value);
                k += 1;
                continue;
            }
            let next = (k..known.len()).find_map(|n| known[n].map(|v| (n, v)));
            // Ends of yarns are never taken out.
            let Some(((a, before), (b, after))) = last.zip(next) else {
                break;
            };
            for arc in &arcs[k..b] {
                let part = (arc - arcs[a]) / (arcs[b] - arcs[a]);
                all.push(between(before, after, part));
            }
            k = b;
        }
        all
    }
}

/// Strands of all yarns, yarn after yarn.
fn visits(network: &YarnNetwork) -> impl Iterator<Item = u32> + '_ {
    (0..network.yarns.len() as u32).flat_map(|y| network.along(y))
}

fn line(a: [f64; 3], b: [f64; 3], part: f64) -> [f64; 3] {
    std::array::from_fn(|i| a[i] + part * (b[i] - a[i]))
}

impl Geometry {
    /// Number of points in a recording.
    pub fn recorded_points(&self) -> usize {
        match &self.passages {
            Some(passages) => passages.paths.points.len(),
            None => self.order.len(),
        }
    }

    /// Values of points as they are recorded.
    pub fn recorded<V: Copy>(&self, of_points: &[V]) -> Vec<V> {
        let Some((passages, yarns)) = self.passages.as_ref().zip(self.yarns.as_ref()) else {
            return self.to_scene(of_points);
        };
        let strands = yarns.network.strands.iter();
        let values = strands.map(|s| of_points[s.node as usize]);
        passages.spread((0..).zip(values), |a, _, _| a)
    }

    /// Strains of segments, one for every visit of the yarns, as they are
    /// recorded.
    pub fn recorded_strains(&self, strains: Vec<f64>) -> Vec<f64> {
        let Some((passages, yarns)) = self.passages.as_ref().zip(self.yarns.as_ref()) else {
            return strains;
        };
        passages.spread(visits(&yarns.network).zip(strains), |a, _, _| a)
    }

    /// Positions as they are recorded \[m\].
    pub fn recorded_positions(&self, q: &[f64]) -> Vec<f64> {
        let Some((passages, yarns)) = self.passages.as_ref().zip(self.yarns.as_ref()) else {
            return self.flat_to_scene(q);
        };
        let points = &q.as_chunks::<3>().0[..yarns.network.nodes()];
        let centres = strand_centres(&StrandPaths::of(&yarns.network), points);
        let values = visits(&yarns.network).zip(centres);
        passages.spread(values, line).into_flattened()
    }

    /// Velocities as they are recorded [m/s].
    pub fn recorded_velocities(&self, v: &[f64]) -> Vec<f64> {
        let Some((passages, yarns)) = self.passages.as_ref().zip(self.yarns.as_ref()) else {
            return self.flat_to_scene(v);
        };
        let v = v.as_chunks::<3>().0;
        let strands = yarns.network.strands.iter();
        let values = strands.map(|s| v[s.node as usize]);
        passages.spread((0..).zip(values), line).into_flattened()
    }

    /// First and last point of every yarn at the start, in the scene's order.
    pub(super) fn yarn_ends(&self) -> Vec<[u32; 2]> {
        if let Some(passages) = &self.passages {
            return passages.ends.clone();
        }
        let Some(yarns) = &self.yarns else {
            return Vec::new();
        };
        let n = &yarns.network;
        let point = |s: u32| self.order.old_of_new[n.strands[s as usize].node as usize];
        n.yarns
            .iter()
            .map(|y| [y.first, y.last].map(point))
            .collect()
    }

    /// What a point of the start has become, in the solver's order.
    pub(super) fn now(&self, point: u32) -> Vec<u32> {
        match &self.passages {
            None => vec![point],
            Some(passages) => {
                let all = (0..).zip(&passages.from);
                all.filter(|(_, from)| **from == point)
                    .map(|(n, _)| n)
                    .collect()
            }
        }
    }
}
