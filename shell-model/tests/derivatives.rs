//! Every energy against finite differences, rigid motions and its own claim
//! of semidefiniteness.

mod common;

use common::{Random, at, evaluate, fabric, relative, smallest_eigenvalue};
use selvedge_energy::{
    Batch, Curvature, EnergyBatch, check_derivatives, check_projection, check_rigid_motion,
};
use selvedge_shell_model::{
    BendingModel, BendingOptions, BodyInertia, DampingKind, MembraneGuard, PointDrag, SharedScalar,
    SharedTargets, TrimBody, TrimThread, attachment_term, bending_term, drag_term, joint_term,
    lumped_masses, membrane_term, patch_term, seam_term, sheet, trim_term,
};

/// A crumpled sheet at the end of a step, and where it was at the start.
fn crumpled(sheet: &sheet::Sheet, amount: f64) -> (Vec<f64>, Vec<f64>) {
    let mut random = Random(42);
    let mut shake =
        |q: &[f64], by: f64| -> Vec<f64> { q.iter().map(|x| x + by * random.next()).collect() };
    let q = shake(&sheet.positions(|[u, v]| [u, 0.0, -v]), amount);
    let start = shake(&q, 0.2 * amount);
    (q, start)
}

fn is_above(term: &dyn EnergyBatch, at: &selvedge_energy::EvalPoint<'_>) {
    for e in 0..term.len() {
        let (_, _, exact) = evaluate(term, at, Curvature::Exact, e);
        let (_, _, projected) = evaluate(term, at, Curvature::Projected, e);
        let gap: Vec<f64> = projected.iter().zip(&exact).map(|(a, b)| a - b).collect();
        let scale = projected.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let least = smallest_eigenvalue(&gap, term.local_dim())
            * gap.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        assert!(
            least >= -1e-9 * scale,
            "{} {e}: {least:.2e} of {scale:.2e}",
            term.name()
        );
    }
}

/// Membrane and bending with every law of friction: first and second
/// derivatives, balance of forces and torques, semidefinite projections that
/// bound the exact matrix.
#[test]
fn elastic_terms() {
    let sheet = sheet::equilateral(4, 4, [0.04, 0.035]).unwrap();
    let fabrics = [fabric()];
    let (q, start) = crumpled(&sheet, 3e-3);
    let at = at(&q, &start, 1e-3);
    let curved: Vec<f64> = (0..sheet.mesh.hinges().len())
        .map(|i| 0.1 * i as f64 - 1.0)
        .collect();
    let mut terms = Vec::new();
    for damping in [
        DampingKind::Off,
        DampingKind::Rate,
        DampingKind::Incremental,
    ] {
        terms.push((
            membrane_term(&sheet.mesh, &fabrics, damping).unwrap(),
            damping,
        ));
        for model in [
            BendingModel::Hinge,
            BendingModel::HingeTangent,
            BendingModel::Quadratic,
        ] {
            let rest_angles = Some(&curved[..]);
            let options = BendingOptions {
                damping,
                model,
                rest_angles,
                ..Default::default()
            };
            terms.push((
                bending_term(&sheet.mesh, &fabrics, &options).unwrap(),
                damping,
            ));
        }
    }
    for (term, damping) in &mut terms {
        term.begin_step(&at);
        let term = &**term;
        let conservative = *damping != DampingKind::Rate || term.is_conservative();
        if conservative {
            check_derivatives(term, &at, 1e-8).unwrap();
        }
        check_rigid_motion(term, &at, 1e-9).unwrap();
        for curvature in [Curvature::Projected, Curvature::GaussNewton] {
            check_projection(term, &at, curvature, 1e-10).unwrap();
        }
        is_above(term, &at);
    }
}

