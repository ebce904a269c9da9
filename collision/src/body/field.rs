use crate::{Aabb, CollisionError};
use rayon::prelude::*;

/// Voxels along one edge of a brick.
pub(crate) const SIDE: usize = 4;
/// Nodes along one edge of a brick.
const NODES: usize = SIDE + 1;
/// Nodes of a brick; those on its faces are stored with every brick they touch.
const BRICK: usize = NODES * NODES * NODES;
/// No fine values in this brick.
const COARSE: u32 = u32::MAX;
/// Most coarse cells, and most bricks, of one field.
const LARGEST: f64 = 1.6e7;

/// Resolution of a [`SparseField`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldSettings {
    /// Edge length of the fine cells [m].
    pub voxel: f64,
    /// Distance from the surface, to both sides, within which cells are fine [m].
    pub band: f64,
}

impl Default for FieldSettings {
    /// 5 mm voxels up to 15 mm from the surface.
    fn default() -> Self {
        Self {
            voxel: 0.005,
            band: 0.015,
        }
    }
}

impl FieldSettings {
    pub(crate) fn check(&self) -> Result<(), CollisionError> {
        for (name, value) in [("voxel", self.voxel), ("band", self.band)] {
            if !(value.is_finite() && value > 0.0) {
                return Err(CollisionError::Parameter {
                    name,
                    value,
                    requirement: "positive and finite",
                });
            }
        }
        Ok(())
    }
}

/// Signed distances at the nodes of a regular block.
pub(crate) trait NodeSource: Sync {
    /// Writes the distance at `origin + spacing (i, j, k)`, `i` fastest.
    fn fill(&self, origin: [f64; 3], spacing: f64, counts: [usize; 3], out: &mut [f64]);
}

/// A signed distance sampled on a sparse grid of two levels.
///
/// A coarse grid of spacing `4 h` covers the box; its cells within `band` of
/// the surface are *bricks* of 4³ fine cells of edge `h`. Values are trilinear
/// in every cell; fine nodes on a face shared with a coarse cell take its
/// interpolant, so that the field is continuous everywhere. The gradient is
/// that of the trilinear function, discontinuous across cell faces.
/// Outside the grid, `φ(p) = φ(c) + |p − c|` with `c` the nearest point of the
/// grid: continuous, increasing outward, and never below the distance.
///
/// # Accuracy
///
/// Where `|φ| ≤ band`, every cell has exact nodes, up to `f32` rounding (relative `6e-8`).
/// With `κ_1, κ_2` the curvatures of the parallel surface through the cell,
///
/// ```text
/// |φ_h − φ|   ≤ h²/8 (|κ_1| + |κ_2|)     where φ is smooth in the cell
///             ≤ (√3/2) h                 everywhere (φ is 1-Lipschitz)
/// ```
/// The second holds with `4 h` in coarse cells. The sign is right wherever
/// `|φ|` exceeds the bound, and in all coarse cells. `|∇φ_h| ≤ √3`.
#[derive(Clone, Debug, PartialEq)]
pub struct SparseField {
    pub(crate) origin: [f64; 3],
    pub(crate) voxel: f64,
    /// Coarse cells along each axis.
    pub(crate) cells: [usize; 3],
    /// Values at coarse nodes, `(cells + 1)` along each axis.
    pub(crate) coarse: Vec<f32>,
    /// Brick of each coarse cell, or `COARSE`.
    pub(crate) bricks: Vec<u32>,
    /// Values of the bricks, `BRICK` each.
    pub(crate) fine: Vec<f32>,
}

impl SparseField {
    pub(crate) fn build(
        source: &impl NodeSource,
        surface: &Aabb,
        settings: &FieldSettings,
    ) -> Result<Self, CollisionError> {
        settings.check()?;
        let h = settings.voxel;
        let wide = SIDE as f64 * h;
        // Room for the band and one coarse cell beyond it.
        let region = surface.inflate(settings.band + 2.0 * wide);
        let extents = region.extents();
        let count = extents.iter().map(|e| (e / wide).ceil()).product::<f64>();
        if count.is_nan() || count > LARGEST {
            return Err(CollisionError::Parameter {
                name: "voxel",
                value: h,
                requirement: "coarse enough for 16 million cells of four voxels around the body",
            });
        }
        let cells = extents.map(|e| ((e / wide).ceil() as usize).max(1));
        let mut field = Self {
            origin: region.min,
            voxel: h,
            cells,
            coarse: Vec::new(),
            bricks: Vec::new(),
            fine: Vec::new(),
        };
        field.fill_coarse(source);
        let refined = field.mark(source, settings.band + h);
        field.fill_fine(source, &refined);
        field.tie_hanging_nodes(&refined);
        Ok(field)
    }

