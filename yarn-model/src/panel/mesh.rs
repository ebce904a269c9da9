use std::collections::BTreeMap;

use super::{Outline, PanelError};

/// A connected piece of flat coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// Places of its vertices in its plane \[m\].
    pub flat: Vec<[f64; 2]>,
    /// Point in space of every vertex, an index into [`PanelSet::points`].
    pub points: Vec<u32>,
    /// Triangles of vertices, counter-clockwise.
    pub triangles: Vec<[u32; 3]>,
}

/// Panels in the plane and in space, with their seams.
#[derive(Clone, Debug, PartialEq)]
pub struct PanelSet {
    /// Points in space, those that coincide taken for one \[m\].
    pub points: Vec<[f64; 3]>,
    /// The panels, in the order of their first triangles.
    pub panels: Vec<Panel>,
}

impl PanelSet {
    /// Takes a mesh apart. Triangles that share an edge in space with the same
    /// flat coordinates at both ends are of one panel. Points closer than
    /// `weld` \[m\] are one point, which is how panels are sewn; so are the flat
    /// places of a point.
    ///
    /// # Errors
    /// [`PanelError`] for numbers that are not finite, points that do not
    /// exist, and flat triangles that have no area or run clockwise.
    pub fn new(
        positions: &[[f64; 3]],
        triangles: &[[u32; 3]],
        flat: &[[[f64; 2]; 3]],
        weld: f64,
    ) -> Result<Self, PanelError> {
        check(positions, triangles, flat)?;
        let (of, points) = welded(positions, weld);
        // Flat places of every point, those that coincide taken for one.
        let mut places: Vec<Vec<[f64; 2]>> = vec![Vec::new(); points.len()];
        let mut corners: Vec<[Corner; 3]> = Vec::with_capacity(triangles.len());
        for (t, flat) in triangles.iter().zip(flat) {
            corners.push([0, 1, 2].map(|k| {
                let point = of[t[k] as usize];
                let [u, v] = flat[k];
                let known = &mut places[point as usize];
                let at = known
                    .iter()
                    .position(|p| (p[0] - u).hypot(p[1] - v) <= weld);
                let at = at.unwrap_or_else(|| {
                    known.push([u, v]);
                    known.len() - 1
                });
                (point, at as u32)
            }));
        }
        let corner = |t: usize, k: usize| corners[t][k];
        let mut first: BTreeMap<[Corner; 2], usize> = BTreeMap::new();
        let mut piece: Vec<usize> = (0..triangles.len()).collect();
        for t in 0..triangles.len() {
            for k in 0..3 {
                let mut edge = [corner(t, k), corner(t, (k + 1) % 3)];
                edge.sort_unstable();
                let other = *first.entry(edge).or_insert(t);
                let (a, b) = (root(&mut piece, t), root(&mut piece, other));
                piece[a.max(b)] = a.min(b);
            }
        }
        let mut panels: Vec<Panel> = Vec::new();
        let mut panel_of: BTreeMap<usize, usize> = BTreeMap::new();
        let mut vertex_of: BTreeMap<(usize, Corner), u32> = BTreeMap::new();
        for t in 0..triangles.len() {
            let p = *panel_of.entry(root(&mut piece, t)).or_insert_with(|| {
                panels.push(Panel {
                    flat: Vec::new(),
                    points: Vec::new(),
                    triangles: Vec::new(),
                });
                panels.len() - 1
            });
            let panel = &mut panels[p];
            let vertices = [0, 1, 2].map(|k| {
                let corner = corner(t, k);
                *vertex_of.entry((p, corner)).or_insert_with(|| {
                    panel.flat.push(flat[t][k]);
                    panel.points.push(corner.0);
                    (panel.flat.len() - 1) as u32
                })
            });
            panel.triangles.push(vertices);
        }
        Ok(Self { points, panels })
    }
}

impl Panel {
    /// Its outline.
    ///
    /// # Errors
    /// [`PanelError`] for a panel without area.
    pub fn outline(&self) -> Result<Outline, PanelError> {
        let place = |v: u32| self.flat[v as usize];
        Outline::from_edges(self.border().iter().map(|e| e.map(place)).collect())
    }

    /// Edges of a single triangle, with the panel on their left, sorted.
    pub fn border(&self) -> Vec<[u32; 2]> {
        let mut uses: BTreeMap<[u32; 2], u32> = BTreeMap::new();
        let edges = |t: &[u32; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]];
        for edge in self.triangles.iter().flat_map(edges) {
            *uses.entry(edge).or_default() += 1;
        }
        let back = |[a, b]: [u32; 2]| uses.contains_key(&[b, a]);
        uses.keys().copied().filter(|e| !back(*e)).collect()
    }
}

/// Point in space, and which of its flat places.
type Corner = (u32, u32);

fn root(parent: &mut [usize], mut k: usize) -> usize {
    while parent[k] != k {
        parent[k] = parent[parent[k]];
        k = parent[k];
    }
    k
}

fn check(
    positions: &[[f64; 3]],
    triangles: &[[u32; 3]],
    flat: &[[[f64; 2]; 3]],
) -> Result<(), PanelError> {
    if triangles.is_empty() {
        return Err(PanelError::EmptyOutline { points: 0 });
    }
    if triangles.len() != flat.len() {
        return Err(PanelError::FlatCount {
            triangles: triangles.len(),
            flat: flat.len(),
        });
    }
    let finite = |p: &[f64; 3]| p.iter().all(|x| x.is_finite());
    if let Some(index) = positions.iter().position(|p| !finite(p)) {
        let what = "point";
        return Err(PanelError::NotFinite { what, index });
    }
    for (triangle, (t, m)) in triangles.iter().zip(flat).enumerate() {
        if let Some(&point) = t.iter().find(|p| **p as usize >= positions.len()) {
            let count = positions.len();
            return Err(PanelError::NoSuchPoint {
                triangle,
                point,
                count,
            });
        }
        let e = [1, 2].map(|k| [m[k][0] - m[0][0], m[k][1] - m[0][1]]);
        let area = e[0][0] * e[1][1] - e[0][1] * e[1][0];
        let longest = e.iter().map(|d| d[0].hypot(d[1])).fold(0.0, f64::max);
        // Not a number is no area either.
        if !(area > 1e-9 * longest * longest && longest.is_finite()) {
            return Err(PanelError::FlatTriangle { triangle });
        }
    }
    Ok(())
}

/// New number of every point, and the points that are left.
fn welded(positions: &[[f64; 3]], weld: f64) -> (Vec<u32>, Vec<[f64; 3]>) {
    let cell = |p: &[f64; 3]| p.map(|x| (x / weld.max(1e-12)).floor() as i64);
    let mut cells: BTreeMap<[i64; 3], Vec<u32>> = BTreeMap::new();
    let mut points: Vec<[f64; 3]> = Vec::new();
    let mut of = Vec::with_capacity(positions.len());
    for p in positions {
        let here = cell(p);
        let near = (0..27).find_map(|k| {
            let shift = [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1];
            let there: [i64; 3] = std::array::from_fn(|i| here[i].saturating_add(shift[i]));
            let close = |q: &&u32| {
                let q = points[**q as usize];
                (0..3).map(|i| (p[i] - q[i]).powi(2)).sum::<f64>() <= weld * weld
            };
            cells.get(&there)?.iter().find(close).copied()
        });
        of.push(near.unwrap_or_else(|| {
            points.push(*p);
            let new = (points.len() - 1) as u32;
            cells.entry(here).or_default().push(new);
            new
        }));
    }
    (of, points)
}
