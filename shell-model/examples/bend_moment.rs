//! Bending moment per width of a sheet rolled to a cylinder, against the
//! fabric's flexural rigidity, for three directions of rolling.

use selvedge_energy::{DofLayout, EvalPoint};
use selvedge_shell_model::{
    BendingOptions, BendingRigidity, Fabric, MembraneModuli, bending_term, sheet,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let fabric = Fabric::new(
        "twill",
        0.25,
        MembraneModuli::isotropic(1000.0, 0.2)?,
        BendingRigidity::new(2.0e-5, 1.6e-5, 1.7e-5)?,
    )?;
    let sheet = sheet::equilateral_edge([0.6, 0.6], 0.01)?;
    let quality = sheet.mesh.hinge_quality().ok_or("a sheet has hinges")?;
    println!(
        "hinges carry {:.3} of the continuum's bending",
        quality.mean
    );

    let rigidity = fabric.bending;
    let fabrics = [fabric];
    let bending = bending_term(&sheet.mesh, &fabrics, &BendingOptions::default())?;
    let layout = DofLayout::points(sheet.mesh.points());
    // Energy per area; boundary edges have no hinge, their share is left out.
    let area: f64 = sheet
        .mesh
        .hinges()
        .iter()
        .map(|h| {
            h.triangles
                .iter()
                .map(|t| sheet.mesh.rest_area(*t as usize))
                .sum::<f64>()
                / 3.0
        })
        .sum();
    let density = |angle: f64, curvature: f64| {
        let (s, c) = angle.sin_cos();
        let r = 1.0 / curvature;
        let q = sheet.positions(|[u, v]| {
            let (along, across) = (c * u + s * v, c * v - s * u);
            [r * (along / r).sin(), r * (along / r).cos(), across]
        });
        let at = EvalPoint {
            layout,
            q: &q,
            q_start: &q,
            dt: 1.0,
        };
        bending.value(&at, 0..bending.len()) / area
    };
    println!("angle  B(angle) N·m  M/κ N·m   ratio");
    for degrees in [0.0_f64, 45.0, 90.0] {
        let angle = degrees.to_radians();
        let (kappa, step) = (2.0, 1e-3);
        let moment = (density(angle, kappa + step) - density(angle, kappa - step)) / (2.0 * step);
        let expected = rigidity.rigidity(angle);
        let ratio = moment / kappa / expected;
        println!(
            "{degrees:5.0}  {expected:.3e}     {:.3e}  {ratio:.3}",
            moment / kappa
        );
        assert!((ratio - 1.0).abs() < 0.08, "{ratio}");
    }
    Ok(())
}
