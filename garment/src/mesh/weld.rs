//! Joining the panels' meshes into one.

use super::boundary::Outline;
use super::close::{Pair, close};
use super::fill::Filled;
use super::segments::Sewing;
use super::{
    GarmentMesh, MeshPanel, MeshSettings, MeshStats, SeamLine, SeamMode, SpringSeam, orient,
    quality,
};
use crate::math::{add, dist, scale};
use crate::pattern::{Finding, Pattern, Severity};
use std::collections::BTreeMap;

pub(super) fn weld(
    pattern: &Pattern,
    settings: &MeshSettings,
    sewing: &Sewing,
    panels: &[(Outline, Filled)],
) -> GarmentMesh {
    let mut offset = vec![0u32];
    for (_, filled) in panels {
        offset.push(offset[offset.len() - 1] + filled.points.len() as u32);
    }
    let total = offset[panels.len()] as usize;
    let mut panel_of_segment = vec![0u32; sewing.segments.len()];
    for (p, (outline, _)) in panels.iter().enumerate() {
        for s in 0..outline.segment_points.len() {
            panel_of_segment[outline.first_segment as usize + s] = p as u32;
        }
    }
    let orientation = orient::orient(&panel_of_segment, panels.len(), sewing);

    let mesh_panels: Vec<MeshPanel> = panels
        .iter()
        .enumerate()
        .map(|(p, (outline, _))| MeshPanel {
            name: pattern.panels[p].name.clone(),
            label: pattern.panels[p].label.clone(),
            frame: pattern.panels[p].frame(),
            side: if orientation.flipped[p] {
                -outline.side
            } else {
                outline.side
            },
            area: outline.area,
        })
        .collect();

    // Panel meshes side by side.
    let mut placed = Vec::with_capacity(total);
    let mut triangles = Vec::new();
    let mut material = Vec::new();
    let mut panel_of_triangle = Vec::new();
    for (p, (outline, filled)) in panels.iter().enumerate() {
        let panel = &mesh_panels[p];
        let own = |q: [f64; 2]| [outline.side * q[0], q[1]];
        placed.extend(filled.points.iter().map(|&q| panel.frame.place(own(q))));
        for t in &filled.triangles {
            let mut t = *t;
            if orientation.flipped[p] {
                t.swap(1, 2);
            }
            triangles.push(t.map(|v| v + offset[p]));
            material.push(t.map(|v| panel.to_material(own(filled.points[v as usize]))));
            panel_of_triangle.push(p as u32);
        }
    }

    let mut pairs = matched_pairs(sewing, panels, &panel_of_segment, &offset);
    let (seam_gap_max, seam_gap_mean) = gaps(&pairs, &placed);
    if settings.seams == SeamMode::Springs {
        for pair in &mut pairs {
            pair.open = true;
        }
    }
    let mut sets = close(total, &mut pairs, &triangles);

    // Number the merged points in order of their first member.
    let mut number = vec![u32::MAX; total];
    let mut sum: Vec<([f64; 3], f64)> = Vec::new();
    for i in 0..total as u32 {
        let root = sets.find(i) as usize;
        if number[root] == u32::MAX {
            number[root] = sum.len() as u32;
            sum.push(([0.0; 3], 0.0));
        }
        number[i as usize] = number[root];
        let s = &mut sum[number[root] as usize];
        s.0 = add(s.0, placed[i as usize]);
        s.1 += 1.0;
    }
    for t in &mut triangles {
        *t = t.map(|v| number[v as usize]);
    }

    let spring_seams: Vec<SpringSeam> = pairs
        .iter()
        .filter(|p| p.open && number[p.a as usize] != number[p.b as usize])
        .map(|p| SpringSeam {
            point: number[p.a as usize],
            edge: [number[p.b as usize]; 2],
            weights: [1.0, 0.0],
            stitch: p.stitch,
        })
        .collect();

    let mut mesh = GarmentMesh {
        points_initial: sum.iter().map(|s| scale(s.0, 1.0 / s.1)).collect(),
        triangles,
        material,
        panel_of_triangle,
        panels: mesh_panels,
        seam_lines: seam_lines(sewing, panels, &panel_of_segment, &offset, &number),
        labels: labels(pattern, sewing, panels, &offset, &number),
        spring_seams,
        stats: MeshStats::default(),
        findings: Vec::new(),
        pattern: pattern.clone(),
        settings: *settings,
    };
    let (non_manifold_edges, flipped_edges) = count_edges(&mesh.triangles);
    let mut stats = MeshStats {
        seam_gap_max,
        seam_gap_mean,
        welded_pairs: pairs.iter().filter(|p| !p.open).count(),
        open_pairs: pairs.iter().filter(|p| p.open).count(),
        non_manifold_edges,
        flipped_edges,
        contracted_edges: sewing.segments.iter().filter(|s| s.pieces == 0).count(),
        ..MeshStats::default()
    };
    quality::measure(&mesh, &mut stats);
    mesh.stats = stats;
    mesh.findings = findings(&mesh, &orientation.inconsistent);
    mesh
}

