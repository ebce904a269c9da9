//! Filling an outline with nearly equilateral Delaunay triangles.
//!
//! Points start on a triangular lattice inside the outline, are triangulated
//! (constrained Delaunay), moved to the centroids of their surroundings and
//! triangulated again. Points of the outline never move and none is added
//! to it, so sewn edges keep matching.

use super::boundary::{Outline, PANEL_POINT_LIMIT};
use crate::GarmentError;
use crate::math::{dist2, dot2, double_area, mix2, sub2};
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};

/// A filled outline: its points first, in order, then interior points.
pub(super) struct Filled {
    pub points: Vec<[f64; 2]>,
    pub triangles: Vec<[u32; 3]>,
}

/// Lattice points keep this distance from the outline, in edge lengths.
const MARGIN: f64 = 0.55;
/// Triangulations with smoothing in between.
const ROUNDS: usize = 6;
/// Smoothing sweeps per triangulation.
const SWEEPS: usize = 3;

pub(super) fn fill(name: &str, outline: &Outline, h: f64) -> Result<Filled, GarmentError> {
    let nb = outline.points.len();
    let estimate = nb as f64 + outline.area / (0.866 * h * h);
    if estimate.is_nan() || estimate > PANEL_POINT_LIMIT as f64 {
        return Err(GarmentError::TooManyPoints {
            panel: name.to_owned(),
            points: estimate,
            edge_length: h,
            limit: PANEL_POINT_LIMIT,
        });
    }
    let check = |points: &[[f64; 2]], triangles: &[[u32; 3]]| {
        let kept: f64 = triangles.iter().map(|t| 0.5 * area_of(points, t)).sum();
        // Rounding of a sum over many triangles, far below one triangle.
        if (kept - outline.area).abs() <= 1e-9 * outline.area.max(h * h) {
            Ok(())
        } else {
            Err(GarmentError::AreaMismatch {
                panel: name.to_owned(),
                kept,
                expected: outline.area,
            })
        }
    };
    let near = Near::new(&outline.points, h);
    let mut points = outline.points.clone();
    seed(&mut points, nb, &near, h);
    let mut triangles = triangulate(&points, nb);
    check(&points, &triangles)?;
    for round in 0..ROUNDS {
        for _ in 0..SWEEPS {
            smooth(&mut points, nb, &triangles);
        }
        if round == 1 || round == 3 {
            thin_and_thicken(&mut points, nb, &triangles, &near, h);
        }
        triangles = triangulate(&points, nb);
        check(&points, &triangles)?;
    }
    if split_ears(&mut points, nb, &triangles, &outline.sewn_corner) {
        triangles = triangulate(&points, nb);
        check(&points, &triangles)?;
    }
    Ok(Filled { points, triangles })
}

fn area_of(points: &[[f64; 2]], t: &[u32; 3]) -> f64 {
    let [a, b, c] = t.map(|i| points[i as usize]);
    double_area(a, b, c)
}

/// Constrained Delaunay triangles inside the outline `0..nb`; empty when the
/// triangulation fails (the area check reports it).
fn triangulate(points: &[[f64; 2]], nb: usize) -> Vec<[u32; 3]> {
    // spade refuses coordinates that underflow when multiplied.
    let clean = |x: f64| if x.abs() < 1e-30 { 0.0 } else { x };
    let vertices: Vec<Point2<f64>> = points
        .iter()
        .map(|p| Point2::new(clean(p[0]), clean(p[1])))
        .collect();
    let edges: Vec<[usize; 2]> = (0..nb).map(|i| [i, (i + 1) % nb]).collect();
    let mut conflict = false;
    let Ok(cdt) =
        ConstrainedDelaunayTriangulation::<Point2<f64>>::try_bulk_load_cdt(vertices, edges, |_| {
            conflict = true
        })
    else {
        return Vec::new();
    };
    if conflict || cdt.num_vertices() != points.len() {
        return Vec::new();
    }
    // Faces left of the outline are inside; flood from there, never over the
    // outline. (Classifying by spade's outer faces fails with inner lines.)
    let mut inside = vec![false; cdt.num_all_faces()];
    let mut stack = Vec::new();
    let handle = spade::handles::FixedVertexHandle::from_index;
    for i in 0..nb {
        let Some(edge) = cdt.get_edge_from_neighbors(handle(i), handle((i + 1) % nb)) else {
            return Vec::new();
        };
        if let Some(face) = edge.face().as_inner()
            && !inside[face.index()]
        {
            inside[face.index()] = true;
            stack.push(face);
        }
    }
    let mut triangles = Vec::with_capacity(2 * points.len());
    while let Some(face) = stack.pop() {
        for edge in face.adjacent_edges() {
            if edge.is_constraint_edge() {
                continue;
            }
            if let Some(next) = edge.rev().face().as_inner()
                && !inside[next.index()]
            {
                inside[next.index()] = true;
                stack.push(next);
            }
        }
    }
    for face in cdt.inner_faces() {
        if inside[face.index()] {
            triangles.push(face.vertices().map(|v| v.index() as u32));
        }
    }
    triangles
}

