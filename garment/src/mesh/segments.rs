//! Which stretches of edges are sewn together, and into how many equal pieces
//! each of them is divided.

use crate::GarmentError;
use crate::math::{dist, dot, sub};
use crate::pattern::{ArcTable, EdgeId, LoopEdge, Pairing, Pattern};
use crate::union_find::UnionFind;

/// A stretch of an edge; mostly the whole edge.
#[derive(Clone, Debug)]
pub(super) struct Segment {
    /// Start and end as fractions of the edge's length, along the outline.
    pub range: [f64; 2],
    /// Number of pieces; 0 when the edge is contracted to a point.
    pub pieces: usize,
    length: f64,
    turning: f64,
    whole: bool,
}

/// Two segments sewn together.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sewn {
    pub a: u32,
    pub b: u32,
    pub pairing: Pairing,
    pub stitch: u32,
}

/// Segments of all edges and how they are sewn.
pub(super) struct Sewing {
    pub segments: Vec<Segment>,
    pub sewn: Vec<Sewn>,
    /// Walking order of each panel.
    pub loops: Vec<Vec<LoopEdge>>,
    /// Arc-length tables of each panel's edges (in their own direction).
    pub tables: Vec<Vec<ArcTable>>,
    /// First segment of each edge of each panel, plus one past the last.
    first: Vec<Vec<u32>>,
}

/// Edges shorter than this part of the edge length are contracted: they would
/// cost needles and gain nothing.
const CONTRACT: f64 = 0.25;
/// Largest turn of a curve within one piece [rad].
const MAX_TURN: f64 = std::f64::consts::FRAC_PI_4;
/// Largest number of pieces of one segment.
const MAX_PIECES: f64 = 1e6;

impl Sewing {
    pub(super) fn new(pattern: &Pattern, h: f64) -> Result<Self, GarmentError> {
        let mut loops = Vec::new();
        let mut tables = Vec::new();
        for panel in &pattern.panels {
            loops.push(panel.outline()?);
            // The outline has checked the corners.
            let list: Vec<ArcTable> = (0..panel.edges.len())
                .filter_map(|e| panel.edge_table(e))
                .collect();
            tables.push(list);
        }
        for (i, s) in pattern.stitches.iter().enumerate() {
            for id in [s.a, s.b] {
                if pattern.edge(id).is_none() {
                    return Err(GarmentError::BadStitch {
                        stitch: i,
                        panel: id.panel,
                        edge: id.edge,
                    });
                }
            }
        }
        let mut sewing = Self {
            segments: Vec::new(),
            sewn: Vec::new(),
            loops,
            tables,
            first: Vec::new(),
        };
        sewing.cut(pattern);
        sewing.divide(h);
        Ok(sewing)
    }

    /// Segments of an edge, in outline order.
    pub(super) fn of_edge(&self, panel: usize, edge: usize) -> std::ops::Range<u32> {
        self.first[panel][edge]..self.first[panel][edge + 1]
    }

    /// Makes the segments: one per edge, or several where one edge is sewn to
    /// a chain of others that share its length.
    fn cut(&mut self, pattern: &Pattern) {
        let mut uses: Vec<Vec<Vec<(u32, EdgeId)>>> = pattern
            .panels
            .iter()
            .map(|p| vec![Vec::new(); p.edges.len()])
            .collect();
        for (i, s) in pattern.stitches.iter().enumerate() {
            uses[s.a.panel as usize][s.a.edge as usize].push((i as u32, s.b));
            uses[s.b.panel as usize][s.b.edge as usize].push((i as u32, s.a));
        }
        // (edge, stitch) → segment, for edges that are cut.
        let mut chosen: Vec<(EdgeId, u32, u32)> = Vec::new();
        for (p, panel) in pattern.panels.iter().enumerate() {
            let mut first = vec![self.segments.len() as u32];
            for e in 0..panel.edges.len() {
                let id = EdgeId {
                    panel: p as u32,
                    edge: e as u32,
                };
                let table = &self.tables[p][e];
                let chain = self.chain(pattern, id, &uses[p][e]);
                let mut start = 0.0;
                for &(stitch, part) in &chain {
                    let end = start + part;
                    chosen.push((id, stitch, self.segments.len() as u32));
                    self.segments.push(segment(table, [start, end], false));
                    start = end;
                }
                if chain.is_empty() {
                    self.segments.push(segment(table, [0.0, 1.0], true));
                } else if let Some(last) = self.segments.last_mut() {
                    last.range[1] = 1.0; // exact end
                }
                first.push(self.segments.len() as u32);
            }
            self.first.push(first);
        }
        for (i, s) in pattern.stitches.iter().enumerate() {
            if s.a == s.b {
                continue; // reported by the doctor; nothing to sew
            }
            let side = |id: EdgeId| {
                chosen
                    .iter()
                    .find(|c| c.0 == id && c.1 == i as u32)
                    .map_or(self.first[id.panel as usize][id.edge as usize], |c| c.2)
            };
            self.sewn.push(Sewn {
                a: side(s.a),
                b: side(s.b),
                pairing: s.pairing(),
                stitch: i as u32,
            });
        }
    }

