use super::Body;
use super::vec3::{add_scaled, dot, norm, sub};
use crate::{Aabb, CollisionError};
use rayon::prelude::*;

/// Cells along one edge of the blocks that are tested and sampled as one.
const SIDE: usize = 8;
const NODES: usize = SIDE + 1;
/// Most blocks of one grid.
const LARGEST: f64 = 5e7;

/// Points [m] and counter-clockwise triangles, seen from outside.
pub type SurfaceMesh = (Vec<[f64; 3]>, Vec<[u32; 3]>);

/// The surface of a body at a time [s], as triangles of about `cell` [m].
///
/// Surface nets [Gibson1998]: one point in every grid cell that the surface
/// passes, the mean of its crossings with the cell's edges, brought onto the
/// surface by Newton steps along `∇φ`; one quadrilateral around every
/// crossed grid edge, split along its shorter diagonal. Features thinner than
/// a cell are lost; where two sheets share a cell they are pinched together.
/// Made for display and reports.
///
/// # Errors
///
/// [`CollisionError::Body`] when the bounds of the body are not finite (see
/// [`surface_mesh_in`]), [`CollisionError::Parameter`] for a cell that is not
/// positive or too small for the body.
pub fn surface_mesh(body: &dyn Body, time: f64, cell: f64) -> Result<SurfaceMesh, CollisionError> {
    let bounds = body.bounds(time);
    if !bounds.is_finite() || bounds.is_empty() {
        return Err(CollisionError::Body {
            body: body.name().to_owned(),
            reason: "its bounds are not finite: give a region".to_owned(),
        });
    }
    surface_mesh_in(body, time, cell, &bounds.inflate(1.5 * cell))
}

/// As [`surface_mesh`], of the part inside `region`; open where that cuts it.
///
/// # Errors
///
/// [`CollisionError::Parameter`] for a cell that is not positive, or too small
/// for the region.
pub fn surface_mesh_in(
    body: &dyn Body,
    time: f64,
    cell: f64,
    region: &Aabb,
) -> Result<SurfaceMesh, CollisionError> {
    let refuse = |requirement| {
        Err(CollisionError::Parameter {
            name: "cell",
            value: cell,
            requirement,
        })
    };
    if !(cell.is_finite() && cell > 0.0) {
        return refuse("positive and finite");
    }
    let blocks = region.extents().map(|e| (e / (cell * SIDE as f64)).ceil());
    if !(blocks.iter().all(|b| *b >= 0.0) && blocks.iter().product::<f64>() <= LARGEST) {
        return refuse("large enough for 25 billion cells in a region that is finite");
    }
    let grid = Grid {
        body,
        time,
        cell,
        origin: region.min,
        blocks: blocks.map(|b| b as usize),
    };
    let total = grid.blocks.iter().product::<usize>();
    let parts: Vec<Part> = (0..total).into_par_iter().map(|b| grid.block(b)).collect();

    let mut places: Vec<(Cell, [f64; 3])> = Vec::new();
    let mut edges: Vec<Edge> = Vec::new();
    for part in parts {
        places.extend(part.places);
        edges.extend(part.edges);
    }
    places.sort_unstable_by_key(|p| p.0);
    let points: Vec<[f64; 3]> = places.iter().map(|p| p.1).collect();
    let mut triangles = Vec::with_capacity(2 * edges.len());
    for edge in &edges {
        if let Some(quad) = around(&places, edge) {
            triangles.extend(split(&points, quad));
        }
    }
    Ok((points, triangles))
}

type Cell = [u32; 3];

/// A grid edge that the surface crosses.
struct Edge {
    from: Cell,
    axis: usize,
    /// The lower end is inside.
    leaving: bool,
}

#[derive(Default)]
struct Part {
    places: Vec<(Cell, [f64; 3])>,
    edges: Vec<Edge>,
}

struct Grid<'a> {
    body: &'a dyn Body,
    time: f64,
    cell: f64,
    origin: [f64; 3],
    blocks: [usize; 3],
}

