//! Triangles against bodies between their points.

mod common;

use std::sync::Arc;

use common::{Floor, Random, World, detect, evaluate, spread};
use selvedge_collision::body::{Body, Pose, RigidMotion, RoundBox, RoundCone};
use selvedge_collision::body::{Interpolation, Keyframe, Placed};
use selvedge_collision::{
    BodyContact, BodyFaces, CollisionError, ContactQuadratic, ContactSource, ContactStiffness,
    Friction, FrictionAnchored, FrictionLagged,
};

/// An equilateral triangle of 2 cm in the plane `y = height`, its middle on the
/// y axis.
fn triangle(height: f64) -> Vec<f64> {
    let r = 0.02 / 3.0_f64.sqrt();
    (0..3)
        .flat_map(|i| {
            let a = f64::from(i) * 2.0 * std::f64::consts::FRAC_PI_3;
            [r * a.cos(), height, r * a.sin()]
        })
        .collect()
}

/// A needle of 1 mm radius along y with its tip at the origin.
fn needle() -> RoundCone {
    RoundCone::new([0.0, -0.3, 0.0], [0.0, -1e-3, 0.0], [1e-3; 2]).unwrap()
}

fn faces(bodies: Vec<Arc<dyn Body>>) -> BodyFaces {
    let potential = ContactQuadratic {
        thickness: 2e-3,
        stiffness: ContactStiffness::PerPair(1e3),
        ..ContactQuadratic::body()
    };
    BodyFaces::new(3, vec![[0, 2, 1]], bodies)
        .unwrap()
        .with_potential(Box::new(potential))
}

/// Bodies below a triangle near the origin: a needle, a ball, a box edge on.
fn below(random: &mut Random) -> Arc<dyn Body> {
    let x = [6e-3 * random.next(), 0.0, 6e-3 * random.next()];
    match (random.next() * 1e6) as i64 % 3 {
        0 => Arc::new(RoundCone::new([x[0], -0.3, x[2]], [x[0], -1e-3, x[2]], [1e-3; 2]).unwrap()),
        1 => Arc::new(RoundCone::sphere([x[0], -0.03, x[2]], 0.03).unwrap()),
        _ => {
            let pose = Pose::new([x[0], -0.0125, x[2]], [0.7, x[0], 0.3]).unwrap();
            Arc::new(RoundBox::new([0.01; 3], 5e-3, pose).unwrap())
        }
    }
}

/// The forces are minus the derivatives of the energy, at all three corners,
/// with corners below the thickness and above it.
#[test]
fn forces_are_derivatives() {
    let mut random = Random(11);
    let (mut inside, mut edges, mut corners) = (0, 0, 0);
    for _ in 0..300 {
        let mut q = triangle(5e-4 + 5e-4 * random.next());
        q.iter_mut().for_each(|x| *x += 5e-4 * random.next());
        let mut s = faces(vec![below(&mut random)]);
        detect(&mut s, &q, &q, 1e-3);
        let (energy, out) = evaluate(&mut s, &q, &q, 1e-3);
        assert!(energy >= 0.0 && s.active() == usize::from(energy > 0.0));
        let Some(w) = out.weights.first() else {
            continue;
        };
        match w.iter().filter(|w| **w > 0.0).count() {
            3 => inside += 1,
            _ => edges += 1,
        }
        corners += out.body_nodes.len();
        let force = spread(3, &out);
        let h = 1e-7;
        for i in 0..9 {
            let at = |d: f64, s: &mut BodyFaces| {
                let mut p = q.clone();
                p[i] += d;
                evaluate(s, &p, &q, 1e-3).0
            };
            let slope = -(at(h, &mut s) - at(-h, &mut s)) / (2.0 * h);
            assert!(
                (slope - force[i]).abs() < 1e-5 * (1.0 + force[i].abs()),
                "{i}: {slope} N is not {} N, weights {w:?}, {out:?}",
                force[i]
            );
        }
        // Semidefinite: a product of one vector with itself.
        let k = &out.curvature[0];
        for i in 0..3 {
            for j in 0..3 {
                let minor = k[i][i] * k[j][j] - k[i][j] * k[j][i];
                assert!(k[i][i] >= 0.0 && k[i][j] == k[j][i]);
                assert!(minor >= -1e-9 * k[i][i] * k[j][j]);
            }
        }
    }
    println!("{inside} inside, {edges} on edges, {corners} with a corner");
    assert!(inside > 50 && edges > 10 && corners > 10);
}