    pub(crate) fn wide(&self) -> f64 {
        SIDE as f64 * self.voxel
    }

    pub(crate) fn cell_of(&self, index: usize) -> [usize; 3] {
        let [nx, ny, _] = self.cells;
        [index % nx, index / nx % ny, index / (nx * ny)]
    }

    pub(crate) fn cell_index(&self, [i, j, k]: [usize; 3]) -> usize {
        (k * self.cells[1] + j) * self.cells[0] + i
    }

    /// Brick of a coarse cell.
    pub(crate) fn brick_of(&self, cell: usize) -> Option<usize> {
        Some(self.bricks[cell])
            .filter(|b| *b != COARSE)
            .map(|b| b as usize)
    }

    /// Coarse cells with a brick, in the order of the bricks.
    pub(crate) fn refined(&self) -> Vec<u32> {
        let cells = 0..self.bricks.len() as u32;
        cells
            .filter(|c| self.bricks[*c as usize] != COARSE)
            .collect()
    }

    fn coarse_node(&self, [i, j, k]: [usize; 3]) -> usize {
        (k * (self.cells[1] + 1) + j) * (self.cells[0] + 1) + i
    }

    pub(crate) fn corner(&self, cell: [usize; 3]) -> [f64; 3] {
        std::array::from_fn(|a| self.origin[a] + self.wide() * cell[a] as f64)
    }

    fn fill_coarse(&mut self, source: &impl NodeSource) {
        let [nx, ny, nz] = self.cells.map(|n| n + 1);
        let mut values = vec![0.0_f32; nx * ny * nz];
        values.par_chunks_mut(nx * ny).enumerate().for_each_init(
            || vec![0.0; nx * ny],
            |plane, (k, out)| {
                source.fill(self.corner([0, 0, k]), self.wide(), [nx, ny, 1], plane);
                for (o, v) in out.iter_mut().zip(plane.iter()) {
                    *o = *v as f32;
                }
            },
        );
        self.coarse = values;
    }

    /// Numbers the cells that come within `reach` of the surface.
    fn mark(&mut self, source: &impl NodeSource, reach: f64) -> Vec<u32> {
        let half = 0.5 * self.wide();
        // φ is 1-Lipschitz: half a diagonal more than `reach` cannot be met.
        let limit = reach + 3.0_f64.sqrt() * half;
        let total = self.cells.iter().product::<usize>();
        let near: Vec<bool> = (0..total)
            .into_par_iter()
            .map(|index| {
                let cell = self.cell_of(index);
                let low = corners(|o| {
                    self.coarse[self.coarse_node(std::array::from_fn(|a| cell[a] + o[a]))].abs()
                })
                .into_iter()
                .fold(f32::INFINITY, f32::min);
                if f64::from(low) > limit {
                    return false;
                }
                let mut center = [0.0];
                source.fill(
                    self.corner(cell).map(|x| x + half),
                    0.0,
                    [1; 3],
                    &mut center,
                );
                center[0].abs() <= limit
            })
            .collect();
        let mut refined = Vec::new();
        self.bricks = vec![COARSE; total];
        for (index, near) in near.into_iter().enumerate() {
            if near {
                self.bricks[index] = refined.len() as u32;
                refined.push(index as u32);
            }
        }
        refined
    }

    fn fill_fine(&mut self, source: &impl NodeSource, refined: &[u32]) {
        let mut values = vec![0.0_f32; refined.len() * BRICK];
        values
            .par_chunks_mut(BRICK)
            .zip(refined)
            .for_each(|(out, index)| {
                let mut block = [0.0; BRICK];
                let origin = self.corner(self.cell_of(*index as usize));
                source.fill(origin, self.voxel, [NODES; 3], &mut block);
                for (o, v) in out.iter_mut().zip(block) {
                    *o = v as f32;
                }
            });
        self.fine = values;
    }

    /// Gives fine nodes that touch a coarse cell the value of its interpolant.
    fn tie_hanging_nodes(&mut self, refined: &[u32]) {
        let mut fine = std::mem::take(&mut self.fine);
        fine.par_chunks_mut(BRICK)
            .zip(refined)
            .for_each(|(out, index)| {
                let cell = self.cell_of(*index as usize);
                for (n, value) in out.iter_mut().enumerate() {
                    let node = [n % NODES, n / NODES % NODES, n / (NODES * NODES)];
                    if self.touches_coarse(cell, node) {
                        let f = node.map(|x| x as f64 / SIDE as f64);
                        *value = trilinear(&self.coarse_corners(cell), f).0 as f32;
                    }
                }
            });
        self.fine = fine;
    }

