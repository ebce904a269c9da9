//! Obstacles of a scene.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use selvedge_collision::body::{
    Body, CacheNote, FieldSettings, Interpolation, Keyframe, MeshBody, Named, Placed, Pose,
    RigidMotion, Shape, SmoothUnion, SurfaceMesh, Union, mannequin, surface_mesh, surface_mesh_in,
};
use selvedge_collision::{Aabb, CollisionError};

use crate::diagnostic::{Diagnostics, Finding};
use crate::file::Parsed;
use crate::file::model::{self, BodyShape, dense_keys};
use crate::file::obj::{self, Purpose};

/// One obstacle, ready to collide with.
#[derive(Clone)]
pub struct BuiltBody {
    /// Its name.
    pub name: String,
    /// Its distance function.
    pub body: Arc<dyn Body>,
    /// Triangles to show, at time zero.
    pub surface: SurfaceMesh,
    /// Whether it moves.
    pub moves: bool,
}

/// Surface of the body that is nearest at its start: distance [m] and its
/// gradient.
pub(super) fn nearest_surface(bodies: &[BuiltBody], p: [f64; 3]) -> (f64, [f64; 3]) {
    let mut best = (f64::MAX, [0.0, 1.0, 0.0]);
    for b in bodies {
        let s = b.body.sample(p, 0.0);
        if s.distance < best.0 {
            best = (s.distance, s.normal);
        }
    }
    best
}

/// Builds every obstacle. `around` is the cloth's bounding box, which cuts
/// half-spaces for display.
///
/// # Errors
/// All findings, when one is an error.
pub fn build(
    parsed: &Parsed,
    around: &Aabb,
    warnings: &mut Diagnostics,
) -> Result<Vec<BuiltBody>, Diagnostics> {
    let mut findings = Diagnostics::new();
    let mut bodies = Vec::new();
    for (i, spec) in parsed.scene.body.iter().enumerate() {
        match build_one(parsed, i, spec, around, &mut findings) {
            Ok(body) => bodies.push(body),
            Err(errors) => findings.extend(errors),
        }
    }
    if findings.has_errors() {
        return Err(findings);
    }
    warnings.extend(findings);
    Ok(bodies)
}

fn build_one(
    parsed: &Parsed,
    index: usize,
    spec: &model::Body,
    around: &Aabb,
    findings: &mut Diagnostics,
) -> Result<BuiltBody, Diagnostics> {
    let path = format!("body.{index}");
    let refuse = |e: CollisionError| -> Diagnostics {
        parsed
            .locations
            .error("scene::body", &path, e.to_string())
            .into()
    };
    let mut surface = None;
    let still: Box<dyn Body> = match &spec.shape {
        BodyShape::Union { shapes, smooth } => {
            let parts = shapes
                .iter()
                .map(|part| shape(&part.shape).ok_or(()))
                .collect::<Result<Vec<_>, ()>>()
                .map_err(|()| {
                    let message = "a union joins analytic shapes only";
                    Diagnostics::from(parsed.locations.error("scene::body", &path, message))
                })?
                .iter()
                .map(Shape::build)
                .collect::<Result<Vec<_>, _>>()
                .map_err(refuse)?;
            if *smooth > 0.0 {
                Box::new(SmoothUnion::new(parts, *smooth).map_err(refuse)?)
            } else {
                Box::new(Union::new(parts).map_err(refuse)?)
            }
        }
        BodyShape::Mannequin { .. } => Box::new(mannequin().build().map_err(refuse)?),
        BodyShape::Mesh {
            file,
            scale,
            voxel,
            center,
            rotation,
        } => {
            let file = parsed.scene.resolve(file);
            let checked = obj::read(&file, *scale, Purpose::Body)?;
            findings.extend(checked.warnings);
            let mesh = checked.mesh;
            let settings = FieldSettings {
                voxel: *voxel,
                ..FieldSettings::default()
            };
            let (body, note) = MeshBody::build_cached(
                spec.name.as_str(),
                &mesh.positions,
                &mesh.triangles,
                &settings,
                &cache_folder(),
            )
            .map_err(refuse)?;
            let shown = file.display().to_string();
            let mut warn = |text: String| {
                findings.push(Finding::warning("body::mesh", shown.as_str(), text));
            };
            if !body.report().is_clean() {
                warn(format!("the mesh needed repair: {}", body.report()));
            }
            if matches!(
                note,
                CacheNote::Replaced { .. } | CacheNote::NotStored { .. }
            ) {
                warn(format!("distance field {note}"));
            }
            let pose = Pose::new(*center, rotation.vector()).map_err(refuse)?;
            let points = mesh.positions.iter().map(|p| pose.to_world(*p)).collect();
            surface = Some((points, mesh.triangles));
            Box::new(Placed::new(body, pose))
        }
        simple => match shape(simple) {
            Some(shape) => shape.build().map_err(refuse)?,
            None => {
                let message = "not a shape";
                return Err(parsed.locations.error("scene::body", &path, message).into());
            }
        },
    };
    let surface = match surface {
        Some(s) => s,
        None => display(still.as_ref(), around).map_err(refuse)?,
    };
    let moves = spec.motion.len() > 1;
    let moving: Box<dyn Body> = if spec.motion.is_empty() {
        still
    } else {
        let keys: Vec<Keyframe> = dense_keys(&spec.motion)
            .iter()
            .map(|k| Keyframe {
                time: k.time,
                translation: k.translation,
                rotation: k.rotation,
            })
            .collect();
        let interpolation = match spec.interpolation {
            model::Interpolation::Linear => Interpolation::Linear,
            model::Interpolation::Eased => Interpolation::Eased,
        };
        let pivot = spec.pivot.unwrap_or([0.0; 3]);
        Box::new(RigidMotion::new(still, &keys, pivot, interpolation).map_err(refuse)?)
    };
    let friction = parsed.scene.contact.friction.unwrap_or(spec.friction);
    let named = Named::new(spec.name.as_str(), moving).with_friction(friction);
    Ok(BuiltBody {
        name: spec.name.clone(),
        body: Arc::new(named.map_err(refuse)?),
        surface,
        moves,
    })
}

