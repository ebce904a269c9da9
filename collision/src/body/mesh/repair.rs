//! From triangles as they come to an oriented surface, closed if possible.

use super::super::vec3::{cross, dot, is_finite, norm, sub};
use super::report::MeshReport;
use super::tree::area_vector;
use crate::{Aabb, CollisionError};

/// Points closer than this fraction of the box's diagonal are one.
const WELD: f64 = 1e-9;

/// A repaired mesh and what was repaired.
pub(crate) struct Repaired {
    pub(crate) points: Vec<[f64; 3]>,
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) report: MeshReport,
}

/// One use of an undirected edge: ends, lower first; triangle; whether the
/// triangle runs from the lower to the higher end.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Use {
    ends: [u32; 2],
    triangle: u32,
    forward: bool,
}

pub(crate) fn repair(
    body: &str,
    points: &[[f64; 3]],
    triangles: &[[u32; 3]],
) -> Result<Repaired, CollisionError> {
    check(points, triangles)?;
    let mut report = MeshReport {
        points: points.len(),
        triangles: triangles.len(),
        ..Default::default()
    };
    let (mut points, mut triangles) = weld(points, triangles, &mut report);
    drop_degenerate(&points, &mut triangles, &mut report);

    let uses = edge_uses(&triangles);
    for group in uses.chunk_by(|a, b| a.ends == b.ends) {
        let ends = group[0].ends.map(|p| points[p as usize]);
        match group {
            [_] => report.boundary_edges.push(ends),
            [a, b] => report.inconsistent_edges += usize::from(a.forward == b.forward),
            _ => report.non_manifold_edges.push(ends),
        }
    }
    orient(&points, &mut triangles, &uses, &mut report);
    let given = triangles.len();
    fill_holes(&mut points, &mut triangles, &mut report);
    if volume(&points, &triangles) < 0.0 {
        report.inverted = true;
        report.flipped_triangles = given - report.flipped_triangles;
        triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }

    report.volume = volume(&points, &triangles);
    report.area = triangles
        .iter()
        .map(|t| norm(area_vector(&corners(&points, t))))
        .sum();
    report.watertight = edge_uses(&triangles)
        .chunk_by(|a, b| a.ends == b.ends)
        .all(|g| g.len() == 2 && g[0].forward != g[1].forward);
    // A sphere has V = 0.094 A^1.5; a sheet closed onto itself has none.
    let solid = report.volume > 1e-6 * report.area.powf(1.5);
    if !solid {
        return Err(CollisionError::Body {
            body: body.to_owned(),
            reason: format!(
                "its triangles enclose no volume ({:.3e} m³ in {:.3e} m²)",
                report.volume, report.area
            ),
        });
    }
    Ok(Repaired {
        points,
        triangles,
        report,
    })
}

fn check(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<(), CollisionError> {
    if let Some(point) = points.iter().position(|p| !is_finite(*p)) {
        return Err(CollisionError::NotFinitePosition { point });
    }
    for (what, count) in [("points", points.len()), ("triangles", triangles.len())] {
        if count > (u32::MAX / 4) as usize {
            return Err(CollisionError::TooMany { what, count });
        }
    }
    for (index, t) in triangles.iter().enumerate() {
        if let Some(point) = t.iter().find(|p| **p as usize >= points.len()) {
            return Err(CollisionError::PointOutOfRange {
                what: "triangle",
                index,
                point: *point,
                points: points.len(),
            });
        }
    }
    Ok(())
}

/// Merges points that are closer than [`WELD`], the first of them staying.
fn weld(
    points: &[[f64; 3]],
    triangles: &[[u32; 3]],
    report: &mut MeshReport,
) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let close = WELD * norm(Aabb::of_points(points).extents());
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    let at = |i: u32| points[i as usize];
    // Sorted along a direction that no grid of points is aligned with.
    let along: Vec<f64> = points
        .iter()
        .map(|p| dot(*p, [0.613_27, 0.561_93, 0.555_01]))
        .collect();
    let place = |i: u32| along[i as usize];
    order.sort_unstable_by(|&a, &b| place(a).total_cmp(&place(b)).then(a.cmp(&b)));
    let mut kept_as: Vec<u32> = (0..points.len() as u32).collect();
    for (n, &i) in order.iter().enumerate() {
        if kept_as[i as usize] != i {
            continue;
        }
        for &j in order[n + 1..]
            .iter()
            .take_while(|j| place(**j) - place(i) <= close)
        {
            if kept_as[j as usize] == j && norm(sub(at(i), at(j))) <= close {
                kept_as[j as usize] = i;
                report.welded_points += 1;
            }
        }
    }
    let mut new_index = vec![u32::MAX; points.len()];
    let mut kept = Vec::with_capacity(points.len());
    for i in 0..points.len() {
        if kept_as[i] == i as u32 {
            new_index[i] = kept.len() as u32;
            kept.push(points[i]);
        }
    }
    let renumber = |p: u32| new_index[kept_as[p as usize] as usize];
    (kept, triangles.iter().map(|t| t.map(renumber)).collect())
}

