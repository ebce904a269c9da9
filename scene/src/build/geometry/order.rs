//! From the scene's order to the solver's.

use selvedge_linsolve::{Pattern, Permutation, reverse_cuthill_mckee};
use selvedge_shell_model::ShellMesh;
use selvedge_yarn_model::YarnNetwork;

use super::Geometry;
use super::draft::Draft;
use crate::build::yarns::YarnCloth;
use crate::file::SceneFile;
use crate::file::model::{Cloth, Reorder};

/// All pieces as one mesh.
pub(super) fn finish(scene: &SceneFile, draft: Draft) -> Result<Geometry, String> {
    let points = draft.positions.len();
    // Yarns are numbered along their courses, which is the better order for
    // whatever runs along them: fronts across a garment cut every yarn.
    let reorder = match scene.assembly.reorder {
        Reorder::Auto if draft.network.is_some() => Reorder::None,
        Reorder::Auto => Reorder::Rcm,
        chosen => chosen,
    };
    let order = match reorder {
        Reorder::None => Permutation::identity(points),
        _ => {
            let nodes = |n: &YarnNetwork| -> Vec<[u32; 2]> {
                let node = |s: u32| n.strands[s as usize].node;
                n.segments().map(|ends| ends.map(node)).collect()
            };
            let segments = draft.network.as_ref().map(nodes).unwrap_or_default();
            let groups = draft.triangles.iter().map(|t| t.as_slice());
            let groups = groups.chain(segments.iter().map(|s| s.as_slice()));
            reverse_cuthill_mckee(&Pattern::from_groups(points, groups))
        }
    };
    let renamed: Vec<[u32; 3]> = draft
        .triangles
        .iter()
        .map(|t| t.map(|p| order.new_of_old[p as usize]))
        .collect();
    let mut triangle_order: Vec<u32> = (0..renamed.len() as u32).collect();
    if reorder == Reorder::Rcm {
        triangle_order.sort_by_key(|&t| {
            let mut nodes = renamed[t as usize];
            nodes.sort_unstable();
            nodes
        });
    }
    let pick = |t: &u32| *t as usize;
    let mesh = ShellMesh::new(
        points,
        triangle_order.iter().map(|t| renamed[pick(t)]).collect(),
        triangle_order
            .iter()
            .map(|t| draft.material[pick(t)])
            .collect(),
        triangle_order
            .iter()
            .map(|t| draft.fabric[pick(t)])
            .collect(),
    )
    .map_err(|e| e.to_string())?;
    if let Some(&p) = mesh.isolated().first()
        && draft.network.is_none()
    {
        let old = order.old_of_new[p as usize];
        return Err(format!(
            "point {old} belongs to no triangle ({} such points): remove them from the mesh",
            mesh.isolated().len()
        ));
    }
    let rename = |p: u32| order.new_of_old[p as usize];
    Ok(Geometry {
        passages: None,
        positions: order.to_new(&draft.positions),
        mesh,
        spring_seams: draft
            .seams
            .iter()
            .map(|&(p, e, w)| (rename(p), e.map(rename), w))
            .collect(),
        fabrics: draft.fabrics,
        triangle_order,
        scene_triangles: draft.triangles,
        scene_material: draft.material,
        scene_fabric: draft.fabric,
        scene_panel: draft.panel,
        panel_names: draft.panel_names,
        sewn: scene.cloth.iter().any(Cloth::is_sewn),
        parts: draft.parts,
        yarns: draft.network.map(|n| YarnCloth {
            network: n.renumbered(&order.new_of_old),
            sliding: scene.cloth.iter().any(|c| c.slides() == Some(true)),
        }),
        order,
    })
}
