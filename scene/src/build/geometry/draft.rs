//! The pieces of a scene as arrays, in the scene's order.

use std::collections::BTreeMap;
use std::ops::Range;

use selvedge_shell_model::fabric::Fabric;
use selvedge_yarn_model::YarnNetwork;

use super::Part;
use super::pieces::{add_mesh, add_pattern, add_sheet};
use crate::build::apart;
use crate::build::sewn::{Sewn, held_labels};
use crate::build::system::broad_phase;
use crate::build::yarns;
use crate::diagnostic::Diagnostics;
use crate::driver::Progress;
use crate::file::model::{Cloth, ClothShape};
use crate::file::{Parsed, SceneFile};
use crate::random::SplitMix;

/// Arrays under construction, in the scene's order.
#[derive(Default)]
pub(super) struct Draft {
    pub positions: Vec<[f64; 3]>,
    pub triangles: Vec<[u32; 3]>,
    pub material: Vec<[[f64; 2]; 3]>,
    pub fabric: Vec<u16>,
    pub panel: Vec<u16>,
    pub panel_names: Vec<String>,
    pub parts: Vec<Part>,
    pub seams: Vec<(u32, [u32; 2], f64)>,
    pub fabrics: Vec<Fabric>,
    pub network: Option<YarnNetwork>,
}

/// Adds a piece.
pub(super) fn add_cloth(
    parsed: &Parsed,
    index: usize,
    cloth: &Cloth,
    progress: &mut (dyn Progress + Send),
    draft: &mut Draft,
    findings: &mut Diagnostics,
) {
    let path = |key: &str| format!("cloth.{index}.{key}");
    let fail = |key: &str, message: String| {
        Diagnostics::from(parsed.locations.error("scene::cloth", &path(key), message))
    };
    if let Some(network) = yarns::network(parsed, index, cloth, progress, findings) {
        return match network {
            Ok(network) => add_yarns(cloth, network, draft),
            Err(errors) => findings.extend(errors),
        };
    }
    let fabric = match fabric_index(&parsed.scene, &cloth.fabric, draft) {
        Ok(i) => i,
        Err(message) => return findings.extend(fail("fabric", message)),
    };
    let start = draft.positions.len() as u32;
    let added = match &cloth.shape {
        ClothShape::Sheet {
            size,
            points,
            lattice,
            ..
        } => {
            let edge = cloth.edge_length().unwrap_or(parsed.scene.mesh.edge_length);
            add_sheet(*size, *points, edge, *lattice, fabric, draft)
                .map(|material| (Some(material), None, Vec::new()))
                .map_err(|message| fail("size", message))
        }
        ClothShape::Mesh {
            file, scale, rest, ..
        } => add_mesh(&parsed.scene, file, *scale, *rest, fabric, draft, findings)
            .map(|()| (None, None, Vec::new())),
        ClothShape::Pattern {
            file,
            panel_fabric,
            hold,
            ..
        } => {
            let edge = cloth.edge_length().unwrap_or(parsed.scene.mesh.edge_length);
            let resolve = |draft: &mut Draft, name: &str| fabric_index(&parsed.scene, name, draft);
            add_pattern(
                parsed,
                index,
                file,
                edge,
                fabric,
                panel_fabric,
                resolve,
                draft,
                findings,
            )
            .map(|mesh| {
                let hold = held_labels(&mesh, hold);
                (None, Some(mesh), hold)
            })
        }
        ClothShape::Knit { .. }
        | ClothShape::Woven { .. }
        | ClothShape::KnitMesh { .. }
        | ClothShape::KnitPattern { .. }
        | ClothShape::WovenMesh { .. } => return,
    };
    let (material, mesh, hold) = match added {
        Ok(added) => added,
        Err(errors) => return findings.extend(errors),
    };
    if let (ClothShape::Pattern { panel_layer, .. }, Some(mesh)) = (&cloth.shape, &mesh) {
        for panel in panel_layer.keys() {
            let names: Vec<&str> = mesh.panels.iter().map(|p| p.name.as_str()).collect();
            if !names.contains(&panel.as_str()) {
                let key = format!("panel_layer.{panel}");
                let message = format!(
                    "`{}`: the pattern has no panel {panel:?}; there are {}",
                    path(&key),
                    names.join(", ")
                );
                findings.extend(fail(&key, message));
            }
        }
    }
    let labels = mesh.iter().flat_map(|m| &m.labels);
    let labels = labels
        .map(|(label, points)| (label.clone(), points.iter().map(|p| start + p).collect()))
        .collect();
    let rotation = cloth.rotation.matrix();
    let garment = mesh.map(|mesh| Sewn {
        mesh,
        rotation,
        center: cloth.center,
    });
    place(cloth, start, draft);
    if !cloth.is_sewn() {
        draft.panel_names.push(cloth.name.clone());
        draft
            .panel
            .resize(draft.triangles.len(), (draft.panel_names.len() - 1) as u16);
    }
    draft.parts.push(Part {
        name: cloth.name.clone(),
        points: start..draft.positions.len() as u32,
        material,
        labels,
        hold,
        garment,
    });
}

