//! Points against bodies: golden forces, stick and slip, moving bodies.

mod common;

use std::sync::Arc;

use common::{Floor, World, detect, evaluate, spread};
use selvedge_collision::{
    Aabb, Body, BodyContact, CollisionError, ContactQuadratic, ContactSource, ContactStiffness,
    Friction, FrictionAnchored, FrictionLagged, StepStart, SurfaceSample,
};
use serde_json::Value;

struct Ball(f64);

impl Body for Ball {
    fn name(&self) -> &str {
        "ball"
    }
    fn sample(&self, p: [f64; 3], _: f64) -> SurfaceSample {
        let r = p.iter().map(|c| c * c).sum::<f64>().sqrt();
        SurfaceSample {
            distance: r - self.0,
            normal: p.map(|c| c / r),
            velocity: [0.0; 3],
        }
    }
    fn bounds(&self, _: f64) -> Aabb {
        Aabb {
            min: [-self.0; 3],
            max: [self.0; 3],
        }
    }
}

/// Force and Gauss-Newton curvature against a sphere match the golden vectors.
#[test]
fn golden_sphere() {
    let golden: Value = serde_json::from_str(include_str!("golden/contact.json")).unwrap();
    for c in golden["sdf_sphere"].as_array().unwrap() {
        let f = |v: &Value| v.as_f64().unwrap();
        let x: Vec<f64> = (0..3).map(|i| f(&c["x"][i])).collect();
        let potential = ContactQuadratic {
            thickness: f(&c["delta"]),
            stiffness: ContactStiffness::PerPair(f(&c["k_c"])),
            cap: 3.0,
        };
        let mut s = BodyContact::new(1, vec![Arc::new(Ball(f(&c["R"])))])
            .with_potential(Box::new(potential));
        detect(&mut s, &x, &x, 1e-3);
        let (_, out) = evaluate(&mut s, &x, &x, 1e-3);
        for i in 0..3 {
            let expected = -f(&c["gradient"][i]);
            assert!((out.body_force[0][i] - expected).abs() < 1e-10 * 0.3);
            for j in 0..3 {
                let expected = f(&c["hessian_gauss_newton"][i][j]);
                assert!((out.body_curvature[0][i][j] - expected).abs() < 1e-10 * 100.0);
            }
        }
    }
}

fn particle(friction: Friction, floor: Floor) -> World {
    let masses = vec![1e-3];
    let s = BodyContact::new(1, vec![Arc::new(floor)])
        .with_friction(friction, &masses)
        .unwrap();
    // At the depth that carries 1 g, so that it starts at rest.
    World::new(
        vec![0.0, 1.5e-3 - 1e-3 * 9.81 / 1e2, 0.0],
        masses,
        vec![Box::new(s)],
    )
}

fn incline(angle: f64) -> [f64; 3] {
    [9.81 * angle.sin(), -9.81 * angle.cos(), 0.0]
}

/// A particle on an incline two per cent below the friction angle comes to
/// rest, two per cent above it slides with the acceleration of Coulomb's law.
#[test]
fn incline_sticks_and_slips() {
    for mu in [0.3, 0.5] {
        for damping_ratio in [0.2, 1.0] {
            let friction = FrictionAnchored {
                damping_ratio,
                ..FrictionAnchored::new(mu)
            };
            let mut stuck = particle(Friction::Anchored(friction), Floor { speed: [0.0; 3] });
            stuck.gravity = incline(0.98 * f64::atan(mu));
            stuck.run(1000, 1e-3);
            let speed = stuck
                .velocity(0)
                .map(f64::abs)
                .into_iter()
                .fold(0.0, f64::max);
            assert!(speed < 1e-9, "mu {mu}: {speed} m/s");
            let sag = 1e-3 * stuck.gravity[0] / 1e2;
            assert!(
                stuck.point(0)[0] < 12.0 * sag,
                "drift of {} m",
                stuck.point(0)[0]
            );

            let mut loose = particle(Friction::Anchored(friction), Floor { speed: [0.0; 3] });
            let angle = 1.02 * f64::atan(mu);
            loose.gravity = incline(angle);
            loose.run(500, 1e-3);
            let before = loose.velocity(0)[0];
            loose.run(500, 1e-3);
            let a = (loose.velocity(0)[0] - before) / 0.5;
            let expected = 9.81 * (angle.sin() - mu * angle.cos());
            assert!(
                (a / expected - 1.0).abs() < 1e-3,
                "mu {mu}: {a} m/s², not {expected}"
            );
        }
    }
}