fn drop_degenerate(points: &[[f64; 3]], triangles: &mut Vec<[u32; 3]>, report: &mut MeshReport) {
    let before = triangles.len();
    triangles.retain(|t| {
        let named_twice = t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
        // Collinear points stay: dropping their triangle would tear the mesh,
        // and distances and solid angles of no area are well defined.
        !named_twice
    });
    report.degenerate_triangles = before - triangles.len();
    report.needles = triangles
        .iter()
        .filter(|t| {
            let [a, b, c] = corners(points, t);
            let longest = [sub(b, a), sub(c, b), sub(a, c)]
                .map(|e| dot(e, e))
                .into_iter()
                .fold(0.0, f64::max);
            2.0 * norm(area_vector(&[a, b, c])) <= 1e-6 * longest
        })
        .count();

    let mut keys: Vec<([u32; 3], u32)> = triangles
        .iter()
        .enumerate()
        .map(|(i, t)| {
            let mut key = *t;
            key.sort_unstable();
            (key, i as u32)
        })
        .collect();
    keys.sort_unstable();
    let mut keep = vec![true; triangles.len()];
    for pair in keys.windows(2) {
        if pair[0].0 == pair[1].0 {
            keep[pair[1].1 as usize] = false;
            report.duplicate_triangles += 1;
        }
    }
    let mut at = 0;
    triangles.retain(|_| {
        at += 1;
        keep[at - 1]
    });
}

/// All uses of edges, those of one edge together.
fn edge_uses(triangles: &[[u32; 3]]) -> Vec<Use> {
    let mut uses = Vec::with_capacity(3 * triangles.len());
    for (i, t) in triangles.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            uses.push(Use {
                ends: [a.min(b), a.max(b)],
                triangle: i as u32,
                forward: a < b,
            });
        }
    }
    uses.sort_unstable();
    uses
}