fn add_yarns(cloth: &Cloth, network: YarnNetwork, draft: &mut Draft) {
    let start = draft.positions.len() as u32;
    let material = match &cloth.shape {
        // Panels have no corners by name.
        ClothShape::KnitMesh { .. }
        | ClothShape::KnitPattern { .. }
        | ClothShape::WovenMesh { .. } => None,
        _ => Some(yarns::selectable(&network, cloth)),
    };
    draft.positions.extend_from_slice(&network.points);
    match &mut draft.network {
        Some(all) => all.append(&network),
        none => *none = Some(network),
    }
    // Shells were draped where the scene puts them.
    if !matches!(cloth.shape, ClothShape::KnitPattern { .. }) {
        place(cloth, start, draft);
    }
    draft.panel_names.push(cloth.name.clone());
    draft.parts.push(Part {
        name: cloth.name.clone(),
        points: start..draft.positions.len() as u32,
        material,
        labels: BTreeMap::new(),
        hold: Vec::new(),
        garment: None,
    });
}

/// Index of a fabric among those in use, with the scene's damping applied.
fn fabric_index(scene: &SceneFile, name: &str, draft: &mut Draft) -> Result<u16, String> {
    if let Some(i) = draft.fabrics.iter().position(|f| f.name == name) {
        return Ok(i as u16);
    }
    let mut fabric = scene.fabric_named(name).map_err(|e| e.to_string())?;
    fabric.name = name.to_owned();
    let d = &scene.damping;
    if scene.damping.kind == crate::file::model::DampingKind::None {
        fabric.drag = 0.0;
    }
    fabric.drag = d.drag.unwrap_or(fabric.drag);
    fabric.membrane_damping = d.membrane.unwrap_or(fabric.membrane_damping);
    fabric.bending_damping = d.bending.unwrap_or(fabric.bending_damping);
    draft.fabrics.push(fabric);
    u16::try_from(draft.fabrics.len() - 1).map_err(|_| "more than 65536 fabrics".to_owned())
}

/// Stretch, noise, rotation and translation of a piece.
fn place(cloth: &Cloth, start: u32, draft: &mut Draft) {
    let r = cloth.rotation.matrix();
    let mut noise = SplitMix(cloth.noise_seed);
    for p in &mut draft.positions[start as usize..] {
        let s = p.map(|x| cloth.stretch * x);
        *p = std::array::from_fn(|i| {
            let turned = r[i][0] * s[0] + r[i][1] * s[1] + r[i][2] * s[2];
            let moved = cloth.center[i] + turned;
            if cloth.noise > 0.0 {
                moved + cloth.noise * noise.normal()
            } else {
                moved
            }
        });
    }
}

/// Moves pieces that cross apart, and says so.
pub(super) fn part_crossed(parsed: &Parsed, draft: &mut Draft, findings: &mut Diagnostics) {
    let contact = &parsed.scene.contact;
    let pieces: Vec<Range<u32>> = draft.parts.iter().map(|p| p.points.clone()).collect();
    let fixed: Vec<bool> = draft.parts.iter().map(|p| p.garment.is_some()).collect();
    let mut broad = broad_phase(contact.broad_phase);
    let (moved, left) = apart::part(
        &mut draft.positions,
        &draft.triangles,
        &pieces,
        &fixed,
        contact.thickness,
        broad.as_mut(),
    );
    let name = |piece: usize| &draft.parts[piece].name;
    let mut warn = |piece: usize, message: String| {
        let path = format!("cloth.{piece}");
        let locations = &parsed.locations;
        findings.push(locations.warning("scene::crossed", &path, message));
    };
    for m in moved {
        let [x, y, z] = m.way;
        let far = (x * x + y * y + z * z).sqrt();
        let message = format!(
            "`{}` crosses `{}` where the scene puts it: moved by {far:.4} m, \
             ({x:.4}, {y:.4}, {z:.4})",
            name(m.piece),
            name(m.other)
        );
        warn(m.piece, message);
    }
    for [a, b] in left {
        let message = format!(
            "`{}` crosses `{}` and could not be moved apart",
            name(a),
            name(b)
        );
        warn(a, message);
    }
}