/// The smoothed law creeps, but not faster than its creep speed.
#[test]
fn smoothed_friction_creeps() {
    let mu = 0.4;
    let mut w = particle(
        Friction::Lagged(FrictionLagged::new(mu)),
        Floor { speed: [0.0; 3] },
    );
    w.gravity = incline(0.9 * f64::atan(mu));
    w.run(500, 1e-3);
    let speed = w.velocity(0)[0];
    assert!(speed > 1e-5 && speed < 1e-3, "{speed} m/s");
}

/// A particle on a floor that moves off is carried along, at the floor's speed
/// when it sticks, with an anchor that travels in the floor's frame.
#[test]
fn moving_floor_carries() {
    let friction = Friction::Anchored(FrictionAnchored::new(0.5));
    let mut w = particle(
        friction,
        Floor {
            speed: [0.2, 0.1, 0.05],
        },
    );
    w.gravity = incline(0.2);
    w.run(1000, 1e-3);
    for (v, s) in w.velocity(0).iter().zip([0.2, 0.1, 0.05]) {
        assert!((v - s).abs() < 1e-6, "{v} m/s on a floor of {s} m/s");
    }
}

/// Beyond the cap the force stays constant and the energy goes on smoothly;
/// deep points are counted.
#[test]
fn force_of_deep_points_is_capped() {
    let mut s = BodyContact::new(1, vec![Arc::new(Floor { speed: [0.0; 3] })]);
    let mut at = |y: f64| {
        let q = [0.0, y, 0.0];
        detect(&mut s, &q, &q, 1e-3);
        let (e, out) = evaluate(&mut s, &q, &q, 1e-3);
        (
            e,
            out.body_force[0][1],
            s.deep_points(),
            s.max_penetration(),
        )
    };
    let cap = 1e2 * 3.0 * 1.5e-3;
    assert!((at(-2.0 * 1.5e-3).1 - cap).abs() < 1e-12);
    assert_eq!(at(-0.02).1, at(-0.03).1);
    assert!((at(-0.02).0 - at(-0.03).0 + cap * 0.01).abs() < 1e-12);
    assert_eq!((at(-4.4e-3).2, at(-4.6e-3).2), (0, 1));
    assert!((at(-0.02).3 - 0.0215).abs() < 1e-15);
}

/// Only chosen points touch, a body's own coefficient wins, and a body that
/// answers NaN is named.
#[test]
fn points_coefficients_and_faults() {
    let q = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 2.0, 1.0, 0.0];
    let bodies: Vec<Arc<dyn Body>> = vec![Arc::new(Floor { speed: [0.0; 3] })];
    let mut s = BodyContact::new(3, bodies.clone())
        .with_points(vec![2, 1])
        .unwrap();
    detect(&mut s, &q, &q, 1e-3);
    assert_eq!(
        s.candidates(),
        1,
        "the high point is ruled out by its distance"
    );
    let (_, out) = evaluate(&mut s, &q, &q, 1e-3);
    assert_eq!(out.body_nodes, [1]);
    let e = BodyContact::new(3, bodies)
        .with_points(vec![3])
        .err()
        .unwrap();
    assert!(
        matches!(e, CollisionError::PointOutOfRange { point: 3, .. }),
        "{e}"
    );

    struct Slippery;
    impl Body for Slippery {
        fn name(&self) -> &str {
            "ice"
        }
        fn sample(&self, p: [f64; 3], t: f64) -> SurfaceSample {
            let mut s = Floor { speed: [0.0; 3] }.sample(p, t);
            if p[0] > 1.5 {
                s.distance = f64::NAN;
            }
            s
        }
        fn bounds(&self, t: f64) -> Aabb {
            Floor { speed: [0.0; 3] }.bounds(t).inflate(1.0)
        }
        fn friction(&self) -> Option<f64> {
            Some(0.0)
        }
    }
    let masses = [1.0; 3];
    let mut s = BodyContact::new(3, vec![Arc::new(Slippery)])
        .with_friction(Friction::Anchored(FrictionAnchored::new(1.0)), &masses)
        .unwrap();
    let moved: Vec<f64> = q
        .iter()
        .enumerate()
        .map(|(i, x)| x + if i % 3 == 0 { 1e-4 } else { 0.0 })
        .collect();
    detect(&mut s, &q[..], &moved, 1e-3);
    let mut out = Default::default();
    let layout = selvedge_energy::DofLayout::points(3);
    let at = selvedge_energy::EvalPoint {
        layout,
        q: &moved,
        q_start: &q,
        dt: 1e-3,
    };
    let e = s.evaluate(&at, true, &mut out).unwrap_err();
    assert!(
        matches!(&e, CollisionError::NotFiniteSample { body, point: 2 } if body == "ice"),
        "{e}"
    );
    assert_eq!(spread(3, &out)[0], 0.0, "no friction on ice");
}