/// Friction on rates leaves out one known part of the derivative; what is
/// given equals the symmetric derivative where the step is short, so the error
/// falls with the displacement of the step.
#[test]
fn rate_damping_misses_first_order_only() {
    let sheet = sheet::equilateral(3, 3, [0.03, 0.026]).unwrap();
    let fabrics = [fabric()];
    let (q, start) = crumpled(&sheet, 2e-3);
    let options = BendingOptions::default();
    for term in [
        membrane_term(&sheet.mesh, &fabrics, DampingKind::Rate).unwrap(),
        bending_term(&sheet.mesh, &fabrics, &options).unwrap(),
    ] {
        assert!(!term.is_conservative());
        let error = |shrink: f64| {
            let near: Vec<f64> = q
                .iter()
                .zip(&start)
                .map(|(q, s)| q + shrink * (s - q))
                .collect();
            let at = at(&q, &near, 1e-3);
            match check_derivatives(&*term, &at, 1.0) {
                Ok(report) => report.hessian,
                Err(error) => panic!("{error}"),
            }
        };
        let (far, near) = (error(1e-2), error(1e-3));
        assert!(
            (near / far - 0.1).abs() < 0.03,
            "{}: {far:.2e} {near:.2e}",
            term.name()
        );
    }
}

/// Power of friction is negative, a rigid rotation is not damped.
#[test]
fn friction_dissipates() {
    let sheet = sheet::equilateral(4, 4, [0.04, 0.035]).unwrap();
    let fabrics = [fabric()];
    let (q, start) = crumpled(&sheet, 2e-3);
    let w = [0.3, -1.0, 2.0];
    let dt = 1e-9;
    let spin: Vec<f64> = q
        .as_chunks::<3>()
        .0
        .iter()
        .flat_map(|p| {
            [
                w[1] * p[2] - w[2] * p[1],
                w[2] * p[0] - w[0] * p[2],
                w[0] * p[1] - w[1] * p[0],
            ]
        })
        .collect();
    let rotated: Vec<f64> = q.iter().zip(&spin).map(|(q, v)| q - dt * v).collect();
    let bend = |damping| BendingOptions {
        damping,
        ..Default::default()
    };
    let pairs = [DampingKind::Off, DampingKind::Rate].map(|damping| {
        [
            membrane_term(&sheet.mesh, &fabrics, damping).unwrap(),
            bending_term(&sheet.mesh, &fabrics, &bend(damping)).unwrap(),
        ]
    });
    for (plain, damped) in pairs[0].iter().zip(&pairs[1]) {
        let friction = |q_start: &[f64], dt: f64| -> Vec<f64> {
            let at = at(&q, q_start, dt);
            let m = plain.local_dim();
            let mut all = vec![0.0; q.len()];
            let (mut a, mut b) = (vec![0.0; m], vec![0.0; m]);
            for e in 0..plain.len() {
                plain.gradients(&at, e..e + 1, &mut a);
                damped.gradients(&at, e..e + 1, &mut b);
                for (k, n) in plain.nodes(e).iter().enumerate() {
                    for i in 0..3 {
                        all[3 * *n as usize + i] -= b[3 * k + i] - a[3 * k + i];
                    }
                }
            }
            all
        };
        let force = friction(&start, 1e-3);
        let power: f64 = force
            .iter()
            .zip(q.iter().zip(&start))
            .map(|(f, (q, s))| f * (q - s) / 1e-3)
            .sum();
        assert!(power < 0.0, "{power}");
        let largest = force.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        // Positions of 0.04 m leave 1e-8 of the rate over a step of 1e-9 s.
        let rigid = friction(&rotated, dt)
            .iter()
            .fold(0.0_f64, |m, x| m.max(x.abs()));
        let typical = 0.2 * 2e-3 / 1e-3;
        assert!(
            rigid / largest < 1e-6 * 0.04 * 2.3 / typical,
            "{rigid:.2e} of {largest:.2e}"
        );
    }
}

