//! Cavities of a body that cloth cannot enter but could be pushed into.

use super::super::field::{NodeSource, SIDE, SparseField};
use super::super::vec3::{add_scaled, norm, scale};
use super::tree::{TriangleTree, area_vector, centroid};
use rayon::prelude::*;

/// Openings narrower than twice this are closed [m]. Cloth keeps 1.5 mm from
/// a body, so that it could pass hardly narrower ones.
const OPENING: f64 = 0.0025;
/// A cavity is at least this many times as wide as its opening.
const WIDENING: f64 = 2.0;
/// Largest distance from the surface in a cavity [m]; a larger one may be a
/// room that cloth is in.
const DEEPEST: f64 = 0.05;
/// Fine cells of a brick.
const CELLS: usize = SIDE * SIDE * SIDE;

#[derive(Clone, Copy, PartialEq, Eq)]
enum Label {
    None,
    Outside,
    Cavity,
}

/// Space around a body, sampled, and which of it are cavities: parts that only
/// openings too narrow for cloth join to the outside, such as a mouth behind
/// its lips.
///
/// Cells where `φ > r` are parted into what is connected; `r` is half an
/// opening. A part is a cavity when it does not reach the border of the grid
/// and its largest `φ` is `2 r` to 5 cm. Cells with `0 < φ ≤ r` belong to
/// the part they are fewest cells away from.
pub(super) struct Cavities<'a> {
    field: &'a SparseField,
    /// Coarse cell of each brick.
    refined: Vec<u32>,
    /// Of coarse cells, then of the cells of each brick.
    labels: Vec<Label>,
    /// How many there are.
    pub(super) count: usize,
}

impl<'a> Cavities<'a> {
    /// Those around the body of a field, if there are any.
    pub(super) fn find(field: &'a SparseField) -> Option<Self> {
        let distances = center_distances(field);
        let limit = OPENING.max(0.5 * field.voxel);
        let mut cavities = Self {
            labels: vec![Label::None; distances.len()],
            refined: field.refined(),
            field,
            count: 0,
        };
        let border = cavities.border();
        cavities.flood(border, limit, &distances, Label::Outside);
        for unit in 0..distances.len() {
            if cavities.labels[unit] != Label::None || distances[unit] <= limit {
                continue;
            }
            let part = cavities.flood(vec![unit], limit, &distances, Label::Outside);
            let depth = part.iter().map(|u| distances[*u]).fold(0.0, f64::max);
            if (WIDENING * limit..=DEEPEST).contains(&depth) {
                cavities.count += 1;
                part.iter()
                    .for_each(|u| cavities.labels[*u] = Label::Cavity);
            }
        }
        if cavities.count == 0 {
            return None;
        }
        cavities.grow(&distances);
        Some(cavities)
    }

    /// Which triangles line a cavity.
    pub(super) fn lining(&self, points: &[[f64; 3]], triangles: &[[u32; 3]]) -> Vec<bool> {
        let lines = |t: &[u32; 3]| {
            let t = t.map(|p| points[p as usize]);
            let area = area_vector(&t);
            let size = norm(area);
            if size == 0.0 {
                return false;
            }
            let off = scale(area, 0.5 * self.field.voxel / size);
            let p = add_scaled(centroid(&t), off, 1.0);
            // Otherwise two parts touch here.
            self.field.sample(p).0 >= 0.0 && self.climb(p) == Label::Cavity
        };
        triangles.par_iter().map(lines).collect()
    }

    /// Whether a node of the grid is in the body or in a cavity.
    fn solid(&self, p: [f64; 3]) -> bool {
        if self.field.sample(p).0 < 0.0 {
            return true;
        }
        // Of the cells around the node, those of the part it belongs to are open.
        let h = 0.5 * self.field.voxel;
        let around = |wanted| {
            (0..8).any(|n| {
                let side = |bit: usize| if n >> bit & 1 == 0 { -h } else { h };
                self.label([p[0] + side(0), p[1] + side(1), p[2] + side(2)]) == wanted
            })
        };
        match (around(Label::Outside), around(Label::Cavity)) {
            (true, _) => false,
            (false, true) => true,
            (false, false) => self.climb(p) == Label::Cavity,
        }
    }

    /// Label a voxel up from the surface, where cells are on one side of it.
    fn climb(&self, mut p: [f64; 3]) -> Label {
        for _ in 0..4 * SIDE {
            let (distance, slope) = self.field.sample(p);
            let steepness = norm(slope);
            if distance >= self.field.voxel || steepness < 1e-6 {
                break;
            }
            p = add_scaled(p, slope, 0.5 * self.field.voxel / steepness);
        }
        self.label(p)
    }

    fn label(&self, p: [f64; 3]) -> Label {
        self.labels[self.unit_at(p)]
    }

    fn unit_at(&self, p: [f64; 3]) -> usize {
        let f = &self.field;
        let mut cell = [0; 3];
        let mut local = [0; 3];
        for a in 0..3 {
            let last = f.cells[a] * SIDE - 1;
            let fine = (((p[a] - f.origin[a]) / f.voxel).max(0.0) as usize).min(last);
            (cell[a], local[a]) = (fine / SIDE, fine % SIDE);
        }
        self.unit(cell, local)
    }

    fn unit(&self, cell: [usize; 3], local: [usize; 3]) -> usize {
        let index = self.field.cell_index(cell);
        match self.field.brick_of(index) {
            None => index,
            Some(brick) => {
                self.field.bricks.len()
                    + brick * CELLS
                    + (local[2] * SIDE + local[1]) * SIDE
                    + local[0]
            }
        }
    }