/// A slipping point is held by the geometric mean of both coefficients times
/// the normal force, whether all points have the same or not; bad ones are
/// refused.
#[test]
fn friction_of_two_materials() {
    struct Rough;
    impl Body for Rough {
        fn name(&self) -> &str {
            "rough"
        }
        fn sample(&self, p: [f64; 3], t: f64) -> SurfaceSample {
            Floor { speed: [0.0; 3] }.sample(p, t)
        }
        fn bounds(&self, t: f64) -> Aabb {
            Floor { speed: [0.0; 3] }.bounds(t)
        }
        fn friction(&self) -> Option<f64> {
            Some(0.9)
        }
    }
    let contact = |bodies: Vec<Arc<dyn Body>>| {
        BodyContact::new(2, bodies)
            .with_friction(Friction::Anchored(FrictionAnchored::new(0.4)), &[1e-3; 2])
            .unwrap()
    };
    let start = [0.0, 1.3e-3, 0.0, 0.5, 1.3e-3, 0.0];
    let q = [1e-2, 1.3e-3, 0.0, 0.51, 1.3e-3, 0.0];
    for (of_cloth, expected) in [
        (vec![0.4, 0.4], [0.6, 0.6]),
        (vec![0.4, 0.1], [0.6, 0.3]),
        (vec![0.0, 0.1], [0.0, 0.3]),
    ] {
        let mut s = contact(vec![Arc::new(Rough)])
            .with_coefficients(of_cloth.clone())
            .unwrap();
        detect(&mut s, &start, &q, 1e-3);
        let (_, out) = evaluate(&mut s, &q, &start, 1e-3);
        for (f, mu) in out.body_force.iter().zip(expected) {
            assert!((-f[0] / f[1] - mu).abs() < 1e-12, "{of_cloth:?}: {f:?}");
        }
        let plain: Vec<Arc<dyn Body>> = vec![Arc::new(Floor { speed: [0.0; 3] })];
        let mut s = contact(plain).with_coefficients(of_cloth.clone()).unwrap();
        detect(&mut s, &start, &q, 1e-3);
        let (_, out) = evaluate(&mut s, &q, &start, 1e-3);
        for (f, mu) in out.body_force.iter().zip(of_cloth) {
            assert!((-f[0] / f[1] - mu).abs() < 1e-12, "{f:?}");
        }
    }
    for bad in [vec![0.1], vec![0.1, -0.1], vec![f64::NAN, 0.1]] {
        assert!(
            contact(vec![Arc::new(Rough)])
                .with_coefficients(bad)
                .is_err()
        );
    }
}

/// Force and curvature are derivatives of the energy on a flat floor, where
/// the Gauss-Newton part is all there is; friction sticking and slipping.
#[test]
fn derivatives_on_a_flat_floor() {
    let start = [0.0, 1.3e-3, 0.0];
    let friction = Friction::Anchored(FrictionAnchored::new(0.4));
    for way in [[1e-7, 0.0, 2e-7], [3e-4, 0.0, -2e-4]] {
        let mut s = BodyContact::new(
            1,
            vec![Arc::new(Floor {
                speed: [0.1, 0.0, 0.0],
            })],
        )
        .with_friction(friction, &[1e-3])
        .unwrap();
        // The floor moves as well: relative to it the point slips or sticks.
        let dt = 1e-3;
        let q: [f64; 3] =
            std::array::from_fn(|i| start[i] + way[i] + if i == 0 { 1e-4 } else { 0.0 });
        detect(&mut s, &start, &q, dt);
        let (_, out) = evaluate(&mut s, &q, &start, dt);
        let h = 1e-9;
        // Along the floor the normal force is constant.
        for i in [0, 2] {
            let (mut a, mut b) = (q, q);
            a[i] += h;
            b[i] -= h;
            let (ea, fa) = evaluate(&mut s, &a, &start, dt);
            let (eb, fb) = evaluate(&mut s, &b, &start, dt);
            let force = -(ea - eb) / (2.0 * h);
            assert!(
                (force - out.body_force[0][i]).abs() < 1e-5 * 8e-3,
                "{force}"
            );
            for j in 0..3 {
                let k = -(fa.body_force[0][j] - fb.body_force[0][j]) / (2.0 * h);
                let expected = out.body_curvature[0][j][i];
                assert!(
                    (k - expected).abs() < 1e-5 * 700.0,
                    "{k} against {expected}"
                );
            }
        }
    }
}

