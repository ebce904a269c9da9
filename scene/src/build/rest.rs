//! Rest coordinates of cloth from mesh files.

use crate::file::model::MeshRest;
use crate::file::obj::ObjMesh;

/// Ratios of rest lengths to the shape's within which texture coordinates are
/// taken for material ones.
const ALIKE: std::ops::RangeInclusive<f64> = 0.8..=1.25;

/// Flat coordinates of the corners of a triangle.
type Flat = [[f64; 2]; 3];

/// Material coordinates of all corners [m]. `scale` is the factor to metres
/// that the positions have been multiplied by already.
///
/// # Errors
/// The line of a face, if one is to blame, and what is wrong.
pub(super) fn coordinates(
    mesh: &ObjMesh,
    scale: f64,
    rest: MeshRest,
) -> Result<Vec<Flat>, (Option<u32>, String)> {
    let shape = || {
        let corners = mesh.triangles.iter().map(|t| corners(mesh, t));
        corners.map(|x| flatten(&x)).collect()
    };
    let scaled = || -> Vec<Flat> {
        let texture = mesh.texture.iter();
        texture.map(|t| t.map(|c| c.map(|x| scale * x))).collect()
    };
    match rest {
        MeshRest::Shape => Ok(shape()),
        MeshRest::Auto if is_material(mesh, scale) => Ok(scaled()),
        MeshRest::Auto => Ok(shape()),
        MeshRest::Texture if mesh.texture.is_empty() => {
            let message = "not every corner of the mesh has texture coordinates";
            Err((None, message.to_owned()))
        }
        MeshRest::Texture => match mesh.texture.iter().position(|t| !is_upright(t)) {
            None => Ok(scaled()),
            Some(t) => {
                let message = "texture coordinates have no area or run clockwise: no rest shape";
                Err((mesh.lines.get(t).copied(), message.to_owned()))
            }
        },
    }
}

/// Whether texture coordinates can be lengths of the cloth at rest.
fn is_material(mesh: &ObjMesh, scale: f64) -> bool {
    let alike = |(t, m): (&[u32; 3], &[[f64; 2]; 3])| {
        let x = corners(mesh, t);
        is_upright(m)
            && (0..3).all(|k| {
                let j = (k + 1) % 3;
                let rest = scale * (m[k][0] - m[j][0]).hypot(m[k][1] - m[j][1]);
                let now = (0..3).map(|i| (x[k][i] - x[j][i]).powi(2)).sum::<f64>();
                ALIKE.contains(&(rest / now.sqrt()))
            })
    };
    !mesh.texture.is_empty() && mesh.triangles.iter().zip(&mesh.texture).all(alike)
}

/// Whether a triangle has area and runs counter-clockwise.
fn is_upright(m: &[[f64; 2]; 3]) -> bool {
    let (a, b) = (
        [m[1][0] - m[0][0], m[1][1] - m[0][1]],
        [m[2][0] - m[0][0], m[2][1] - m[0][1]],
    );
    let longest = a[0].hypot(a[1]).max(b[0].hypot(b[1]));
    a[0] * b[1] - a[1] * b[0] > 1e-6 * longest * longest
}

fn corners(mesh: &ObjMesh, t: &[u32; 3]) -> [[f64; 3]; 3] {
    t.map(|p| mesh.positions[p as usize])
}

/// A triangle laid into its own plane; warp along the first edge's direction
/// projected on the world's x axis where that is possible.
fn flatten(x: &[[f64; 3]; 3]) -> Flat {
    let sub = |a: [f64; 3], b: [f64; 3]| -> [f64; 3] { std::array::from_fn(|i| a[i] - b[i]) };
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    };
    let unit = |a: [f64; 3]| {
        let l = dot(a, a).sqrt();
        a.map(|v| if l > 0.0 { v / l } else { 0.0 })
    };
    let (e1, e2) = (sub(x[1], x[0]), sub(x[2], x[0]));
    let n = unit(cross(e1, e2));
    let along: [f64; 3] = std::array::from_fn(|i| f64::from(i == 0) - n[0] * n[i]);
    let u = if dot(along, along) > 1e-6 {
        unit(along)
    } else {
        unit(e1)
    };
    let v = cross(n, u);
    [[0.0; 2], [dot(e1, u), dot(e1, v)], [dot(e2, u), dot(e2, v)]]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square of two triangles, 10 % larger than its texture coordinates.
    fn square() -> ObjMesh {
        let at = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let triangles = vec![[0, 1, 2], [0, 2, 3]];
        ObjMesh {
            positions: at.map(|[u, v]| [1.1 * u, 0.0, -1.1 * v]).to_vec(),
            texture: triangles
                .iter()
                .map(|t: &[u32; 3]| t.map(|p| at[p as usize]))
                .collect(),
            triangles,
            lines: vec![5, 6],
        }
    }

    /// Texture coordinates in the size of the shape are its rest; others only
    /// if asked for, and not when they cannot be a rest shape.
    #[test]
    fn texture_at_rest() {
        let mesh = square();
        let shape = coordinates(&mesh, 1.0, MeshRest::Shape).unwrap();
        assert!((shape[0][1][0] - 1.1).abs() < 1e-12);
        assert_eq!(
            coordinates(&mesh, 1.0, MeshRest::Auto).unwrap(),
            mesh.texture
        );
        // In cm: positions have been scaled, texture coordinates follow.
        let mut small = square();
        small.scale(0.01);
        let found = coordinates(&small, 0.01, MeshRest::Auto).unwrap();
        assert!((found[0][1][0] - 0.01).abs() < 1e-15);
        // A picture of unit size on a small cloth.
        let found = coordinates(&small, 1.0, MeshRest::Auto).unwrap();
        assert!((found[0][1][0] - 0.011).abs() < 1e-12);
        let found = coordinates(&small, 1.0, MeshRest::Texture).unwrap();
        assert_eq!(found, mesh.texture);

        let mut turned = square();
        turned.texture[1].swap(0, 1);
        assert_eq!(coordinates(&turned, 1.0, MeshRest::Auto).unwrap(), shape);
        let error = coordinates(&turned, 1.0, MeshRest::Texture).unwrap_err();
        assert_eq!(error.0, Some(6));
        turned.texture.clear();
        assert_eq!(coordinates(&turned, 1.0, MeshRest::Auto).unwrap(), shape);
        assert!(coordinates(&turned, 1.0, MeshRest::Texture).is_err());
    }
}
