use std::io::Write;
use std::path::Path;

use super::SplitCorners;
use crate::atomic::write_atomically;
use crate::{RecordError, Surface, YarnPaths};

/// Writes a surface as Wavefront OBJ.
///
/// Coordinates are the shortest decimals that read back to the same bits.
/// Material coordinates become `vt` in metres, panels become groups, in the
/// order of the triangles. Equal surfaces give equal files.
///
/// # Errors
/// [`RecordError::Surface`], [`RecordError::Write`].
pub fn write_obj(path: &Path, surface: &Surface<'_>) -> Result<(), RecordError> {
    surface.validate()?;
    let split = SplitCorners::new(surface);
    let textured = !surface.material.is_empty();
    write_atomically(path, |out| {
        writeln!(
            out,
            "# {} points, {} triangles",
            surface.points,
            surface.triangles.len()
        )?;
        for [x, y, z] in &surface.positions.as_chunks::<3>().0[..surface.points] {
            writeln!(out, "v {x} {y} {z}")?;
        }
        if textured {
            for [u, v] in &split.material {
                writeln!(out, "vt {u} {v}")?;
            }
        }
        let mut group = None;
        for (t, corners) in split.triangles.iter().enumerate() {
            let panel = surface.panels.get(t).copied();
            if panel.is_some() && panel != group {
                group = panel;
                writeln!(
                    out,
                    "g {}",
                    one_word(&surface.panel_name(panel.unwrap_or_default()))
                )?;
            }
            write!(out, "f")?;
            for &corner in corners {
                let point = split.point[corner as usize] + 1;
                if textured {
                    write!(out, " {point}/{}", corner + 1)?;
                } else {
                    write!(out, " {point}")?;
                }
            }
            writeln!(out)?;
        }
        Ok(())
    })
}

/// Writes yarns as Wavefront OBJ: the points as they are and a polyline (`l`) a
/// yarn, grouped by pieces of cloth.
///
/// # Errors
/// [`RecordError::Surface`], [`RecordError::Write`].
pub fn write_obj_lines(
    path: &Path,
    positions: &[f64],
    yarns: &YarnPaths,
    panel_names: &[String],
) -> Result<(), RecordError> {
    let points = positions.as_chunks::<3>().0;
    if let Some(reason) = yarns.fault(points.len()) {
        return Err(RecordError::Surface { reason });
    }
    let surface = Surface {
        positions,
        points: points.len(),
        panel_names,
        ..Surface::default()
    };
    surface.validate()?;
    write_atomically(path, |out| {
        writeln!(
            out,
            "# {} points, {} yarns",
            points.len(),
            yarns.radii.len()
        )?;
        for [x, y, z] in points {
            writeln!(out, "v {x} {y} {z}")?;
        }
        let mut group = None;
        for (yarn, panel) in yarns.panels.iter().enumerate() {
            if group != Some(panel) {
                group = Some(panel);
                writeln!(out, "g {}", one_word(&surface.panel_name(*panel)))?;
            }
            write!(out, "l")?;
            for p in &yarns.points[yarns.visits(yarn)] {
                write!(out, " {}", p + 1)?;
            }
            writeln!(out)?;
        }
        Ok(())
    })
}

/// Names end at white space in this format.
fn one_word(name: &str) -> String {
    name.chars()
        .map(|c| {
            if c.is_whitespace() || c.is_control() {
                '_'
            } else {
                c
            }
        })
        .collect()
}