/// A point that would end the step more than three thicknesses inside a body is
/// refused by name; one that ends near the surface, moves along with the body,
/// or begins deep already, is not.
#[test]
fn overrun_points_are_refused() {
    let detect = |from: f64, to: f64| {
        let mut s = BodyContact::new(2, vec![Arc::new(Ball(0.1))]);
        let at = |x: f64| [5.0, 0.0, 0.0, x, 0.0, 0.0];
        s.detect(&StepStart {
            q_start: &at(from),
            q_predicted: &at(to),
            dt: 1e-3,
            time: 0.0,
        })
    };
    assert!(detect(0.101, 0.099).is_ok());
    assert!(detect(0.09, 0.08).is_ok());
    assert!(detect(0.13, 0.101).is_ok());
    match detect(0.105, 0.09) {
        Err(CollisionError::Overrun {
            point,
            depth,
            limit,
            ..
        }) => {
            assert_eq!(point, 1);
            assert!((depth - 0.01).abs() < 1e-12 && (limit - 4.5e-3).abs() < 1e-12);
        }
        other => panic!("{other:?}"),
    }
}

/// Speed and lowest place of a point of 80 mg that falls on the floor at
/// `speed` \[m/s\], by backward Euler with steps cut where they are refused.
fn thrown(speed: f64, stops: bool) -> (f64, f64) {
    let mass = 8e-5;
    let potential = ContactQuadratic {
        stiffness: ContactStiffness::PerPair(1e3),
        ..ContactQuadratic::body()
    };
    let mut s = BodyContact::new(1, vec![Arc::new(Floor { speed: [0.0; 3] })])
        .with_potential(Box::new(potential));
    if stops {
        s = s.with_masses(&[mass]).unwrap();
    }
    let (mut y, mut v, mut h, mut time) = (0.01, -speed, 1e-3, 0.0);
    let mut lowest = f64::INFINITY;
    while time < 0.12 && h > 1e-9 {
        let start = [0.0, y, 0.0];
        let step = StepStart {
            q_start: &start,
            q_predicted: &[0.0, y + h * v, 0.0],
            dt: h,
            time,
        };
        if let Err(e) = s.detect(&step) {
            assert!(matches!(e, CollisionError::Overrun { .. }), "{e}");
            h *= 0.75;
            continue;
        }
        let mut end = y + h * v;
        for _ in 0..20 {
            let (_, out) = evaluate(&mut s, &[0.0, end, 0.0], &start, h);
            let (f, k) = match out.body_force.first() {
                Some(f) => (f[1], out.body_curvature[0][1][1]),
                None => (0.0, 0.0),
            };
            let b = mass * (y + h * v - end) + h * h * f;
            end += b / (mass + h * h * k);
        }
        v = (end - y) / h;
        y = end;
        time += h;
        h = (h / 0.9).min(1e-3);
        lowest = lowest.min(y);
    }
    (v, lowest)
}

/// A point with more energy than the penalty takes up is stopped within the
/// depth that is allowed, whatever its speed, and does not come back faster
/// than the penalty alone throws it; without masses it goes right through.
#[test]
fn fast_points_are_stopped() {
    for speed in [20.0, 1e2, 1e3, 1e5] {
        let (v, lowest) = thrown(speed, true);
        println!("{speed} m/s: {v} m/s in the end, {lowest} m");
        assert!(lowest > -4.5e-3, "{speed} m/s: {lowest} m");
        assert!(v.abs() < 16.0, "{speed} m/s: {v} m/s");
    }
    let (_, lowest) = thrown(1e3, false);
    assert!(lowest < -1.0, "{lowest} m: the test is too easy");
}

/// A point that the penalty can stop is left to it, to the last bit.
#[test]
fn slow_points_know_no_impacts() {
    for speed in [0.1, 1.0, 10.0] {
        assert_eq!(thrown(speed, true), thrown(speed, false));
    }
}
