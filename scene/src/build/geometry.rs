//! Cloth of a scene as one mesh in the solver's order.

use std::collections::BTreeMap;
use std::ops::Range;

use selvedge_garment::{GarmentMesh, Pattern, pattern};
use selvedge_integrator::State;
use selvedge_linsolve::{Pattern as BlockPattern, Permutation, reverse_cuthill_mckee};
use selvedge_shell_model::fabric::Fabric;
use selvedge_shell_model::shape::hinge_angles;
use selvedge_shell_model::{ShellMesh, sheet};
use selvedge_yarn_model::YarnNetwork;

use super::apart;
use super::cuts;
use super::passages::Passages;
use super::rest;
use super::sewn::{Sewn, held_labels};
use super::system::broad_phase;
use super::yarns::{self, YarnCloth};
use crate::diagnostic::{Diagnostics, Finding};
use crate::file::model::{Cloth, ClothShape, Lattice, MeshRest, Reorder, RestAngles};
use crate::file::obj::{self, Purpose};
use crate::file::{Parsed, SceneFile};

/// All cloth of a scene.
#[derive(Clone)]
pub struct Geometry {
    /// The mesh in the solver's order.
    pub mesh: ShellMesh,
    /// Initial positions in the solver's order [m].
    pub positions: Vec<[f64; 3]>,
    /// Fabrics by index.
    pub fabrics: Vec<Fabric>,
    /// From the scene's order of points to the solver's and back.
    pub order: Permutation,
    /// For every triangle of the solver its index in the scene's order.
    pub triangle_order: Vec<u32>,
    /// Triangles in the scene's order, naming points in the scene's order.
    pub scene_triangles: Vec<[u32; 3]>,
    /// Material coordinates of their corners [m].
    pub scene_material: Vec<[[f64; 2]; 3]>,
    /// Fabric of each, in the scene's order.
    pub scene_fabric: Vec<u16>,
    /// Panel of each, in the scene's order.
    pub scene_panel: Vec<u16>,
    /// Names of the panels.
    pub panel_names: Vec<String>,
    /// The pieces.
    pub parts: Vec<Part>,
    /// Spring seams in the solver's order: point, edge, weight of its second
    /// end.
    pub spring_seams: Vec<(u32, [u32; 2], f64)>,
    /// Whether any piece is sewn from a pattern.
    pub sewn: bool,
    /// Cloth made of yarns, which is then all of it.
    pub yarns: Option<YarnCloth>,
    /// What is recorded of yarns that leave their contacts.
    pub passages: Option<Passages>,
}

/// One piece of cloth, in the scene's order.
#[derive(Clone)]
pub struct Part {
    /// Its name.
    pub name: String,
    /// Its points.
    pub points: Range<u32>,
    /// Material coordinates of its points [m], for sheets.
    pub material: Option<Vec<[f64; 2]>>,
    /// Points of labelled edges.
    pub labels: BTreeMap<String, Vec<u32>>,
    /// Labels attached to the body.
    pub hold: Vec<String>,
    /// The garment, for pieces sewn from a pattern.
    pub garment: Option<Sewn>,
}

/// Arrays under construction, in the scene's order.
#[derive(Default)]
struct Draft {
    positions: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
    material: Vec<[[f64; 2]; 3]>,
    fabric: Vec<u16>,
    panel: Vec<u16>,
    panel_names: Vec<String>,
    parts: Vec<Part>,
    seams: Vec<(u32, [u32; 2], f64)>,
    fabrics: Vec<Fabric>,
    network: Option<YarnNetwork>,
}

impl Geometry {
    /// Meshes every piece and joins them.
    ///
    /// # Errors
    /// All findings of the pieces, when one is an error.
    pub fn new(parsed: &Parsed, warnings: &mut Diagnostics) -> Result<Self, Diagnostics> {
        let scene = &parsed.scene;
        let mut draft = Draft::default();
        let mut findings = Diagnostics::new();
        for (i, cloth) in scene.cloth.iter().enumerate() {
            add_cloth(parsed, i, cloth, &mut draft, &mut findings);
        }
        if findings.has_errors() {
            return Err(findings);
        }
        if scene.contact.part_crossed == Some(true) {
            part_crossed(parsed, &mut draft, &mut findings);
        }
        let mut geometry = finish(scene, draft)
            .map_err(|message| {
                let mut error = parsed.locations.error("scene::cloth", "cloth", message);
                if scene.cloth.iter().any(Cloth::is_sewn) {
                    error = error.help(
                        "a shorter edge length where panels are narrow; check that no two \
                         stitches join the same edges",
                    );
                }
                // What was suspicious before may be the reason.
                let mut all = findings.clone();
                all.push(error);
                all
            })
            .inspect(|_| warnings.extend(findings.clone()))?;
        if scene.topology.changes && geometry.yarns.is_some() {
            let cuts = cuts::planned(parsed, &geometry)?;
            geometry.passages = Some(Passages::new(&geometry, &cuts));
        }
        Ok(geometry)
    }

