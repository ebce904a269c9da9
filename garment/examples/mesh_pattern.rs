//! Reads a sewing pattern, examines and meshes it, and closes it around a
//! body. Prints numbers and checks them.
//!
//! `cargo run --example mesh_pattern [-- PATTERN.json [EDGE_LENGTH]]`

use selvedge_garment::{AssembleSettings, GarmentMesh, MeshSettings, Pattern, preassemble};

/// A plain torso: a vertical capsule of 12 cm radius.
fn torso(p: [f64; 3]) -> (f64, [f64; 3]) {
    let y = p[1].clamp(0.8, 1.3);
    let d = [p[0], p[1] - y, p[2]];
    let l = d.iter().map(|x| x * x).sum::<f64>().sqrt().max(1e-12);
    (l - 0.12, d.map(|x| x / l))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let default = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../scenes/patterns/tshirt.json"
    );
    let path = args.next().unwrap_or_else(|| default.to_owned());
    let edge_length = args.next().map_or(Ok(0.01), |s| s.parse())?;

    let pattern = Pattern::from_json(&std::fs::read(&path)?)?;
    println!(
        "{path}: {} panels, {} stitches",
        pattern.panels.len(),
        pattern.stitches.len()
    );
    for f in selvedge_garment::pattern::examine(&pattern) {
        println!("  {:?}: {} ({})", f.severity, f.message, f.help);
    }

    let settings = MeshSettings {
        edge_length,
        ..MeshSettings::default()
    };
    let mesh = GarmentMesh::build(&pattern, &settings)?;
    let s = &mesh.stats;
    println!(
        "{} points, {} triangles, {:.4} m²",
        s.points, s.triangles, s.area
    );
    println!(
        "smallest angle {:.1}° (mean {:.1}°), edges {:.1} to {:.1} mm",
        s.min_angle_degrees,
        s.min_angle_mean_degrees,
        1e3 * s.edge_min,
        1e3 * s.edge_max
    );
    println!(
        "seam gaps: mean {:.1} cm, largest {:.1} cm",
        100.0 * s.seam_gap_mean,
        100.0 * s.seam_gap_max
    );
    let panels: f64 = mesh.panels.iter().map(|p| p.area).sum();
    assert!((s.area / panels - 1.0).abs() < 1e-9);
    assert_eq!(s.flipped_edges, 0);

    let (positions, report) = preassemble(&mesh, &torso, &AssembleSettings::default());
    println!(
        "assembled: stretch up to {:.1} %, half of the edges within {:.2} %, {} points inside",
        100.0 * report.stretch_max,
        100.0 * report.strain_percentiles[0],
        report.points_inside
    );
    assert_eq!(positions.len(), s.points);
    assert_eq!(report.points_inside, 0);
    Ok(())
}
