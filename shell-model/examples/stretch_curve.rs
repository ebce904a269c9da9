//! Force against stretch of a strip cut along the warp, the weft and the bias,
//! next to the moduli that a laboratory would measure on it.

use selvedge_energy::{DofLayout, EvalPoint};
use selvedge_shell_model::{
    BendingRigidity, DampingKind, Fabric, MembraneModuli, ShellMesh, membrane_term,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (warp, weft, bias, poisson) = (2000.0, 1300.0, 150.0, 0.2); // N/m
    let fabric = Fabric::new(
        "poplin",
        0.12,
        MembraneModuli::from_moduli(warp, weft, bias, poisson)?,
        BendingRigidity::isotropic(5e-6)?,
    )?;
    let fabrics = [fabric];
    println!("angle  measured N/m  at strain 1e-4  at strain 0.1");
    for (angle, modulus) in [(0.0, warp), (45.0, bias), (90.0, weft)] {
        // A unit square of cloth cut at this angle: one triangle carries the
        // strain of all.
        let (s, c) = f64::to_radians(angle).sin_cos();
        let cut = [[0.0, 0.0], [c, s], [-s, c]];
        let mesh = ShellMesh::new(3, vec![[0, 1, 2]], vec![cut], vec![0])?;
        let membrane = membrane_term(&mesh, &fabrics, DampingKind::Off)?;
        // Force per width [N/m] with the sides free to move: relax the lateral
        // displacement of point 2 by Newton's method on its two unknowns.
        let force = |stretch: f64| {
            let mut q = vec![0.0, 0.0, 0.0, stretch, 0.0, 0.0, 0.0, 1.0, 0.0];
            let (mut g, mut h) = ([0.0; 9], [0.0; 81]);
            for _ in 0..30 {
                let layout = DofLayout::points(3);
                let at = EvalPoint {
                    layout,
                    q: &q,
                    q_start: &q,
                    dt: 1.0,
                };
                let curvature = selvedge_energy::Curvature::Projected;
                membrane.hessians(&at, curvature, 0..1, &mut g, &mut h);
                let (a, b, d) = (h[60], h[61], h[70]);
                let det = a * d - b * b;
                q[6] -= (d * g[6] - b * g[7]) / det;
                q[7] -= (a * g[7] - b * g[6]) / det;
            }
            g[3] / 0.5 // the triangle is half the square
        };
        let (small, large) = (force(1.0001) / 1e-4, force(1.1) / 0.1);
        println!("{angle:5.0}  {modulus:12.1}  {small:14.1}  {large:13.1}");
        assert!((small / modulus - 1.0).abs() < 1e-3);
        assert!(large > small, "the material stiffens with stretch");
    }
    Ok(())
}
