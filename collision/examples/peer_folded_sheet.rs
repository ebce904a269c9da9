//! Contact pairs and curvatures of a folded sheet of 170,528 triangles, timed
//! on the mesh that `benches/peers/ipc_toolkit.py` reads.
//!
//! ```sh
//! RAYON_NUM_THREADS=1 taskset -c 0 cargo run --release -p selvedge-collision \
//!     --example peer_folded_sheet -- /tmp/folded
//! ```
//! writes `positions.f64` and `triangles.u32` (little endian) into the folder.

use std::path::Path;

use selvedge_collision::{
    CollisionMesh, ContactQuadratic, ContactResponse, ContactSet, ContactSource, SelfContact,
    SelfContactSettings, StepStart,
};
use selvedge_energy::{DofLayout, EvalPoint};

/// Cells along a side: 2 · 292² triangles.
const CELLS: usize = 292;
/// Side of the sheet [m].
const SIDE: f64 = 1.0;
/// Distance of the two layers [m].
const GAP: f64 = 0.9e-3;
/// Distance below which pairs are in contact [m].
const THICKNESS: f64 = 1.2e-3;

type Sheet = (Vec<f64>, Vec<f64>, Vec<[u32; 3]>);

/// A square sheet folded over its middle, slightly wavy: rest positions,
/// positions, triangles. The layers are sheared against each other, so that
/// their edges are not parallel.
fn folded() -> Sheet {
    let n = CELLS;
    let (mut rest, mut q, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
    let radius = 0.5 * GAP;
    let arc = std::f64::consts::PI * radius;
    for j in 0..=n {
        for i in 0..=n {
            let (u, v) = (SIDE * i as f64 / n as f64, SIDE * j as f64 / n as f64);
            rest.extend([u, v, 0.0]);
            let s = u - 0.5 * (SIDE - arc);
            let (x, z) = if s < 0.0 {
                (s, -radius)
            } else if s < arc {
                let a = s / radius;
                (radius * a.sin(), -radius * a.cos())
            } else {
                (arc - s, radius)
            };
            let y = v + 0.05 * s.max(0.0);
            let wave = 4e-3 * (31.0 * y).sin() * (23.0 * x).cos();
            q.extend([x, y, z + wave]);
        }
    }
    let at = |i: usize, j: usize| (j * (n + 1) + i) as u32;
    for j in 0..n {
        for i in 0..n {
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    (rest, q, triangles)
}

fn write(folder: &Path, q: &[f64], triangles: &[[u32; 3]]) -> std::io::Result<()> {
    std::fs::create_dir_all(folder)?;
    let q: Vec<u8> = q.iter().flat_map(|x| x.to_le_bytes()).collect();
    std::fs::write(folder.join("positions.f64"), q)?;
    let t = triangles.as_flattened();
    let t: Vec<u8> = t.iter().flat_map(|i| i.to_le_bytes()).collect();
    std::fs::write(folder.join("triangles.u32"), t)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (rest, q, triangles) = folded();
    if let Some(folder) = std::env::args().nth(1) {
        write(Path::new(&folder), &q, &triangles)?;
    }
    let points = q.len() / 3;
    let mesh = CollisionMesh::from_positions(&rest, triangles, &[], THICKNESS)?;
    // nothing moves: pairs within the thickness, no more
    let settings = SelfContactSettings {
        margin: 0.0,
        overshoot: 0.0,
        skin: 0.0,
        release: 0.0,
    };
    let potential = ContactQuadratic {
        thickness: THICKNESS,
        ..ContactQuadratic::cloth()
    };
    let mut contact = SelfContact::new(mesh)
        .with_potential(Box::new(potential))
        .with_settings(settings)?;
    let at = EvalPoint {
        layout: DofLayout::points(points),
        q: &q,
        q_start: &q,
        dt: 1e-3,
    };
    let step = StepStart {
        q_start: &q,
        q_predicted: &q,
        dt: 1e-3,
        time: 0.0,
    };
    let (mut set, mut response) = (ContactSet::default(), ContactResponse::default());
    let start = processor_seconds();
    contact.detect(&step)?;
    let candidates = processor_seconds();
    contact.contacts(&at, &mut set);
    let pairs = processor_seconds();
    let energy = contact.evaluate(&at, true, &mut response)?;
    let end = processor_seconds();
    println!(
        "processor s: candidates {:.3}, with the contact set {:.3}; energy, forces and \
         curvatures {:.3} ({energy:.3} J)",
        candidates - start,
        pairs - start,
        end - pairs
    );
    let c = contact.pairs();
    println!(
        "{points} points: {} vertex-triangle and {} edge-edge candidates, {} contacts, \
         {} curvatures after merging",
        c.vertex_triangle.len(),
        c.edge_edge.len(),
        set.len(),
        response.curvature.len()
    );
    assert_eq!(contact.active(), set.len());
    Ok(())
}

/// Time on a core of all threads of this process; NaN where it is not known.
fn processor_seconds() -> f64 {
    let Ok(tasks) = std::fs::read_dir("/proc/self/task") else {
        return f64::NAN;
    };
    let nanoseconds = |task: std::fs::DirEntry| {
        let text = std::fs::read_to_string(task.path().join("schedstat")).ok()?;
        text.split(' ').next()?.parse::<f64>().ok()
    };
    tasks.flatten().filter_map(nanoseconds).sum::<f64>() * 1e-9
}
