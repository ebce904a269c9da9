//! The same bits whatever the number of threads, and after a restart.

use std::sync::Arc;

use selvedge_collision::body::Shape;
use selvedge_collision::{
    Body, BodyContact, CollisionMesh, Friction, FrictionAnchored, SelfContact,
};
use selvedge_integrator::{Outcome, Simulation};
use selvedge_shell_model::{lumped_masses, sheet};
use selvedge_tests::{Setup, Solver, bits, plain_fabric, stacked};

/// Two sheets of `n × n` points, one upon the other and already in contact,
/// fall onto a sphere; contacts rub, the fabric is damped.
fn two_layers(n: usize, solver: Solver) -> Simulation {
    let sheet = sheet::equilateral(n - 1, n - 1, [0.3, 0.3]).expect("sheet");
    let mesh = stacked(&sheet.mesh, 2);
    let layer = |y: f64, lean: f64| {
        sheet
            .flat
            .iter()
            .map(move |[u, v]| [u - 0.15 + lean * v, y, v - 0.15])
    };
    // 0.97 mm apart and sheared: contact without coinciding points.
    let positions: Vec<[f64; 3]> = layer(0.1012, 0.0).chain(layer(0.10217, 0.01)).collect();
    let mut fabric = plain_fabric(1000.0, 1e-5, 0.2);
    fabric.membrane_damping = 1e-3;
    fabric.bending_damping = 1e-2;
    fabric.drag = 1.0;
    let masses = lumped_masses(&mesh, std::slice::from_ref(&fabric)).expect("masses");
    let rubs = || Friction::Anchored(FrictionAnchored::new(0.3));
    let ball = Shape::Sphere {
        center: [0.0; 3],
        radius: 0.1,
    }
    .build()
    .expect("sphere");
    let ball: Arc<dyn Body> = Arc::from(ball);
    let body = BodyContact::new(mesh.points(), vec![ball]).with_friction(rubs(), &masses);
    let cloth = CollisionMesh::new(
        mesh.points(),
        mesh.triangles().to_vec(),
        mesh.material(),
        &[],
        1e-3,
    )
    .expect("collision mesh");
    let cloth = SelfContact::new(cloth).with_friction(rubs(), &masses);
    let mut setup = Setup::new(mesh, positions, fabric);
    setup.velocities.fill([0.3, -1.0, 0.0]);
    setup.contacts = vec![
        Box::new(body.expect("friction")),
        Box::new(cloth.expect("friction")),
    ];
    setup.solver = solver;
    setup.newton.tolerance = 1e-3;
    // Few iterations: some steps are refused and split.
    setup.newton.iterations = 5;
    setup.linear_tolerance = 1e-2;
    setup.simulation()
}

/// Takes `steps` accepted steps; returns the most contacts seen.
fn advance(s: &mut Simulation, steps: u64) -> usize {
    let (end, mut contacts) = (s.counters().steps + steps, 0);
    while s.counters().steps < end {
        match s.advance().expect("two layers") {
            Outcome::Accepted { report, .. } => contacts = contacts.max(report.contacts),
            Outcome::Rejected { .. } => {}
            Outcome::Ended(reason) => panic!("{reason:?}"),
        }
    }
    contacts
}

fn on_threads(n: usize, solver: Solver, steps: u64) {
    let runs = [1, 2, 4].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("threads");
        pool.install(|| {
            let mut s = two_layers(n, solver);
            let contacts = advance(&mut s, steps);
            assert!(
                contacts > s.state().layout.points,
                "{contacts} contacts are too few"
            );
            println!(
                "{solver:?}, {threads} threads: {contacts} contacts, {:?}",
                s.counters()
            );
            bits(&s)
        })
    });
    for other in &runs[1..] {
        let first = runs[0].iter().zip(other).position(|(a, b)| a != b);
        assert_eq!(first, None, "the first number that differs");
    }
}

/// Cloth on cloth on a sphere with friction gives the same bits on 1, 2 and 4
/// threads, with the linear systems in double precision.
#[test]
fn threads_do_not_matter_in_double_precision() {
    on_threads(48, Solver::Double, 6);
}

/// The same with the linear systems in single precision.
#[test]
fn threads_do_not_matter_in_single_precision() {
    on_threads(32, Solver::Single, 20);
}

/// The same with the sums of conjugate gradients in single precision too.
#[test]
fn threads_do_not_matter_in_single_precision_throughout() {
    on_threads(32, Solver::SingleThroughout, 20);
}

/// A run that is saved, put into a simulation made anew and gone on with ends
/// with the same bits as one that was not interrupted: anchors and sides of
/// contacts, step size and counters are all in the snapshot.
#[test]
fn restored_run_is_the_same_run() {
    let mut whole = two_layers(20, Solver::Single);
    advance(&mut whole, 40);
    let mut first = two_layers(20, Solver::Single);
    let contacts = advance(&mut first, 17);
    assert!(contacts > 0, "nothing touches");
    let snapshot = first.snapshot();
    let kept: usize = (0..2)
        .map(|i| {
            snapshot
                .section(&format!("contact {i}"))
                .map_or(0, <[f64]>::len)
        })
        .sum();
    assert!(kept > 0, "no anchors in the snapshot");
    drop(first);
    let mut second = two_layers(20, Solver::Single);
    second
        .restore(&snapshot)
        .expect("a snapshot of the same plan");
    advance(&mut second, 23);
    assert_eq!(whole.counters(), second.counters());
    assert_eq!(whole.state().time.to_bits(), second.state().time.to_bits());
    assert!(
        bits(&whole) == bits(&second),
        "the restored run went another way"
    );
    assert_eq!(whole.snapshot(), second.snapshot());
    // Without the anchors it would not have: the snapshot is not idle.
    let fresh = two_layers(20, Solver::Single).snapshot();
    let mut forgetful = snapshot.clone();
    for (name, values) in &mut forgetful.sections {
        if name.starts_with("contact") {
            *values = fresh.section(name).expect("the same plan").to_vec();
        }
    }
    let mut third = two_layers(20, Solver::Single);
    third.restore(&forgetful).expect("contacts without memory");
    advance(&mut third, 23);
    assert!(bits(&whole) != bits(&third), "contacts have no memory");
}

/// A snapshot of another plan is refused.
#[test]
fn foreign_snapshot_is_refused() {
    let snapshot = two_layers(6, Solver::Double).snapshot();
    let error = two_layers(5, Solver::Double)
        .restore(&snapshot)
        .expect_err("another mesh");
    assert!(error.to_string().contains('`'), "{error}");
}