/// Makes neighbours agree, piece by piece; a piece that needed reversals
/// and ends up inside out is reversed as a whole.
fn orient(points: &[[f64; 3]], triangles: &mut [[u32; 3]], uses: &[Use], report: &mut MeshReport) {
    // Neighbours over edges of exactly two triangles; `true`: they disagree.
    let mut links: Vec<(u32, u32, bool)> = Vec::with_capacity(uses.len());
    for group in uses.chunk_by(|a, b| a.ends == b.ends) {
        if let [a, b] = group {
            let disagree = a.forward == b.forward;
            links.push((a.triangle, b.triangle, disagree));
            links.push((b.triangle, a.triangle, disagree));
        }
    }
    links.sort_unstable();
    let mut start = vec![0_usize; triangles.len() + 1];
    for l in &links {
        start[l.0 as usize + 1] += 1;
    }
    for i in 0..triangles.len() {
        start[i + 1] += start[i];
    }
    let mut flip: Vec<Option<bool>> = vec![None; triangles.len()];
    let mut piece = Vec::new();
    for seed in 0..triangles.len() {
        if flip[seed].is_some() {
            continue;
        }
        report.components += 1;
        flip[seed] = Some(false);
        piece.clear();
        piece.push(seed as u32);
        let mut next = 0;
        while next < piece.len() {
            let t = piece[next] as usize;
            next += 1;
            let mine = flip[t] == Some(true);
            for (_, other, disagree) in &links[start[t]..start[t + 1]] {
                if flip[*other as usize].is_none() {
                    flip[*other as usize] = Some(mine != *disagree);
                    piece.push(*other);
                }
            }
        }
        let mut reversed = 0;
        for &t in &piece {
            if flip[t as usize] == Some(true) {
                triangles[t as usize].swap(1, 2);
                reversed += 1;
            }
        }
        if reversed > 0 && volume_of(points, piece.iter().map(|t| &triangles[*t as usize])) < 0.0 {
            piece.iter().for_each(|t| triangles[*t as usize].swap(1, 2));
            reversed = piece.len() - reversed;
        }
        report.flipped_triangles += reversed;
    }
}

/// Closes every loop of boundary edges with a fan around its centroid.
fn fill_holes(points: &mut Vec<[f64; 3]>, triangles: &mut Vec<[u32; 3]>, report: &mut MeshReport) {
    // The missing neighbour of edge a→b runs b→a.
    let mut open: Vec<(u32, u32)> = edge_uses(triangles)
        .chunk_by(|a, b| a.ends == b.ends)
        .filter(|g| g.len() == 1)
        .map(|g| {
            if g[0].forward {
                (g[0].ends[1], g[0].ends[0])
            } else {
                (g[0].ends[0], g[0].ends[1])
            }
        })
        .collect();
    open.sort_unstable();
    let mut used = vec![false; open.len()];
    for first in 0..open.len() {
        if used[first] {
            continue;
        }
        let mut chain = vec![first];
        used[first] = true;
        loop {
            let (_, end) = open[chain[chain.len() - 1]];
            if end == open[first].0 {
                break;
            }
            let from = open.partition_point(|e| e.0 < end);
            let next = (from..open.len())
                .take_while(|e| open[*e].0 == end)
                .find(|e| !used[*e]);
            let Some(next) = next else {
                chain.clear(); // not a loop
                break;
            };
            used[next] = true;
            chain.push(next);
        }
        if chain.len() < 3 {
            continue;
        }
        let rim: Vec<[f64; 3]> = chain.iter().map(|e| points[open[*e].0 as usize]).collect();
        let length: f64 = (0..rim.len())
            .map(|i| norm(sub(rim[(i + 1) % rim.len()], rim[i])))
            .sum();
        report.filled_holes += 1;
        report.largest_hole = report.largest_hole.max(length);
        if let [a, b, c] = chain[..] {
            triangles.push([open[a].0, open[b].0, open[c].0]);
            continue;
        }
        let hub = points.len() as u32;
        let n = rim.len() as f64;
        points.push(std::array::from_fn(|k| {
            rim.iter().map(|p| p[k]).sum::<f64>() / n
        }));
        triangles.extend(chain.iter().map(|e| [open[*e].0, open[*e].1, hub]));
    }
}

pub(crate) fn corners(points: &[[f64; 3]], t: &[u32; 3]) -> [[f64; 3]; 3] {
    t.map(|p| points[p as usize])
}

fn volume(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> f64 {
    volume_of(points, triangles.iter())
}

/// Signed volume over tetrahedra to the first corner, which keeps rounding
/// small far from the origin.
fn volume_of<'a>(points: &[[f64; 3]], triangles: impl Iterator<Item = &'a [u32; 3]>) -> f64 {
    let mut apex = None;
    let mut sum = 0.0;
    for t in triangles {
        let [a, b, c] = corners(points, t);
        let o = *apex.get_or_insert(a);
        sum += dot(sub(a, o), cross(sub(b, o), sub(c, o)));
    }
    sum / 6.0
}