/// Adds lattice points inside the outline, rows along x, symmetric about the
/// middle of the bounding box so that mirrored panels get mirrored meshes.
fn seed(points: &mut Vec<[f64; 2]>, nb: usize, near: &Near, h: f64) {
    let outline: Vec<[f64; 2]> = points[..nb].to_vec();
    let (mut low, mut high) = ([f64::MAX; 2], [f64::MIN; 2]);
    for p in &outline {
        for k in 0..2 {
            low[k] = low[k].min(p[k]);
            high[k] = high[k].max(p[k]);
        }
    }
    let middle = mix2(low, high, 0.5);
    let rise = h * 0.75f64.sqrt();
    let rows = ((high[1] - low[1]) / (2.0 * rise)).ceil() as i64;
    let mut crossings: Vec<f64> = Vec::new();
    for row in -rows..=rows {
        let y = middle[1] + row as f64 * rise;
        crossings.clear();
        for i in 0..nb {
            let (a, b) = (outline[i], outline[(i + 1) % nb]);
            if (a[1] > y) != (b[1] > y) {
                crossings.push(a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]));
            }
        }
        crossings.sort_by(f64::total_cmp);
        let shift = if row.rem_euclid(2) == 0 { 0.0 } else { 0.5 };
        for span in crossings.chunks_exact(2) {
            let first = ((span[0] - middle[0]) / h - shift).ceil() as i64;
            let last = ((span[1] - middle[0]) / h - shift).floor() as i64;
            for column in first..=last {
                let p = [middle[0] + (column as f64 + shift) * h, y];
                if near.distance_exceeds(p, MARGIN * h) {
                    points.push(p);
                }
            }
        }
    }
}

/// Triangles around each point.
struct Stars {
    start: Vec<u32>,
    list: Vec<u32>,
}

impl Stars {
    fn new(points: usize, triangles: &[[u32; 3]]) -> Self {
        let mut start = vec![0u32; points + 1];
        for t in triangles {
            for &v in t {
                start[v as usize + 1] += 1;
            }
        }
        for i in 0..points {
            start[i + 1] += start[i];
        }
        let mut next = start.clone();
        let mut list = vec![0u32; 3 * triangles.len()];
        for (i, t) in triangles.iter().enumerate() {
            for &v in t {
                list[next[v as usize] as usize] = i as u32;
                next[v as usize] += 1;
            }
        }
        Self { start, list }
    }

    fn of(&self, v: usize) -> &[u32] {
        &self.list[self.start[v] as usize..self.start[v + 1] as usize]
    }
}

/// Moves interior points to the area-weighted centroid of their triangles,
/// unless that would turn a triangle over.
fn smooth(points: &mut [[f64; 2]], nb: usize, triangles: &[[u32; 3]]) {
    let stars = Stars::new(points.len(), triangles);
    for v in nb..points.len() {
        let (mut sum, mut weight) = ([0.0; 2], 0.0);
        for &t in stars.of(v) {
            let corners = triangles[t as usize].map(|i| points[i as usize]);
            let area = double_area(corners[0], corners[1], corners[2]);
            for k in 0..2 {
                sum[k] += area * (corners[0][k] + corners[1][k] + corners[2][k]) / 3.0;
            }
            weight += area;
        }
        if weight.is_nan() || weight <= 0.0 {
            continue;
        }
        let old = points[v];
        points[v] = [sum[0] / weight, sum[1] / weight];
        let floor = 1e-3 * weight / stars.of(v).len() as f64;
        if stars
            .of(v)
            .iter()
            .any(|&t| area_of(points, &triangles[t as usize]) < floor)
        {
            points[v] = old;
        }
    }
}

