//! Sampling a panel's outline at the points its seams ask for.

use super::segments::Sewing;
use crate::GarmentError;
use crate::math::polygon_area;
use crate::pattern::{Pattern, polygon_crossing};
use crate::union_find::UnionFind;

/// A sampled outline, seen from outside: counter-clockwise.
pub(super) struct Outline {
    /// Points of the polygon [m]; `x` is negated when `side` is −1.
    pub points: Vec<[f64; 2]>,
    /// +1, or −1 when the panel is drawn clockwise.
    pub side: f64,
    /// Points of each segment along the outline, ends included; segments of
    /// the panel in order of their edges.
    pub segment_points: Vec<Vec<u32>>,
    /// Panel-wide index of the first of these segments.
    pub first_segment: u32,
    /// Points with sewn pieces on both sides: corners where a triangle with
    /// both pieces as sides would fold onto its neighbour when welded.
    pub sewn_corner: Vec<bool>,
    /// Signed area of the polygon, positive [m²].
    pub area: f64,
}

/// Smallest area of a panel [m²].
const MIN_AREA: f64 = 1e-8;
/// Largest number of points of one panel.
const MAX_POINTS: usize = 500_000;

pub(super) fn sample(
    pattern: &Pattern,
    index: usize,
    sewing: &Sewing,
    h: f64,
) -> Result<Outline, GarmentError> {
    let panel = &pattern.panels[index];
    let first_segment = sewing.of_edge(index, 0).start;
    let last_segment = sewing.of_edge(index, panel.edges.len() - 1).end;
    let corner_of = merge_corners(pattern, index, sewing);
    let mut is_sewn = vec![false; sewing.segments.len()];
    for s in &sewing.sewn {
        is_sewn[s.a as usize] = true;
        is_sewn[s.b as usize] = true;
    }
    let mut points: Vec<[f64; 2]> = Vec::new();
    let mut edge_of_point: Vec<usize> = Vec::new();
    let mut sewn_piece: Vec<bool> = Vec::new(); // piece from this point on
    let mut segment_points = vec![Vec::new(); (last_segment - first_segment) as usize];
    for l in &sewing.loops[index] {
        let table = &sewing.tables[index][l.edge];
        let at = |f: f64| {
            if f <= 0.0 || f >= 1.0 {
                let end = usize::from((f >= 1.0) != l.reversed);
                corner_of[panel.edges[l.edge].ends[end] as usize]
            } else {
                table.at(if l.reversed { 1.0 - f } else { f })
            }
        };
        for s in sewing.of_edge(index, l.edge) {
            let segment = &sewing.segments[s as usize];
            let list: &mut Vec<u32> = &mut segment_points[(s - first_segment) as usize];
            let [from, to] = segment.range;
            for i in 0..segment.pieces {
                let f = from + (to - from) * i as f64 / segment.pieces as f64;
                list.push(points.len() as u32);
                points.push(at(f));
                edge_of_point.push(l.edge);
                sewn_piece.push(is_sewn[s as usize]);
            }
            list.push(points.len() as u32); // start of the next piece
        }
    }
    let n = points.len();
    if n > MAX_POINTS {
        return Err(GarmentError::TooManyPoints {
            panel: panel.name.clone(),
            points: n as f64,
            edge_length: h,
            limit: MAX_POINTS,
        });
    }
    for list in &mut segment_points {
        for p in list {
            *p %= n as u32;
        }
    }
    if let Some((i, j, at)) = polygon_crossing(&points) {
        return Err(GarmentError::OutlineCrosses {
            panel: panel.name.clone(),
            edge_a: edge_of_point[i],
            edge_b: edge_of_point[j],
            at,
        });
    }
    let signed = polygon_area(&points);
    if signed.is_nan() || signed.abs() < MIN_AREA {
        return Err(GarmentError::NoArea {
            panel: panel.name.clone(),
            area: signed,
        });
    }
    let side = signed.signum();
    for p in &mut points {
        p[0] *= side;
    }
    let sewn_corner = (0..n)
        .map(|i| sewn_piece[i] && sewn_piece[(i + n - 1) % n])
        .collect();
    Ok(Outline {
        points,
        side,
        segment_points,
        first_segment,
        sewn_corner,
        area: signed.abs(),
    })
}

/// Position of each corner: contracted edges pull theirs together.
fn merge_corners(pattern: &Pattern, index: usize, sewing: &Sewing) -> Vec<[f64; 2]> {
    let panel = &pattern.panels[index];
    let count = panel.vertices.len();
    let mut sets = UnionFind::new(count);
    for (e, edge) in panel.edges.iter().enumerate() {
        let segments = sewing.of_edge(index, e);
        if segments.len() == 1 && sewing.segments[segments.start as usize].pieces == 0 {
            sets.join(edge.ends[0], edge.ends[1]);
        }
    }
    let mut sum = vec![([0.0f64; 2], 0.0f64); count];
    for i in 0..count {
        let s = &mut sum[sets.find(i as u32) as usize];
        s.0[0] += panel.vertices[i][0];
        s.0[1] += panel.vertices[i][1];
        s.1 += 1.0;
    }
    (0..count)
        .map(|i| {
            let (p, n) = sum[sets.find(i as u32) as usize];
            if n == 1.0 {
                panel.vertices[i]
            } else {
                [p[0] / n, p[1] / n]
            }
        })
        .collect()
}

pub(super) const PANEL_POINT_LIMIT: usize = MAX_POINTS;
