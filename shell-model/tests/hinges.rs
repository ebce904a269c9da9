//! Hinges at the edge: through ±π, collapsed wings, rotated material, and
//! against automatic differentiation.

mod common;

use std::f64::consts::PI;

use common::{Random, at, close, evaluate, fabric};
use nalgebra::SVector;
use num_dual::{DualNum, hessian};
use selvedge_energy::{Batch, Curvature, EvalPoint, StencilEnergy};
use selvedge_shell_model::{
    BendingHinge, BendingOptions, Fabric, HingeRest, IncrementalDamping, PlainAngle, RateDamping,
    ShellMesh, TangentAngle, Undamped, bending_term, hinge_rest, membrane_term, shape, sheet,
};

fn folded(theta: f64) -> Vec<f64> {
    let (s, c) = theta.sin_cos();
    // Wing 2 of height 8 mm turned about the edge along x.
    vec![
        0.0,
        0.0,
        0.0,
        0.01,
        0.0,
        0.0,
        0.004,
        0.009,
        0.0,
        0.0055,
        -0.008 * c,
        -0.008 * s,
    ]
}

fn rest(stiffness: f64, angle: f64) -> HingeRest {
    let heights = [0.009, 0.008];
    HingeRest {
        points: [0, 1, 2, 3],
        stiffness,
        angle,
        length: 0.01,
        heights,
        damping: 0.1,
    }
}

/// Swept through ±π twice around, the angle is continued: energy and force are
/// continuous, and a checkpoint in between continues the same way.
#[test]
fn unwraps() {
    let mut energy = BendingHinge::<Undamped>::new(&[rest(2.0, 0.0)]);
    let mut resumed = None;
    let n = 1000;
    for i in 0..=n {
        let theta = 4.0 * PI * f64::from(i) / f64::from(n);
        let q = folded(theta);
        let at = at(&q, &q, 1e-3);
        let q: [f64; 12] = q[..].try_into().unwrap();
        let mut g = [0.0; 12];
        let value = energy.gradient(0, &q, &at, &mut g);
        assert!(
            (value - theta * theta).abs() < 1e-12 * (1.0 + theta * theta),
            "{theta}"
        );
        // The moment over wing 2's height acts at its corner.
        let force = (g[9].powi(2) + g[10].powi(2) + g[11].powi(2)).sqrt();
        assert!(
            (force - 2.0 * theta / 0.008).abs() < 1e-8,
            "{theta}: {force}"
        );
        energy.commit(&at);
        if i == 600 {
            let mut other = BendingHinge::<Undamped>::new(&[rest(2.0, 0.0)]);
            other.restore_history(energy.history());
            resumed = Some(other);
        }
        if let Some(other) = &mut resumed {
            assert_eq!(
                other.value(0, &q, &at).to_bits(),
                energy.value(0, &q, &at).to_bits()
            );
            other.commit(&at);
        }
    }
    assert!((energy.history()[0] - 4.0 * PI).abs() < 1e-12);
}

/// Just short of folded over, the force opens the hinge on either side of π
/// as long as the history says on which side it came.
#[test]
fn folded_over() {
    for side in [1.0, -1.0] {
        let mut energy = BendingHinge::<Undamped>::new(&[rest(1.0, 0.0)]);
        let mut forces = Vec::new();
        for theta in [side * (PI - 1e-3), side * (PI - 1e-6), side * (PI + 1e-6)] {
            let q = folded(theta);
            let at = at(&q, &q, 1e-3);
            energy.commit(&at);
            let q: [f64; 12] = q[..].try_into().unwrap();
            let mut g = [0.0; 12];
            energy.gradient(0, &q, &at, &mut g);
            forces.push(g[11]);
        }
        assert!(forces.iter().all(|f| f.signum() == forces[0].signum()));
        assert!((forces[2] - forces[1]).abs() < 1e-4 * forces[1].abs());
    }
    // The tangent law has no side to change to.
    let q = folded(PI - 1e-6);
    let tangent = BendingHinge::<Undamped, TangentAngle>::new(&[rest(1.0, 0.0)]);
    let value = tangent.value(0, q[..].try_into().unwrap(), &at(&q, &q, 1e-3));
    assert!((value / 8e12 - 1.0).abs() < 1e-3, "{value:e}");
}