    /// Values of points brought to the scene's order; those of trims, which
    /// come after the cloth's, are left out.
    pub fn to_scene<V: Copy>(&self, solver: &[V]) -> Vec<V> {
        self.order.to_old(&solver[..self.order.len()])
    }

    /// Flat coordinates brought to the scene's order.
    pub fn flat_to_scene(&self, solver: &[f64]) -> Vec<f64> {
        self.to_scene(solver.as_chunks::<3>().0).into_flattened()
    }

    /// Rest angle of every hinge \[rad\], where a piece is not flat at rest.
    pub fn rest_angles(&self, scene: &SceneFile) -> Option<Vec<f64>> {
        let curved = |part: &Part| {
            let shape = scene.cloth.iter().find(|c| c.name == part.name);
            let shape = shape.map(|c| &c.shape);
            matches!(shape, Some(ClothShape::Mesh { rest_angles, .. })
                if *rest_angles == RestAngles::Shape)
        };
        let curved: Vec<&Part> = self.parts.iter().filter(|p| curved(p)).collect();
        if curved.is_empty() {
            return None;
        }
        let mut bent = vec![false; self.mesh.points()];
        for p in curved.iter().flat_map(|part| part.points.clone()) {
            bent[self.order.new_of_old[p as usize] as usize] = true;
        }
        let mut angles = hinge_angles(&self.mesh, self.positions.as_flattened());
        for (angle, hinge) in angles.iter_mut().zip(self.mesh.hinges()) {
            if !bent[hinge.points[0] as usize] {
                *angle = 0.0;
            }
        }
        Some(angles)
    }

    /// Everything at rest where it begins.
    pub fn start(&self) -> State {
        match &self.yarns {
            Some(yarns) if yarns.sliding => {
                let positions = match &self.passages {
                    Some(passages) => passages.points(&self.positions),
                    None => self.positions.clone(),
                };
                State::with_scalars(&positions, &yarns.network.arcs())
            }
            _ => State::at_rest(&self.positions),
        }
    }

    /// A piece by its name.
    pub fn part(&self, name: &str) -> Option<&Part> {
        self.parts.iter().find(|p| p.name == name)
    }
}