/// Seams, joints, patches, attachments, drag: exact derivatives; the ramp and
/// the targets are taken over when a step begins and not before.
#[test]
fn attachments() {
    let sheet = sheet::grid(3, 3, [0.03, 0.03]).unwrap();
    let (q, start) = crumpled(&sheet, 2e-3);
    let at = at(&q, &start, 1e-3);
    let ramp = SharedScalar::new(10.0);
    let targets = SharedTargets::new(vec![[0.1, 0.2, 0.3], [0.0, 0.0, 0.1]]);
    let mut seam = seam_term(&[(0, [5, 6], 0.3), (3, [9, 8], 1.0)], ramp.clone());
    let mut attachment = attachment_term(&[2, 7], 50.0, targets.clone()).unwrap();
    let others = [
        joint_term(&[[0, 15], [3, 12]], ramp.clone()),
        patch_term(&[(0, [5, 6, 10], [0.2, 0.5, 0.3])], ramp.clone()),
    ];
    for term in others.iter().chain([&seam]) {
        check_derivatives(&**term, &at, 1e-9).unwrap();
        check_projection(&**term, &at, Curvature::Exact, 1e-12).unwrap();
        // The torque of a spring through a point on the line of its gap.
        check_rigid_motion(&**term, &at, 1e-10).unwrap();
    }
    let drag = drag_term(&sheet.mesh, &[fabric()]).unwrap().unwrap();
    check_derivatives(&*drag, &at, 1e-9).unwrap();
    check_derivatives(&*attachment, &at, 1e-9).unwrap();

    let before = (seam.value(&at, 0..2), attachment.value(&at, 0..2));
    ramp.set(1000.0);
    targets.update(|_, [x, y, z]| [x + 1.0, y, z]);
    assert_eq!(before, (seam.value(&at, 0..2), attachment.value(&at, 0..2)));
    seam.begin_step(&at);
    attachment.begin_step(&at);
    assert!((seam.value(&at, 0..2) / before.0 - 100.0).abs() < 1e-9);
    assert!(attachment.value(&at, 0..2) > 10.0 * before.1);
}

/// Drag: force `−α m v` on every point that has mass, none without drag.
#[test]
fn drag() {
    let sheet = sheet::grid(2, 2, [0.1, 0.1]).unwrap();
    let masses = lumped_masses(&sheet.mesh, &[fabric()]).unwrap();
    assert!((masses.iter().sum::<f64>() - 0.2 * 0.01).abs() < 1e-18);
    let drag = Batch::<_, 1, 3>::new(
        "drag",
        PointDrag::new(&masses.iter().map(|m| 5.0 * m).collect::<Vec<_>>()),
    );
    let q = sheet.positions(|[u, v]| [u, 0.0, v]);
    let start: Vec<f64> = q.iter().map(|x| x - 2e-3).collect();
    let mut g = [0.0; 3];
    for e in 0..drag.len() {
        drag.gradients(&at(&q, &start, 1e-3), e..e + 1, &mut g);
        for x in g {
            assert!((x / (5.0 * masses[drag.nodes(e)[0] as usize] * 2.0) - 1.0).abs() < 1e-10);
        }
    }
    let mut still = fabric();
    still.drag = 0.0;
    assert!(drag_term(&sheet.mesh, &[still]).unwrap().is_none());
}

/// The guard against collapse: derivatives, its projection, silence above the
/// onset and at the point of full collapse.
#[test]
fn guard() {
    let sheet = sheet::equilateral(2, 2, [0.02, 0.0173]).unwrap();
    let guard = Batch::<_, 3, 9>::new("guard", MembraneGuard::new(&sheet.mesh, &[150.0], 0.6));
    let squeezed = sheet.positions(|[u, v]| [u, 0.3 * v, 0.1 * u - 0.2 * v]);
    let mut random = Random(7);
    let q: Vec<f64> = squeezed.iter().map(|x| x + 3e-4 * random.next()).collect();
    let at_q = at(&q, &squeezed, 1e-3);
    check_derivatives(&guard, &at_q, 1e-8).unwrap();
    check_rigid_motion(&guard, &at_q, 1e-9).unwrap();
    check_projection(&guard, &at_q, Curvature::Projected, 1e-10).unwrap();
    check_projection(&guard, &at_q, Curvature::GaussNewton, 1e-10).unwrap();
    is_above(&guard, &at_q);
    let flat = sheet.positions(|[u, v]| [u, 0.0, v]);
    assert_eq!(guard.value(&at(&flat, &flat, 1e-3), 0..guard.len()), 0.0);
    let point = vec![0.3; flat.len()];
    let (value, g, h) = evaluate(&guard, &at(&point, &point, 1e-3), Curvature::Exact, 0);
    assert!(value > 0.0);
    assert!(g.iter().chain(&h).all(|x| *x == 0.0));
}

