//! Separate pieces of cloth that cross where a scene puts them.

use std::ops::Range;

use selvedge_collision::{BroadPhase, Intersection, self_intersections};

/// A piece that was moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Moved {
    /// The piece.
    pub piece: usize,
    /// The piece that it crossed.
    pub other: usize,
    /// Where it was moved [m].
    pub way: [f64; 3],
}

/// Tries along one direction before its ways are bisected.
const TRIES: usize = 64;

/// Cloth without an inside has no right side to be moved to, but two pieces
/// that cross can be moved apart as they are, which strains nothing.
///
/// Of two pieces that cross, the one with fewer points (the later one of
/// equals) is moved along the one of 26 directions (axes and diagonals) in
/// which it is free of all others after the shortest way, and twice the
/// `clearance` \[m\] farther. `fixed` pieces stay. Returns what was moved, and
/// what could not be: pairs that are fixed, or a piece that crosses itself.
pub(super) fn part(
    positions: &mut [[f64; 3]],
    triangles: &[[u32; 3]],
    pieces: &[Range<u32>],
    fixed: &[bool],
    clearance: f64,
    broad: &mut dyn BroadPhase,
) -> (Vec<Moved>, Vec<[usize; 2]>) {
    let of = |p: u32| pieces.iter().position(|r| r.contains(&p));
    let pair = |c: &Intersection| {
        let (a, b) = (of(c.edge[0])?, of(triangles[c.triangle as usize][0])?);
        Some([a.min(b), a.max(b)])
    };
    let (mut moved, mut left) = (Vec::new(), Vec::new());
    // A piece may be moved more than once, but not for ever.
    for _ in 0..2 * pieces.len() {
        let all = self_intersections(positions.as_flattened(), triangles, broad);
        left = all.iter().filter_map(pair).collect();
        left.sort_unstable();
        left.dedup();
        let next = left.iter().find_map(|&[a, b]| {
            let (small, large) = match pieces[a].len() < pieces[b].len() {
                true => (a, b),
                false => (b, a),
            };
            match (a == b, fixed[small], fixed[large]) {
                (true, ..) | (_, true, true) => None,
                (_, false, _) => Some((small, large)),
                _ => Some((large, small)),
            }
        });
        let Some((piece, other)) = next else { break };
        let range = pieces[piece].start as usize..pieces[piece].end as usize;
        let mut crosses = |way: [f64; 3]| {
            let mut tried = positions.to_vec();
            shift(&mut tried[range.clone()], way);
            let all = self_intersections(tried.as_flattened(), triangles, broad);
            all.iter().any(|c| {
                let [a, b] = pair(c).unwrap_or([piece; 2]);
                a != b && (a == piece || b == piece)
            })
        };
        let far = span(&positions[range.clone()]) + span(positions);
        let Some(way) = shortest(far, clearance, &mut crosses) else {
            break;
        };
        shift(&mut positions[range], way);
        moved.push(Moved { piece, other, way });
        left.clear();
    }
    (moved, left)
}

/// The shortest way out of `crosses`, up to `far` \[m\].
fn shortest(
    far: f64,
    clearance: f64,
    crosses: &mut dyn FnMut([f64; 3]) -> bool,
) -> Option<[f64; 3]> {
    let mut best: Option<(f64, [f64; 3])> = None;
    for n in (0..27).filter(|n| *n != 13) {
        let d = [n % 3, n / 3 % 3, n / 9].map(|k| f64::from(k) - 1.0);
        let size = d.iter().map(|x| x * x).sum::<f64>().sqrt();
        let along = |s: f64| d.map(|x| x / size * s);
        let least = best.map_or(far, |(s, _)| s - 2.0 * clearance);
        let tries = (1..=TRIES).map(|k| far * k as f64 / TRIES as f64);
        let free = tries
            .take_while(|s| s - far / TRIES as f64 <= least)
            .find(|s| !crosses(along(*s)));
        let Some(mut high) = free else { continue };
        let mut low = high - far / TRIES as f64;
        while high - low > 0.1 * clearance.max(1e-6 * far) {
            let middle = 0.5 * (low + high);
            if crosses(along(middle)) {
                low = middle;
            } else {
                high = middle;
            }
        }
        let s = high + 2.0 * clearance;
        let shorter = best.is_none_or(|(b, _)| s < b - 1e-9 * far);
        if shorter && !crosses(along(s)) {
            best = Some((s, along(s)));
        }
    }
    best.map(|(_, way)| way)
}