    /// Units of the cells along the border of the grid.
    fn border(&self) -> Vec<usize> {
        let n = self.field.cells;
        let mut units = Vec::new();
        for index in 0..self.field.bricks.len() {
            let cell = self.field.cell_of(index);
            if (0..3).any(|a| cell[a] == 0 || cell[a] + 1 == n[a]) {
                match self.field.brick_of(index) {
                    None => units.push(index),
                    Some(_) => units.extend((0..CELLS).map(|n| self.unit(cell, place(n)))),
                }
            }
        }
        units
    }

    /// Labels what is connected to the seeds where `φ > limit`; returns it.
    fn flood(
        &mut self,
        seeds: Vec<usize>,
        limit: f64,
        distances: &[f64],
        label: Label,
    ) -> Vec<usize> {
        let mut part = seeds;
        part.retain(|u| distances[*u] > limit);
        self.spread(&mut part, |u| distances[u] > limit, |_| label);
        part
    }

    /// Gives the cells between the parts and the surface to the nearest part.
    fn grow(&mut self, distances: &[f64]) {
        let all = 0..self.labels.len();
        let mut known: Vec<usize> = all.filter(|u| self.labels[*u] != Label::None).collect();
        let before = self.labels.clone();
        self.spread(&mut known, |u| distances[u] > 0.0, |u| before[u]);
    }

    /// Labels the seeds and hands their labels on to free neighbours, nearest
    /// first; appends those to the seeds.
    fn spread(
        &mut self,
        front: &mut Vec<usize>,
        open: impl Fn(usize) -> bool,
        label: impl Fn(usize) -> Label,
    ) {
        for &unit in front.iter() {
            self.labels[unit] = label(unit);
        }
        let (mut next, mut near) = (0, Vec::new());
        while next < front.len() {
            let unit = front[next];
            next += 1;
            near.clear();
            self.neighbours(unit, &mut near);
            for &n in &near {
                if self.labels[n] == Label::None && open(n) {
                    self.labels[n] = self.labels[unit];
                    front.push(n);
                }
            }
        }
    }

    /// Appends the units that share a face with `unit`.
    fn neighbours(&self, unit: usize, out: &mut Vec<usize>) {
        let (index, local) = match unit.checked_sub(self.field.bricks.len()) {
            None => (unit, None),
            Some(fine) => (
                self.refined[fine / CELLS] as usize,
                Some(place(fine % CELLS)),
            ),
        };
        let cell = self.field.cell_of(index);
        for axis in 0..3 {
            for up in [false, true] {
                if let Some(at) = local
                    && let Some(at) = step(at, axis, up, SIDE)
                {
                    out.push(self.unit(cell, at));
                    continue;
                }
                let Some(beside) = step(cell, axis, up, self.field.cells[axis]) else {
                    continue;
                };
                let face = if up { 0 } else { SIDE - 1 };
                let refined = self.field.brick_of(self.field.cell_index(beside)).is_some();
                match local {
                    None if refined => {
                        for n in 0..SIDE * SIDE {
                            let mut at = [n % SIDE; 3];
                            (at[axis], at[(axis + 1) % 3]) = (face, n / SIDE);
                            out.push(self.unit(beside, at));
                        }
                    }
                    _ => {
                        let mut at = local.unwrap_or_default();
                        at[axis] = face;
                        out.push(self.unit(beside, at));
                    }
                }
            }
        }
    }
}

/// One cell further along an axis of `count` cells.
fn step(mut at: [usize; 3], axis: usize, up: bool, count: usize) -> Option<[usize; 3]> {
    at[axis] = if up {
        Some(at[axis] + 1).filter(|i| *i < count)
    } else {
        at[axis].checked_sub(1)
    }?;
    Some(at)
}

/// Place of a fine cell in its brick.
fn place(n: usize) -> [usize; 3] {
    [n % SIDE, n / SIDE % SIDE, n / (SIDE * SIDE)]
}

/// Distances at the centers of the units; negative where a brick stands for
/// its cell.
fn center_distances(field: &SparseField) -> Vec<f64> {
    let refined = field.refined();
    let center = |corner: [f64; 3], edge: f64| field.sample(corner.map(|x| x + 0.5 * edge)).0;
    let coarse = (0..field.bricks.len())
        .into_par_iter()
        .map(|index| match field.brick_of(index) {
            Some(_) => f64::NEG_INFINITY,
            None => center(field.corner(field.cell_of(index)), field.wide()),
        });
    let fine = (0..refined.len() * CELLS).into_par_iter().map(|n| {
        let corner = field.corner(field.cell_of(refined[n / CELLS] as usize));
        let at = place(n % CELLS);
        let corner = std::array::from_fn(|a| corner[a] + field.voxel * at[a] as f64);
        center(corner, field.voxel)
    });
    coarse.chain(fine).collect()
}

/// Distances to a body whose cavities are filled.
pub(super) struct Filled<'a> {
    pub(super) cavities: &'a Cavities<'a>,
    /// Triangles of the outer surface.
    pub(super) outer: &'a TriangleTree,
}

impl NodeSource for Filled<'_> {
    fn fill(&self, origin: [f64; 3], spacing: f64, counts: [usize; 3], out: &mut [f64]) {
        self.outer.distances(origin, spacing, counts, out);
        let [nx, ny, _] = counts;
        for (n, d) in out.iter_mut().enumerate() {
            let node = [n % nx, n / nx % ny, n / (nx * ny)];
            let p = std::array::from_fn(|a| origin[a] + spacing * node[a] as f64);
            if self.cavities.solid(p) {
                *d = -*d;
            }
        }
    }
}