/// A button on threads: gradient and symmetric second derivative against
/// differences of the energy under the exponential map, torque balance, and
/// the orientation after two turns.
#[test]
fn rigid_trim() {
    let bodies = [TrimBody {
        centre: 3,
        spin: 4,
        orientation: [0.9, 0.1, -0.3, 0.2],
    }];
    let weights = [0.5, 0.7, -0.2];
    let threads = [TrimThread {
        points: [0, 1, 2],
        weights,
        body: 0,
        arm: [4e-3, 1e-3, -2e-3],
        stiffness: 1e3,
    }];
    let mut term = trim_term(&bodies, &threads).unwrap();
    let q = vec![
        0.01, 0.002, -0.004, 0.012, 0.006, -0.001, 0.015, 0.001, 0.002, 0.003, 0.001, 0.002, 0.4,
        -0.3, 0.1,
    ];
    let here = at(&q, &q, 1e-3);
    let (_, g, h) = evaluate(&*term, &here, Curvature::Exact, 0);
    let value = |moves: &[(usize, f64)]| {
        let mut moved = q.clone();
        for (i, by) in moves {
            moved[*i] += by;
        }
        term.value(&at(&moved, &q, 1e-3), 0..1)
    };
    // Unknowns of length 5 mm, a turn of 1 rad moves the arm as far.
    let step = |i: usize| if i < 12 { 1e-5 } else { 1e-3 };
    let mut gradient = vec![0.0; 15];
    let mut second = vec![0.0; 225];
    for i in 0..15 {
        let a = step(i);
        gradient[i] = (value(&[(i, a)]) - value(&[(i, -a)])) / (2.0 * a);
        for j in 0..15 {
            let b = step(j);
            second[15 * i + j] =
                (value(&[(i, a), (j, b)]) - value(&[(i, a), (j, -b)]) - value(&[(i, -a), (j, b)])
                    + value(&[(i, -a), (j, -b)]))
                    / (4.0 * a * b);
        }
    }
    assert!(
        relative(&g, &gradient) < 1e-6,
        "{:.2e}",
        relative(&g, &gradient)
    );
    assert!(
        relative(&h, &second) < 1e-6,
        "{:.2e}",
        relative(&h, &second)
    );
    is_above(&*term, &here);
    for c in [Curvature::Projected, Curvature::GaussNewton] {
        check_projection(&*term, &here, c, 1e-10).unwrap();
    }
    // Newton's third law, with the torque on the body.
    for i in 0..3 {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let force: f64 = (0..4).map(|n| g[3 * n + i]).sum();
        let torque = |n: usize| q[3 * n + j] * g[3 * n + k] - q[3 * n + k] * g[3 * n + j];
        let torque = (0..4).map(torque).sum::<f64>() + g[12 + i];
        assert!(force.abs() < 1e-12 * g[9].abs(), "{force}");
        assert!(torque.abs() < 1e-12 * g[9].abs(), "{torque}");
    }
    // Two half turns about the same axis bring the thread back.
    let rest = term.value(&here, 0..1);
    let half: Vec<f64> = q
        .iter()
        .zip([0.0; 12].into_iter().chain([0.6, 0.0, 0.8]))
        .map(|(q, axis)| q + std::f64::consts::PI * axis)
        .collect();
    term.commit(&at(&half, &q, 1e-3));
    assert!((term.value(&here, 0..1) - rest).abs() > 1e-3 * rest);
    let history = term.history().to_vec();
    term.commit(&at(&half, &q, 1e-3));
    assert!((term.value(&here, 0..1) / rest - 1.0).abs() < 1e-12);
    term.restore_history(&history);
    term.commit(&at(&half, &q, 1e-3));
    assert!((term.value(&here, 0..1) / rest - 1.0).abs() < 1e-12);
}

