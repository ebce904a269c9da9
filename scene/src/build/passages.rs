//! What is recorded of yarns that leave their contacts.

use selvedge_record::YarnPaths;
use selvedge_yarn_model::topology::Change;
use selvedge_yarn_model::{NONE, StrandPaths, YarnNetwork, strand_centres};

use super::cuts::PlannedCut;
use super::geometry::Geometry;

/// The passages of yarns through the contacts that they begin in.
///
/// Where contacts break, points come and go; the passages of the yarns as the
/// scene begins stay, and every one of them is a point of the recording: the
/// centre line of its own yarn, so that yarns which lie on each other in one
/// point are drawn beside each other. A passage that was taken out lies on the
/// straight line between those beside it. Where a yarn is going to be cut, its
/// way ends and begins anew from the start, with a passage for either new end.
#[derive(Clone, Debug)]
pub struct Passages {
    paths: YarnPaths,
    /// First and last point of every yarn at the start, in the scene's order.
    ends: Vec<[u32; 2]>,
    /// Passage of every strand.
    of_strand: Vec<u32>,
    /// Point of the start, in the solver's order, that every point was.
    from: Vec<u32>,
    /// Cuts, in the order of their places.
    cuts: Vec<Cut>,
    /// Points at the ends that cuts have made; sorted.
    loose: Vec<u32>,
}

/// A cut that is to come, or has happened.
#[derive(Clone, Copy, Debug)]
struct Cut {
    /// When \[s\].
    time: f64,
    /// Passage of the end before it; that of the one behind it follows.
    end: u32,
    done: bool,
}

impl Passages {
    /// All passages of a scene as it begins, and of the ends that cuts, in the
    /// order of their places, are going to make.
    pub(super) fn new(geometry: &Geometry, planned: &[PlannedCut]) -> Self {
        let base = geometry.yarn_paths();
        let network = geometry.yarns.as_ref().map(|y| &y.network);
        let strands: Vec<u32> = network.into_iter().flat_map(visits).collect();
        let mut of_strand = vec![NONE; strands.len()];
        let mut paths = YarnPaths {
            offsets: vec![0],
            ..YarnPaths::default()
        };
        let mut cuts = Vec::with_capacity(planned.len());
        for yarn in 0..base.radii.len() {
            for visit in base.visits(yarn) {
                of_strand[strands[visit] as usize] = paths.arcs.len() as u32;
                paths.arcs.push(base.arcs[visit]);
                let planned = planned.get(cuts.len());
                if let Some(cut) = planned.filter(|c| c.visit as usize == visit) {
                    cuts.push(Cut {
                        time: cut.time,
                        end: paths.arcs.len() as u32,
                        done: false,
                    });
                    let arc = 0.5 * (base.arcs[visit] + base.arcs[visit + 1]);
                    paths.arcs.push(arc);
                    end_way(&mut paths, &base, yarn);
                    paths.arcs.push(arc);
                }
            }
            end_way(&mut paths, &base, yarn);
        }
        let count = paths.arcs.len();
        paths.points = (0..count as u32).collect();
        paths.layers = vec![0; count];
        Self {
            ends: geometry.yarn_ends(),
            paths,
            of_strand,
            from: (0..geometry.order.len() as u32).collect(),
            cuts,
            loose: Vec::new(),
        }
    }

    /// Strands behind which a yarn is to be cut by a time \[s\].
    pub(super) fn due(&self, network: &YarnNetwork, time: f64) -> Vec<u32> {
        let due = |c: &&Cut| !c.done && c.time <= time;
        let mut found: Vec<u32> = Vec::new();
        if !self.cuts.iter().any(|c| due(&c)) {
            return found;
        }
        let mut strand_of = vec![NONE; self.paths.points.len()];
        for (strand, passage) in (0..).zip(&self.of_strand) {
            if let Some(place) = strand_of.get_mut(*passage as usize) {
                *place = strand;
            }
        }
        for cut in self.cuts.iter().filter(due) {
            // Passages before it may have been taken out.
            let before = strand_of[..cut.end as usize].iter().rfind(|s| **s != NONE);
            let cuttable = |s: &&u32| network.strands[**s as usize].next != NONE;
            // Two cuts of one segment come one after the other.
            if let Some(&strand) = before.filter(cuttable)
                && found.last() != Some(&strand)
            {
                found.push(strand);
            }
        }
        found
    }

    /// Time of the last cut \[s\].
    pub(super) fn last_cut(&self) -> Option<f64> {
        self.cuts.iter().map(|c| c.time).reduce(f64::max)
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
        let mut next = Self {
            of_strand: change.strand_from.iter().map(strand).collect(),
            from: self.points_of(change),
            ..self.clone()
        };
        let was_loose = |n: &u32| self.loose.binary_search(n).is_ok();
        let nodes = (0..).zip(&change.node_from);
        let loose = nodes.filter(|(_, from)| was_loose(from)).map(|(n, _)| n);
        next.loose = loose.collect();
        for &[end, start, before, after] in &change.cuts {
            let [low, high] = [before, after].map(|s| self.of_strand[s as usize]);
            let here = |c: &&mut Cut| !c.done && (low..high).contains(&c.end);
            let first = next.cuts.iter_mut().filter(here);
            if let Some(cut) = first.min_by(|a, b| a.time.total_cmp(&b.time)) {
                cut.done = true;
                next.of_strand[end as usize] = cut.end;
                next.of_strand[start as usize] = cut.end + 1;
            }
            let made = [end, start].map(|s| change.network.strands[s as usize].node);
            next.loose.extend(made);
        }
        next.loose.sort_unstable();
        next.loose.dedup();
        next
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

/// Ends the way of a yarn, or of a part of it.
fn end_way(paths: &mut YarnPaths, base: &YarnPaths, yarn: usize) {
    paths.offsets.push(paths.arcs.len() as u32);
    paths.radii.push(base.radii[yarn]);
    paths.panels.push(base.panels[yarn]);
}

/// Strands of all yarns, yarn after yarn.
pub(super) fn visits(network: &YarnNetwork) -> impl Iterator<Item = u32> + '_ {
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

    /// What a point of the start has become, in the solver's order, without the
    /// ends of cuts beside it.
    pub(super) fn now(&self, point: u32) -> Vec<u32> {
        match &self.passages {
            None => vec![point],
            Some(passages) => {
                let all = (0..).zip(&passages.from);
                all.filter(|(_, from)| **from == point)
                    .map(|(n, _)| n)
                    .filter(|n| passages.loose.binary_search(n).is_err())
                    .collect()
            }
        }
    }
}
