use std::io::Write;
use std::path::Path;

use crate::atomic::write_atomically;
use crate::{RecordError, Surface};

/// Writes a surface as binary little-endian PLY in double precision, with the
/// panel of each triangle when there are panels.
///
/// # Errors
/// [`RecordError::Surface`], [`RecordError::Write`].
pub fn write_ply(path: &Path, surface: &Surface<'_>) -> Result<(), RecordError> {
    surface.validate()?;
    write_atomically(path, |out| {
        writeln!(
            out,
            "ply\nformat binary_little_endian 1.0\ncomment metres, y up"
        )?;
        writeln!(out, "element vertex {}", surface.points)?;
        writeln!(
            out,
            "property double x\nproperty double y\nproperty double z"
        )?;
        writeln!(out, "element face {}", surface.triangles.len())?;
        writeln!(out, "property list uchar uint vertex_indices")?;
        if !surface.panels.is_empty() {
            writeln!(out, "property ushort panel")?;
        }
        writeln!(out, "end_header")?;
        for x in &surface.positions[..3 * surface.points] {
            out.write_all(&x.to_le_bytes())?;
        }
        for (t, triangle) in surface.triangles.iter().enumerate() {
            out.write_all(&[3])?;
            for p in triangle {
                out.write_all(&p.to_le_bytes())?;
            }
            if let Some(panel) = surface.panels.get(t) {
                out.write_all(&panel.to_le_bytes())?;
            }
        }
        Ok(())
    })
}
