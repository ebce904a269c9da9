use super::{Panel, PanelSet};
use crate::vec3::V;

/// From a panel's plane into space, through its triangles.
#[derive(Clone, Debug)]
pub struct PanelSurface<'a> {
    set: &'a PanelSet,
    panel: &'a Panel,
    /// Unit normals of the vertices.
    normals: Vec<[f64; 3]>,
    low: [f64; 2],
    size: f64,
    cells: [usize; 2],
    /// Triangles by cell of a grid, those whose bounding box touches it.
    grid: Vec<Vec<u32>>,
}

impl<'a> PanelSurface<'a> {
    /// Sorts the triangles of a panel into a grid.
    pub fn new(set: &'a PanelSet, panel: usize) -> Self {
        let panel = &set.panels[panel];
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for p in &panel.flat {
            for k in 0..2 {
                low[k] = low[k].min(p[k]);
                high[k] = high[k].max(p[k]);
            }
        }
        let extent = [high[0] - low[0], high[1] - low[1]];
        let count = panel.triangles.len().max(1) as f64;
        let least = extent[0].max(extent[1]) / 4096.0;
        let size = (2.0 * extent[0] * extent[1] / count).sqrt().max(least);
        let cells = extent.map(|e| (e / size) as usize + 1);
        let mut surface = Self {
            set,
            panel,
            normals: normals(set, panel),
            low,
            size,
            cells,
            grid: vec![Vec::new(); cells[0] * cells[1]],
        };
        for t in 0..panel.triangles.len() {
            let corners = surface.corners(t as u32);
            let bound = |of: fn(f64, f64) -> f64| {
                let of = |k: usize| of(of(corners[0][k], corners[1][k]), corners[2][k]);
                surface.cell([of(0), of(1)])
            };
            let (from, to) = (bound(f64::min), bound(f64::max));
            for y in from[1]..=to[1] {
                for x in from[0]..=to[0] {
                    surface.grid[y * cells[0] + x].push(t as u32);
                }
            }
        }
        surface
    }

    /// Place in space \[m\] and unit normal, towards the viewer of the side on
    /// which triangles run counter-clockwise. Beyond the border the nearest
    /// triangle's plane goes on.
    pub fn place(&self, flat: [f64; 2]) -> ([f64; 3], [f64; 3]) {
        let t = self.nearest(flat);
        let b = barycentric(self.corners(t), flat);
        let vertices = self.panel.triangles[t as usize];
        let inside = b.map(|b| b.clamp(0.0, 1.0));
        let (mut point, mut normal) = (V::zeros(), V::zeros());
        for k in 0..3 {
            let v = vertices[k] as usize;
            point += b[k] * V::from(self.set.points[self.panel.points[v] as usize]);
            normal += inside[k] * V::from(self.normals[v]);
        }
        let fallback = V::from(self.normals[vertices[0] as usize]);
        let normal = normal.try_normalize(1e-9).unwrap_or(fallback);
        (point.into(), normal.into())
    }

    /// Unit normal at a vertex of the panel.
    pub fn normal(&self, vertex: u32) -> [f64; 3] {
        self.normals[vertex as usize]
    }

    /// The triangle of a place, else the nearest one; the first of several.
    fn nearest(&self, flat: [f64; 2]) -> u32 {
        let home = self.cell(flat);
        let far = self.cells[0].max(self.cells[1]);
        let mut best = (f64::INFINITY, 0);
        for ring in 0..=far {
            // What is in this ring is at least this far away.
            let reach = (ring as f64 - 1.0) * self.size;
            if best.0 <= 0.0 || best.0 < reach.max(0.0) {
                break;
            }
            for t in self.ring(home, ring) {
                let d = distance(self.corners(t), flat);
                if d < best.0 || (d == best.0 && t < best.1) {
                    best = (d, t);
                }
            }
        }
        best.1
    }

    /// Triangles of the cells at a distance of `ring` cells.
    fn ring(&self, home: [usize; 2], ring: usize) -> impl Iterator<Item = u32> + '_ {
        let range =
            |k: usize| home[k].saturating_sub(ring)..(home[k] + ring + 1).min(self.cells[k]);
        let on = move |x: usize, y: usize| home[0].abs_diff(x).max(home[1].abs_diff(y)) == ring;
        let (xs, ys) = (range(0), range(1));
        let cells = ys.flat_map(move |y| xs.clone().map(move |x| (x, y)));
        let cells = cells.filter(move |(x, y)| on(*x, *y));
        cells.flat_map(move |(x, y)| self.grid[y * self.cells[0] + x].iter().copied())
    }

    fn cell(&self, p: [f64; 2]) -> [usize; 2] {
        // A cast of what is negative gives 0.
        [0, 1].map(|k| (((p[k] - self.low[k]) / self.size) as usize).min(self.cells[k] - 1))
    }

    fn corners(&self, t: u32) -> [[f64; 2]; 3] {
        self.panel.triangles[t as usize].map(|v| self.panel.flat[v as usize])
    }
}

/// Normals of vertices, triangles weighted by their area.
fn normals(set: &PanelSet, panel: &Panel) -> Vec<[f64; 3]> {
    let mut normals = vec![V::zeros(); panel.flat.len()];
    for t in &panel.triangles {
        let x = t.map(|v| V::from(set.points[panel.points[v as usize] as usize]));
        let n = (x[1] - x[0]).cross(&(x[2] - x[0]));
        for v in t {
            normals[*v as usize] += n;
        }
    }
    let unit = |n: V| n.try_normalize(1e-30).unwrap_or_else(V::z);
    normals.into_iter().map(|n| unit(n).into()).collect()
}

fn barycentric([a, b, c]: [[f64; 2]; 3], p: [f64; 2]) -> [f64; 3] {
    let doubled = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| {
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    };
    let whole = doubled(a, b, c);
    let (v, w) = (doubled(a, p, c) / whole, doubled(a, b, p) / whole);
    [1.0 - v - w, v, w]
}

/// Distance of a place from a triangle, 0 inside \[m\].
fn distance(t: [[f64; 2]; 3], p: [f64; 2]) -> f64 {
    if barycentric(t, p).iter().all(|b| *b >= 0.0) {
        return 0.0;
    }
    let side = |k: usize| along(t[k], t[(k + 1) % 3], p).1;
    (0..3).map(side).fold(f64::INFINITY, f64::min)
}

/// Fraction along the segment from `a` to `b` nearest to `p`, and the distance.
pub(super) fn along(a: [f64; 2], b: [f64; 2], p: [f64; 2]) -> (f64, f64) {
    let d = [b[0] - a[0], b[1] - a[1]];
    let square = d[0] * d[0] + d[1] * d[1];
    let dot = (p[0] - a[0]) * d[0] + (p[1] - a[1]) * d[1];
    let t = if square > 0.0 {
        (dot / square).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (t, (a[0] + t * d[0] - p[0]).hypot(a[1] + t * d[1] - p[1]))
}