    /// The parts (stitch, share of the length) of an edge sewn to several
    /// others whose lengths add up to its own, in outline order; empty when
    /// it is one segment.
    fn chain(&self, pattern: &Pattern, id: EdgeId, uses: &[(u32, EdgeId)]) -> Vec<(u32, f64)> {
        if uses.len() < 2 || uses.iter().any(|u| u.1 == id) {
            return Vec::new();
        }
        let length = |e: EdgeId| self.tables[e.panel as usize][e.edge as usize].length();
        let own = length(id);
        let total: f64 = uses.iter().map(|u| length(u.1)).sum();
        let tolerance = 0.2 * own;
        if (total - own).abs() > tolerance
            || uses.iter().any(|u| length(u.1) > own - 0.05 * own)
            || total <= 0.0
        {
            return Vec::new();
        }
        // Order along this edge by where the partners lie in the placement.
        let place = |e: EdgeId, t: f64| {
            let panel = e.panel as usize;
            let walked = self.loops[panel]
                .iter()
                .any(|l| l.edge == e.edge as usize && l.reversed);
            let t = if walked { 1.0 - t } else { t };
            pattern.panels[panel]
                .frame()
                .place(self.tables[panel][e.edge as usize].at(t))
        };
        let (a, b) = (place(id, 0.0), place(id, 1.0));
        let along = |e: EdgeId| {
            if dist(a, b) > 0.0 {
                dot(sub(place(e, 0.5), a), sub(b, a))
            } else {
                0.0
            }
        };
        let mut parts: Vec<(f64, u32, f64)> = uses
            .iter()
            .map(|u| (along(u.1), u.0, length(u.1) / total))
            .collect();
        parts.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
        parts.into_iter().map(|p| (p.1, p.2)).collect()
    }

    /// Counts pieces: segments that are sewn together (through any number of
    /// stitches) get the same count, from their mean length.
    fn divide(&mut self, h: f64) {
        let count = self.segments.len();
        let mut sets = UnionFind::new(count);
        for s in &self.sewn {
            sets.join(s.a, s.b);
        }
        let root: Vec<usize> = (0..count as u32).map(|i| sets.find(i) as usize).collect();
        let mut sum = vec![(0.0f64, 0.0f64, 0.0f64, 0.0f64, true); count];
        for (i, s) in self.segments.iter().enumerate() {
            let g = &mut sum[root[i]];
            g.0 += s.length;
            g.1 += 1.0;
            g.2 = g.2.max(s.turning);
            g.3 = g.3.max(s.length);
            g.4 &= s.whole;
        }
        let mut pieces: Vec<usize> = sum
            .iter()
            .map(|&(length, members, turning, longest, whole)| {
                if members == 0.0 || (whole && longest < CONTRACT * h) {
                    return 0;
                }
                let by_length = (length / members / h).round();
                let by_turn = (turning / MAX_TURN).ceil();
                by_length.max(by_turn).clamp(1.0, MAX_PIECES) as usize
            })
            .collect();
        // Every outline keeps at least three points.
        for p in 0..self.loops.len() {
            loop {
                let range = self.first[p][0] as usize..self.first[p][self.loops[p].len()] as usize;
                let total: usize = range.clone().map(|i| pieces[root[i]]).sum();
                if total >= 3 {
                    break;
                }
                let longest = range.fold(None::<usize>, |best, i| match best {
                    Some(b) if self.segments[b].length >= self.segments[i].length => Some(b),
                    _ => Some(i),
                });
                match longest {
                    Some(i) => pieces[root[i]] += 1,
                    None => break,
                }
            }
        }
        for i in 0..count {
            self.segments[i].pieces = pieces[root[i]];
        }
    }
}

fn segment(table: &ArcTable, range: [f64; 2], whole: bool) -> Segment {
    let part = range[1] - range[0];
    Segment {
        range,
        pieces: 0,
        length: table.length() * part,
        turning: table.turning() * part,
        whole,
    }
}

impl Sewn {
    /// Index on segment `b` of the point matched to point `i` of segment `a`.
    pub(super) fn partner(&self, i: usize, pieces: usize) -> usize {
        match self.pairing {
            Pairing::Opposed => pieces - i,
            Pairing::Parallel => i,
        }
    }
}
