//! Bending moment per width of cloth rolled to a cylinder, against the
//! fabric's flexural rigidity, for three directions of rolling.
//!
//! Hinges sample an anisotropic rigidity in the directions of their edges, and
//! a lattice of equilateral triangles has only three: the mean over meshes
//! turned against the warp is what the calibration promises.

use selvedge_energy::{DofLayout, EvalPoint};
use selvedge_shell_model::{
    BendingOptions, BendingRigidity, Fabric, MembraneModuli, ShellMesh, bending_term, sheet,
};

const MESHES: usize = 6;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let rigidity = BendingRigidity::new(2.0e-5, 1.6e-5, 1.7e-5)?;
    let fabrics = [Fabric::new(
        "twill",
        0.25,
        MembraneModuli::isotropic(1000.0, 0.2)?,
        rigidity,
    )?];
    let sheet = sheet::equilateral_edge([0.6, 0.6], 0.01)?;
    let quality = sheet.mesh.hinge_quality().ok_or("a sheet has hinges")?;
    println!(
        "hinges carry {:.3} of the continuum's bending",
        quality.mean
    );

    let layout = DofLayout::points(sheet.mesh.points());
    // Boundary edges have no hinge: their share of the area is left out.
    let pair =
        |t: &[u32; 2]| sheet.mesh.rest_area(t[0] as usize) + sheet.mesh.rest_area(t[1] as usize);
    let area: f64 = sheet
        .mesh
        .hinges()
        .iter()
        .map(|h| pair(&h.triangles) / 3.0)
        .sum();

    let mut ratios = [[0.0; MESHES]; 3];
    for mesh_index in 0..MESHES {
        // The lattice repeats every 60 degrees.
        let (s, c) = (mesh_index as f64 * 10.0_f64.to_radians()).sin_cos();
        let turn = |[u, v]: [f64; 2]| [c * u - s * v, s * u + c * v];
        let mesh = ShellMesh::new(
            sheet.mesh.points(),
            sheet.mesh.triangles().to_vec(),
            sheet.mesh.material().iter().map(|t| t.map(turn)).collect(),
            sheet.mesh.fabric().to_vec(),
        )?;
        let bending = bending_term(&mesh, &fabrics, &BendingOptions::default())?;
        for (row, degrees) in ratios.iter_mut().zip([0.0_f64, 45.0, 90.0]) {
            let (s, c) = degrees.to_radians().sin_cos();
            let density = |curvature: f64| {
                let q = sheet.positions(|p| {
                    let [u, v] = turn(p);
                    let (along, across) = (curvature * (c * u + s * v), c * v - s * u);
                    [along.sin() / curvature, along.cos() / curvature, across]
                });
                let at = EvalPoint {
                    layout,
                    q: &q,
                    q_start: &q,
                    dt: 1.0,
                };
                bending.value(&at, 0..bending.len()) / area
            };
            let (kappa, step) = (2.0, 1e-3);
            let moment = (density(kappa + step) - density(kappa - step)) / (2.0 * step);
            row[mesh_index] = moment / kappa / rigidity.rigidity(degrees.to_radians());
        }
    }
    println!("rolled at  B N·m      M/(κ B): mean  lowest  highest mesh");
    for (row, degrees) in ratios.iter().zip([0.0_f64, 45.0, 90.0]) {
        let mean = row.iter().sum::<f64>() / MESHES as f64;
        let (low, high) = row
            .iter()
            .fold((f64::INFINITY, 0.0_f64), |(a, b), r| (a.min(*r), b.max(*r)));
        let b = rigidity.rigidity(degrees.to_radians());
        println!("{degrees:6.0}°    {b:.2e}            {mean:.3}   {low:.3}   {high:.3}");
        assert!(
            (mean - 1.0).abs() < 0.02,
            "the mean carries the fabric's law: {mean}"
        );
    }
    Ok(())
}
