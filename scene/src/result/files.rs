//! Results in a folder.

use std::io;
use std::path::{Path, PathBuf};

use selvedge_record::export::{Skin, write_obj, write_obj_lines};
use selvedge_record::{RecordError, Surface};

use crate::build::{BuiltScene, Geometry};
use crate::driver::RunError;
use crate::summary::Summary;
use crate::yarn_skin::still_skin;

pub(crate) const OBJ: &str = "final.obj";
pub(crate) const SUMMARY: &str = "summary.json";

pub(crate) fn write(
    directory: &Path,
    built: &BuiltScene,
    positions: &[f64],
    summary: &Summary,
) -> Result<(), RunError> {
    let g = &built.geometry;
    if g.yarns.is_some() {
        write_yarns(&directory.join(OBJ), g, positions)?;
        return write_summary(directory, summary);
    }
    let surface = Surface {
        positions,
        points: g.mesh.points(),
        triangles: &g.scene_triangles,
        material: &g.scene_material,
        panels: &g.scene_panel,
        panel_names: &g.panel_names,
    };
    write_obj(&directory.join(OBJ), &surface)?;
    write_summary(directory, summary)
}

/// Writes yarns as tubes, or as lines where these would be too many.
fn write_yarns(path: &Path, g: &Geometry, positions: &[f64]) -> Result<(), RunError> {
    let yarns = g.yarn_paths();
    let points = g.recorded_points();
    let skin = still_skin(&yarns, points).map_err(|e| RecordError::Surface {
        reason: e.to_string(),
    })?;
    let Some(skin) = skin else {
        return Ok(write_obj_lines(path, positions, &yarns, &g.panel_names)?);
    };
    let surface = Surface {
        positions: &skin.positions(positions),
        points: skin.points(),
        triangles: skin.triangles(),
        material: &[],
        panels: skin.panels(),
        panel_names: &g.panel_names,
    };
    Ok(write_obj(path, &surface)?)
}

/// Writes `summary.json` into a folder.
///
/// # Errors
/// [`RunError::Write`] with the file's path.
pub fn write_summary(directory: &Path, summary: &Summary) -> Result<(), RunError> {
    let text = serde_json::to_string_pretty(summary).unwrap_or_default() + "\n";
    write_whole(&directory.join(SUMMARY), text.as_bytes())
}

/// Replaces a file at once: readers see the old or the new contents.
///
/// # Errors
/// [`RunError::Write`] with the file's path.
pub fn write_whole(path: &Path, contents: &[u8]) -> Result<(), RunError> {
    let failed = |source| RunError::Write {
        path: path.to_owned(),
        source,
    };
    let temporary = beside(path, ".new");
    let written =
        std::fs::write(&temporary, contents).and_then(|()| std::fs::rename(&temporary, path));
    if written.is_err() {
        // Nothing half-written stays behind; the first error is the one to tell.
        let _ = std::fs::remove_file(&temporary);
    }
    written.map_err(failed)
}

/// Makes the folder and finds out whether results can be put there under their
/// names, before hours go into them. Files of an earlier run stay as they are.
///
/// # Errors
/// [`RunError::Write`] with the path that is in the way.
pub fn check_results(directory: &Path, names: &[&str]) -> Result<(), RunError> {
    let failed = |path: &Path, source| RunError::Write {
        path: path.to_owned(),
        source,
    };
    std::fs::create_dir_all(directory).map_err(|e| failed(directory, e))?;
    for name in names {
        let path = directory.join(name);
        if path.is_dir() {
            return Err(failed(&path, io::ErrorKind::IsADirectory.into()));
        }
        let probe = beside(&path, ".probe");
        std::fs::write(&probe, [])
            .and_then(|()| std::fs::remove_file(&probe))
            .map_err(|e| failed(&path, e))?;
    }
    Ok(())
}

fn beside(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(suffix);
    path.with_file_name(name)
}
