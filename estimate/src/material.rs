//! The same point of the cloth on two meshes.

use parry3d_f64::math::Vector;
use parry3d_f64::query::PointQueryWithLocation;
use parry3d_f64::shape::TriMesh;
use selvedge_record::compare::Distances;

use crate::EstimateError;

/// Cloth in space, with the place of every triangle in its panel.
#[derive(Clone, Copy, Debug)]
pub struct Surface<'a> {
    /// Corners of the triangles.
    pub triangles: &'a [[u32; 3]],
    /// Material coordinates of the corners, warp and weft [m].
    pub material: &'a [[[f64; 2]; 3]],
    /// Panel of each triangle.
    pub panel: &'a [u16],
    /// Positions of the points, x, y, z of each [m].
    pub positions: &'a [f64],
}

/// Finds points of the cloth by panel and material coordinates.
///
/// The panels lie side by side in one mesh, each in a plane of its own; a point
/// beyond a panel's outline, which coarser edges cut differently, is put to the
/// nearest place on it.
pub struct MaterialMap<'a> {
    surface: Surface<'a>,
    flat: TriMesh,
    apart: f64,
}

impl<'a> MaterialMap<'a> {
    /// Prepares the search in a surface.
    ///
    /// # Errors
    /// [`EstimateError::Empty`] for a surface without triangles.
    pub fn new(surface: Surface<'a>) -> Result<Self, EstimateError> {
        let all = || surface.material.iter().flatten().flatten();
        let size = all().fold(0.0f64, |m, x| m.max(x.abs()));
        // Farther from each other than any two points of one panel.
        let apart = 4.0 * size + 1.0;
        let corners = surface.material.iter().zip(surface.panel);
        let points: Vec<Vector> = corners
            .flat_map(|(corners, &panel)| corners.map(|c| place(c, panel, apart)))
            .collect();
        let n = surface.triangles.len() as u32;
        let triangles = (0..n).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let flat = TriMesh::new(points, triangles).map_err(|_| EstimateError::Empty)?;
        Ok(Self {
            surface,
            flat,
            apart,
        })
    }

    /// Where a material point is in space [m].
    pub fn position(&self, material: [f64; 2], panel: u16) -> [f64; 3] {
        let at = place(material, panel, self.apart);
        let (_, (t, location)) = self.flat.project_local_point_and_get_location(at, true);
        let weights = location
            .barycentric_coordinates()
            .unwrap_or([1.0, 0.0, 0.0]);
        let corners = self.surface.triangles[t as usize];
        let mut out = [0.0; 3];
        for (w, p) in weights.into_iter().zip(corners) {
            for i in 0..3 {
                out[i] += w * self.surface.positions[3 * p as usize + i];
            }
        }
        out
    }

    /// Distances of another surface's points to the same points here.
    pub fn distance(&self, other: &Surface<'_>) -> Distances {
        let points = other.positions.len() / 3;
        let mut seen = vec![false; points];
        let mut all = Vec::with_capacity(points);
        let triangles = other.triangles.iter().zip(other.material).zip(other.panel);
        for ((corners, material), &panel) in triangles {
            for (&p, &m) in corners.iter().zip(material) {
                let p = p as usize;
                if std::mem::replace(&mut seen[p], true) {
                    continue;
                }
                let here = self.position(m, panel);
                let square = |i: usize| (here[i] - other.positions[3 * p + i]).powi(2);
                all.push((square(0) + square(1) + square(2)).sqrt());
            }
        }
        Distances::of(&all)
    }
}

fn place([u, v]: [f64; 2], panel: u16, apart: f64) -> Vector {
    Vector::new(u, v, apart * f64::from(panel))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    struct Cloth {
        triangles: Vec<[u32; 3]>,
        material: Vec<[[f64; 2]; 3]>,
        panel: Vec<u16>,
        positions: Vec<f64>,
    }

    impl Cloth {
        fn surface(&self) -> Surface<'_> {
            Surface {
                triangles: &self.triangles,
                material: &self.material,
                panel: &self.panel,
                positions: &self.positions,
            }
        }
    }

    /// A unit square of `n × n` cells, bent to a cylinder.
    fn square(n: usize, panel: u16) -> Cloth {
        let at = |i: usize, j: usize| [i as f64 / n as f64, j as f64 / n as f64];
        let id = |i: usize, j: usize| (i * (n + 1) + j) as u32;
        let (mut triangles, mut material, mut positions) = (vec![], vec![], vec![]);
        for i in 0..=n {
            for j in 0..=n {
                let [u, v] = at(i, j);
                positions.extend([u.sin() + f64::from(panel), v, u.cos()]);
            }
        }
        for i in 0..n {
            for j in 0..n {
                for c in [[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]] {
                    triangles.push(c.map(|(a, b)| id(i + a, j + b)));
                    material.push(c.map(|(a, b)| at(i + a, j + b)));
                }
            }
        }
        Cloth {
            panel: vec![panel; triangles.len()],
            triangles,
            material,
            positions,
        }
    }

    #[test]
    fn a_finer_mesh_of_the_same_shape_is_a_chord_away() {
        let fine = square(32, 0);
        let coarse = square(8, 0);
        // Nodes of the coarse mesh are nodes of the fine one.
        let there = MaterialMap::new(fine.surface())
            .unwrap()
            .distance(&coarse.surface());
        assert!(there.max < 1e-14, "{there:?}");
        // The other way, half-way between two nodes 1/8 apart on a unit circle.
        let back = MaterialMap::new(coarse.surface())
            .unwrap()
            .distance(&fine.surface());
        assert_relative_eq!(back.max, 1.0 - (1.0f64 / 16.0).cos(), max_relative = 1e-2);
        assert!(back.mean < back.p95 && back.p95 <= back.max);
    }

    #[test]
    fn panels_are_kept_apart() {
        let mut one = square(4, 0);
        let two = square(4, 1);
        let shift = (one.positions.len() / 3) as u32;
        let shifted = two.triangles.iter().map(|t| t.map(|p| p + shift));
        one.triangles.extend(shifted);
        one.material.extend(&two.material);
        one.panel.extend(&two.panel);
        one.positions.extend(&two.positions);
        let both = one.surface();
        let map = MaterialMap::new(both).unwrap();
        let (a, b) = (map.position([0.5, 0.5], 0), map.position([0.5, 0.5], 1));
        assert_relative_eq!(b[0] - a[0], 1.0, epsilon = 1e-12);
        assert!(map.distance(&both).max < 1e-14);
    }

    #[test]
    fn percentiles_are_nearest_ranks() {
        let all: Vec<f64> = (1..=100).map(f64::from).collect();
        let d = Distances::of(&all);
        assert_eq!((d.mean, d.p95, d.max), (50.5, 95.0, 100.0));
        assert_eq!(Distances::of(&[]), Distances::default());
    }
}
