//! Sheets, meshes and patterns.

use std::collections::BTreeMap;
use std::path::Path;

use selvedge_garment::{GarmentMesh, Pattern, pattern};
use selvedge_shell_model::sheet;

use super::draft::Draft;
use crate::build::rest;
use crate::diagnostic::{Diagnostics, Finding};
use crate::file::model::{Lattice, MeshRest};
use crate::file::obj::{self, Purpose};
use crate::file::{Parsed, SceneFile};

/// Adds a sheet; returns the material coordinates of its points.
pub(super) fn add_sheet(
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

/// Adds a mesh from a file.
pub(super) fn add_mesh(
    scene: &SceneFile,
    file: &Path,
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

/// Adds the panels of a garment's pattern.
#[allow(clippy::too_many_arguments)]
pub(super) fn add_pattern(
    parsed: &Parsed,
    index: usize,
    file: &Path,
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
