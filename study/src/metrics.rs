//! How far two runs are apart.

use std::collections::BTreeMap;

use selvedge_record::compare::{self, SurfaceOptions, compare_points, compare_surfaces};
use serde::{Deserialize, Serialize};

use crate::record::Figures;
use crate::shape::Shape;

/// Distances of two shapes \[m\].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Distances {
    /// Between points of equal index; `None` for different meshes.
    pub vertices: Option<VertexDistances>,
    /// Mean distance of the points of either surface to the other surface, the
    /// larger of both directions. Of yarns, which have no surface: the mean of
    /// `vertices`, an upper bound.
    pub surface_mean_m: f64,
    /// Hausdorff distance of the surfaces; of yarns the largest of `vertices`.
    pub hausdorff_m: f64,
}

/// Distances between points of equal index \[m\].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct VertexDistances {
    /// Arithmetic mean.
    pub mean_m: f64,
    /// The smallest value that 95 % do not exceed.
    pub p95_m: f64,
    /// Largest.
    pub max_m: f64,
}

/// Compares two shapes; `None` when one of them alone has no surface, or when
/// both have none and differ in points.
pub fn distances(a: &Shape, b: &Shape) -> Option<Distances> {
    let same = a.triangles == b.triangles && a.positions.len() == b.positions.len();
    let vertices = match same {
        true => compare_points(&a.positions, &b.positions).ok(),
        false => None,
    };
    if a == b {
        // What a search for the largest distance finds to round-off.
        let vertices = vertices.map(|_| VertexDistances::default());
        let zero = Distances::default();
        return Some(Distances { vertices, ..zero });
    }
    if same && a.triangles.is_empty() {
        let d = vertices?;
        return Some(Distances {
            vertices: Some(of_points(&d)),
            surface_mean_m: d.mean,
            hausdorff_m: d.max,
        });
    }
    let options = SurfaceOptions::default();
    let surfaces = compare_surfaces(&a.surface(), &b.surface(), &options).ok()?;
    Some(Distances {
        vertices: vertices.as_ref().map(of_points),
        surface_mean_m: surfaces
            .a_to_b
            .vertices
            .mean
            .max(surfaces.b_to_a.vertices.mean),
        hausdorff_m: surfaces.hausdorff,
    })
}

fn of_points(d: &compare::Distances) -> VertexDistances {
    VertexDistances {
        mean_m: d.mean,
        p95_m: d.p95,
        max_m: d.max,
    }
}

/// Energies of a run less those of the reference, by term \[J\]; a term that
/// only one of them has counts as zero in the other.
pub fn energy_differences(run: &Figures, reference: &Figures) -> BTreeMap<String, f64> {
    let names = run.energies_j.keys().chain(reference.energies_j.keys());
    let value = |f: &Figures, name: &String| f.energies_j.get(name).copied().unwrap_or(0.0);
    names
        .map(|name| (name.clone(), value(run, name) - value(reference, name)))
        .collect()
}

/// The repeatability floor: how far runs are apart that differ by next to
/// nothing at the start \[m\]. Differences up to this mean nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Floor {
    /// Runs compared with one another, the reference among them.
    pub runs: usize,
    /// Largest mean distance of points of equal index.
    pub mean_m: f64,
    /// Largest 95th percentile of it.
    pub p95_m: f64,
    /// Largest distance of points of equal index.
    pub max_m: f64,
    /// Largest mean distance of the surfaces.
    pub surface_mean_m: f64,
    /// Largest Hausdorff distance.
    pub hausdorff_m: f64,
}

impl Floor {
    /// Over all pairs of the shapes; `None` for fewer than two.
    pub fn of(shapes: &[&Shape]) -> Option<Self> {
        let mut floor: Option<Self> = None;
        for (i, a) in shapes.iter().enumerate() {
            for b in &shapes[..i] {
                let Some(d) = distances(a, b) else { continue };
                let f = floor.get_or_insert_with(|| Self {
                    runs: shapes.len(),
                    ..Self::default()
                });
                let v = d.vertices.unwrap_or_default();
                f.mean_m = f.mean_m.max(v.mean_m);
                f.p95_m = f.p95_m.max(v.p95_m);
                f.max_m = f.max_m.max(v.max_m);
                f.surface_mean_m = f.surface_mean_m.max(d.surface_mean_m);
                f.hausdorff_m = f.hausdorff_m.max(d.hausdorff_m);
            }
        }
        floor
    }
}

/// Median of the values; `None` without any.
pub fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    match n {
        0 => None,
        n if n % 2 == 1 => Some(sorted[n / 2]),
        n => Some(0.5 * (sorted[n / 2 - 1] + sorted[n / 2])),
    }
}

/// Least of the values; `None` without any.
pub fn least(values: &[f64]) -> Option<f64> {
    values.iter().copied().reduce(f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(z: f64) -> Shape {
        Shape {
            positions: vec![0.0, 0.0, z, 1.0, 0.0, z, 0.0, 1.0, z, 1.0, 1.0, z],
            triangles: vec![[0, 1, 2], [2, 1, 3]],
        }
    }

    /// Parallel squares; another mesh has no vertex distances.
    #[test]
    fn of_squares() {
        let d = distances(&square(0.0), &square(0.25)).unwrap();
        let v = d.vertices.unwrap();
        for x in [v.mean_m, v.p95_m, v.max_m, d.surface_mean_m, d.hausdorff_m] {
            assert!((x - 0.25).abs() < 1e-12, "{x}");
        }
        let zero = distances(&square(0.1), &square(0.1)).unwrap();
        assert_eq!(zero.vertices.unwrap().max_m, 0.0);
        assert_eq!(zero.hausdorff_m, 0.0);
        let mut other = square(0.5);
        other.triangles = vec![[0, 1, 3], [0, 3, 2]];
        let d = distances(&square(0.0), &other).unwrap();
        assert!(d.vertices.is_none() && (d.hausdorff_m - 0.5).abs() < 1e-9);
        assert_eq!(distances(&square(0.0), &Shape::default()), None);
        // Yarns have points alone.
        let points = |z| Shape {
            triangles: Vec::new(),
            ..square(z)
        };
        let d = distances(&points(0.0), &points(0.25)).unwrap();
        assert_eq!(d.vertices.unwrap().max_m, 0.25);
        assert_eq!((d.surface_mean_m, d.hausdorff_m), (0.25, 0.25));
        let (a, b, c) = (square(0.0), square(1e-6), square(-1e-6));
        let floor = Floor::of(&[&a, &b, &c]).unwrap();
        assert!((floor.mean_m - 2e-6).abs() < 1e-15 && floor.runs == 3);
        assert_eq!(Floor::of(&[&a]), None);
    }

    /// Middle values.
    #[test]
    fn medians() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), Some(2.5));
        assert_eq!(median(&[]), None);
        assert_eq!(least(&[2.0, 1.5]), Some(1.5));
    }
}