/// A wing that closes to nothing, by steps or within one: force bounded by
/// `k π/(0.02 η̄)`, all finite, and back to full stiffness when it opens.
#[test]
fn collapsing_wing() {
    let k = 1e-5;
    let mut energy = BendingHinge::<RateDamping>::new(&[rest(k, 0.0)]);
    let bound = k * PI / (0.02 * 0.008);
    let squashed = |factor: f64, theta: f64| {
        let mut q = folded(theta);
        q[10] *= factor;
        q[11] *= factor;
        q
    };
    for lagged in [true, false] {
        for exponent in 0..60 {
            let q = squashed(10_f64.powf(-0.2 * f64::from(exponent)), 2.0);
            let at = at(&q, &q, 1e-3);
            let whole = folded(2.0);
            energy.begin_step(&if lagged {
                at
            } else {
                self::at(&q, &whole, 1e-3)
            });
            let local: [f64; 12] = q[..].try_into().unwrap();
            let (mut g, mut h) = ([0.0; 12], [[0.0; 12]; 12]);
            for curvature in [
                Curvature::Exact,
                Curvature::Projected,
                Curvature::GaussNewton,
            ] {
                energy.hessian(0, &local, &at, curvature, &mut g, &mut h);
                let force = (g[9].powi(2) + g[10].powi(2) + g[11].powi(2)).sqrt();
                assert!(force <= bound, "{exponent}: {force:e} over {bound:e}");
                assert!(h.iter().flatten().all(|x| x.is_finite()));
            }
        }
    }
    for exact in [[0.0; 12], {
        // Edge, then a wing, of exactly no size.
        let mut q: [f64; 12] = folded(1.0)[..].try_into().unwrap();
        q[3] = 0.0;
        q
    }] {
        let mut energy = BendingHinge::<RateDamping>::new(&[HingeRest {
            length: 0.0,
            heights: [0.0; 2],
            ..rest(k, 0.0)
        }]);
        let at = at(&exact, &exact, 1e-3);
        energy.begin_step(&at);
        let (mut g, mut h) = ([1.0; 12], [[1.0; 12]; 12]);
        assert_eq!(
            energy.hessian(0, &exact, &at, Curvature::Exact, &mut g, &mut h),
            0.0
        );
        assert!(g.iter().chain(h.iter().flatten()).all(|x| *x == 0.0));
    }
    let whole = folded(2.0);
    let at = at(&whole, &whole, 1e-3);
    energy.begin_step(&at);
    let value = energy.value(0, whole[..].try_into().unwrap(), &at);
    assert!((value / (0.5 * k * 4.0) - 1.0).abs() < 1e-12);
}

