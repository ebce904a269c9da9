//! Carrying positions from a coarse mesh of a pattern to a finer one.

use crate::GarmentMesh;
use crate::math::double_area;

/// Positions of the points of `fine` by linear interpolation within the
/// triangles of `coarse` at the same place of the same panel; points with
/// parts in several panels get the mean.
pub fn prolong(coarse: &GarmentMesh, positions: &[[f64; 3]], fine: &GarmentMesh) -> Vec<[f64; 3]> {
    let grids: Vec<PanelGrid> = (0..coarse.panels.len())
        .map(|p| PanelGrid::new(coarse, p as u32))
        .collect();
    // One part per (point, panel, place): corners of triangles repeat them.
    let mut parts: Vec<(u32, u32, [f64; 2])> = Vec::with_capacity(3 * fine.triangles.len());
    for (t, corners) in fine.triangles.iter().enumerate() {
        for k in 0..3 {
            parts.push((corners[k], fine.panel_of_triangle[t], fine.material[t][k]));
        }
    }
    parts.sort_by(|a, b| {
        (a.0, a.1)
            .cmp(&(b.0, b.1))
            .then(a.2[0].total_cmp(&b.2[0]))
            .then(a.2[1].total_cmp(&b.2[1]))
    });
    parts.dedup();
    let mut out = fine.points_initial.clone();
    for group in parts.chunk_by(|a, b| a.0 == b.0) {
        let (mut sum, mut count) = ([0.0; 3], 0.0);
        for &(_, panel, uv) in group {
            let Some((t, w)) = grids[panel as usize].locate(coarse, uv) else {
                continue;
            };
            for k in 0..3 {
                let p = positions[coarse.triangles[t][k] as usize];
                for c in 0..3 {
                    sum[c] += w[k] * p[c];
                }
            }
            count += 1.0;
        }
        if count > 0.0 {
            out[group[0].0 as usize] = sum.map(|s| s / count);
        }
    }
    out
}

/// The triangles of one panel in a grid over its material coordinates.
struct PanelGrid {
    low: [f64; 2],
    cell: f64,
    size: [usize; 2],
    cells: Vec<Vec<u32>>,
    all: Vec<u32>,
}

impl PanelGrid {
    fn new(mesh: &GarmentMesh, panel: u32) -> Self {
        let all: Vec<u32> = (0..mesh.triangles.len() as u32)
            .filter(|&t| mesh.panel_of_triangle[t as usize] == panel)
            .collect();
        let (mut low, mut high) = ([f64::MAX; 2], [f64::MIN; 2]);
        for &t in &all {
            for p in mesh.material[t as usize] {
                for k in 0..2 {
                    low[k] = low[k].min(p[k]);
                    high[k] = high[k].max(p[k]);
                }
            }
        }
        let area = ((high[0] - low[0]) * (high[1] - low[1])).max(0.0);
        let cell = (2.0 * mesh.settings.edge_length).max((area / 1e5).sqrt());
        let size = [0, 1].map(|k| ((high[k] - low[k]).max(0.0) / cell) as usize + 1);
        let mut grid = Self {
            low,
            cell,
            size,
            cells: vec![Vec::new(); size[0] * size[1]],
            all,
        };
        for i in 0..grid.all.len() {
            let t = grid.all[i];
            let corners = mesh.material[t as usize].map(|p| grid.cell_of(p));
            let range = |k: usize| {
                let c = corners.map(|c| c[k]);
                c[0].min(c[1]).min(c[2])..=c[0].max(c[1]).max(c[2])
            };
            for y in range(1) {
                for x in range(0) {
                    grid.cells[y * size[0] + x].push(t);
                }
            }
        }
        grid
    }

    fn cell_of(&self, p: [f64; 2]) -> [usize; 2] {
        [0, 1].map(|k| {
            let c = ((p[k] - self.low[k]) / self.cell).max(0.0) as usize;
            c.min(self.size[k] - 1)
        })
    }

    /// The triangle that holds `p` best, with barycentric weights. Outlines
    /// of both meshes differ by the sagitta of their curves, so weights may
    /// reach a little outside.
    fn locate(&self, mesh: &GarmentMesh, p: [f64; 2]) -> Option<(usize, [f64; 3])> {
        let c = self.cell_of(p);
        let here = &self.cells[c[1] * self.size[0] + c[0]];
        let mut best = pick(mesh, here, p, None);
        if best.is_none_or(|b| smallest(b.1) < -1e-9) {
            for y in c[1].saturating_sub(1)..=(c[1] + 1).min(self.size[1] - 1) {
                for x in c[0].saturating_sub(1)..=(c[0] + 1).min(self.size[0] - 1) {
                    best = pick(mesh, &self.cells[y * self.size[0] + x], p, best);
                }
            }
        }
        best.or_else(|| pick(mesh, &self.all, p, None))
    }
}

fn smallest(w: [f64; 3]) -> f64 {
    w[0].min(w[1]).min(w[2])
}

fn pick(
    mesh: &GarmentMesh,
    list: &[u32],
    p: [f64; 2],
    mut best: Option<(usize, [f64; 3])>,
) -> Option<(usize, [f64; 3])> {
    for &t in list {
        let [a, b, c] = mesh.material[t as usize];
        let whole = double_area(a, b, c);
        let w = [
            double_area(p, b, c) / whole,
            double_area(a, p, c) / whole,
            double_area(a, b, p) / whole,
        ];
        if smallest(w).is_finite() && best.is_none_or(|x| smallest(w) > smallest(x.1)) {
            best = Some((t as usize, w));
        }
    }
    best
}