/// Moves pieces that cross apart, and says so.
fn part_crossed(parsed: &Parsed, draft: &mut Draft, findings: &mut Diagnostics) {
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

fn add_cloth(
    parsed: &Parsed,
    index: usize,
    cloth: &Cloth,
    draft: &mut Draft,
    findings: &mut Diagnostics,
) {
    let path = |key: &str| format!("cloth.{index}.{key}");
    let fail = |key: &str, message: String| {
        Diagnostics::from(parsed.locations.error("scene::cloth", &path(key), message))
    };
    if let Some(network) = yarns::network(parsed, index, cloth) {
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

/// Returns the material coordinates of the points.
fn add_sheet(
    size: [f64; 2],
    points: Option<[usize; 2]>,
    edge: f64,
    lattice: Lattice,
    fabric: u16,
    draft: &mut Draft,
) -> Result<Vec<[f64; 2]>, String> {
    let made = match (points, lattice) {
        (Some([nu, nv]), Lattice::Alternating) => sheet::grid(nu, nv, size),
        (Some([nu, nv]), Lattice::Equilateral) => sheet::equilateral(nu, nv, size),
        (None, Lattice::Equilateral) => sheet::equilateral_edge(size, edge),
        (None, Lattice::Alternating) => {
            let count = |s: f64| (s / edge).round().max(1.0) as usize + 1;
            sheet::grid(count(size[0]), count(size[1]), size)
        }
    }
    .map_err(|e| e.to_string())?;
    let from = draft.positions.len() as u32;
    // Centred, in the x-z plane; weft along −z makes the normal point up.
    let flat = made.positions(|[u, v]| [u - 0.5 * size[0], 0.0, 0.5 * size[1] - v]);
    draft.positions.extend_from_slice(flat.as_chunks::<3>().0);
    draft
        .triangles
        .extend(made.mesh.triangles().iter().map(|t| t.map(|p| from + p)));
    draft.material.extend_from_slice(made.mesh.material());
    draft.fabric.resize(draft.triangles.len(), fabric);
    let mut material = vec![[0.0; 2]; made.mesh.points()];
    for (t, m) in made.mesh.triangles().iter().zip(made.mesh.material()) {
        for (p, m) in t.iter().zip(m) {
            material[*p as usize] = *m;
        }
    }
    Ok(material)
}

fn add_mesh(
    scene: &SceneFile,
    file: &std::path::Path,
    scale: f64,
    rest: MeshRest,
    fabric: u16,
    draft: &mut Draft,
    findings: &mut Diagnostics,
) -> Result<(), Diagnostics> {
    let checked = obj::read(&scene.resolve(file), scale, Purpose::Cloth)?;
    findings.extend(checked.warnings);
    let mesh = checked.mesh;
    let from = draft.positions.len() as u32;
    let material = rest::coordinates(&mesh, scale, rest).map_err(|(line, message)| {
        let shown = scene.resolve(file).display().to_string();
        let finding = Finding::error("mesh::texture", shown, message);
        let finding = line
            .into_iter()
            .fold(finding, |f, line| f.line(line as usize));
        Diagnostics::from(finding.help("`rest = \"shape\"` takes the shape of the file"))
    })?;
    draft.material.extend(material);
    draft
        .triangles
        .extend(mesh.triangles.iter().map(|t| t.map(|p| from + p)));
    draft.positions.extend_from_slice(&mesh.positions);
    draft.fabric.resize(draft.triangles.len(), fabric);
    Ok(())
}

#[allow(clippy::too_many_arguments)]
fn add_pattern(
    parsed: &Parsed,
    index: usize,
    file: &std::path::Path,
    edge: f64,
    fabric: u16,
    panel_fabric: &BTreeMap<String, String>,
    resolve: impl Fn(&mut Draft, &str) -> Result<u16, String>,
    draft: &mut Draft,
    findings: &mut Diagnostics,
) -> Result<GarmentMesh, Diagnostics> {
    let path = parsed.scene.resolve(file);
    let shown = path.display().to_string();
    let error = |message: String| {
        Diagnostics::from(parsed.locations.error(
            "scene::pattern",
            &format!("cloth.{index}.file"),
            message,
        ))
    };
    let bytes = std::fs::read(&path).map_err(|e| error(format!("cannot read `{shown}`: {e}")))?;
    let read = Pattern::from_json(&bytes).map_err(|e| error(format!("{shown}: {e}")))?;
    findings.extend(pattern_findings(&shown, &pattern::examine(&read)));
    if findings.has_errors() {
        return Err(std::mem::take(findings));
    }
    let settings = selvedge_garment::MeshSettings {
        edge_length: edge,
        ..Default::default()
    };
    let mesh = GarmentMesh::build(&read, &settings).map_err(|e| error(format!("{shown}: {e}")))?;
    findings.extend(pattern_findings(&shown, &mesh.findings));

    let from = draft.positions.len() as u32;
    let first_panel = draft.panel_names.len() as u16;
    draft.positions.extend_from_slice(&mesh.points_initial);
    draft
        .triangles
        .extend(mesh.triangles.iter().map(|t| t.map(|p| from + p)));
    draft.material.extend_from_slice(&mesh.material);
    let mut fabric_of_panel = Vec::new();
    for panel in &mesh.panels {
        draft.panel_names.push(panel.name.clone());
        fabric_of_panel.push(match panel_fabric.get(&panel.name) {
            None => fabric,
            Some(name) => resolve(draft, name).map_err(error)?,
        });
    }
    if let Some(name) = panel_fabric
        .keys()
        .find(|n| !mesh.panels.iter().any(|p| p.name == **n))
    {
        let names: Vec<&str> = mesh.panels.iter().map(|p| p.name.as_str()).collect();
        return Err(error(format!(
            "`panel_fabric` names panel `{name}`; the pattern has {}",
            names.join(", ")
        )));
    }
    draft.panel.extend(
        mesh.panel_of_triangle
            .iter()
            .map(|&p| first_panel + p as u16),
    );
    draft.fabric.extend(
        mesh.panel_of_triangle
            .iter()
            .map(|&p| fabric_of_panel[p as usize]),
    );
    draft.seams.extend(
        mesh.spring_seams
            .iter()
            .map(|s| (from + s.point, s.edge.map(|p| from + p), s.weights[1])),
    );
    Ok(mesh)
}

/// Findings of the pattern's doctor; what is only worth knowing is left out.
fn pattern_findings(file: &str, all: &[pattern::Finding]) -> Diagnostics {
    let mut findings = Diagnostics::new();
    for f in all {
        let finding = match f.severity {
            pattern::Severity::Error => Finding::error("pattern", file, f.message.as_str()),
            pattern::Severity::Warning => Finding::warning("pattern", file, f.message.as_str()),
            pattern::Severity::Note => continue,
        };
        findings.push(finding.help(f.help.as_str()));
    }
    findings
}

/// Stretch, noise, rotation and translation of a piece.
fn place(cloth: &Cloth, start: u32, draft: &mut Draft) {
    let r = cloth.rotation.matrix();
    let mut noise = Noise(cloth.noise_seed);
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

/// Small seeded generator (SplitMix64): the same displacement on every
/// machine, without a dependency.
pub(super) struct Noise(pub(super) u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Sum of twelve uniform numbers: mean 0, deviation 1, bounded by 6.
    pub(super) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

fn finish(scene: &SceneFile, draft: Draft) -> Result<Geometry, String> {
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
            reverse_cuthill_mckee(&BlockPattern::from_groups(points, groups))
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
