//! Energies under rotations of space and of the grain.

use selvedge_energy::{Curvature, DofLayout, EvalPoint};
use selvedge_shell_model::fabric::{BendingRigidity, Fabric, MembraneModuli};
use selvedge_shell_model::{
    BendingOptions, DampingKind, ShellMesh, bending_term, membrane_term, sheet,
};

use crate::case::{ALONE, Case, Expected, Figures, Pace, below};
use crate::sim::{cross, norm};
use crate::{Bench, HardError};

pub static CASES: [Case; 2] = [
    Case {
        number: 3,
        name: "rigid-rotation",
        setup: "crumpled patch whose velocities are a rotation, bending dissipation 0.1 s",
        naive: "internal friction brakes rigid motion",
        bounds: &[below("dissipative force", "1", 1e-11)],
        pace: Pace::Quick,
        axes: ALONE,
        expected: Expected::Passes,
        run: rigid_rotation,
    },
    Case {
        number: 44,
        name: "rotated-grain",
        setup: "anisotropic patch turned in space; grain turned by 90° with warp and weft swapped",
        naive: "warp and weft mixed up",
        bounds: &[
            below("energy change, turned", "1", 1e-12),
            below("energy change, swapped", "1", 1e-12),
        ],
        pace: Pace::Quick,
        axes: ALONE,
        expected: Expected::Passes,
        run: rotated_grain,
    },
];

fn fabric(warp: f64, weft: f64, bends: [f64; 3]) -> Result<Fabric, HardError> {
    let membrane = MembraneModuli::direct(warp, weft, 50.0, 100.0)?;
    let [u, v, d] = bends;
    let mut fabric = Fabric::new("f", 0.2, membrane, BendingRigidity::new(u, v, d)?)?;
    fabric.bending_damping = 0.1;
    Ok(fabric)
}

/// A wavy patch, `n × n` cells of 2 cm.
fn wavy(n: usize) -> Result<(ShellMesh, Vec<f64>), HardError> {
    let size = 0.02 * n as f64;
    let patch = sheet::equilateral(n, n, [size, size])?;
    let q = patch.positions(|[u, v]| {
        [
            1.01 * u,
            0.004 * (40.0 * u).sin() + 0.003 * (70.0 * v + 1.0).cos(),
            0.98 * v,
        ]
    });
    Ok((patch.mesh, q))
}

fn rigid_rotation(_: &Bench) -> Result<Figures, HardError> {
    let (mesh, q) = wavy(6)?;
    let fabrics = [fabric(2000.0, 1500.0, [2e-5, 1.5e-5, 1e-5])?];
    let terms = [
        membrane_term(&mesh, &fabrics, DampingKind::Rate)?,
        bending_term(&mesh, &fabrics, &BendingOptions::default())?,
    ];
    let dt = 1e-3;
    let spin = [3.0, -2.0, 5.0];
    let force = |velocity: &dyn Fn(usize, [f64; 3]) -> [f64; 3]| -> f64 {
        let points = q.as_chunks::<3>().0.iter().enumerate();
        let start: Vec<f64> = points
            .flat_map(|(i, p)| {
                let v = velocity(i, *p);
                [0, 1, 2].map(|k| p[k] - dt * v[k])
            })
            .collect();
        let mut worst = 0.0_f64;
        for term in &terms {
            let m = term.local_dim();
            let (mut moving, mut still) = (vec![0.0; m], vec![0.0; m]);
            let at = |start| EvalPoint {
                layout: DofLayout::points(q.len() / 3),
                q: &q,
                q_start: start,
                dt,
            };
            for e in 0..term.len() {
                term.gradients(&at(&start), e..e + 1, &mut moving);
                term.gradients(&at(&q), e..e + 1, &mut still);
                for (a, b) in moving.iter().zip(&still) {
                    worst = worst.max((a - b).abs());
                }
            }
        }
        worst
    };
    let rotation = force(&|_, p| cross(spin, p));
    // Velocities of the same size that deform.
    let other = force(&|i, p| {
        let v = norm(cross(spin, p));
        [
            v * (i as f64).sin(),
            v * (3.0 * i as f64).cos(),
            v * (i as f64 * 0.7).sin(),
        ]
    });
    Ok(vec![("dissipative force", rotation / other)])
}

fn rotated_grain(_: &Bench) -> Result<Figures, HardError> {
    let (mesh, q) = wavy(5)?;
    let energy = |mesh: &ShellMesh, q: &[f64], fabric: Fabric| -> Result<f64, HardError> {
        let fabrics = [fabric];
        let at = EvalPoint {
            layout: DofLayout::points(q.len() / 3),
            q,
            q_start: q,
            dt: 1e-3,
        };
        let membrane = membrane_term(mesh, &fabrics, DampingKind::Off)?;
        let bending = bending_term(mesh, &fabrics, &BendingOptions::default())?;
        let mut sum = 0.0;
        for term in [membrane, bending] {
            let m = term.local_dim();
            let (mut g, mut h) = (vec![0.0; m], vec![0.0; m * m]);
            for e in 0..term.len() {
                sum += term.hessians(&at, Curvature::Exact, e..e + 1, &mut g, &mut h);
            }
        }
        Ok(sum)
    };
    let bends = [2e-5, 1.5e-5, 1e-5];
    let plain = energy(&mesh, &q, fabric(2000.0, 1500.0, bends)?)?;
    let (s, c) = 0.7_f64.sin_cos();
    let turned: Vec<f64> = q
        .as_chunks::<3>()
        .0
        .iter()
        .flat_map(|[x, y, z]| [c * x - s * y, s * x + c * y, *z])
        .collect();
    let turned = energy(&mesh, &turned, fabric(2000.0, 1500.0, bends)?)?;
    let grain = mesh.material().iter().map(|t| t.map(|[u, v]| [-v, u]));
    let other = ShellMesh::new(
        mesh.points(),
        mesh.triangles().to_vec(),
        grain.collect(),
        mesh.fabric().to_vec(),
    )?;
    let swapped = energy(&other, &q, fabric(1500.0, 2000.0, [1.5e-5, 2e-5, 1e-5])?)?;
    Ok(vec![
        ("energy change, turned", (turned / plain - 1.0).abs()),
        ("energy change, swapped", (swapped / plain - 1.0).abs()),
    ])
}
