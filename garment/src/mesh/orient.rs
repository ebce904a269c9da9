//! Which panels are turned over so that all triangles face the same side.

use super::segments::Sewing;
use crate::pattern::Pairing;

/// The result of orienting panels over their seams.
pub(super) struct Orientation {
    /// Panels whose triangles face the other side than their outline says.
    pub flipped: Vec<bool>,
    /// Stitches over which no consistent choice exists.
    pub inconsistent: Vec<u32>,
}

/// Walks the panels over their seams: opposed pairing keeps the side,
/// parallel pairing turns it. Of the two answers for a connected group, the
/// one that turns fewer panels is taken.
pub(super) fn orient(panel_of_segment: &[u32], panels: usize, sewing: &Sewing) -> Orientation {
    let mut turn: Vec<Option<bool>> = vec![None; panels];
    let mut flipped = vec![false; panels];
    for start in 0..panels {
        if turn[start].is_some() {
            continue;
        }
        turn[start] = Some(false);
        let mut group = vec![start];
        let mut next = 0;
        while next < group.len() {
            let panel = group[next];
            next += 1;
            for s in &sewing.sewn {
                let [a, b] = [s.a, s.b].map(|x| panel_of_segment[x as usize] as usize);
                let other = match panel {
                    p if p == a => b,
                    p if p == b => a,
                    _ => continue,
                };
                if turn[other].is_none() {
                    turn[other] = turn[panel].map(|t| t != (s.pairing == Pairing::Parallel));
                    group.push(other);
                }
            }
        }
        let turned = group.iter().filter(|&&p| turn[p] == Some(true)).count();
        let all = 2 * turned > group.len();
        for &p in &group {
            flipped[p] = (turn[p] == Some(true)) != all;
        }
    }
    let inconsistent = sewing
        .sewn
        .iter()
        .filter(|s| {
            let [a, b] = [s.a, s.b].map(|x| flipped[panel_of_segment[x as usize] as usize]);
            (a != b) != (s.pairing == Pairing::Parallel)
        })
        .map(|s| s.stitch)
        .collect();
    Orientation {
        flipped,
        inconsistent,
    }
}
