//! Triangle meshes as bodies.

mod cache;
mod cavities;
mod repair;
mod report;
mod tree;

pub use cache::CacheNote;
pub use report::MeshReport;

use super::field::{NodeSource, SparseField};
use super::vec3::{add_scaled, norm, scale};
use super::{Body, FieldSettings, SurfaceSample};
use crate::{Aabb, CollisionError};
use cavities::{Cavities, Filled};
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
/// that curve the depth can be too small. Cavities that cloth cannot enter, such
/// as a mouth behind its lips, are filled: parts of the outside up to 10 cm
/// wide behind openings narrower than 5 mm (or a voxel). Cloth pressed against
/// their walls would be drawn into them. [`MeshReport`] tells all of it.
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
        let sampled = sample(&repaired, settings)?;
        Ok(Self::assemble(name, &repaired, sampled))
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
        let (sampled, note) =
            cache::read_or_build(cache_dir, &key, || sample(&repaired, settings))?;
        Ok((Self::assemble(name, &repaired, sampled), note))
    }

    fn assemble(name: String, repaired: &Repaired, sampled: Sampled) -> Self {
        let bounds = Aabb::of_points(&repaired.points);
        let report = MeshReport {
            hidden_triangles: sampled.hidden,
            filled_cavities: sampled.cavities,
            ..repaired.report.clone()
        };
        Self {
            name,
            bounds,
            field: sampled.field,
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

/// A field, and what of the mesh is not in it.
struct Sampled {
    field: SparseField,
    /// Triangles inside another part.
    hidden: usize,
    /// Cavities filled.
    cavities: usize,
}

fn sample(mesh: &Repaired, settings: &FieldSettings) -> Result<Sampled, CollisionError> {
    let all = TriangleTree::new(&mesh.points, mesh.triangles.iter().copied());
    let mut source = Source {
        all,
        visible: None,
        closed: mesh.report.watertight,
    };
    let mut left_out: Vec<bool> = mesh
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
    let hidden = left_out.iter().filter(|h| **h).count();
    if hidden > 0 && hidden < mesh.triangles.len() {
        source.visible = Some(remaining(mesh, &left_out));
    }
    let around = Aabb::of_points(&mesh.points);
    let mut field = SparseField::build(&source, &around, settings)?;
    let mut count = 0;
    if let Some(cavities) = Cavities::find(&field) {
        let lining = cavities.lining(&mesh.points, &mesh.triangles);
        for (out, lines) in left_out.iter_mut().zip(lining) {
            *out |= lines;
        }
        count = cavities.count;
        let filled = Filled {
            cavities: &cavities,
            outer: &remaining(mesh, &left_out),
        };
        field = SparseField::build(&filled, &around, settings)?;
    }
    Ok(Sampled {
        field,
        hidden,
        cavities: count,
    })
}

/// The triangles that are not left out.
fn remaining(mesh: &Repaired, left_out: &[bool]) -> TriangleTree {
    let kept = mesh.triangles.iter().zip(left_out);
    TriangleTree::new(
        &mesh.points,
        kept.filter(|(_, out)| !**out).map(|(t, _)| *t),
    )
}

impl NodeSource for Source {
    fn fill(&self, origin: [f64; 3], spacing: f64, counts: [usize; 3], out: &mut [f64]) {
        let tree = self.visible.as_ref().unwrap_or(&self.all);
        tree.distances(origin, spacing, counts, out);
        let [nx, ny, _] = counts;
        let strides = [1, nx, nx * ny];
        for n in 0..out.len() {
            let node = [n % nx, n / nx % ny, n / (nx * ny)];
            let d = out[n];
            let known = (0..3)
                .filter(|a| self.closed && node[*a] > 0)
                .map(|a| out[n - strides[a]])
                .find(|before| before.abs() + d > spacing * (1.0 + 1e-9));
            let inside = match known {
                Some(before) => before.is_sign_negative(),
                None => self.inside(std::array::from_fn(|a| {
                    origin[a] + spacing * node[a] as f64
                })),
            };
            out[n] = if inside { -d } else { d };
        }
    }
}
