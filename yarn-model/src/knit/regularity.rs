//! How alike the loops of a knit are.

use std::collections::BTreeMap;

use crate::YarnNetwork;
use crate::vec3::V;

/// Difference in shape of neighbouring equal loops, relative to their size.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LoopSpread {
    /// Pairs of loops compared.
    pub pairs: usize,
    /// Root mean square over all pairs \[1\].
    pub mean: f64,
    /// The worst pair \[1\].
    pub worst: f64,
}

/// Contacts of a loop: at its base left and right, at its head left and right.
type Contacts = [u32; 4];

impl YarnNetwork {
    /// Compares every loop at least `margin` loops away from the border with
    /// the next equal one in its row and the next in its column, `repeat`
    /// columns and rows away.
    ///
    /// The shape of a loop is the distances of its eight nodes from each other,
    /// so that its place and turn do not count; two loops differ by
    ///
    /// ```text
    /// √(Σ (d_a − d_b)² / Σ ½ (d_a² + d_b²))       over the 28 pairs of nodes
    /// ```
    /// `points` \[m\] are those of the nodes. Loops with other than one parent
    /// and one child are left out.
    pub fn loop_spread(
        &self,
        points: &[[f64; 3]],
        repeat: [usize; 2],
        margin: usize,
    ) -> LoopSpread {
        // Base contacts by row and column, left and right.
        let mut bases: BTreeMap<[usize; 2], [u32; 2]> = BTreeMap::new();
        for (k, c) in self.stitches.iter().enumerate() {
            let at = [c.row as usize, c.column as usize];
            let base = bases.entry(at).or_insert([u32::MAX; 2]);
            base[usize::from(c.side > 0)] = k as u32;
        }
        let most = |k: usize| bases.keys().map(|at| at[k]).max().unwrap_or(0);
        let size = [most(0) + 1, most(1) + 1];
        let shape = |[row, column]: [usize; 2]| -> Option<[f64; 28]> {
            let within = |i: usize, n: usize| i >= margin && i + margin < n;
            // The last row of contacts is that of the bind-off.
            if !within(row, size[0] - 1) || !within(column, size[1]) {
                return None;
            }
            let [a, b] = *bases.get(&[row, column])?;
            let [c, d] = *bases.get(&[row + 1, column])?;
            self.shape([a, b, c, d], points)
        };
        let (mut pairs, mut sum, mut worst) = (0, 0.0, 0.0f64);
        for &at in bases.keys() {
            let Some(one) = shape(at) else { continue };
            for next in [[at[0], at[1] + repeat[0]], [at[0] + repeat[1], at[1]]] {
                let Some(other) = shape(next) else { continue };
                let (mut apart, mut all) = (0.0, 0.0);
                for (a, b) in one.iter().zip(&other) {
                    apart += (a - b) * (a - b);
                    all += 0.5 * (a * a + b * b);
                }
                pairs += 1;
                sum += apart / all;
                worst = worst.max((apart / all).sqrt());
            }
        }
        LoopSpread {
            pairs,
            mean: (sum / f64::max(pairs as f64, 1.0)).sqrt(),
            worst,
        }
    }

    /// Distances of the nodes of a loop from each other.
    fn shape(&self, contacts: Contacts, points: &[[f64; 3]]) -> Option<[f64; 28]> {
        let mut x = [V::zeros(); 8];
        for (x, c) in x.as_chunks_mut::<2>().0.iter_mut().zip(contacts) {
            let c = self.stitches.get(c as usize)?;
            if c.parents != 1 {
                return None;
            }
            *x = [c.a, c.b].map(|n| V::from(points[n as usize]));
        }
        let mut distances = [0.0; 28];
        let mut k = 0;
        for i in 0..8 {
            for j in 0..i {
                distances[k] = (x[i] - x[j]).norm();
                k += 1;
            }
        }
        Some(distances)
    }
}
