//! Walking a panel's edges and testing its outline with exact predicates.

use super::{LoopEdge, Panel};
use crate::GarmentError;
use robust::{Coord, orient2d};

/// The edges in walking order from edge 0.
pub(super) fn walk(panel: &Panel) -> Result<Vec<LoopEdge>, GarmentError> {
    let open = |edge: usize, corner: u32| GarmentError::OpenOutline {
        panel: panel.name.clone(),
        edge,
        at: panel
            .vertices
            .get(corner as usize)
            .copied()
            .unwrap_or([0.0; 2]),
    };
    let count = panel.edges.len();
    let Some(first) = panel.edges.first() else {
        return Err(open(0, 0));
    };
    for (i, e) in panel.edges.iter().enumerate() {
        if let Some(&bad) = e.ends.iter().find(|&&v| v as usize >= panel.vertices.len()) {
            return Err(open(i, bad));
        }
    }
    let mut used = vec![false; count];
    let mut order = vec![LoopEdge {
        edge: 0,
        reversed: false,
    }];
    used[0] = true;
    let (start, mut corner) = (first.ends[0], first.ends[1]);
    while order.len() < count {
        let last = order[order.len() - 1].edge;
        // Files list the loop in order: start the search after the last edge.
        let next = (1..count)
            .map(|k| (last + k) % count)
            .filter(|&e| !used[e])
            .find(|&e| panel.edges[e].ends.contains(&corner));
        let Some(e) = next else {
            return Err(open(last, corner));
        };
        let reversed = panel.edges[e].ends[0] != corner;
        corner = panel.edges[e].ends[usize::from(!reversed)];
        used[e] = true;
        order.push(LoopEdge { edge: e, reversed });
    }
    if corner == start {
        Ok(order)
    } else {
        Err(open(order[count - 1].edge, corner))
    }
}

fn coord(p: [f64; 2]) -> Coord<f64> {
    Coord { x: p[0], y: p[1] }
}

fn side(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    orient2d(coord(a), coord(b), coord(c))
}

fn in_box(a: [f64; 2], b: [f64; 2], p: [f64; 2]) -> bool {
    (0..2).all(|k| p[k] >= a[k].min(b[k]) && p[k] <= a[k].max(b[k]))
}

/// Whether two closed segments share a point; exact.
fn segments_meet(a: [f64; 2], b: [f64; 2], c: [f64; 2], d: [f64; 2]) -> bool {
    let (c1, d1) = (side(a, b, c), side(a, b, d));
    let (a2, b2) = (side(c, d, a), side(c, d, b));
    let straddle = |x: f64, y: f64| (x > 0.0 && y < 0.0) || (x < 0.0 && y > 0.0);
    if straddle(c1, d1) && straddle(a2, b2) {
        return true;
    }
    (c1 == 0.0 && in_box(a, b, c))
        || (d1 == 0.0 && in_box(a, b, d))
        || (a2 == 0.0 && in_box(c, d, a))
        || (b2 == 0.0 && in_box(c, d, b))
}

/// First pair of segments of a closed polygon that meet other than at a
/// common end, and about where. Segment `i` runs from point `i` to `i + 1`.
pub(crate) fn polygon_crossing(p: &[[f64; 2]]) -> Option<(usize, usize, [f64; 2])> {
    let n = p.len();
    if n < 3 {
        return Some((0, 0, p.first().copied().unwrap_or([0.0; 2])));
    }
    let at = |i: usize| p[i % n];
    // Sweep over x: only segments whose x ranges overlap are compared.
    let low = |i: usize| at(i)[0].min(at(i + 1)[0]);
    let high = |i: usize| at(i)[0].max(at(i + 1)[0]);
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&i, &j| low(i).total_cmp(&low(j)).then(i.cmp(&j)));
    let mut active: Vec<usize> = Vec::new();
    let mut found: Option<(usize, usize)> = None;
    for &i in &order {
        active.retain(|&j| high(j) >= low(i));
        for &j in &active {
            let (f, s) = (i.min(j), i.max(j));
            let meets = if s == f + 1 {
                folds_back(at(f), at(s), at(s + 1))
            } else if f == 0 && s == n - 1 {
                folds_back(at(s), at(0), at(1))
            } else {
                segments_meet(at(f), at(f + 1), at(s), at(s + 1))
            };
            if meets && found.is_none_or(|best| (f, s) < best) {
                found = Some((f, s));
            }
        }
        active.push(i);
    }
    found.map(|(f, s)| (f, s, meeting_point(at(f), at(f + 1), at(s), at(s + 1))))
}

/// Two consecutive segments `a b`, `b c` that overlap (or have no length).
fn folds_back(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> bool {
    if a == b || b == c {
        return true;
    }
    side(a, b, c) == 0.0 && (in_box(a, b, c) || in_box(b, c, a))
}

fn meeting_point(a: [f64; 2], b: [f64; 2], c: [f64; 2], d: [f64; 2]) -> [f64; 2] {
    use crate::math::{cross2, mix2, sub2};
    let (r, s) = (sub2(b, a), sub2(d, c));
    let det = cross2(r, s);
    if det.abs() > 1e-300 {
        let t = cross2(sub2(c, a), s) / det;
        if t.is_finite() {
            return mix2(a, b, t.clamp(0.0, 1.0));
        }
    }
    [c, d].into_iter().find(|&q| in_box(a, b, q)).unwrap_or(a)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bow tie crosses in its middle; a square and a dart do not.
    #[test]
    fn crossings() {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        assert_eq!(polygon_crossing(&square), None);
        let bow = [[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]];
        assert_eq!(polygon_crossing(&bow), Some((0, 2, [0.5, 0.5])));
        let dart = [
            [0.0, 0.0],
            [0.4, 0.0],
            [0.5, 0.8],
            [0.6, 0.0],
            [1.0, 0.0],
            [0.5, 1.0],
        ];
        assert_eq!(polygon_crossing(&dart), None);
        let touching = [[0.0, 0.0], [1.0, 0.0], [0.5, 1.0], [0.5, 0.0], [0.2, 1.0]];
        assert!(polygon_crossing(&touching).is_some());
        let spike = [[0.0, 0.0], [1.0, 0.0], [0.5, 0.0], [0.5, 1.0]];
        assert!(polygon_crossing(&spike).is_some());
    }
}
