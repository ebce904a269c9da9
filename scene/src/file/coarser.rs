//! The same scene on another mesh.

use super::model::{ClothShape, SceneFile, Select};

/// The scene with edges `factor` times as long, or why there is none.
pub fn coarser(scene: &SceneFile, factor: f64) -> Result<SceneFile, String> {
    let mut out = scene.clone();
    out.mesh.edge_length *= factor;
    for cloth in &mut out.cloth {
        match &mut cloth.shape {
            ClothShape::Sheet {
                points,
                edge_length,
                ..
            } => {
                if let Some(points) = points {
                    for n in points {
                        let cells = ((*n as f64 - 1.0) / factor).round();
                        if cells < 1.0 {
                            return Err(format!("`{}` has too few points", cloth.name));
                        }
                        *n = cells as usize + 1;
                    }
                }
                if let Some(edge_length) = edge_length {
                    *edge_length *= factor;
                }
            }
            ClothShape::Pattern { edge_length, .. } => {
                if let Some(edge_length) = edge_length {
                    *edge_length *= factor;
                }
            }
            ClothShape::Mesh { .. } => {
                return Err(format!(
                    "the mesh of `{}` is a file: there is no other one to compare with",
                    cloth.name
                ));
            }
            ClothShape::Knit { .. }
            | ClothShape::Woven { .. }
            | ClothShape::KnitMesh { .. }
            | ClothShape::KnitPattern { .. }
            | ClothShape::WovenMesh { .. } => {
                return Err(format!(
                    "the points of `{}` are where its yarns cross: there is no coarser cloth to \
                     compare with",
                    cloth.name
                ));
            }
        }
    }
    let numbered = |select: &Select| matches!(select, Select::Points(_));
    let pins = scene.pin.iter().map(|p| &p.select);
    let attachments = scene.attachment.iter().map(|a| &a.select);
    if pins.chain(attachments).any(numbered) {
        return Err("pins name points by number, which other meshes number differently".into());
    }
    Ok(out)
}