    fn touches_coarse(&self, cell: [usize; 3], node: [usize; 3]) -> bool {
        let range = |a: usize| match node[a] {
            0 => cell[a].saturating_sub(1)..=cell[a],
            SIDE => cell[a]..=(cell[a] + 1).min(self.cells[a] - 1),
            _ => cell[a]..=cell[a],
        };
        range(2).any(|k| {
            range(1).any(|j| range(0).any(|i| self.bricks[self.cell_index([i, j, k])] == COARSE))
        })
    }

    fn coarse_corners(&self, cell: [usize; 3]) -> [f64; 8] {
        let base = self.coarse_node(cell);
        let row = self.cells[0] + 1;
        let plane = row * (self.cells[1] + 1);
        corners(|o| f64::from(self.coarse[base + o[0] + o[1] * row + o[2] * plane]))
    }

    /// Distance [m] and its gradient at a point.
    #[inline]
    pub fn sample(&self, p: [f64; 3]) -> (f64, [f64; 3]) {
        let (wide, per_wide) = (self.wide(), 1.0 / self.wide());
        let mut cell = [0; 3];
        let mut f = [0.0; 3];
        let mut beyond = [0.0; 3];
        for a in 0..3 {
            let x = (p[a] - self.origin[a]) * per_wide;
            let inside = x.clamp(0.0, self.cells[a] as f64);
            beyond[a] = (x - inside) * wide;
            cell[a] = (inside as usize).min(self.cells[a] - 1); // NaN: cell 0, f NaN
            f[a] = inside - cell[a] as f64;
        }
        let brick = self.bricks[self.cell_index(cell)];
        let (values, spacing) = if brick == COARSE {
            (self.coarse_corners(cell), wide)
        } else {
            let mut base = brick as usize * BRICK;
            let mut stride = 1;
            for a in 0..3 {
                let x = f[a] * SIDE as f64;
                let i = (x as usize).min(SIDE - 1);
                f[a] = x - i as f64;
                base += i * stride;
                stride *= NODES;
            }
            let block = &self.fine[base..base + 2 + NODES + NODES * NODES];
            (
                corners(|o| f64::from(block[o[0] + o[1] * NODES + o[2] * NODES * NODES])),
                self.voxel,
            )
        };
        let (mut distance, slope) = trilinear(&values, f);
        let mut gradient = slope.map(|s| s / spacing);
        let r2 = beyond.iter().map(|e| e * e).sum::<f64>();
        if r2 > 0.0 {
            let r = r2.sqrt();
            distance += r;
            for a in 0..3 {
                if beyond[a] != 0.0 {
                    gradient[a] = beyond[a] / r;
                }
            }
        }
        (distance, gradient)
    }

    /// Bytes on the heap.
    pub fn heap_bytes(&self) -> usize {
        4 * (self.coarse.capacity() + self.bricks.capacity() + self.fine.capacity())
    }

    /// Number of refined bricks of 4³ voxels.
    pub fn brick_count(&self) -> usize {
        self.fine.len() / BRICK
    }

    /// Whether the arrays fit each other, for a field read from a file.
    pub(crate) fn is_consistent(&self) -> bool {
        let product = |n: [usize; 3]| n.iter().try_fold(1_usize, |a, b| a.checked_mul(*b));
        let nodes = self.cells.map(|n| n.saturating_add(1));
        let bricks = self.brick_count();
        self.cells.iter().all(|n| *n > 0)
            && self.voxel.is_finite()
            && self.voxel > 0.0
            && self.origin.iter().all(|x| x.is_finite())
            && product(nodes) == Some(self.coarse.len())
            && product(self.cells) == Some(self.bricks.len())
            && self.fine.len() == bricks * BRICK
            && self
                .bricks
                .iter()
                .all(|b| *b == COARSE || (*b as usize) < bricks)
    }
}

/// Evaluates `f` at the corners of the unit cell, x fastest.
#[inline]
fn corners<T>(f: impl Fn([usize; 3]) -> T) -> [T; 8] {
    std::array::from_fn(|n| f([n & 1, n >> 1 & 1, n >> 2]))
}

/// Trilinear interpolant and its gradient per cell at `f` in [0, 1]³.
#[inline]
fn trilinear(v: &[f64; 8], [x, y, z]: [f64; 3]) -> (f64, [f64; 3]) {
    let lerp = |a: f64, b: f64, t: f64| a + (b - a) * t;
    let along = [
        lerp(v[0], v[1], x),
        lerp(v[2], v[3], x),
        lerp(v[4], v[5], x),
        lerp(v[6], v[7], x),
    ];
    let low = lerp(along[0], along[1], y);
    let high = lerp(along[2], along[3], y);
    let dx = lerp(
        lerp(v[1] - v[0], v[3] - v[2], y),
        lerp(v[5] - v[4], v[7] - v[6], y),
        z,
    );
    let dy = lerp(along[1] - along[0], along[3] - along[2], z);
    (lerp(low, high, z), [dx, dy, high - low])
}
