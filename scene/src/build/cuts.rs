//! Where the cuts of a scene meet its yarns.

use selvedge_yarn_model::NONE;

use super::geometry::Geometry;
use super::passages::visits;
use crate::diagnostic::Diagnostics;
use crate::file::Parsed;

/// A segment of a yarn that is to be cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PlannedCut {
    /// When \[s\].
    pub time: f64,
    /// Visit at its beginning, of all visits of the yarns as the scene begins.
    pub visit: u32,
}

/// Longest flat distance between neighbours on a yarn, in arc lengths between
/// them: where a yarn is merged into a seam, its flat place may be that of the
/// panel beyond.
const LONGEST: f64 = 3.0;

/// Segments that the cuts of a scene cross on the flat cloth, in the order of
/// the visits; what two of them cross goes to the earlier one.
///
/// # Errors
/// A finding for every cut that crosses nothing.
pub(super) fn planned(
    parsed: &Parsed,
    geometry: &Geometry,
) -> Result<Vec<PlannedCut>, Diagnostics> {
    let mut findings = Diagnostics::new();
    let mut all = Vec::new();
    let Some(yarns) = &geometry.yarns else {
        return Ok(all);
    };
    let network = &yarns.network;
    for (i, cut) in parsed.scene.cut.iter().enumerate() {
        let Some(part) = geometry.part(&cut.cloth) else {
            continue;
        };
        let own = |node: u32| {
            let point = geometry.order.old_of_new[node as usize];
            part.points.contains(&point)
        };
        let before = all.len();
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for (visit, s) in (0..).zip(visits(network)) {
            let strand = &network.strands[s as usize];
            if !own(strand.node) {
                continue;
            }
            let a = network.flat[strand.node as usize];
            for k in 0..2 {
                (low[k], high[k]) = (low[k].min(a[k]), high[k].max(a[k]));
            }
            if strand.next == NONE {
                continue;
            }
            let next = &network.strands[strand.next as usize];
            let b = network.flat[next.node as usize];
            let longest = LONGEST * (next.arc - strand.arc).abs();
            if (a[0] - b[0]).hypot(a[1] - b[1]) <= longest && crosses([a, b], [cut.from, cut.to]) {
                all.push(PlannedCut {
                    time: cut.time,
                    visit,
                });
            }
        }
        if all.len() == before {
            let message = format!(
                "`cut.{i}` crosses no yarn: the flat cloth {:?} reaches from [{:.4}, {:.4}] to \
                 [{:.4}, {:.4}] m",
                cut.cloth, low[0], low[1], high[0], high[1]
            );
            let path = format!("cut.{i}.from");
            findings.push(parsed.locations.error("scene::cut", &path, message));
        }
    }
    if findings.has_errors() {
        return Err(findings);
    }
    all.sort_by(|a, b| a.visit.cmp(&b.visit).then(a.time.total_cmp(&b.time)));
    all.dedup_by_key(|c| c.visit);
    Ok(all)
}

/// Whether a segment crosses a cut. Ends of segments on the cut's line count as
/// on its left, so that a yarn through such a point is cut once.
fn crosses([a, b]: [[f64; 2]; 2], [from, to]: [[f64; 2]; 2]) -> bool {
    let way = [to[0] - from[0], to[1] - from[1]];
    let side = |p: [f64; 2]| way[0] * (p[1] - from[1]) - way[1] * (p[0] - from[0]);
    let (sa, sb) = (side(a), side(b));
    if (sa >= 0.0) == (sb >= 0.0) {
        return false;
    }
    let t = sa / (sa - sb);
    let met: [f64; 2] = std::array::from_fn(|k| a[k] + t * (b[k] - a[k]) - from[k]);
    let along = met[0] * way[0] + met[1] * way[1];
    (0.0..=way[0] * way[0] + way[1] * way[1]).contains(&along)
}

#[cfg(test)]
mod tests {
    use super::crosses;

    #[test]
    fn segments_across_are_crossed_once() {
        let cut = [[0.0, 0.0], [1.0, 0.0]];
        assert!(crosses([[0.5, -1.0], [0.5, 1.0]], cut));
        assert!(!crosses([[1.5, -1.0], [1.5, 1.0]], cut));
        assert!(!crosses([[0.5, 1.0], [0.7, 2.0]], cut));
        // A yarn through a node on the cut.
        let yarn = [[0.5, -1.0], [0.5, 0.0], [0.5, 1.0]];
        let times = yarn.windows(2).filter(|w| crosses([w[0], w[1]], cut));
        assert_eq!(times.count(), 1);
        // Along the cut.
        assert!(!crosses([[0.2, 0.0], [0.8, 0.0]], cut));
    }
}