fn shift(points: &mut [[f64; 3]], way: [f64; 3]) {
    for p in points {
        for k in 0..3 {
            p[k] += way[k];
        }
    }
}

/// Diagonal of the box around points [m].
fn span(points: &[[f64; 3]]) -> f64 {
    let mut sum = 0.0;
    for k in 0..3 {
        let (low, high) = points
            .iter()
            .fold((f64::MAX, f64::MIN), |(l, h), p| (l.min(p[k]), h.max(p[k])));
        sum += (high - low).powi(2);
    }
    sum.sqrt()
}

#[cfg(test)]
mod tests {
    use selvedge_collision::BvhParry;

    use super::*;

    /// A square of 4 by 4 cells of 1 cm, by its corner and two edges.
    fn square(
        at: [f64; 3],
        u: [f64; 3],
        v: [f64; 3],
        x: &mut Vec<[f64; 3]>,
        t: &mut Vec<[u32; 3]>,
    ) -> Range<u32> {
        let first = x.len() as u32;
        for j in 0..5 {
            for i in 0..5 {
                let (a, b) = (0.01 * f64::from(i), 0.01 * f64::from(j));
                x.push(std::array::from_fn(|k| at[k] + a * u[k] + b * v[k]));
            }
        }
        for j in 0..4 {
            for i in 0..4 {
                let p = first + 5 * j + i;
                t.extend([[p, p + 1, p + 6], [p, p + 6, p + 5]]);
            }
        }
        first..x.len() as u32
    }

    /// A sheet and one that stands 1.3 cm deep in it: the second one is lifted
    /// by that and the clearance; where it is fixed, the first one goes down.
    #[test]
    fn the_shortest_way_out_is_taken() {
        for fixed in [[false, false], [false, true]] {
            let (mut x, mut t) = (Vec::new(), Vec::new());
            let (e, up) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
            let pieces = [
                square([0.0; 3], e, [0.0, 0.0, 1.0], &mut x, &mut t),
                square([0.0013, -0.013, 0.0217], e, up, &mut x, &mut t),
            ];
            let (moved, left) = part(&mut x, &t, &pieces, &fixed, 1e-3, &mut BvhParry::new());
            assert!(left.is_empty() && moved.len() == 1, "{moved:?} {left:?}");
            let sign = if fixed[1] { -1.0 } else { 1.0 };
            let m = moved[0];
            assert_eq!((m.piece, m.other), if fixed[1] { (0, 1) } else { (1, 0) });
            assert!(m.way[0] == 0.0 && m.way[2] == 0.0, "{m:?}");
            assert!((sign * m.way[1] - 0.015).abs() < 2e-4, "{m:?}");
            let crossed = self_intersections(x.as_flattened(), &t, &mut BvhParry::new());
            assert!(crossed.is_empty());
        }
    }

    /// Nothing is moved that does not cross, or may not be.
    #[test]
    fn what_is_apart_or_fixed_stays() {
        for (height, fixed) in [(0.01, false), (-0.013, true)] {
            let (mut x, mut t) = (Vec::new(), Vec::new());
            let (e, up) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
            let pieces = [
                square([0.0; 3], e, [0.0, 0.0, 1.0], &mut x, &mut t),
                square([0.0013, height, 0.0217], e, up, &mut x, &mut t),
            ];
            let before = x.clone();
            let fix = [fixed; 2];
            let (moved, left) = part(&mut x, &t, &pieces, &fix, 1e-3, &mut BvhParry::new());
            assert!(moved.is_empty() && x == before);
            assert_eq!(left.len(), usize::from(fixed));
        }
    }
}
