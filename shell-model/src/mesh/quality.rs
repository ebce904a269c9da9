use super::ShellMesh;

/// How well the hinges of a mesh carry the bending of a continuum.
///
/// A sheet rolled to a slight cylinder has the energy `B κ²/2` per area; the
/// ratio of the hinges' energy (unit stiffness factor, isotropic `B`) to it is
/// 1 on an equilateral mesh in any direction, about 1.01 to 1.17 on a Delaunay
/// mesh of well-spaced points, and 0.8 to 3, depending on the direction, on a
/// right-triangle grid whose diagonals are all parallel. It multiplies the
/// bending rigidity that the simulation shows. Boundary edges have no hinge
/// and are left out of the area as well.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HingeQuality {
    /// Mean over directions \[1\].
    pub mean: f64,
    /// Smallest over directions \[1\].
    pub min: f64,
    /// Largest over directions \[1\].
    pub max: f64,
}

/// Directions over half a turn.
const DIRECTIONS: usize = 24;

impl ShellMesh {
    /// The stiffness ratio of the hinges, or `None` for a mesh without hinges.
    pub fn hinge_quality(&self) -> Option<HingeQuality> {
        if self.hinges().is_empty() {
            return None;
        }
        let mut energy = [0.0; DIRECTIONS];
        let mut area = 0.0;
        for hinge in self.hinges() {
            let [one, two] = self.wings(hinge);
            let length = 0.5 * (one.length + two.length);
            let areas = one.area + two.area;
            area += areas / 3.0;
            // Both wings unfolded into the plane of the first, edge along (1, 0).
            let nodes = [
                [0.0, 0.0],
                [length, 0.0],
                [one.foot * length, one.height],
                [(1.0 - two.foot) * length, -two.height],
            ];
            for (i, energy) in energy.iter_mut().enumerate() {
                let (s, c) = (std::f64::consts::PI * i as f64 / DIRECTIONS as f64).sin_cos();
                // The bending direction seen from the edge.
                let along = c * one.direction[0] + s * one.direction[1];
                let across = s * one.direction[0] - c * one.direction[1];
                let [w0, w1, w2, w3] = nodes.map(|[x, y]| 0.5 * (x * along + y * across).powi(2));
                let rise = |w: f64, foot: f64| w - (1.0 - foot) * w0 - foot * w1;
                let angle = rise(w2, one.foot) / one.height + rise(w3, 1.0 - two.foot) / two.height;
                *energy += length * length / areas * angle * angle;
            }
        }
        let ratios = energy.map(|e| e / area);
        Some(HingeQuality {
            mean: ratios.iter().sum::<f64>() / DIRECTIONS as f64,
            min: ratios.iter().copied().fold(f64::INFINITY, f64::min),
            max: ratios.iter().copied().fold(0.0, f64::max),
        })
    }
}
