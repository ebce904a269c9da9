//! Triangle meshes from OBJ files, and what may be wrong with them.
//!
//! Groups and objects are read as one mesh, so that a body whose parts share
//! points stays closed; polygons are cut into fans; positions keep double
//! precision; texture coordinates keep their own indices, which is what seams
//! need.

mod doctor;
mod parse;

use std::path::Path;

use crate::diagnostic::{Diagnostics, Finding};

/// A triangle mesh as a file has it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ObjMesh {
    /// Positions, in the unit of the file until scaled.
    pub positions: Vec<[f64; 3]>,
    /// Corners of the triangles.
    pub triangles: Vec<[u32; 3]>,
    /// Texture coordinates of the corners; empty when the file has none or not
    /// for every corner.
    pub texture: Vec<[[f64; 2]; 3]>,
    /// Line of the face that each triangle came from, from 1.
    pub lines: Vec<u32>,
}

impl ObjMesh {
    /// Least and greatest corner of the bounding box; zeros without points.
    pub fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        let Some(first) = self.positions.first() else {
            return ([0.0; 3], [0.0; 3]);
        };
        let mut bounds = (*first, *first);
        for p in &self.positions {
            for k in 0..3 {
                bounds.0[k] = bounds.0[k].min(p[k]);
                bounds.1[k] = bounds.1[k].max(p[k]);
            }
        }
        bounds
    }

    /// Multiplies positions by `factor`, for example 0.01 for a file in cm.
    pub fn scale(&mut self, factor: f64) {
        for x in self.positions.iter_mut().flatten() {
            *x *= factor;
        }
    }
}

/// What a mesh is for, which decides what is wrong with it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// A piece of cloth: an open or closed manifold with boundary.
    Cloth,
    /// An obstacle: a closed surface with normals outwards.
    Body,
}

/// A mesh with what is suspicious about it.
#[derive(Clone, Debug)]
pub struct Checked {
    /// The mesh, scaled to metres.
    pub mesh: ObjMesh,
    /// What is suspicious.
    pub warnings: Diagnostics,
}

/// Reads an OBJ file, scales it to metres by `scale` and examines it.
///
/// # Errors
/// All findings, when one of them is an error: the file cannot be read, is
/// empty, has faulty lines, or its mesh cannot serve its purpose.
pub fn read(path: &Path, scale: f64, purpose: Purpose) -> Result<Checked, Diagnostics> {
    let name = path.display().to_string();
    let bytes = std::fs::read(path).map_err(|e| {
        let message = format!("cannot read the mesh: {e}");
        let finding = Finding::error("mesh::unreadable", &name, message);
        Diagnostics::from(finding.help("check the path and its permissions"))
    })?;
    parse(&String::from_utf8_lossy(&bytes), &name, scale, purpose)
}

/// As [`read`], from the text of a file called `name`.
///
/// # Errors
/// As [`read`].
pub fn parse(text: &str, name: &str, scale: f64, purpose: Purpose) -> Result<Checked, Diagnostics> {
    let (mut mesh, mut findings) = parse::parse(text, name);
    if !findings.has_errors() {
        mesh.scale(scale);
        findings.extend(doctor::examine(&mesh, name, purpose));
    }
    if findings.has_errors() {
        return Err(findings);
    }
    Ok(Checked {
        mesh,
        warnings: findings,
    })
}
