use crate::diagnostic::{Diagnostics, Finding};

use super::ObjMesh;

/// Findings of one kind after which the rest is only counted.
const SHOWN: usize = 5;

/// A corner of a face: point and, if given, texture coordinate.
type Corner = (u32, Option<u32>);

/// Reads points, texture coordinates and faces; other lines are passed over.
pub(super) fn parse(text: &str, name: &str) -> (ObjMesh, Diagnostics) {
    let mut findings = Diagnostics::new();
    let mut mesh = ObjMesh::default();
    let mut texture: Vec<[f64; 2]> = Vec::new();
    let mut corners: Vec<[Option<u32>; 3]> = Vec::new();
    let mut faulty = 0;
    if text.trim().is_empty() {
        let finding = Finding::error("mesh::empty", name, "the file is empty");
        findings.push(finding.help("export the mesh again"));
        return (mesh, findings);
    }
    for (number, line) in text.lines().enumerate() {
        let number = number + 1;
        let mut words = line.split('#').next().unwrap_or("").split_whitespace();
        let result = match words.next() {
            Some("v") => numbers::<3>(words).map(|p| mesh.positions.push(p)),
            Some("vt") => numbers::<2>(words).map(|t| texture.push(t)),
            Some("f") => words
                .map(|w| corner(w, mesh.positions.len(), texture.len()))
                .collect::<Result<Vec<Corner>, String>>()
                .and_then(|face| {
                    if face.len() < 3 {
                        return Err(format!("a face of {} corners", face.len()));
                    }
                    for i in 1..face.len() - 1 {
                        let triangle = [face[0], face[i], face[i + 1]];
                        mesh.triangles.push(triangle.map(|c| c.0));
                        mesh.lines.push(u32::try_from(number).unwrap_or(u32::MAX));
                        corners.push(triangle.map(|c| c.1));
                    }
                    Ok(())
                }),
            _ => Ok(()),
        };
        if let Err(message) = result {
            faulty += 1;
            if faulty <= SHOWN {
                let finding = Finding::error("mesh::syntax", name, message).line(number);
                findings.push(finding.help("a damaged or truncated file? export it again"));
            }
        }
    }
    if faulty > SHOWN {
        let message = format!("{} more faulty lines", faulty - SHOWN);
        findings.push(Finding::error("mesh::syntax", name, message));
    }
    if mesh.triangles.is_empty() && faulty == 0 {
        let message = format!("{} points but no face", mesh.positions.len());
        let help = "an OBJ mesh needs faces: lines that begin with `f`";
        findings.push(Finding::error("mesh::empty", name, message).help(help));
    }
    let all: Option<Vec<[u32; 3]>> = corners
        .iter()
        .map(|c| Some([c[0]?, c[1]?, c[2]?]))
        .collect();
    if let Some(all) = all {
        let at = |i: u32| texture[i as usize];
        mesh.texture = all.into_iter().map(|c| c.map(at)).collect();
    }
    (mesh, findings)
}

fn numbers<'w, const N: usize>(
    mut words: impl Iterator<Item = &'w str>,
) -> Result<[f64; N], String> {
    let mut out = [0.0; N];
    for x in &mut out {
        let word = words
            .next()
            .ok_or_else(|| format!("fewer than {N} numbers"))?;
        *x = match word.parse::<f64>() {
            Ok(x) if x.is_finite() => x,
            _ => return Err(format!("{word:?} is not a finite number")),
        };
    }
    Ok(out)
}

/// `v`, `v/vt`, `v//vn` or `v/vt/vn`; negative numbers count from the end.
fn corner(word: &str, points: usize, textures: usize) -> Result<Corner, String> {
    let mut parts = word.split('/');
    let point = index(parts.next().unwrap_or(""), points, "point")?;
    let texture = match parts.next() {
        None | Some("") => None,
        Some(t) => Some(index(t, textures, "texture coordinate")?),
    };
    Ok((point, texture))
}

fn index(word: &str, count: usize, what: &str) -> Result<u32, String> {
    let given: i64 = word
        .parse()
        .map_err(|_| format!("{word:?} is not the number of a {what}"))?;
    let from_zero = if given < 0 {
        i64::try_from(count).ok().and_then(|n| n.checked_add(given))
    } else {
        given.checked_sub(1)
    };
    from_zero
        .and_then(|i| u32::try_from(i).ok())
        .filter(|i| (*i as usize) < count)
        .ok_or_else(|| format!("there is no {what} {given}: the file has {count} so far"))
}
