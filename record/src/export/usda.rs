use std::io::{self, BufWriter, Write};
use std::path::Path;

use super::Shown;
use crate::atomic::write_atomically;
use crate::{BodySurface, RecordError, RunHeader};

/// Time codes a second; times in between are exact decimals, not rounded.
const RATE: f64 = 24.0;

/// Writes a stage with the bodies and the cloth, its points as time samples.
pub(super) fn write(
    recording: &Shown<'_>,
    indices: &[usize],
    path: &Path,
) -> Result<(), RecordError> {
    let header = recording.header();
    let mut failed = None;
    let written = write_atomically(path, |out| {
        let code = |i: usize| recording.time(i) * RATE;
        writeln!(out, "#usda 1.0\n(")?;
        writeln!(out, "    defaultPrim = \"World\"")?;
        writeln!(
            out,
            "    endTimeCode = {}",
            code(indices[indices.len() - 1])
        )?;
        writeln!(out, "    metersPerUnit = 1")?;
        writeln!(out, "    startTimeCode = {}", code(indices[0]))?;
        writeln!(out, "    timeCodesPerSecond = {RATE}")?;
        writeln!(out, "    upAxis = \"Y\"\n)\n")?;
        writeln!(out, "def Xform \"World\"\n{{")?;
        for (i, body) in header.bodies.iter().enumerate() {
            write_body(out, i, body)?;
        }
        writeln!(out, "    def Mesh \"Cloth\"\n    {{")?;
        topology(out, &header.triangles)?;
        writeln!(out, "        uniform bool doubleSided = 1")?;
        write_material(out, header)?;
        writeln!(out, "        point3f[] points.timeSamples = {{")?;
        for &index in indices {
            let frame = match recording.frame(index) {
                Ok(frame) => frame,
                Err(error) => {
                    failed = Some(error);
                    return Err(io::ErrorKind::Other.into());
                }
            };
            write!(out, "            {}: ", code(index))?;
            let points = frame.positions[..3 * header.points].as_chunks::<3>().0;
            write_points(out, points)?;
            writeln!(out, ",")?;
        }
        writeln!(out, "        }}\n    }}\n}}")
    });
    match failed {
        Some(error) => Err(error),
        None => written,
    }
}

fn write_body<W: Write>(
    out: &mut BufWriter<W>,
    index: usize,
    body: &BodySurface,
) -> io::Result<()> {
    writeln!(out, "    def Mesh \"Body_{index}\" (")?;
    writeln!(
        out,
        "        displayName = {}\n    )\n    {{",
        quoted(&body.name)
    )?;
    topology(out, &body.triangles)?;
    write!(out, "        point3f[] points = ")?;
    write_points(out, &body.points)?;
    writeln!(out, "\n    }}\n")
}

fn topology<W: Write>(out: &mut BufWriter<W>, triangles: &[[u32; 3]]) -> io::Result<()> {
    write!(out, "        int[] faceVertexCounts = [")?;
    list(out, triangles.iter().map(|_| 3))?;
    write!(out, "]\n        int[] faceVertexIndices = [")?;
    list(out, triangles.as_flattened().iter())?;
    writeln!(out, "]\n        uniform token subdivisionScheme = \"none\"")
}

fn write_material<W: Write>(out: &mut BufWriter<W>, header: &RunHeader) -> io::Result<()> {
    if header.material.is_empty() {
        return Ok(());
    }
    write!(out, "        texCoord2f[] primvars:st = [")?;
    let corners = header.material.as_flattened().iter();
    list(
        out,
        corners.map(|[u, v]| format!("({}, {})", *u as f32, *v as f32)),
    )?;
    writeln!(
        out,
        "] (\n            interpolation = \"faceVarying\"\n        )"
    )
}

fn write_points<W: Write>(out: &mut BufWriter<W>, points: &[[f64; 3]]) -> io::Result<()> {
    write!(out, "[")?;
    for (i, p) in points.iter().enumerate() {
        let [x, y, z] = p.map(|x| x as f32);
        let comma = if i == 0 { "" } else { ", " };
        write!(out, "{comma}({x}, {y}, {z})")?;
    }
    write!(out, "]")
}

fn list<W: Write>(
    out: &mut BufWriter<W>,
    values: impl Iterator<Item = impl std::fmt::Display>,
) -> io::Result<()> {
    for (i, value) in values.enumerate() {
        let comma = if i == 0 { "" } else { ", " };
        write!(out, "{comma}{value}")?;
    }
    Ok(())
}

fn quoted(text: &str) -> String {
    let mut quoted = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            c if c.is_control() => quoted.push(' '),
            c => quoted.push(c),
        }
    }
    quoted + "\""
}
