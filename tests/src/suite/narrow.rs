//! A narrow strip of the shell as a rod: its mesh and its measured rigidities.

use selvedge_shell_model::sheet;

use super::stability::{Flat, Rows};
use crate::rows;

/// Width [m], and rigidity [N·m] and modulus [N/m] of the fabric. In its
/// plane the strip is some 1e5 times as rigid as out of it at any length, so
/// that it does not deform before it buckles.
pub const WIDTH: f64 = 1.0 / 32.0;
/// `B`
pub const RIGIDITY: f64 = 1e-5;
/// `k`
pub const STIFFNESS: f64 = 2e4;

/// Poisson's ratio of hinges on equilateral triangles.
///
/// A hinge of edge length `l` and height `η = √3/2 l` turns by the second
/// difference across its edge, from which the edge's own curvature takes away
/// a part, since an edge is straight: `θ η = κ_n η² − κ_t l²/4`, so that it
/// sees `κ_n − κ_t/3`. Three directions 60° apart make of the mean curvature
/// `H` and the deviation `d`
///
/// ```text
/// Σ (κ_n − κ_t/3)² = 4/3 H² + 8/3 d²;   plate: (1 + ν) H² + (1 − ν) d²  ⇒  ν = −1/3
/// ```
pub const POISSON: f64 = -1.0 / 3.0;

/// `EI = (1 − ν²) B b` of a plate [N·m²].
pub fn plate_bending() -> f64 {
    (1.0 - POISSON * POISSON) * RIGIDITY * WIDTH
}

/// `GJ = 2 (1 − ν) B b` of a plate [N·m²]: the twisting moment
/// `M_xy = B (1 − ν) κ_xy` counts twice, once over the width and once as the
/// forces along the edges that it amounts to.
pub fn plate_torsion() -> f64 {
    2.0 * (1.0 - POISSON) * RIGIDITY * WIDTH
}

/// A strip of [`WIDTH`] along y with its mid-line at x = 0.
pub struct Narrow {
    /// Distance of its rows [m].
    pub spacing: f64,
    /// Points by rows.
    pub rows: Vec<Vec<u32>>,
    /// Flat positions [m].
    pub flat: Vec<f64>,
    /// Its energies.
    pub shell: Flat,
}

impl Narrow {
    /// An equilateral mesh of so many cells across, and the even number of rows
    /// of cells that comes closest to `length` [m] and `ends` rows more; the
    /// clamps take these.
    pub fn new(columns: usize, length: f64, ends: f64) -> Self {
        let spacing = WIDTH / columns as f64 * 0.75_f64.sqrt();
        let cells = 2 * (0.5 * (length / spacing + ends)).round() as usize;
        let size = [WIDTH, spacing * cells as f64];
        let sheet = sheet::equilateral(columns, cells, size).expect("sheet");
        Self {
            spacing,
            rows: rows(&sheet),
            flat: sheet.positions(|[u, v]| [u - 0.5 * WIDTH, v, 0.0]),
            shell: Flat::new(&sheet, STIFFNESS, RIGIDITY, Rows::Free),
        }
    }

    /// Length between clamps that each take half a cell beyond their first
    /// row [m], with both ends clamped.
    fn clamped_length(&self) -> f64 {
        (self.rows.len() - 2) as f64 * self.spacing
    }

    /// Energy [J] and deflections [m] for a rotation of 1 of one end against
    /// the other that deflects a point of an end by `w(x, distance from the
    /// clamp, side)` per half of it.
    fn turned(&self, w: fn(f64, f64, f64) -> f64) -> (f64, Vec<f64>) {
        let last = self.rows.len() - 1;
        let mut held = Vec::new();
        for (pair, side) in [([0, 1], -1.0), ([last - 1, last], 1.0)] {
            let clamp = if side < 0.0 {
                0.5 * self.spacing
            } else {
                (last as f64 - 0.5) * self.spacing
            };
            for p in pair.into_iter().flat_map(|r| &self.rows[r]) {
                let at = 3 * *p as usize;
                held.push((*p, 0.5 * w(self.flat[at], self.flat[at + 1] - clamp, side)));
            }
        }
        self.shell.deflected(&self.flat, &held)
    }

    /// `Θ²/2E`
    fn compliance(&self, w: fn(f64, f64, f64) -> f64) -> f64 {
        0.5 / self.turned(w).0
    }
}

fn bent(_: f64, distance: f64, side: f64) -> f64 {
    side * distance
}

fn twisted(x: f64, _: f64, side: f64) -> f64 {
    side * x
}

/// Poisson's ratio that a bent strip with so many cells across shows in its
/// middle: minus the curvature across over the one along.
pub fn poisson(columns: usize) -> f64 {
    let strip = Narrow::new(columns, 16.0 * WIDTH, 1.0);
    let (_, w) = strip.turned(bent);
    // A row with points on both edges and its neighbours two rows on.
    let middle = strip.rows.len() / 4 * 2;
    let z = |p: u32| w[3 * p as usize + 2];
    let across = |row: usize| {
        let row = &strip.rows[row];
        let [a, b] = [row[0], row[row.len() - 1]];
        (z(a), z(b), z(row[row.len() / 2]))
    };
    let mid = across(middle).2;
    let along =
        (across(middle - 2).2 + across(middle + 2).2 - 2.0 * mid) / (2.0 * strip.spacing).powi(2);
    let (a, b, _) = across(middle);
    -(a + b - 2.0 * mid) / (0.5 * WIDTH).powi(2) / along
}

/// Bending and torsional rigidity [N·m²] of the strip with so many cells
/// across, as it is discretised.
///
/// Strips of 8 and 16 widths are bent, or twisted, by clamps at both ends; the
/// difference of their compliances is that of 8 widths without any end:
///
/// ```text
/// Θ²/2E = L/R + ends,   R = ΔL / Δ(Θ²/2E)
/// ```
pub fn rigidities(columns: usize) -> [f64; 2] {
    let [short, long] = [8.0, 16.0].map(|n| Narrow::new(columns, n * WIDTH, 1.0));
    let length = long.clamped_length() - short.clamped_length();
    let of = |w: fn(f64, f64, f64) -> f64| length / (long.compliance(w) - short.compliance(w));
    [of(bent), of(twisted)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Both rigidities approach those of a plate with Poisson's ratio −1/3, and
    /// a bent strip curls that way.
    #[test]
    fn rigidities_of_a_plate() {
        let [coarse, fine] = [4, 8].map(rigidities);
        for (k, plate) in [plate_bending(), plate_torsion()].into_iter().enumerate() {
            let error = |found: [f64; 2]| (found[k] / plate - 1.0).abs();
            assert!(
                error(fine) < 0.6 * error(coarse),
                "{coarse:?} {fine:?} {plate}"
            );
            // Edges count for less with every cell.
            let extrapolated = 2.0 * fine[k] - coarse[k];
            assert_relative_eq!(extrapolated, plate, max_relative = 1e-3);
        }
        let [coarse, fine] = [4, 8].map(poisson);
        assert!(
            (fine - POISSON).abs() < (coarse - POISSON).abs(),
            "{coarse} {fine}"
        );
        assert_relative_eq!(fine, POISSON, max_relative = 0.05);
    }
}
