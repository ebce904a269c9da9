use std::collections::BTreeMap;

use super::PanelSet;
use super::surface::along;

/// Turning of a border above which a rod ends and another begins: 45°.
const CORNER: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// A stretch of border: a seam of two or more sides, or the free edge of one.
#[derive(Clone, Debug, PartialEq)]
pub struct Seam {
    /// Points in space along it; the first one again at the end if it is
    /// closed.
    pub points: Vec<u32>,
    /// Its sides.
    pub sides: Vec<SeamSide>,
    /// Length at rest up to every point, mean of the sides \[m\].
    pub arc: Vec<f64>,
}

/// A panel's side of a seam.
#[derive(Clone, Debug, PartialEq)]
pub struct SeamSide {
    /// The panel.
    pub panel: u32,
    /// Its vertices along the seam.
    pub vertices: Vec<u32>,
}

/// A border edge in space with the vertices of its sides at both ends.
struct Edge {
    points: [u32; 2],
    /// Panel, vertices at the two points.
    sides: Vec<(u32, [u32; 2])>,
}

/// An edge that goes on: itself, whether it is passed backwards, and for each
/// side of the one before the side that goes on.
type Next = (usize, bool, Vec<usize>);

impl PanelSet {
    /// Stretches of the panels' borders. Sides belong together where they share
    /// their points in space.
    pub fn seams(&self) -> Vec<Seam> {
        let edges = self.border_edges();
        let mut at: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        for (e, edge) in edges.iter().enumerate() {
            for p in edge.points {
                at.entry(p).or_default().push(e);
            }
        }
        let next = |e: usize, backwards: bool| self.next(&edges, &at, e, backwards);
        let mut used = vec![false; edges.len()];
        let mut seams = Vec::new();
        // Those with an end first, from their ends; what is left is closed.
        for closed in [false, true] {
            for e in 0..edges.len() {
                let start = [false, true];
                let start = start.into_iter().find(|b| closed || next(e, !b).is_none());
                if let (false, Some(backwards)) = (used[e], start) {
                    seams.push(self.walk(&edges, e, backwards, &next, &mut used));
                }
            }
        }
        seams
    }

    fn border_edges(&self) -> Vec<Edge> {
        let mut edges: BTreeMap<[u32; 2], Vec<(u32, [u32; 2])>> = BTreeMap::new();
        for (p, panel) in self.panels.iter().enumerate() {
            for [a, b] in panel.border() {
                let [x, y] = [a, b].map(|v| panel.points[v as usize]);
                let (points, vertices) = if x < y {
                    ([x, y], [a, b])
                } else {
                    ([y, x], [b, a])
                };
                if x != y {
                    edges.entry(points).or_default().push((p as u32, vertices));
                }
            }
        }
        let edge = |(points, sides)| Edge { points, sides };
        edges.into_iter().map(edge).collect()
    }

    /// The edge on which all sides of edge `e` go on past its last point, if
    /// there is exactly one and no corner.
    fn next(
        &self,
        edges: &[Edge],
        at: &BTreeMap<u32, Vec<usize>>,
        e: usize,
        backwards: bool,
    ) -> Option<Next> {
        let edge = &edges[e];
        let end = usize::from(!backwards);
        let point = edge.points[end];
        let mut found = None;
        for &o in at.get(&point)?.iter().filter(|o| **o != e) {
            let other = &edges[o];
            let start = usize::from(other.points[1] == point);
            let Some(order) = continued(&edge.sides, end, &other.sides, start) else {
                continue;
            };
            if found.is_some() {
                return None;
            }
            found = Some((o, start == 1, order));
        }
        let (o, back, order) = found?;
        let straight = edge.sides.iter().zip(&order).all(|((panel, a), k)| {
            let b = edges[o].sides[*k].1;
            let flat = |v: u32| self.panels[*panel as usize].flat[v as usize];
            let (x, y, z) = (flat(a[1 - end]), flat(a[end]), flat(b[usize::from(!back)]));
            let (d, f) = ([y[0] - x[0], y[1] - x[1]], [z[0] - y[0], z[1] - y[1]]);
            let dot = d[0] * f[0] + d[1] * f[1];
            dot >= CORNER * d[0].hypot(d[1]) * f[0].hypot(f[1])
        });
        straight.then_some((o, back, order))
    }

