//! Triangle meshes as bodies.

mod cache;
mod repair;
mod report;
mod tree;

pub use cache::CacheNote;
pub use report::MeshReport;

use super::field::{NodeSource, SparseField};
use super::vec3::{add_scaled, norm, scale};
use super::{Body, FieldSettings, SurfaceSample};
use crate::{Aabb, CollisionError};
use rayon::prelude::*;
use repair::{Repaired, corners, repair};
use std::path::Path;
use tree::{TriangleTree, area_vector, centroid};

/// A closed triangle mesh, as a signed distance on a [`SparseField`].
///
/// Distances at grid nodes are exact. A node is inside where the generalised
/// winding number [Jacobson2013] exceeds one half in magnitude, which does
/// not ask for a clean mesh; in a closed mesh, nodes further apart from the surface than
/// from each other inherit the sign, as the segment between them cannot cross it.
///
/// # Repair
///
/// Points at one place are merged, triangles without three different points
/// and copies are dropped, neighbours made to agree on the outside, a mesh of
/// negative volume turned inside out, loops of boundary edges filled with fans
/// around their centroids. Triangles whose two sides both lie inside (an arm
/// that reaches into the torso) are left out of the distance; those that
/// straddle the intersection curve stay, so that within one edge length of
/// that curve the depth can be too small. [`MeshReport`] tells all of it.
///
/// # Accuracy
///
/// The bounds of [`SparseField`] with respect to the repaired mesh. Gaps that are not loops
/// keep the distance to the nearest triangle and change sign where the winding
/// number is one half.
#[derive(Clone, Debug)]
pub struct MeshBody {
    name: String,
    bounds: Aabb,
    field: SparseField,
    report: MeshReport,
}

impl MeshBody {
    /// Samples the distance to triangles over `points` [m].
    ///
    /// # Errors
    ///
    /// [`CollisionError::NotFinitePosition`], [`CollisionError::PointOutOfRange`]
    /// or [`CollisionError::TooMany`] for meshes that are not meshes,
    /// [`CollisionError::Body`] when they enclose no volume, and
    /// [`CollisionError::Parameter`] for settings out of range.
    pub fn build(
        name: impl Into<String>,
        points: &[[f64; 3]],
        triangles: &[[u32; 3]],
        settings: &FieldSettings,
    ) -> Result<Self, CollisionError> {
        let name = name.into();
        settings.check()?;
        let repaired = repair(&name, points, triangles)?;
        let (field, hidden) = sample(&repaired, settings)?;
        Ok(Self::assemble(name, &repaired, field, hidden))
    }

    /// As [`build`](Self::build), reading the field from `cache_dir` when the
    /// same mesh was sampled with the same settings before.
    ///
    /// Entries are named by a hash of points, triangles, settings and format,
    /// carry a checksum, and appear by renaming a finished file. One that is
    /// damaged is built again; a folder that cannot be written is no error: the
    /// note says so.
    ///
    /// # Errors
    ///
    /// Those of [`build`](Self::build).
    pub fn build_cached(
        name: impl Into<String>,
        points: &[[f64; 3]],
        triangles: &[[u32; 3]],
        settings: &FieldSettings,
        cache_dir: &Path,
    ) -> Result<(Self, CacheNote), CollisionError> {
        let name = name.into();
        settings.check()?;
        let repaired = repair(&name, points, triangles)?;
        let key = cache::key(points, triangles, settings);
        let ((field, hidden), note) =
            cache::read_or_build(cache_dir, &key, || sample(&repaired, settings))?;
        Ok((Self::assemble(name, &repaired, field, hidden), note))
    }

    fn assemble(name: String, repaired: &Repaired, field: SparseField, hidden: usize) -> Self {
        let bounds = Aabb::of_points(&repaired.points);
        let report = MeshReport {
            hidden_triangles: hidden,
            ..repaired.report.clone()
        };
        Self {
            name,
            bounds,
            field,
            report,
        }
    }

    /// What the mesh was like and what was repaired.
    pub const fn report(&self) -> &MeshReport {
        &self.report
    }

    /// The sampled distance.
    pub const fn field(&self) -> &SparseField {
        &self.field
    }
}

impl Body for MeshBody {
    fn name(&self) -> &str {
        &self.name
    }
    fn sample(&self, p: [f64; 3], _time: f64) -> SurfaceSample {
        let (distance, normal) = self.field.sample(p);
        SurfaceSample {
            distance,
            normal,
            velocity: [0.0; 3],
        }
    }
    fn bounds(&self, _time: f64) -> Aabb {
        self.bounds
    }
}

/// Exact signed distances to a mesh.
struct Source {
    /// All triangles, for the sign.
    all: TriangleTree,
    /// Those of the outer surface, for the distance; `None`: all.
    visible: Option<TriangleTree>,
    closed: bool,
}

impl Source {
    fn inside(&self, p: [f64; 3]) -> bool {
        self.all.winding(p).abs() > 0.5
    }
}

fn sample(
    mesh: &Repaired,
    settings: &FieldSettings,
) -> Result<(SparseField, usize), CollisionError> {
    let all = TriangleTree::new(&mesh.points, mesh.triangles.iter().copied());
    let mut source = Source {
        all,
        visible: None,
        closed: mesh.report.watertight,
    };
    let hidden: Vec<bool> = mesh
        .triangles
        .par_iter()
        .map(|t| {
            let t = corners(&mesh.points, t);
            let (center, area) = (centroid(&t), area_vector(&t));
            let size = norm(area);
            if size == 0.0 {
                return false;
            }
            // 1e-3 of the triangle's size to each side.
            let off = scale(area, 1e-3 / size.sqrt());
            source.inside(add_scaled(center, off, 1.0))
                && source.inside(add_scaled(center, off, -1.0))
        })
        .collect();
    let count = hidden.iter().filter(|h| **h).count();
    if count > 0 && count < mesh.triangles.len() {
        let kept = mesh
            .triangles
            .iter()
            .zip(&hidden)
            .filter(|(_, h)| !**h)
            .map(|(t, _)| *t);
        source.visible = Some(TriangleTree::new(&mesh.points, kept));
    }
    let field = SparseField::build(&source, &Aabb::of_points(&mesh.points), settings)?;
    Ok((field, count))
}

impl NodeSource for Source {
    fn fill(&self, origin: [f64; 3], spacing: f64, counts: [usize; 3], out: &mut [f64]) {
        let tree = self.visible.as_ref().unwrap_or(&self.all);
        let [nx, ny, _] = counts;
        // The nearest triangle of the node before, of the row and the plane before.
        let mut hints = [0_u32; 3];
        let strides = [1, nx, nx * ny];
        for n in 0..out.len() {
            let node = [n % nx, n / nx % ny, n / (nx * ny)];
            let p = std::array::from_fn(|a| origin[a] + spacing * node[a] as f64);
            let level = node.iter().position(|i| *i > 0).unwrap_or(2);
            let (d2, triangle) = tree.nearest(p, hints[level]);
            hints[..=level].fill(triangle);
            let d = d2.sqrt();
            let known = (0..3)
                .filter(|a| self.closed && node[*a] > 0)
                .map(|a| out[n - strides[a]])
                .find(|before| before.abs() + d > spacing * (1.0 + 1e-9));
            let inside = match known {
                Some(before) => before.is_sign_negative(),
                None => self.inside(p),
            };
            out[n] = if inside { -d } else { d };
        }
    }
}