/// A turn and a shift of body and cloth turn the forces and nothing else.
#[test]
fn rigid_motion_turns_forces() {
    let mut random = Random(3);
    let pose = Pose::new([0.3, -0.2, 0.1], [0.4, -1.1, 0.7]).unwrap();
    let mut met = 0;
    for _ in 0..100 {
        let mut q = triangle(1e-3);
        q.iter_mut().for_each(|x| *x += 1e-3 * random.next());
        let body = below(&mut random);
        let turned: Vec<f64> = q
            .as_chunks::<3>()
            .0
            .iter()
            .flat_map(|p| pose.to_world(*p))
            .collect();
        let mut a = faces(vec![body.clone()]);
        let mut b = faces(vec![Arc::new(Placed::new(body, pose))]);
        detect(&mut a, &q, &q, 1e-3);
        detect(&mut b, &turned, &turned, 1e-3);
        let (ea, fa) = evaluate(&mut a, &q, &q, 1e-3);
        let (eb, fb) = evaluate(&mut b, &turned, &turned, 1e-3);
        assert!((ea - eb).abs() < 1e-12, "{ea} J, {eb} J");
        met += usize::from(ea > 0.0);
        let (fa, fb) = (spread(3, &fa), spread(3, &fb));
        for (a, b) in fa.as_chunks::<3>().0.iter().zip(fb.as_chunks::<3>().0) {
            for (x, y) in pose.rotate(*a).iter().zip(b) {
                assert!((x - y).abs() < 1e-6, "{x} N, {y} N");
            }
        }
    }
    assert!(met > 30, "{met}");
}

/// On a flat floor the points do all there is to do, at any depth and tilt.
#[test]
fn flat_floors_are_left_to_points() {
    let mut random = Random(8);
    for tilt in [0.0, 1e-9, 1e-4, 1e-2] {
        for height in [1.4e-3, 0.0, -3e-3] {
            let mut q = triangle(height);
            q.iter_mut().for_each(|x| *x += tilt * random.next());
            let mut s = faces(vec![Arc::new(Floor { speed: [0.0; 3] })]);
            detect(&mut s, &q, &q, 1e-3);
            let (energy, out) = evaluate(&mut s, &q, &q, 1e-3);
            assert!(energy < 1e-15, "{energy} J at {height} m");
            assert!(spread(3, &out).iter().all(|f| f.abs() < 1e-9));
        }
    }
}

/// Height of a falling triangle above the tip of a needle after 0.3 s.
fn fallen(with_faces: bool, speed: f64) -> f64 {
    let masses = vec![1e-4; 3];
    let bodies: Vec<Arc<dyn Body>> = vec![Arc::new(needle())];
    let mut sources: Vec<Box<dyn ContactSource>> =
        vec![Box::new(BodyContact::new(3, bodies.clone()))];
    if with_faces {
        let friction = Friction::Anchored(FrictionAnchored::new(0.3));
        let s = faces(bodies).with_friction(friction, &masses).unwrap();
        sources.push(Box::new(s));
    }
    let mut w = World::new(triangle(0.01), masses, sources);
    w.gravity = [0.0, -9.81, 0.0];
    w.v = [0.0, -speed, 0.0].repeat(3);
    w.run(300, 1e-3);
    w.point(0)[1]
}

/// A triangle that falls on a needle is held by its inside; by its points
/// alone it is not.
#[test]
fn needle_is_caught() {
    let (caught, lost) = (fallen(true, 0.5), fallen(false, 0.5));
    // The weight of three points on 1 kN/m.
    let rest = 2e-3 - 3.0 * 1e-4 * 9.81 / 1e3;
    assert!((caught - rest).abs() < 1e-4, "{caught} m, not {rest} m");
    assert!(lost < -0.4, "{lost} m");
}