impl Grid<'_> {
    fn block(&self, index: usize) -> Part {
        let [bx, by, _] = self.blocks;
        let first = [index % bx, index / bx % by, index / (bx * by)].map(|b| b * SIDE);
        let at = |node: [usize; 3]| -> [f64; 3] {
            std::array::from_fn(|a| self.origin[a] + self.cell * (first[a] + node[a]) as f64)
        };
        let half = 0.5 * SIDE as f64 * self.cell;
        let center = at([0; 3]).map(|x| x + half);
        // Half a diagonal, doubled for distances that are interpolated.
        let limit = 2.0 * 3.0_f64.sqrt() * half;
        if self.body.sample(center, self.time).distance.abs() > limit {
            return Part::default();
        }
        let mut values = [0.0; NODES * NODES * NODES];
        for (n, v) in values.iter_mut().enumerate() {
            let node = [n % NODES, n / NODES % NODES, n / (NODES * NODES)];
            *v = self.body.sample(at(node), self.time).distance;
        }
        let value = |n: [usize; 3]| values[(n[2] * NODES + n[1]) * NODES + n[0]];
        let mut part = Part::default();
        for n in 0..SIDE * SIDE * SIDE {
            let cell = [n % SIDE, n / SIDE % SIDE, n / (SIDE * SIDE)];
            let id = std::array::from_fn(|a| (first[a] + cell[a]) as u32);
            if let Some(offset) = mean_crossing(cell, value) {
                let start = std::array::from_fn(|a| at(cell)[a] + self.cell * offset[a]);
                part.places.push((id, self.onto_surface(start)));
            }
            for axis in 0..3 {
                let mut end = cell;
                end[axis] += 1;
                let leaving = value(cell) < 0.0;
                if leaving != (value(end) < 0.0) {
                    part.edges.push(Edge {
                        from: id,
                        axis,
                        leaving,
                    });
                }
            }
        }
        part
    }

    fn onto_surface(&self, start: [f64; 3]) -> [f64; 3] {
        let mut p = start;
        for _ in 0..4 {
            let s = self.body.sample(p, self.time);
            if s.distance.abs() < 1e-6 * self.cell {
                break;
            }
            let g2 = dot(s.normal, s.normal);
            // A weak gradient says little about where the surface is.
            if g2 <= 0.01 || g2.is_nan() {
                break;
            }
            p = add_scaled(p, s.normal, -s.distance / g2);
        }
        if norm(sub(p, start)) <= self.cell {
            p
        } else {
            start
        }
    }
}

/// Mean of the crossings on the edges of a cell, in units of the cell.
fn mean_crossing(cell: [usize; 3], value: impl Fn([usize; 3]) -> f64) -> Option<[f64; 3]> {
    let corner = |o: [usize; 3]| value([cell[0] + o[0], cell[1] + o[1], cell[2] + o[2]]);
    let (mut sum, mut count) = ([0.0; 3], 0.0);
    for axis in 0..3 {
        let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
        for n in 0..4 {
            let mut o = [0; 3];
            o[b] = n & 1;
            o[c] = n >> 1;
            let low = corner(o);
            let mut end = o;
            end[axis] = 1;
            let high = corner(end);
            if (low < 0.0) != (high < 0.0) {
                sum[axis] += low / (low - high);
                sum[b] += o[b] as f64;
                sum[c] += o[c] as f64;
                count += 1.0;
            }
        }
    }
    (count > 0.0).then(|| sum.map(|s| s / count))
}

/// The points of the four cells around an edge, counter-clockwise from outside.
fn around(places: &[(Cell, [f64; 3])], edge: &Edge) -> Option<[u32; 4]> {
    let (b, c) = ((edge.axis + 1) % 3, (edge.axis + 2) % 3);
    let mut quad = [0; 4];
    for (slot, (back_b, back_c)) in quad.iter_mut().zip([(0, 0), (1, 0), (1, 1), (0, 1)]) {
        let mut cell = edge.from;
        cell[b] = cell[b].checked_sub(back_b)?;
        cell[c] = cell[c].checked_sub(back_c)?;
        *slot = places.binary_search_by_key(&cell, |p| p.0).ok()? as u32;
    }
    if !edge.leaving {
        quad.reverse();
    }
    Some(quad)
}

fn split(points: &[[f64; 3]], [a, b, c, d]: [u32; 4]) -> [[u32; 3]; 2] {
    let length = |i: u32, j: u32| norm(sub(points[i as usize], points[j as usize]));
    if length(a, c) <= length(b, d) {
        [[a, b, c], [a, c, d]]
    } else {
        [[a, b, d], [b, c, d]]
    }
}
