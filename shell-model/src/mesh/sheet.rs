//! Rectangular sheets for tests, examples and studies.

use super::ShellMesh;
use crate::ModelError;

/// A rectangular sheet of fabric 0 with its material coordinates as points.
#[derive(Clone, Debug)]
pub struct Sheet {
    /// The mesh.
    pub mesh: ShellMesh,
    /// Material coordinates `(u, v)` of every point \[m\].
    pub flat: Vec<[f64; 2]>,
}

impl Sheet {
    /// Flat positions `q` under a map of the material plane into space \[m\].
    pub fn positions(&self, map: impl Fn([f64; 2]) -> [f64; 3]) -> Vec<f64> {
        self.flat.iter().flat_map(|p| map(*p)).collect()
    }

    /// Points whose material coordinates satisfy `inside`.
    pub fn select(&self, inside: impl Fn([f64; 2]) -> bool) -> Vec<u32> {
        (0..self.flat.len() as u32)
            .filter(|i| inside(self.flat[*i as usize]))
            .collect()
    }
}

/// Right triangles: `nu × nv` cells over `size` \[m\], diagonals alternating
/// like the lines of the British flag, so that no diagonal direction is
/// stiffer. Bending over such a mesh still depends on direction; use
/// [`equilateral`] where it matters.
///
/// # Errors
/// [`ModelError::Parameter`] for no cells or a size that is not positive.
pub fn grid(nu: usize, nv: usize, size: [f64; 2]) -> Result<Sheet, ModelError> {
    check(nu, nv, size)?;
    let mut flat = Vec::with_capacity((nu + 1) * (nv + 1));
    for j in 0..=nv {
        for i in 0..=nu {
            flat.push([
                size[0] * i as f64 / nu as f64,
                size[1] * j as f64 / nv as f64,
            ]);
        }
    }
    let at = |i: usize, j: usize| (j * (nu + 1) + i) as u32;
    let mut triangles = Vec::with_capacity(2 * nu * nv);
    for j in 0..nv {
        for i in 0..nu {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            if (i + j) % 2 == 0 {
                triangles.extend([[a, b, c], [a, c, d]]);
            } else {
                triangles.extend([[a, b, d], [b, c, d]]);
            }
        }
    }
    finish(flat, triangles)
}

/// Near-equilateral triangles: `nv` rows of height `size[1] / nv`, points
/// `size[0] / nu` apart and shifted by half on every second row, whose ends
/// close with half a triangle.
///
/// Equilateral when `size[1] / nv = √3/2 · size[0] / nu`; see
/// [`equilateral_edge`].
///
/// # Errors
/// [`ModelError::Parameter`] for no cells or a size that is not positive.
pub fn equilateral(nu: usize, nv: usize, size: [f64; 2]) -> Result<Sheet, ModelError> {
    check(nu, nv, size)?;
    let spacing = size[0] / nu as f64;
    let mut flat = Vec::new();
    let mut rows = Vec::with_capacity(nv + 1);
    for j in 0..=nv {
        let first = flat.len() as u32;
        let v = size[1] * j as f64 / nv as f64;
        if j % 2 == 0 {
            flat.extend((0..=nu).map(|i| [size[0] * i as f64 / nu as f64, v]));
        } else {
            flat.push([0.0, v]);
            flat.extend((0..nu).map(|i| [spacing * (i as f64 + 0.5), v]));
            flat.push([size[0], v]);
        }
        rows.push((first, flat.len() as u32 - first));
    }
    let mut triangles = Vec::new();
    for pair in rows.windows(2) {
        let [(low, low_count), (high, high_count)] = pair else {
            continue;
        };
        // Walk along both rows, always advancing the one that lags.
        let (mut a, mut b) = (0, 0);
        while a + 1 < *low_count || b + 1 < *high_count {
            let (p, q) = (low + a, high + b);
            let next_low = (a + 1 < *low_count).then(|| flat[p as usize + 1][0]);
            let next_high = (b + 1 < *high_count).then(|| flat[q as usize + 1][0]);
            // The row with points at both corners closes its half triangle last.
            let low_first = match (next_low, next_high) {
                (Some(l), Some(h)) if l == h => low_count < high_count,
                (Some(l), Some(h)) => l < h,
                (l, _) => l.is_some(),
            };
            if low_first {
                triangles.push([p, p + 1, q]);
                a += 1;
            } else {
                triangles.push([p, q + 1, q]);
                b += 1;
            }
        }
    }
    finish(flat, triangles)
}

/// [`equilateral`] with the row and column counts that bring the edges
/// closest to `edge` \[m\].
///
/// # Errors
/// [`ModelError::Parameter`] when a size or `edge` is not positive.
pub fn equilateral_edge(size: [f64; 2], edge: f64) -> Result<Sheet, ModelError> {
    if !(edge > 0.0 && edge.is_finite()) {
        return Err(ModelError::Parameter {
            what: "edge length",
            value: edge,
            allowed: "positive and finite",
        });
    }
    let count = |length: f64, step: f64| (length / step).round().max(1.0) as usize;
    let row = edge * 0.75_f64.sqrt();
    equilateral(count(size[0], edge), count(size[1], row), size)
}

fn check(nu: usize, nv: usize, size: [f64; 2]) -> Result<(), ModelError> {
    for (what, value) in [("cells along u", nu as f64), ("cells along v", nv as f64)] {
        if !(1.0..=1e9).contains(&value) {
            return Err(ModelError::Parameter {
                what,
                value,
                allowed: "between 1 and 1e9",
            });
        }
    }
    for (what, value) in [("size along u", size[0]), ("size along v", size[1])] {
        if !(value > 0.0 && value.is_finite()) {
            return Err(ModelError::Parameter {
                what,
                value,
                allowed: "positive and finite",
            });
        }
    }
    Ok(())
}

fn finish(flat: Vec<[f64; 2]>, triangles: Vec<[u32; 3]>) -> Result<Sheet, ModelError> {
    let material = triangles
        .iter()
        .map(|t| t.map(|p| flat[p as usize]))
        .collect();
    let fabric = vec![0; triangles.len()];
    let mesh = ShellMesh::new(flat.len(), triangles, material, fabric)?;
    Ok(Sheet { mesh, flat })
}