/// Analytic shapes in the terms of the collision crate.
fn shape(spec: &BodyShape) -> Option<Shape> {
    Some(match spec {
        BodyShape::Sphere { center, radius } => Shape::Sphere {
            center: *center,
            radius: *radius,
        },
        BodyShape::Capsule {
            from,
            to,
            radius,
            radius_to,
        } => Shape::Capsule {
            a: *from,
            b: *to,
            radius: [*radius, radius_to.unwrap_or(*radius)],
        },
        BodyShape::Ellipsoid {
            center,
            radii,
            rotation,
        } => Shape::Ellipsoid {
            center: *center,
            axes: *radii,
            rotation: rotation.vector(),
        },
        BodyShape::Box {
            center,
            size,
            rotation,
            rounding,
        } => Shape::Box {
            center: *center,
            half: size.map(|s| 0.5 * s),
            rounding: *rounding,
            rotation: rotation.vector(),
        },
        BodyShape::Plane { point, normal } => Shape::Plane {
            point: *point,
            normal: *normal,
        },
        BodyShape::Union { .. } | BodyShape::Mesh { .. } | BodyShape::Mannequin { .. } => {
            return None;
        }
    })
}

/// About a hundred cells along the longest side.
fn display(body: &dyn Body, around: &Aabb) -> Result<SurfaceMesh, CollisionError> {
    let bounds = body.bounds(0.0);
    let longest = |b: &Aabb| b.extents().into_iter().fold(0.0, f64::max);
    if bounds.is_finite() && !bounds.is_empty() {
        return surface_mesh(body, 0.0, (longest(&bounds) / 100.0).max(1e-3));
    }
    let size = longest(around).max(0.1);
    surface_mesh_in(body, 0.0, size / 40.0, &around.inflate(0.3 * size))
}

/// Where distance fields, relaxed loops and draped shells are kept between runs.
pub(super) fn cache_folder() -> PathBuf {
    let of = |name: &str| {
        std::env::var_os(name)
            .filter(|v| !v.is_empty())
            .map(PathBuf::from)
    };
    of("SELVEDGE_CACHE")
        .or_else(|| of("XDG_CACHE_HOME").map(|c| c.join("selvedge")))
        .or_else(|| of("HOME").map(|h| h.join(".cache").join("selvedge")))
        .unwrap_or_else(|| Path::new(".selvedge-cache").to_owned())
}