/// Removes interior points that crowd a neighbour and adds points in
/// triangles that are too large.
fn thin_and_thicken(
    points: &mut Vec<[f64; 2]>,
    nb: usize,
    triangles: &[[u32; 3]],
    near: &Near,
    h: f64,
) {
    let mut keep = vec![true; points.len()];
    let mut touched = vec![false; points.len()];
    let mut added = Vec::new();
    for t in triangles {
        for k in 0..3 {
            let (i, j) = (t[k] as usize, t[(k + 1) % 3] as usize);
            if dist2(points[i], points[j]) < 0.6 * h && keep[i] && keep[j] {
                let victim = i.max(j);
                if victim >= nb {
                    keep[victim] = false;
                }
            }
        }
    }
    for t in triangles {
        if t.iter().any(|&v| touched[v as usize]) {
            continue;
        }
        let [a, b, c] = t.map(|v| points[v as usize]);
        let longest = dist2(a, b).max(dist2(b, c)).max(dist2(c, a));
        // Equilateral: area 0.433 h². A triangle of 0.75 h² has room for one
        // more point, unless it lies along the outline.
        if double_area(a, b, c) > 2.0 * 0.75 * h * h && longest > 1.45 * h {
            let p = [(a[0] + b[0] + c[0]) / 3.0, (a[1] + b[1] + c[1]) / 3.0];
            if near.distance_exceeds(p, 0.5 * h) {
                added.push(p);
                for &v in t {
                    touched[v as usize] = true;
                }
            }
        }
    }
    let mut index = 0;
    points.retain(|_| {
        index += 1;
        keep[index - 1]
    });
    points.extend(added);
}

/// Splits the far side of triangles that have two pieces of the outline as
/// sides at a corner sewn on both: welded to a mirror image, such a triangle
/// would fold flat onto its partner.
fn split_ears(
    points: &mut Vec<[f64; 2]>,
    nb: usize,
    triangles: &[[u32; 3]],
    sewn_corner: &[bool],
) -> bool {
    let before = points.len();
    for t in triangles {
        for k in 0..3 {
            let [p, c, n] = [t[k], t[(k + 1) % 3], t[(k + 2) % 3]].map(|v| v as usize);
            let is_ear = c < nb && p == (c + nb - 1) % nb && n == (c + 1) % nb;
            if nb > 3 && is_ear && sewn_corner[c] {
                points.push(mix2(points[p], points[n], 0.5));
            }
        }
    }
    points.len() > before
}

/// Pieces of the outline in a grid, to ask whether a point is near them.
struct Near {
    low: [f64; 2],
    cell: f64,
    size: [usize; 2],
    start: Vec<u32>,
    list: Vec<u32>,
    segments: Vec<[[f64; 2]; 2]>,
}

impl Near {
    fn new(outline: &[[f64; 2]], h: f64) -> Self {
        let n = outline.len();
        let segments: Vec<[[f64; 2]; 2]> =
            (0..n).map(|i| [outline[i], outline[(i + 1) % n]]).collect();
        let (mut low, mut high) = ([f64::MAX; 2], [f64::MIN; 2]);
        for p in outline {
            for k in 0..2 {
                low[k] = low[k].min(p[k]);
                high[k] = high[k].max(p[k]);
            }
        }
        let area = (high[0] - low[0]) * (high[1] - low[1]);
        let cell = (1.5 * h).max((area / 1e6).sqrt());
        let size = [0, 1].map(|k| ((high[k] - low[k]) / cell) as usize + 1);
        let mut grid = Self {
            low,
            cell,
            size,
            start: vec![0; size[0] * size[1] + 1],
            list: Vec::new(),
            segments,
        };
        let mut entries: Vec<(u32, u32)> = Vec::new();
        for (i, s) in grid.segments.iter().enumerate() {
            let [c, d] = s.map(|p| grid.cell_of(p));
            for y in c[1].min(d[1])..=c[1].max(d[1]) {
                for x in c[0].min(d[0])..=c[0].max(d[0]) {
                    entries.push(((y * size[0] + x) as u32, i as u32));
                }
            }
        }
        entries.sort_unstable();
        for &(cell, _) in &entries {
            grid.start[cell as usize + 1] += 1;
        }
        for i in 0..size[0] * size[1] {
            grid.start[i + 1] += grid.start[i];
        }
        grid.list = entries.into_iter().map(|e| e.1).collect();
        grid
    }

    fn cell_of(&self, p: [f64; 2]) -> [usize; 2] {
        [0, 1].map(|k| {
            let c = ((p[k] - self.low[k]) / self.cell).max(0.0) as usize;
            c.min(self.size[k] - 1)
        })
    }

    /// Whether the outline is further away than `reach`, which must not
    /// exceed the cell size.
    fn distance_exceeds(&self, p: [f64; 2], reach: f64) -> bool {
        let c = self.cell_of(p);
        for y in c[1].saturating_sub(1)..=(c[1] + 1).min(self.size[1] - 1) {
            for x in c[0].saturating_sub(1)..=(c[0] + 1).min(self.size[0] - 1) {
                let cell = y * self.size[0] + x;
                for &s in &self.list[self.start[cell] as usize..self.start[cell + 1] as usize] {
                    let [a, b] = self.segments[s as usize];
                    let d = sub2(b, a);
                    let t = (dot2(sub2(p, a), d) / dot2(d, d)).clamp(0.0, 1.0);
                    if dist2(p, mix2(a, b, t)) <= reach {
                        return false;
                    }
                }
            }
        }
        true
    }
}
