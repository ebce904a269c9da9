//! Figures of a state: depths, crossings, strains, gaps.

use selvedge_collision::{Intersection, self_intersections};
use selvedge_shell_model::strain::edge_strain;
use selvedge_yarn_model::NONE;

use crate::build::{BuiltScene, Geometry, YarnCloth, broad_phase};
use crate::summary::Defect;

/// Geometric figures of a state, in the solver's order.
pub(crate) struct Figures {
    pub max_penetration: f64,
    pub self_intersections: usize,
    pub max_strain: f64,
    pub mean_strain: f64,
    pub max_seam_gap: f64,
    pub max_drop: Option<f64>,
    pub defects: Vec<Defect>,
}

/// Crossings that are listed with their place; all are counted.
const LISTED_CROSSINGS: usize = 20;

pub(crate) fn figures(built: &BuiltScene, q: &[f64], time: f64) -> Figures {
    let g = &built.geometry;
    let (max_strain, mean_strain) = strains(g, q);
    let q = &q[..3 * g.mesh.points()];
    let (points, _) = q.as_chunks::<3>();
    let (mut deepest, mut deepest_point) = (0.0_f64, 0);
    let mut samples = Vec::new();
    for body in &built.bodies {
        samples.clear();
        body.body.sample_many(points, time, &mut samples);
        for (k, s) in samples.iter().enumerate() {
            if -s.distance > deepest {
                (deepest, deepest_point) = (-s.distance, k);
            }
        }
    }
    // A point's panel is that of the first triangle around it.
    let part =
        |t: usize| g.panel_names[usize::from(g.scene_panel[g.triangle_order[t] as usize])].clone();
    let around = |corners: &[u32]| {
        let mut all = g.mesh.triangles().iter();
        all.position(|t| corners.iter().all(|c| t.contains(c)))
    };
    let penetration = (deepest > 0.0).then(|| Defect {
        kind: "penetration",
        at: points[deepest_point],
        parts: around(&[deepest_point as u32])
            .map(part)
            .into_iter()
            .collect(),
        depth_m: Some(deepest),
    });
    let crossing = |(at, crossed): ([f64; 3], Option<Intersection>)| {
        let parts = crossed.iter().flat_map(|c| {
            let parts = around(&c.edge).into_iter().chain([c.triangle as usize]);
            parts.map(part)
        });
        Defect {
            kind: "self-intersection",
            at,
            parts: parts.collect(),
            depth_m: None,
        }
    };
    let crossings = crossings(built, q);
    let gap = g.spring_seams.iter().map(|&(p, [a, b], w)| {
        let (p, a, b) = (points[p as usize], points[a as usize], points[b as usize]);
        (0..3)
            .map(|i| (p[i] - (1.0 - w) * a[i] - w * b[i]).powi(2))
            .sum::<f64>()
            .sqrt()
    });
    let count = crossings.len();
    let listed = crossings.into_iter().take(LISTED_CROSSINGS);
    Figures {
        max_penetration: deepest,
        self_intersections: count,
        max_strain,
        mean_strain,
        max_seam_gap: gap.fold(0.0, f64::max),
        max_drop: max_drop(built, points),
        defects: penetration
            .into_iter()
            .chain(listed.map(crossing))
            .collect(),
    }
}

/// Where cloth passes through itself: edges through triangles, or yarns that no
/// stitch joins in each other.
fn crossings(built: &BuiltScene, q: &[f64]) -> Vec<([f64; 3], Option<Intersection>)> {
    if built.geometry.yarns.is_some() {
        // Points that are nowhere are in nothing.
        let places = built.passed_into(q).unwrap_or_default();
        return places.into_iter().map(|p| (p, None)).collect();
    }
    let mut broad = broad_phase(built.scene().contact.broad_phase);
    let triangles = built.geometry.mesh.triangles();
    let found = self_intersections(q, triangles, broad.as_mut());
    found.into_iter().map(|c| (c.place, Some(c))).collect()
}

/// Largest and mean magnitude of the strain of edges, or of the segments of
/// yarns.
fn strains(g: &Geometry, q: &[f64]) -> (f64, f64) {
    let Some(yarns) = &g.yarns else {
        let strain = edge_strain(&g.mesh, &q[..3 * g.mesh.points()]);
        return (strain.max_abs, strain.mean_abs);
    };
    let ends = yarns.network.yarns.iter().scan(0, |sum, y| {
        *sum += y.strands as usize;
        Some(*sum - 1)
    });
    let mut ends = ends.peekable();
    let (mut largest, mut sum, mut count) = (0.0_f64, 0.0, 0_usize);
    for (k, strain) in yarn_strains(yarns, q).into_iter().enumerate() {
        if ends.next_if_eq(&k).is_some() {
            continue;
        }
        let strain = strain.abs();
        // NaN wins, so that it is seen.
        if strain > largest || strain.is_nan() {
            largest = strain;
        }
        sum += strain;
        count += 1;
    }
    (largest, sum / count.max(1) as f64)
}

/// Strain `|x_1 − x_0|/Δu − 1` of the segment from every strand to the next,
/// yarn after yarn, with the arc lengths of the state where they slide and
/// those at rest where not; NaN at the end of a yarn.
pub(crate) fn yarn_strains(yarns: &YarnCloth, q: &[f64]) -> Vec<f64> {
    let n = &yarns.network;
    let (points, arcs) = q.split_at(3 * n.nodes());
    let points = points.as_chunks::<3>().0;
    let slid = yarns.sliding && arcs.len() >= n.strands.len();
    let strain = |s: u32| {
        let a = n.strands[s as usize];
        if a.next == NONE {
            return f64::NAN;
        }
        let b = n.strands[a.next as usize];
        let rest = match slid {
            true => arcs[a.next as usize] - arcs[s as usize],
            false => b.arc - a.arc,
        };
        let [x, y] = [a, b].map(|s| points[s.node as usize]);
        (x[0] - y[0]).hypot(x[1] - y[1]).hypot(x[2] - y[2]) / rest - 1.0
    };
    let yarns = 0..n.yarns.len() as u32;
    yarns.flat_map(|y| n.along(y)).map(strain).collect()
}

/// How far the highest point of a garment is below its highest point in the
/// pattern, for the garment that sank most [m].
fn max_drop(built: &BuiltScene, points: &[[f64; 3]]) -> Option<f64> {
    let g = &built.geometry;
    let gravity = built.scene().simulation.gravity;
    let size = gravity.iter().map(|x| x * x).sum::<f64>().sqrt();
    if size == 0.0 {
        return None;
    }
    let height = |p: &[f64; 3]| -(0..3).map(|i| p[i] * gravity[i] / size).sum::<f64>();
    let top = |heights: &mut dyn Iterator<Item = f64>| heights.fold(f64::NEG_INFINITY, f64::max);
    let garments = g.parts.iter().filter_map(|part| {
        let sewn = part.garment.as_ref()?;
        let before = top(&mut sewn
            .mesh
            .points_initial
            .iter()
            .map(|&p| height(&sewn.place(p))));
        let after = top(&mut part
            .points
            .clone()
            .map(|k| height(&points[g.order.new_of_old[k as usize] as usize])));
        Some(before - after)
    });
    garments.reduce(f64::max)
}
