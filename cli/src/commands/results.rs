use std::path::{Path, PathBuf};
use std::process::ExitCode;

use selvedge_record::compare::{
    CompareOptions, SurfaceOptions, compare_points, compare_recordings, compare_surfaces,
};
use selvedge_record::export::{self, FrameRange};
use selvedge_record::{Recording, RunHeader, Surface};
use selvedge_scene::file::obj::{self, Purpose};
use selvedge_scene::{YarnSkin, whole_skin, write_whole};

use crate::Failure;
use crate::args::Format;
use crate::output::{self, complain, say};
use crate::{report, report_data};

/// A recording by its path, or in a folder of results.
fn recording(path: &Path) -> Result<(Recording, PathBuf), Failure> {
    let file = if path.is_dir() {
        let whole = path.join("run.mcap");
        if whole.exists() {
            whole
        } else {
            path.join("run.mcap.part")
        }
    } else {
        path.to_owned()
    };
    let recording = Recording::open(&file)?;
    for warning in recording.warnings() {
        complain(format_args!("warning: {}: {warning}", file.display()));
    }
    Ok((recording, file))
}

/// `selvedge compare`: prints JSON.
pub fn compare(a: &Path, b: &Path, json: bool) -> Result<ExitCode, Failure> {
    let is_obj = |p: &Path| p.extension().is_some_and(|e| e.eq_ignore_ascii_case("obj"));
    let value = if is_obj(a) || is_obj(b) {
        let (a, b) = (shape(a)?, shape(b)?);
        let surfaces = compare_surfaces(&a.surface(), &b.surface(), &SurfaceOptions::default())?;
        let points = if a.triangles == b.triangles {
            Some(compare_points(&a.positions, &b.positions)?)
        } else {
            None
        };
        serde_json::json!({ "points": points, "surfaces": surfaces })
    } else {
        let (a, b) = (recording(a)?.0, recording(b)?.0);
        let comparison = compare_recordings(&a, &b, &CompareOptions::default())?;
        serde_json::to_value(comparison).map_err(|e| Failure::Other(e.to_string()))?
    };
    output::value(&value, json)?;
    Ok(ExitCode::SUCCESS)
}

/// The last surface of a result.
struct Shape {
    positions: Vec<f64>,
    triangles: Vec<[u32; 3]>,
}

impl Shape {
    fn surface(&self) -> Surface<'_> {
        Surface {
            positions: &self.positions,
            points: self.positions.len() / 3,
            triangles: &self.triangles,
            material: &[],
            panels: &[],
            panel_names: &[],
        }
    }
}

fn shape(path: &Path) -> Result<Shape, Failure> {
    if path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("obj"))
    {
        let mesh = obj::read(path, 1.0, Purpose::Cloth)?.mesh;
        let positions = mesh.positions.as_flattened().to_vec();
        return Ok(Shape {
            positions,
            triangles: mesh.triangles,
        });
    }
    let (recording, _) = recording(path)?;
    let last = recording
        .frames()
        .len()
        .checked_sub(1)
        .ok_or_else(|| Failure::Usage(format!("`{}` holds no frame", path.display())))?;
    let mut positions = recording.frame(last)?.positions;
    positions.truncate(3 * recording.header().points);
    Ok(Shape {
        positions,
        triangles: recording.header().triangles.clone(),
    })
}

/// `selvedge export`
pub fn export(
    run: &Path,
    format: Format,
    output: Option<&Path>,
    last: bool,
    json: bool,
) -> Result<ExitCode, Failure> {
    let (recording, file) = recording(run)?;
    let format = match format {
        Format::Csv => {
            let table = output.map_or_else(|| file.with_file_name("run.csv"), Path::to_owned);
            export::write_steps_csv(&recording, &table)?;
            return exported(&[table], json);
        }
        Format::Obj => export::Format::Obj,
        Format::Ply => export::Format::Ply,
        Format::Gltf => export::Format::Glb,
        Format::Usd => export::Format::Usda,
        Format::Pc2 => export::Format::Pc2,
    };
    let output = match output {
        Some(path) => path.to_owned(),
        None => file.with_file_name(format!("run.{}", format.extension())),
    };
    let frames = if last {
        FrameRange::last(&recording)
    } else {
        FrameRange::ALL
    };
    let skin = skin(recording.header(), format, frames.count(&recording))?;
    let skin = skin.as_ref().map(|s| s as &dyn export::Skin);
    let written = export::export_skinned(&recording, format, frames, &output, skin)?;
    exported(&written, json)
}

/// Says which files were written.
fn exported(written: &[PathBuf], json: bool) -> Result<ExitCode, Failure> {
    if json {
        let files: Vec<String> = written.iter().map(|f| f.display().to_string()).collect();
        say!(
            "{}",
            serde_json::json!({ "event": "export", "files": files })
        )?;
        return Ok(ExitCode::SUCCESS);
    }
    match written {
        [one] => say!("{}", one.display())?,
        [first, ..] => say!("{} files from {} on", written.len(), first.display())?,
        [] => {}
    }
    Ok(ExitCode::SUCCESS)
}

/// Tubes for yarns; coarser where one file holds many frames.
fn skin(
    header: &RunHeader,
    format: export::Format,
    frames: usize,
) -> Result<Option<YarnSkin>, Failure> {
    let (yarns, points) = (&header.yarns, header.points);
    if yarns.is_empty() || format == export::Format::Pc2 {
        return Ok(None);
    }
    let animated = matches!(format, export::Format::Glb | export::Format::Usda);
    let budget = match animated {
        true => (ANIMATED_TRIANGLES / frames.max(1)).clamp(50_000, STILL_TRIANGLES),
        false => STILL_TRIANGLES,
    };
    whole_skin(yarns, points, [budget, MOST_TRIANGLES])
        .map(Some)
        .map_err(|e| Failure::Other(format!("the recording's yarns cannot be drawn: {e}")))
}

/// Triangles of all frames of an animated file together, where yarns are few.
const ANIMATED_TRIANGLES: usize = 4_000_000;
/// Triangles of a state, where yarns are few.
const STILL_TRIANGLES: usize = 100_000;
/// Triangles of a state in any case; visits are left out beyond.
const MOST_TRIANGLES: usize = 2_000_000;

/// `selvedge view`
pub fn view(run: &Path, json: bool) -> Result<ExitCode, Failure> {
    let (recording, file) = recording(run)?;
    let data = report_data::of_recording(&recording)?;
    let page = file.with_file_name("report.html");
    write_whole(&page, report::render(&data).as_bytes())?;
    if json {
        let page = page.display().to_string();
        say!("{}", serde_json::json!({ "event": "view", "report": page }))?;
    } else {
        say!("{}", page.display())?;
    }
    Ok(ExitCode::SUCCESS)
}
