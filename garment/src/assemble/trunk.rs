//! Which parts of a body hang down beside it: arms and hands.
//!
//! A wide skirt starts as flat panels whose side seams run across the arms;
//! it must fall before it may feel them. Going up slice by slice from the
//! feet, whatever begins without support below (a hand) is a hanging limb
//! until it meets the trunk.

use crate::place::BodyField;

/// A body on a grid, its hanging limbs marked.
pub(super) struct Trunk {
    low: [f64; 3],
    size: [usize; 3],
    limb: Vec<bool>,
}

/// Grid spacing [m]; thinner than a wrist.
const CELL: f64 = 0.025;
/// Cells around a limb that belong to it.
const REACH: usize = 3;
/// Largest grid; larger regions are not searched for limbs.
const MAX_CELLS: usize = 4_000_000;

impl Trunk {
    /// Samples `body` in a box [m]. `None` when nothing hangs, or the box is
    /// too large.
    pub(super) fn new(body: BodyField<'_>, low: [f64; 3], high: [f64; 3]) -> Option<Self> {
        let size = [0, 1, 2].map(|k| ((high[k] - low[k]).max(0.0) / CELL) as usize + 2);
        let count = size.iter().try_fold(1usize, |n, &s| n.checked_mul(s))?;
        if count > MAX_CELLS {
            return None;
        }
        let index = |x: usize, y: usize, z: usize| (y * size[2] + z) * size[0] + x;
        // 0 outside, 1 trunk, 2 limb
        let mut class = vec![0u8; count];
        let mut seen_body = false;
        let mut has_limb = false;
        let mut component: Vec<(usize, usize)> = Vec::new();
        for y in 0..size[1] {
            let mut open = vec![false; size[0] * size[2]];
            for z in 0..size[2] {
                for x in 0..size[0] {
                    let p = [
                        low[0] + x as f64 * CELL,
                        low[1] + y as f64 * CELL,
                        low[2] + z as f64 * CELL,
                    ];
                    open[z * size[0] + x] = body(p).0 < 0.0;
                }
            }
            let mut first_slice = false;
            for start in 0..open.len() {
                if !open[start] {
                    continue;
                }
                first_slice |= !seen_body;
                component.clear();
                component.push((start % size[0], start / size[0]));
                open[start] = false;
                let mut supported = false;
                let mut next = 0;
                while next < component.len() {
                    let (x, z) = component[next];
                    next += 1;
                    supported |= y > 0 && class[index(x, y - 1, z)] == 1;
                    let near = [
                        (x.wrapping_sub(1), z),
                        (x + 1, z),
                        (x, z.wrapping_sub(1)),
                        (x, z + 1),
                    ];
                    for (x, z) in near {
                        if x < size[0] && z < size[2] && open[z * size[0] + x] {
                            open[z * size[0] + x] = false;
                            component.push((x, z));
                        }
                    }
                }
                let limb = !(supported || first_slice);
                has_limb |= limb;
                for &(x, z) in &component {
                    class[index(x, y, z)] = if limb { 2 } else { 1 };
                }
            }
            seen_body |= first_slice;
        }
        if !has_limb {
            return None;
        }
        // Grow both classes together, so that a limb's surroundings end
        // halfway to the trunk.
        for _ in 0..REACH {
            let old = class.clone();
            for y in 0..size[1] {
                for z in 0..size[2] {
                    for x in 0..size[0] {
                        if old[index(x, y, z)] != 0 {
                            continue;
                        }
                        let near = [
                            (x.wrapping_sub(1), y, z),
                            (x + 1, y, z),
                            (x, y.wrapping_sub(1), z),
                            (x, y + 1, z),
                            (x, y, z.wrapping_sub(1)),
                            (x, y, z + 1),
                        ];
                        class[index(x, y, z)] = near
                            .into_iter()
                            .filter(|&(x, y, z)| x < size[0] && y < size[1] && z < size[2])
                            .map(|(x, y, z)| old[index(x, y, z)])
                            .max()
                            .unwrap_or(0);
                    }
                }
            }
        }
        Some(Self {
            low,
            size,
            limb: class.into_iter().map(|c| c == 2).collect(),
        })
    }

    /// Whether a hanging limb lies at this `x` and `y`, at any `z`.
    pub(super) fn limb_behind(&self, x: f64, y: f64) -> bool {
        (0..self.size[2]).any(|z| self.in_limb([x, y, self.low[2] + z as f64 * CELL]))
    }

    /// Whether a point is in or close to a hanging limb.
    pub(super) fn in_limb(&self, p: [f64; 3]) -> bool {
        let mut c = [0usize; 3];
        for k in 0..3 {
            let t = ((p[k] - self.low[k]) / CELL).round();
            if !(t >= 0.0 && t < self.size[k] as f64) {
                return false;
            }
            c[k] = t as usize;
        }
        self.limb[(c[1] * self.size[2] + c[2]) * self.size[0] + c[0]]
    }
}
