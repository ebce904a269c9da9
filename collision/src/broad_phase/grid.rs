use crate::{Aabb, BroadPhase};

/// Boxes that cover more cells than this are tested against all others.
const MAX_CELLS: u64 = 64;

/// Cells along an axis, so that three indices fit a 64-bit key.
const MAX_SIDE: f64 = 1048576.0;

/// Uniform grid, sorted instead of hashed: no table, no iteration order.
///
/// The cell is 1.5 times the mean largest extent of the boxes. Good when the
/// boxes are of similar size, as those of a cloth mesh are; boxes that cover
/// more than 64 cells are tested against all others, so that a few large ones
/// do no harm and many of them cost quadratic time.
#[derive(Clone, Debug, Default)]
pub struct HashGrid {
    entries: Vec<(u64, u32)>,
    large: Vec<u32>,
}

impl HashGrid {
    /// An empty grid.
    pub fn new() -> Self {
        Self::default()
    }
}

/// Maps coordinates to cells.
struct Cells {
    origin: [f64; 3],
    inverse: f64,
}

impl Cells {
    /// Cell of a coordinate, clamped into the grid.
    fn of(&self, p: [f64; 3]) -> [u64; 3] {
        std::array::from_fn(|i| {
            ((p[i] - self.origin[i]) * self.inverse).clamp(0.0, MAX_SIDE - 1.0) as u64
        })
    }
}

fn key(c: [u64; 3]) -> u64 {
    (c[0] << 40) | (c[1] << 20) | c[2]
}

impl BroadPhase for HashGrid {
    fn name(&self) -> &str {
        "hash-grid"
    }

    fn overlaps(&mut self, boxes: &[Aabb], pairs: &mut Vec<[u32; 2]>) {
        pairs.clear();
        self.entries.clear();
        self.large.clear();

        let mut domain = Aabb::EMPTY;
        let (mut sum, mut count) = (0.0, 0usize);
        for b in boxes.iter().filter(|b| b.is_finite() && !b.is_empty()) {
            domain = domain.merge(b);
            sum += largest(b);
            count += 1;
        }
        let side = largest(&domain);
        let mean = sum / count.max(1) as f64;
        // Points without extent: cells that would hold one of them each.
        let wanted = if mean > 0.0 {
            1.5 * mean
        } else {
            side / (count as f64).cbrt()
        };
        let cell = wanted.max(side / MAX_SIDE);
        let inverse = if cell > 0.0 && cell.is_finite() {
            1.0 / cell
        } else {
            0.0
        };
        let cells = Cells {
            origin: domain.min,
            inverse,
        };

        for (i, b) in boxes.iter().enumerate() {
            if b.is_empty() || (0..3).any(|k| b.min[k].is_nan() || b.max[k].is_nan()) {
                continue;
            }
            if !b.is_finite() {
                self.large.push(i as u32);
                continue;
            }
            let (lo, hi) = (cells.of(b.min), cells.of(b.max));
            if (0..3).map(|k| hi[k] - lo[k] + 1).product::<u64>() > MAX_CELLS {
                self.large.push(i as u32);
                continue;
            }
            for x in lo[0]..=hi[0] {
                for y in lo[1]..=hi[1] {
                    for z in lo[2]..=hi[2] {
                        self.entries.push((key([x, y, z]), i as u32));
                    }
                }
            }
        }
        self.entries.sort_unstable();

        for run in self.entries.chunk_by(|a, b| a.0 == b.0) {
            for (n, &(cell, j)) in run.iter().enumerate() {
                let b = &boxes[j as usize];
                for &(_, i) in &run[..n] {
                    let a = &boxes[i as usize];
                    // Of all cells that a pair shares, the lowest reports it.
                    if a.overlaps(b) && {
                        let (ca, cb) = (cells.of(a.min), cells.of(b.min));
                        key(std::array::from_fn(|k| ca[k].max(cb[k]))) == cell
                    } {
                        pairs.push([i, j]);
                    }
                }
            }
        }

        for (n, &l) in self.large.iter().enumerate() {
            let b = &boxes[l as usize];
            for (i, a) in boxes.iter().enumerate() {
                let i = i as u32;
                // Pairs of two large boxes are found from the later one.
                if i == l || a.is_empty() || self.large[n..].binary_search(&i).is_ok() {
                    continue;
                }
                if a.overlaps(b) {
                    pairs.push([i.min(l), i.max(l)]);
                }
            }
        }
    }

    fn heap_bytes(&self) -> usize {
        self.entries.capacity() * size_of::<(u64, u32)>() + self.large.capacity() * 4
    }
}

fn largest(b: &Aabb) -> f64 {
    b.extents().into_iter().fold(0.0, f64::max)
}