/// A needle that comes up lifts the triangle and carries it sideways.
#[test]
fn moving_needle_carries() {
    let key = |time: f64, translation: [f64; 3]| Keyframe {
        time,
        translation,
        rotation: [0.0; 3],
    };
    let keys = [key(0.0, [0.0; 3]), key(0.2, [2e-3, 0.02, 0.0])];
    let body = RigidMotion::new(needle(), &keys, [0.0; 3], Interpolation::Linear).unwrap();
    let masses = vec![1e-4; 3];
    let friction = Friction::Anchored(FrictionAnchored::new(0.9));
    let s = faces(vec![Arc::new(body)])
        .with_friction(friction, &masses)
        .unwrap();
    let rest = 2e-3 - 3.0 * 1e-4 * 9.81 / 1e3;
    let mut w = World::new(triangle(rest), masses, vec![Box::new(s)]);
    w.gravity = [0.0, -9.81, 0.0];
    w.run(200, 1e-3);
    let middle = |k: usize| (0..3).map(|i| w.point(i)[k]).sum::<f64>() / 3.0;
    assert!((middle(1) - rest - 0.02).abs() < 2e-4, "{} m up", middle(1));
    assert!((middle(0) - 2e-3).abs() < 2e-4, "{} m aside", middle(0));
}

/// Anchors survive a checkpoint to the bit, and foreign ones are refused; both
/// frictions hold against a slide.
#[test]
fn anchors_and_checkpoints() {
    for friction in [
        Friction::Anchored(FrictionAnchored::new(0.4)),
        Friction::Lagged(FrictionLagged::new(0.4)),
    ] {
        let make = || {
            faces(vec![Arc::new(needle())])
                .with_friction(friction, &[1e-4; 3])
                .unwrap()
        };
        let (mut a, mut b) = (make(), make());
        let q = triangle(1.5e-3);
        let slid: Vec<f64> = (0..9)
            .map(|i| q[i] + if i % 3 == 0 { 2e-3 } else { 0.0 })
            .collect();
        detect(&mut a, &q, &q, 1e-3);
        let layout = selvedge_energy::DofLayout::points(3);
        a.commit(&selvedge_energy::EvalPoint {
            layout,
            q: &q,
            q_start: &q,
            dt: 1e-3,
        });
        let history = a.history();
        assert_eq!(history.len(), 8);
        b.restore_history(&history).unwrap();
        detect(&mut a, &q, &slid, 1e-3);
        detect(&mut b, &q, &slid, 1e-3);
        let (ea, fa) = evaluate(&mut a, &slid, &q, 1e-3);
        let (eb, fb) = evaluate(&mut b, &slid, &q, 1e-3);
        assert_eq!((ea, &fa), (eb, &fb));
        let f = spread(3, &fa);
        let sum = |k: usize| f[k] + f[3 + k] + f[6 + k];
        let ratio = -sum(0) / sum(1);
        assert!((ratio - 0.4).abs() < 1e-6, "{friction:?}: {ratio}");
        let mut bad = history.clone();
        bad[1] = 1.0;
        for bad in [&bad[..], &history[1..]] {
            assert!(matches!(
                b.restore_history(bad),
                Err(CollisionError::History { .. })
            ));
        }
    }
}

/// Bad input is an error with numbers.
#[test]
fn bad_input_is_refused() {
    let e = BodyFaces::new(3, vec![[0, 1, 3]], Vec::new())
        .err()
        .unwrap();
    assert!(
        matches!(e, CollisionError::PointOutOfRange { point: 3, .. }),
        "{e}"
    );
    let e = BodyFaces::new(3, vec![[0, 1, 2], [2, 1, 2]], Vec::new())
        .err()
        .unwrap();
    assert!(
        matches!(
            e,
            CollisionError::RepeatedPoint {
                index: 1,
                point: 2,
                ..
            }
        ),
        "{e}"
    );
    let make = || faces(vec![Arc::new(needle())]);
    assert!(make().with_masses(&[1.0; 2]).is_err());
    assert!(make().with_areas(vec![1.0; 2]).is_err());
    assert!(make().with_still(&[]).is_err());
}
