use std::collections::BTreeMap;

use crate::diagnostic::{Diagnostics, Finding};

use super::{ObjMesh, Purpose};
use crate::file::suggest::show;

/// Height over longest edge below which a triangle counts as degenerate.
const FLAT: f64 = 1e-4;

/// What is wrong with a mesh whose positions are in metres.
pub(super) fn examine(mesh: &ObjMesh, name: &str, purpose: Purpose) -> Diagnostics {
    let mut out = Diagnostics::new();
    size(mesh, name, purpose, &mut out);
    degenerate(mesh, name, purpose, &mut out);
    let edges = Edges::new(mesh);
    edges.manifold(name, purpose, &mut out);
    edges.orientation(mesh, name, purpose, &mut out);
    loose(mesh, name, purpose, &mut out);
    out
}

fn size(mesh: &ObjMesh, name: &str, purpose: Purpose, out: &mut Diagnostics) {
    let (min, max) = mesh.bounds();
    let extent = (0..3).map(|k| max[k] - min[k]).fold(0.0, f64::max);
    // Sizes that are suspicious, and sizes that are impossible.
    let ((low, high), (least, most)) = match purpose {
        // A napkin in cm and a garment at a hundredth are beyond the first.
        Purpose::Cloth => ((0.02, 15.0), (0.002, 120.0)),
        Purpose::Body => ((0.01, 50.0), (0.01, 50.0)),
    };
    if extent > high || extent < low {
        let factor = if extent > 1000.0 {
            0.001
        } else if extent > high {
            0.01
        } else {
            100.0
        };
        let message = format!("the mesh is {} m large", show(extent));
        let help = format!("is it in another unit? `scale = {factor}`, for example");
        let finding = if extent > most || extent < least {
            Finding::error("mesh::scale", name, message)
        } else {
            Finding::warning("mesh::scale", name, message)
        };
        out.push(finding.help(help));
    }
}

fn degenerate(mesh: &ObjMesh, name: &str, purpose: Purpose, out: &mut Diagnostics) {
    let mut flat = Vec::new();
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
        let edge = |p: [f64; 3], q: [f64; 3]| [q[0] - p[0], q[1] - p[1], q[2] - p[2]];
        let (u, v, w) = (edge(a, b), edge(a, c), edge(b, c));
        let longest = [u, v, w].iter().map(|e| length(*e)).fold(0.0, f64::max);
        let area = length(cross(u, v)); // twice
        if area.is_nan() || area <= FLAT * longest * longest {
            flat.push(t);
        }
    }
    let Some(first) = flat.first() else { return };
    let message = format!(
        "{} of {} triangles have no area",
        flat.len(),
        mesh.triangles.len()
    );
    let line = mesh.lines[*first] as usize;
    out.push(match purpose {
        Purpose::Cloth => Finding::error("mesh::degenerate", name, message)
            .line(line)
            .help("remove or collapse them: they have no rest shape"),
        Purpose::Body => Finding::warning("mesh::degenerate", name, message)
            .line(line)
            .help("they are left out"),
    });
}

/// Points that no triangle uses.
fn loose(mesh: &ObjMesh, name: &str, purpose: Purpose, out: &mut Diagnostics) {
    let mut used = vec![false; mesh.positions.len()];
    for i in mesh.triangles.iter().flatten() {
        used[*i as usize] = true;
    }
    let count = used.iter().filter(|u| !**u).count();
    if count > 0 {
        let message = format!("{count} points belong to no triangle");
        out.push(match purpose {
            Purpose::Cloth => Finding::error("mesh::loose-points", name, message)
                .help("remove them: a point without triangles has no mass"),
            Purpose::Body => {
                Finding::warning("mesh::loose-points", name, message).help("they are left out")
            }
        });
    }
}

/// Every edge with the triangles on it: index and whether it runs upwards.
struct Edges<'a> {
    mesh: &'a ObjMesh,
    by_ends: BTreeMap<[u32; 2], Vec<(usize, bool)>>,
}

impl<'a> Edges<'a> {
    fn new(mesh: &'a ObjMesh) -> Self {
        let mut by_ends: BTreeMap<[u32; 2], Vec<(usize, bool)>> = BTreeMap::new();
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            for k in 0..3 {
                let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
                if a != b {
                    let ends = [a.min(b), a.max(b)];
                    by_ends.entry(ends).or_default().push((t, a < b));
                }
            }
        }
        Self { mesh, by_ends }
    }

    fn line(&self, triangle: usize) -> usize {
        self.mesh.lines[triangle] as usize
    }

    fn manifold(&self, name: &str, purpose: Purpose, out: &mut Diagnostics) {
        let crowded: Vec<_> = self.by_ends.values().filter(|t| t.len() > 2).collect();
        if let Some(first) = crowded.first() {
            let message = format!(
                "{} edges have more than two triangles, the first of them {}",
                crowded.len(),
                first.len()
            );
            let finding = Finding::error("mesh::non-manifold", name, message);
            out.push(
                finding
                    .line(self.line(first[2].0))
                    .help("remove doubled faces, or split the points along such edges"),
            );
        }
        let open: Vec<_> = self.by_ends.values().filter(|t| t.len() == 1).collect();
        if purpose == Purpose::Body
            && let Some(first) = open.first()
        {
            let message = format!(
                "the surface is open: {} edges have one triangle",
                open.len()
            );
            let help = "close the holes: an open surface has no inside";
            let finding = Finding::error("mesh::open", name, message);
            out.push(finding.line(self.line(first[0].0)).help(help));
        }
    }

    fn orientation(&self, mesh: &ObjMesh, name: &str, purpose: Purpose, out: &mut Diagnostics) {
        let pairs = self.by_ends.values().filter(|t| t.len() == 2);
        let clashing: Vec<_> = pairs.filter(|t| t[0].1 == t[1].1).collect();
        if let Some(first) = clashing.first() {
            let message = format!(
                "neighbours face opposite ways across {} edges",
                clashing.len()
            );
            let help = "turn the faces the same way round (\"recalculate normals\")";
            let finding = Finding::error("mesh::orientation", name, message);
            out.push(finding.line(self.line(first[1].0)).help(help));
            return;
        }
        let closed = self.by_ends.values().all(|t| t.len() == 2);
        if purpose == Purpose::Body && closed && volume(mesh) < 0.0 {
            let message = "the surface is inside out: its normals point inwards";
            let finding = Finding::error("mesh::inside-out", name, message);
            out.push(finding.help("flip all faces"));
        }
    }
}

/// Enclosed volume [m³], positive when normals point outwards.
fn volume(mesh: &ObjMesh) -> f64 {
    let origin = mesh.positions[mesh.triangles[0][0] as usize];
    let from = |i: u32| {
        let p = mesh.positions[i as usize];
        [p[0] - origin[0], p[1] - origin[1], p[2] - origin[2]]
    };
    let six_times: f64 = mesh
        .triangles
        .iter()
        .map(|t| {
            let (a, n) = (from(t[0]), cross(from(t[1]), from(t[2])));
            a[0] * n[0] + a[1] * n[1] + a[2] * n[2]
        })
        .sum();
    six_times / 6.0
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

fn length(v: [f64; 3]) -> f64 {
    v[0].hypot(v[1]).hypot(v[2])
}