fn dual_energy<D: DualNum<Primitive = f64> + Copy>(q: SVector<D, 12>, k: f64, rest: f64) -> D {
    let x = |i: usize| [q[3 * i], q[3 * i + 1], q[3 * i + 2]];
    let sub = |a: [D; 3], b: [D; 3]| [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    let cross = |a: [D; 3], b: [D; 3]| {
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    };
    let dot = |a: [D; 3], b: [D; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let e = sub(x(1), x(0));
    let (n1, n2) = (cross(e, sub(x(2), x(0))), cross(sub(x(3), x(0)), e));
    let sine = dot(cross(n1, n2), e) / dot(e, e).sqrt();
    let theta = sine.atan2(dot(n1, n2));
    (theta - rest).powi(2) * (0.5 * k)
}

/// The closed form against automatic differentiation of the definition.
#[test]
fn automatic_differentiation() {
    let mut random = Random(3);
    for _ in 0..50 {
        let q: [f64; 12] = std::array::from_fn(|_| random.next());
        let raw = HingeRest {
            length: 0.0,
            heights: [0.0; 2],
            ..rest(1.7, 0.2)
        };
        let batch = Batch::<_, 4, 12>::new("", BendingHinge::<Undamped, PlainAngle>::new(&[raw]));
        // Away from the cut of the arc tangent both agree on the branch.
        let angle = angle_of(&q);
        if (angle - 0.2).abs() > 3.0 {
            continue;
        }
        let (value, g, h) = evaluate(&batch, &at(&q, &q, 1e-3), Curvature::Exact, 0);
        let (f, df, d2f) = hessian(
            |q| dual_energy(q, 1.7, 0.2),
            &SVector::<f64, 12>::from_row_slice(&q),
        );
        close("value", &[value], &[f], 1e-12);
        close("gradient", &g, df.as_slice(), 1e-9);
        close("hessian", &h, d2f.as_slice(), 1e-9);
    }
}

fn angle_of(q: &[f64; 12]) -> f64 {
    let material = |a, b, c| [a, b, c];
    let mesh = ShellMesh::new(
        4,
        vec![[0, 1, 2], [1, 0, 3]],
        vec![
            material([0.0, 0.0], [1.0, 0.0], [0.5, 1.0]),
            material([1.0, 0.0], [0.0, 0.0], [0.5, -1.0]),
        ],
        vec![0, 0],
    )
    .unwrap();
    shape::hinge_angles(&mesh, q)[0]
}

/// Turning material axes and fabric together changes nothing: a sheet cut at
/// 90° from a fabric with warp and weft exchanged.
#[test]
fn exchanging_warp_and_weft() {
    let sheet = sheet::equilateral(5, 5, [0.05, 0.045]).unwrap();
    let mesh = &sheet.mesh;
    let turned = ShellMesh::new(
        mesh.points(),
        mesh.triangles().to_vec(),
        mesh.material()
            .iter()
            .map(|t| t.map(|[u, v]| [-v, u]))
            .collect(),
        mesh.fabric().to_vec(),
    )
    .unwrap();
    let one = fabric();
    let mut other = one.clone();
    (other.membrane.warp, other.membrane.weft) = (one.membrane.weft, one.membrane.warp);
    (other.bending.warp, other.bending.weft) = (one.bending.weft, one.bending.warp);
    let mut random = Random(9);
    let q: Vec<f64> = sheet
        .positions(|[u, v]| [u, v, 0.0])
        .iter()
        .map(|x| x + 2e-3 * random.next())
        .collect();
    let at = at(&q, &q, 1e-3);
    let total = |mesh: &ShellMesh, fabric: &Fabric| {
        let fabrics = [fabric.clone()];
        let membrane = membrane_term(mesh, &fabrics, Default::default()).unwrap();
        let bending = bending_term(mesh, &fabrics, &BendingOptions::default()).unwrap();
        [
            membrane.value(&at, 0..membrane.len()),
            bending.value(&at, 0..bending.len()),
        ]
    };
    let (a, b) = (total(mesh, &one), total(&turned, &other));
    for i in 0..2 {
        assert!((a[i] / b[i] - 1.0).abs() < 1e-12, "{a:?} {b:?}");
    }
    // And by 45°: the same quadratic forms in axes turned by an eighth.
    let s = 0.5_f64.sqrt();
    let diagonal = ShellMesh::new(
        mesh.points(),
        mesh.triangles().to_vec(),
        mesh.material()
            .iter()
            .map(|t| t.map(|[u, v]| [s * (u - v), s * (u + v)]))
            .collect(),
        mesh.fabric().to_vec(),
    )
    .unwrap();
    // Equal warp and weft keep an orthotropic law orthotropic at 45°.
    let mut square = one.clone();
    (square.membrane.weft, square.bending.weft) = (square.membrane.warp, square.bending.warp);
    let mut eighth = square.clone();
    let c = &square.membrane;
    eighth.membrane.warp = 0.5 * (c.warp + c.coupling) + c.shear;
    eighth.membrane.weft = eighth.membrane.warp;
    eighth.membrane.coupling = 0.5 * (c.warp + c.coupling) - c.shear;
    eighth.membrane.shear = 0.5 * (c.warp - c.coupling);
    (eighth.bending.warp, eighth.bending.weft) = (square.bending.bias, square.bending.bias);
    eighth.bending.bias = square.bending.warp;
    let (a, b) = (total(mesh, &square), total(&diagonal, &eighth));
    for i in 0..2 {
        assert!((a[i] / b[i] - 1.0).abs() < 1e-12, "{a:?} {b:?}");
    }
}

/// A sheet rolled to a cylinder in any direction has the continuum's bending
/// energy, for isotropic fabric exactly on equilateral triangles.
#[test]
fn cylinder_energy() {
    let sheet = sheet::equilateral_edge([0.4, 0.35], 0.01).unwrap();
    let mut f = fabric();
    (f.bending.weft, f.bending.bias) = (f.bending.warp, f.bending.warp);
    let hinges = hinge_rest(&sheet.mesh, &[f.clone()], &BendingOptions::default()).unwrap();
    let bending = bending_term(&sheet.mesh, &[f.clone()], &BendingOptions::default()).unwrap();
    let radius = 0.5;
    for direction in [0.0, 0.4, PI / 2.0] {
        let (s, c) = f64::sin_cos(direction);
        let q = sheet.positions(|[u, v]| {
            let (along, across) = (c * u + s * v, c * v - s * u);
            [
                radius * (along / radius).sin(),
                radius * (along / radius).cos(),
                across,
            ]
        });
        let at = at(&q, &q, 1e-3);
        // Inner hinges alone: those with all four points off the boundary.
        let (mut energy, mut area) = (0.0, 0.0);
        let boundary = sheet.mesh.boundary_points();
        for (e, hinge) in sheet.mesh.hinges().iter().enumerate() {
            assert_eq!(hinges[e].points, hinge.points);
            if hinge
                .points
                .iter()
                .all(|p| boundary.binary_search(p).is_err())
            {
                energy += bending.value(&at, e..e + 1);
                area += hinge
                    .triangles
                    .iter()
                    .map(|t| sheet.mesh.rest_area(*t as usize))
                    .sum::<f64>()
                    / 3.0;
            }
        }
        let continuum = 0.5 * f.bending.warp * area / (radius * radius);
        // Rows are 1.01 of the ideal height, and the edge of the region leaves
        // an unequal number of hinges per direction.
        assert!(
            (energy / continuum - 1.0).abs() < 0.02,
            "{direction}: {}",
            energy / continuum
        );
    }
}

/// Hinges are evaluated four at a time; one alone, or beside a collapsed one,
/// gives the same bits.
#[test]
fn four_at_a_time_are_the_same_bits() {
    let mut random = Random(5);
    let count = 11;
    let mut rests = Vec::new();
    let mut q = Vec::new();
    for e in 0..count {
        rests.push(HingeRest {
            points: std::array::from_fn(|k| (4 * e + k) as u32),
            ..rest(1.0 + f64::from(e as u32), 0.1)
        });
        let noise = (0..12).map(|_| 2e-3 * random.next());
        q.extend(folded(0.3 * e as f64).iter().zip(noise).map(|(x, n)| x + n));
    }
    // the wing of hinge 6 has no height
    for k in 0..3 {
        q[6 * 12 + 6 + k] = q[6 * 12 + k];
    }
    let q_start: Vec<f64> = q.iter().map(|x| x + 1e-4 * random.next()).collect();
    let at = at(&q, &q_start, 1e-3);
    fn compare<E: StencilEnergy<4, 12>>(energy: &E, at: &EvalPoint<'_>, count: usize) {
        let mut g = vec![[0.0; 12]; count];
        let mut h = vec![[[0.0; 12]; 12]; count];
        for curvature in [
            Curvature::Exact,
            Curvature::Projected,
            Curvature::GaussNewton,
        ] {
            let sum = energy.hessians(0..count, at, curvature, &mut g, &mut h);
            let mut own = 0.0;
            for e in 0..count {
                let q = at.gather::<4, 12>(&[3; 4], &energy.stencils()[e]);
                let (mut one, mut two) = ([0.0; 12], [[0.0; 12]; 12]);
                own += energy.hessian(e, &q, at, curvature, &mut one, &mut two);
                assert_eq!(g[e].map(f64::to_bits), one.map(f64::to_bits), "{e}");
                assert_eq!(h[e], two, "{e} {curvature:?}");
            }
            assert_eq!(sum.to_bits(), own.to_bits());
            let again = energy.gradients(0..count, at, &mut g);
            assert_eq!(again.to_bits(), own.to_bits());
        }
        assert!(g[6].iter().all(|v| *v == 0.0) && g[5].iter().any(|v| *v != 0.0));
    }
    compare(&BendingHinge::<Undamped>::new(&rests), &at, count);
    compare(&BendingHinge::<RateDamping>::new(&rests), &at, count);
    compare(
        &BendingHinge::<RateDamping, TangentAngle>::new(&rests),
        &at,
        count,
    );
    compare(&BendingHinge::<IncrementalDamping>::new(&rests), &at, count);
}