    fn walk(
        &self,
        edges: &[Edge],
        start: usize,
        backwards: bool,
        next: &impl Fn(usize, bool) -> Option<Next>,
        used: &mut [bool],
    ) -> Seam {
        let (first, last) = (usize::from(backwards), usize::from(!backwards));
        let edge = &edges[start];
        let mut seam = Seam {
            points: vec![edge.points[first], edge.points[last]],
            sides: Vec::new(),
            arc: vec![0.0],
        };
        for (panel, vertices) in &edge.sides {
            seam.sides.push(SeamSide {
                panel: *panel,
                vertices: vec![vertices[first], vertices[last]],
            });
        }
        used[start] = true;
        // Side of the present edge for each side of the seam.
        let mut order: Vec<usize> = (0..edge.sides.len()).collect();
        let mut here = (start, backwards);
        while let Some((e, back, onto)) = next(here.0, here.1) {
            if used[e] {
                break;
            }
            used[e] = true;
            here = (e, back);
            let end = usize::from(!back);
            seam.points.push(edges[e].points[end]);
            for (k, side) in seam.sides.iter_mut().enumerate() {
                order[k] = onto[order[k]];
                side.vertices.push(edges[e].sides[order[k]].1[end]);
            }
        }
        for k in 1..seam.points.len() {
            let length = |s: &SeamSide| {
                let flat = &self.panels[s.panel as usize].flat;
                let [a, b] = [s.vertices[k - 1], s.vertices[k]].map(|v| flat[v as usize]);
                (b[0] - a[0]).hypot(b[1] - a[1])
            };
            let mean = seam.sides.iter().map(length).sum::<f64>() / seam.sides.len() as f64;
            seam.arc.push(seam.arc[k - 1] + mean);
        }
        seam
    }
}

/// For each side at end `end` the side that has the same vertex at `start`;
/// `None` unless all sides of both edges find one.
fn continued(
    sides: &[(u32, [u32; 2])],
    end: usize,
    others: &[(u32, [u32; 2])],
    start: usize,
) -> Option<Vec<usize>> {
    if sides.len() != others.len() {
        return None;
    }
    let mut taken = vec![false; others.len()];
    let mut order = Vec::with_capacity(sides.len());
    for (panel, vertices) in sides {
        let same = |(k, (p, v)): &(usize, &(u32, [u32; 2]))| {
            !taken[*k] && p == panel && v[start] == vertices[end]
        };
        let (k, _) = others.iter().enumerate().find(same)?;
        taken[k] = true;
        order.push(k);
    }
    Some(order)
}

impl Seam {
    /// Length at rest \[m\].
    pub fn length(&self) -> f64 {
        self.arc[self.arc.len() - 1]
    }

    /// Whether its end is its beginning.
    pub fn is_closed(&self) -> bool {
        self.points.len() > 3 && self.points.first() == self.points.last()
    }

    /// Edge and fraction along it at an arc length \[m\].
    pub fn at(&self, arc: f64) -> (usize, f64) {
        let last = self.arc.len() - 2;
        let edge = self.arc.partition_point(|a| *a <= arc);
        let edge = edge.saturating_sub(1).min(last);
        let length = self.arc[edge + 1] - self.arc[edge];
        let fraction = if length > 0.0 {
            (arc - self.arc[edge]) / length
        } else {
            0.0
        };
        (edge, fraction.clamp(0.0, 1.0))
    }

    /// Place in space at an edge and a fraction \[m\].
    pub fn point(&self, set: &PanelSet, (edge, t): (usize, f64)) -> [f64; 3] {
        let [a, b] = [edge, edge + 1].map(|k| set.points[self.points[k] as usize]);
        std::array::from_fn(|i| a[i] + t * (b[i] - a[i]))
    }

    /// Place in the plane of a side's panel at an edge and a fraction \[m\].
    pub fn flat(&self, set: &PanelSet, side: usize, (edge, t): (usize, f64)) -> [f64; 2] {
        let [a, b] = self.ends(set, side, edge);
        [0, 1].map(|i| a[i] + t * (b[i] - a[i]))
    }

    /// Arc length nearest to a place in the plane of a side's panel, and the
    /// distance \[m\].
    pub fn nearest(&self, set: &PanelSet, side: usize, flat: [f64; 2]) -> (f64, f64) {
        let mut best = (0.0, f64::INFINITY);
        for edge in 0..self.arc.len() - 1 {
            let [a, b] = self.ends(set, side, edge);
            let (t, distance) = along(a, b, flat);
            if distance < best.1 {
                let arc = self.arc[edge] + t * (self.arc[edge + 1] - self.arc[edge]);
                best = (arc, distance);
            }
        }
        best
    }

    fn ends(&self, set: &PanelSet, side: usize, edge: usize) -> [[f64; 2]; 2] {
        let side = &self.sides[side];
        let flat = &set.panels[side.panel as usize].flat;
        [edge, edge + 1].map(|k| flat[side.vertices[k] as usize])
    }
}