/// A thread by hand: the energy of a known gap, forces shared by barycentric
/// coordinates, the torque; and the same energy and turned forces when cloth
/// and body move rigidly together.
#[test]
fn trim_by_hand() {
    let body = |orientation| TrimBody {
        centre: 3,
        spin: 4,
        orientation,
    };
    let thread = TrimThread {
        points: [0, 1, 2],
        weights: [0.2, 0.3, 0.5],
        body: 0,
        arm: [2e-3, 0.0, -1e-3],
        stiffness: 500.0,
    };
    let x = [[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.0, 0.01, 0.0]];
    // The place is (3, 5, 0) mm; centre and arm leave d = (0, 3, −1) mm.
    let centre = [1e-3, 2e-3, 2e-3];
    let q: Vec<f64> = x.into_iter().chain([centre, [0.0; 3]]).flatten().collect();
    let term = trim_term(&[body([1.0, 0.0, 0.0, 0.0])], &[thread]).unwrap();
    let (value, g, _) = evaluate(&*term, &at(&q, &q, 1e-3), Curvature::Exact, 0);
    assert!((value - 0.5 * 500.0 * 10e-6).abs() < 1e-15);
    // −k r × d with r = (2, 0, −1) mm
    let expected = [
        [0.0, 0.3, -0.1],
        [0.0, 0.45, -0.15],
        [0.0, 0.75, -0.25],
        [0.0, -1.5, 0.5],
        [-1.5e-3, -1e-3, -3e-3],
    ];
    assert!(relative(&g, expected.as_flattened()) < 1e-13, "{g:?}");
    // A quarter turn about the third axis and a shift.
    let turn = |p: [f64; 3]| [-p[1], p[0], p[2]];
    let moved: Vec<f64> = x
        .into_iter()
        .chain([centre])
        .map(turn)
        .flat_map(|p| [p[0] + 0.3, p[1] - 0.2, p[2] + 0.1])
        .chain([0.7, 0.1, -0.2])
        .collect();
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let term = trim_term(&[body([half, 0.0, 0.0, half])], &[thread]).unwrap();
    let (after, g, _) = evaluate(&*term, &at(&moved, &moved, 1e-3), Curvature::Exact, 0);
    assert!((after / value - 1.0).abs() < 1e-12);
    let turned: Vec<f64> = expected.into_iter().flat_map(turn).collect();
    assert!(relative(&g, &turned) < 1e-12, "{g:?}");
}

/// Inertia of a button: a disc's moments; free rotation about a principal
/// axis keeps the angular momentum exactly.
#[test]
fn button_inertia() {
    let disc = BodyInertia::disc(1e-3, 6e-3, 2e-3);
    assert!((disc.principal[2] - 0.5e-3 * 36e-6).abs() < 1e-20);
    let orientation = [0.8, 0.0, 0.6, 0.0];
    let j = disc.world(orientation);
    let trace: f64 = (0..3).map(|i| j[i][i]).sum();
    assert!((trace / (3.0 * disc.mean()) - 1.0).abs() < 1e-14);
    // The body's third axis in the world, turned by 2 atan(0.75) about y.
    let axis = [0.96, 0.0, 0.28];
    let omega = axis.map(|x| 30.0 * x);
    let (change, matrix) = disc.residual(orientation, omega, omega, 0.01);
    assert!(
        change
            .iter()
            .all(|x| x.abs() < 1e-14 * disc.principal[2] * 30.0 * 10.0)
    );
    let l: Vec<f64> = (0..3)
        .map(|i| (0..3).map(|k| matrix[i][k] * omega[k]).sum())
        .collect();
    for i in 0..3 {
        assert!((l[i] - 30.0 * disc.principal[2] * axis[i]).abs() < 1e-18);
    }
}