/// The point pairs of all seams, by index over all panels.
fn matched_pairs(
    sewing: &Sewing,
    panels: &[(Outline, Filled)],
    panel_of_segment: &[u32],
    offset: &[u32],
) -> Vec<Pair> {
    let mut pairs = Vec::new();
    for s in &sewing.sewn {
        let [a, b] = [s.a, s.b].map(|x| points_of(x, panels, panel_of_segment, offset));
        let pieces = sewing.segments[s.a as usize].pieces;
        for i in 0..=pieces {
            pairs.push(Pair {
                a: a[i],
                b: b[s.partner(i, pieces)],
                stitch: s.stitch,
                end: i == 0 || i == pieces,
                open: false,
            });
        }
    }
    pairs
}

fn points_of(
    segment: u32,
    panels: &[(Outline, Filled)],
    panel_of_segment: &[u32],
    offset: &[u32],
) -> Vec<u32> {
    let p = panel_of_segment[segment as usize] as usize;
    let outline = &panels[p].0;
    outline.segment_points[(segment - outline.first_segment) as usize]
        .iter()
        .map(|&v| v + offset[p])
        .collect()
}

fn gaps(pairs: &[Pair], placed: &[[f64; 3]]) -> (f64, f64) {
    let (mut largest, mut sum) = (0.0f64, 0.0);
    for p in pairs {
        let d = dist(placed[p.a as usize], placed[p.b as usize]);
        largest = largest.max(d);
        sum += d;
    }
    (largest, sum / pairs.len().max(1) as f64)
}

fn seam_lines(
    sewing: &Sewing,
    panels: &[(Outline, Filled)],
    panel_of_segment: &[u32],
    offset: &[u32],
    number: &[u32],
) -> Vec<SeamLine> {
    sewing
        .sewn
        .iter()
        .map(|s| SeamLine {
            stitch: s.stitch,
            points: points_of(s.a, panels, panel_of_segment, offset)
                .into_iter()
                .map(|v| number[v as usize])
                .collect(),
        })
        .collect()
}

fn labels(
    pattern: &Pattern,
    sewing: &Sewing,
    panels: &[(Outline, Filled)],
    offset: &[u32],
    number: &[u32],
) -> BTreeMap<String, Vec<u32>> {
    let mut labels: BTreeMap<String, Vec<u32>> = BTreeMap::new();
    for (p, panel) in pattern.panels.iter().enumerate() {
        for (e, edge) in panel.edges.iter().enumerate() {
            let Some(label) = &edge.label else {
                continue;
            };
            let list = labels.entry(label.clone()).or_default();
            for s in sewing.of_edge(p, e) {
                let outline = &panels[p].0;
                for &v in &outline.segment_points[(s - outline.first_segment) as usize] {
                    list.push(number[(v + offset[p]) as usize]);
                }
            }
        }
    }
    for list in labels.values_mut() {
        list.sort_unstable();
        list.dedup();
    }
    labels
}

/// Edges with more than two triangles, and edges walked twice in the same
/// direction (their triangles face opposite sides).
fn count_edges(triangles: &[[u32; 3]]) -> (usize, usize) {
    let mut edges: Vec<(u32, u32, bool)> = Vec::with_capacity(3 * triangles.len());
    for t in triangles {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            edges.push((a.min(b), a.max(b), a < b));
        }
    }
    edges.sort_unstable();
    let (mut crowded, mut flipped) = (0, 0);
    for group in edges.chunk_by(|x, y| (x.0, x.1) == (y.0, y.1)) {
        match group {
            [_] => {}
            [x, y] => flipped += usize::from(x.2 == y.2),
            _ => crowded += 1,
        }
    }
    (crowded, flipped)
}

fn findings(mesh: &GarmentMesh, inconsistent: &[u32]) -> Vec<Finding> {
    let mut out = Vec::new();
    let mut push = |severity, message: String, help: &str| {
        out.push(Finding {
            severity,
            panel: None,
            edge: None,
            place: None,
            message,
            help: help.to_owned(),
        });
    };
    if !inconsistent.is_empty() {
        push(
            Severity::Warning,
            format!(
                "the garment has no outside: going round it through stitches {inconsistent:?} \
                 turns the cloth over"
            ),
            "check \"right_wrong\" and the outlines' directions of the panels they join",
        );
    }
    let stats = &mesh.stats;
    if stats.open_pairs > 0 && mesh.settings.seams == SeamMode::Weld {
        push(
            Severity::Note,
            format!(
                "{} of {} sewn point pairs stay open (tip of a cone or pillow)",
                stats.open_pairs,
                stats.open_pairs + stats.welded_pairs
            ),
            "they are tied by springs instead; a smaller edge length shrinks the opening",
        );
    }
    if stats.non_manifold_edges > 0 {
        push(
            Severity::Note,
            format!(
                "{} edges are shared by more than two triangles",
                stats.non_manifold_edges
            ),
            "expected where three or more layers are sewn into one seam",
        );
    }
    out
}
