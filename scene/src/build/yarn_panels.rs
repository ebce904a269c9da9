//! Cloth of yarns in the shape of a mesh: panels knitted or woven, then sewn.

use selvedge_yarn_model::panel::{
    Outline, PanelError, PanelSet, PanelWeave, SewingOptions, knitted_panel, woven_panel,
};
use selvedge_yarn_model::{YarnMaterial, YarnNetwork};

use super::draped::draped;
use super::yarns::{
    Construction, draft_named, find_yarn, knit_options, pattern_named, relaxed_options,
};
use crate::diagnostic::Diagnostics;
use crate::driver::Progress;
use crate::file::Parsed;
use crate::file::model::{Cloth, ClothShape, Grain, RestShape};
use crate::file::obj::{self, Purpose};

/// Distance below which points of the file are one [m].
const WELD: f64 = 1e-5;

/// How far ends of knitted yarns are drawn to a border, in stitches, and of
/// woven ones in spacings.
const REACH: f64 = 1.5;

/// Most rounds in which lengths are brought to rest.
const ROUNDS: usize = 300;

/// A panel's yarns within its outline; the name of what does not fit.
type Fill<'a> = Box<dyn Fn(&Outline) -> Result<Option<YarnNetwork>, PanelError> + 'a>;

/// Yarns of a mesh, in space as the file has it.
pub(super) fn network(
    parsed: &Parsed,
    index: usize,
    cloth: &Cloth,
    progress: &mut (dyn Progress + Send),
) -> Result<YarnNetwork, Diagnostics> {
    let fail = |key: &str, message: String| {
        let path = format!("cloth.{index}.{key}");
        Diagnostics::from(parsed.locations.error("scene::yarns", &path, message))
    };
    let yarn = |key: &str, name: &str| find_yarn(parsed, name).map_err(|m| fail(key, m));
    let seam = |name: &Option<String>, own: &YarnMaterial| match name {
        Some(name) => yarn("seam_yarn", name),
        None => Ok(own.clone()),
    };
    let (set, fill, what, options): (PanelSet, Fill<'_>, _, _) = match &cloth.shape {
        ClothShape::KnitMesh { knit, .. } | ClothShape::KnitPattern { knit, .. } => {
            let own = yarn("yarn", &knit.yarn)?;
            let chart = &knit.chart;
            let pattern = match pattern_named(parsed, chart).map_err(|m| fail("chart", m))? {
                Construction::Pattern(pattern) => pattern,
                Construction::Chart(..) => {
                    let message = format!("{chart} is of fixed size: a panel needs a repeat");
                    return Err(fail("chart", message));
                }
            };
            let mut loops = knit_options(own.clone(), knit.course_pitch, knit.wale_pitch);
            if knit.rest_shape == RestShape::Relaxed {
                let of = relaxed_options(parsed, chart, &loops);
                loops = of.map_err(|m| fail("rest_shape", m))?;
            }
            let (course, row) = (loops.template.course, loops.template.row);
            let material = seam(&knit.seam_yarn, &own)?;
            let set = match &cloth.shape {
                ClothShape::KnitMesh {
                    file, scale, grain, ..
                } => panels(parsed, file, *scale, *grain, &fail)?,
                ClothShape::KnitPattern { drape_time, .. } => {
                    let clearance = 2.0 * own.radius.max(material.radius);
                    let file = draped(parsed, cloth, *drape_time, clearance, progress);
                    let file = file.map_err(|m| fail("file", m))?;
                    panels(parsed, &file, 1.0, Grain::U, &fail)?
                }
                _ => return Err(fail("kind", "not knitted".to_owned())),
            };
            let options = SewingOptions {
                material,
                pitch: 0.5 * course,
                slack: knit.seam_slack,
                reach: REACH * course.max(row),
            };
            let fill = move |outline: &Outline| {
                let knitted = knitted_panel(&pattern, &loops, outline)?;
                Ok(knitted.map(|k| k.network))
            };
            (set, Box::new(fill), "stitch", options)
        }
        ClothShape::WovenMesh {
            file,
            scale,
            grain,
            draft,
            spacing,
            crimp,
            yarn: name,
            weft_yarn,
            seam_yarn,
            seam_slack,
            ..
        } => {
            let own = yarn("yarn", name)?;
            let draft = draft_named(parsed, draft).map_err(|m| fail("draft", m))?;
            let options = SewingOptions {
                material: seam(seam_yarn, &own)?,
                pitch: *spacing,
                slack: *seam_slack,
                reach: REACH * spacing,
            };
            let mut weave = PanelWeave {
                spacing: [*spacing; 2],
                crimp: [*crimp; 2],
                materials: vec![own],
                warp_materials: vec![0],
                weft_materials: vec![0],
            };
            if let Some(name) = weft_yarn {
                weave.materials.push(yarn("weft_yarn", name)?);
                weave.weft_materials = vec![1];
            }
            let fill = move |outline: &Outline| woven_panel(&draft, &weave, outline);
            let set = panels(parsed, file, *scale, *grain, &fail)?;
            (set, Box::new(fill), "crossing", options)
        }
        _ => return Err(fail("kind", "not made of panels of yarn".to_owned())),
    };
    let mut flat = Vec::with_capacity(set.panels.len());
    for (panel, piece) in set.panels.iter().enumerate() {
        let filled = piece.outline().and_then(|outline| {
            let area = outline.area();
            fill(&outline)?.ok_or(PanelError::TooSmall { panel, what, area })
        });
        flat.push(filled.map_err(|e| fail("file", e.to_string()))?);
    }
    let sewn = set.sew(&flat, &options);
    let mut sewn = sewn.map_err(|e| fail("file", e.to_string()))?;
    sewn.settle(ROUNDS, options.slack);
    Ok(sewn.network)
}

fn panels(
    parsed: &Parsed,
    file: &std::path::Path,
    scale: f64,
    grain: Grain,
    fail: &impl Fn(&str, String) -> Diagnostics,
) -> Result<PanelSet, Diagnostics> {
    let mesh = obj::read(&parsed.scene.resolve(file), scale, Purpose::Cloth)?.mesh;
    if mesh.texture.is_empty() {
        let message = "not every corner of the mesh has texture coordinates: no panels";
        return Err(fail("file", message.to_owned()));
    }
    // Grain along y, without turning the panel over.
    let upright = |[u, v]: [f64; 2]| match grain {
        Grain::U => [-scale * v, scale * u],
        Grain::V => [scale * u, scale * v],
    };
    let texture = mesh.texture.iter().map(|t| t.map(upright));
    let flat: Vec<[[f64; 2]; 3]> = texture.collect();
    PanelSet::new(&mesh.positions, &mesh.triangles, &flat, WELD)
        .map_err(|e| fail("file", e.to_string()))
}
