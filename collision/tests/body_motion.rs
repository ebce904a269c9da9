//! Rigid motion: poses, velocities, frames.

mod body_support;

use body_support::{Random, add_scaled, gradient_error, norm, sub};
use selvedge_collision::body::{Body, Interpolation, Keyframe, RigidMotion, Shape};

const PIVOT: [f64; 3] = [0.1, 0.5, 0.0];

fn keys() -> [Keyframe; 3] {
    [
        Keyframe {
            time: 0.5,
            translation: [0.0; 3],
            rotation: [0.0; 3],
        },
        Keyframe {
            time: 1.0,
            translation: [0.2, 0.1, 0.0],
            rotation: [0.3, 1.2, -0.4],
        },
        Keyframe {
            time: 2.0,
            translation: [0.1, 0.0, 0.4],
            rotation: [0.0, -0.5, 0.9],
        },
    ]
}

fn moving(interpolation: Interpolation) -> RigidMotion<Box<dyn Body>> {
    let shape = Shape::Box {
        center: [0.1; 3],
        half: [0.3, 0.2, 0.1],
        rounding: 0.05,
        rotation: [0.0; 3],
    };
    RigidMotion::new(shape.build().unwrap(), &keys(), PIVOT, interpolation).unwrap()
}

/// The surface velocity is the time derivative of a point fixed to the body,
/// and the distance at a fixed point changes by `−n · v`.
#[test]
fn velocity_is_the_derivative_of_the_pose() {
    let mut random = Random(1);
    for interpolation in [Interpolation::Linear, Interpolation::Eased] {
        let body = moving(interpolation);
        for time in [0.2, 0.6, 0.77, 0.999, 1.3, 1.9, 2.5] {
            for _ in 0..50 {
                let p = random.point(0.8);
                let s = body.sample(p, time);
                let foot = add_scaled(p, s.normal, -s.distance);
                let local = body.to_body(foot, time);
                let dt = 1e-5;
                let (a, b) = (
                    body.from_body(local, time - dt),
                    body.from_body(local, time + dt),
                );
                let v = sub(b, a).map(|x| x / (2.0 * dt));
                assert!(
                    norm(sub(v, s.velocity)) < 1e-8,
                    "{interpolation:?} {time} {v:?} {s:?}"
                );
                if gradient_error(&body, p, time, 1e-4) < 1e-6 {
                    let rate = (body.sample(p, time + dt).distance
                        - body.sample(p, time - dt).distance)
                        / (2.0 * dt);
                    let normal: f64 = (0..3).map(|i| s.normal[i] * s.velocity[i]).sum();
                    assert!((rate + normal).abs() < 1e-6, "{rate} {normal}");
                }
            }
        }
    }
}

/// Keys are met exactly; eased motion rests at them; outside it stands still.
#[test]
fn keys_are_met() {
    for interpolation in [Interpolation::Linear, Interpolation::Eased] {
        let body = moving(interpolation);
        for key in keys() {
            let at = body.from_body(PIVOT, key.time);
            let wanted = add_scaled(PIVOT, key.translation, 1.0);
            assert!(
                norm(sub(at, wanted)) < 1e-14,
                "the pivot follows the translation"
            );
            let v = body.sample([0.4; 3], key.time).velocity;
            if interpolation == Interpolation::Eased {
                assert!(norm(v) < 1e-12);
            }
        }
        assert_eq!(body.sample([0.4; 3], 0.1).velocity, [0.0; 3]);
        assert_eq!(body.sample([0.4; 3], 2.0).velocity, [0.0; 3]);
        assert_eq!(
            body.sample([0.4; 3], 5.0).distance,
            body.sample([0.4; 3], 2.0).distance
        );
        assert!(!body.sample([0.4; 3], f64::NAN).distance.is_nan());
    }
}

/// Many samples are the samples one by one; the bounds follow the motion.
#[test]
fn batches_and_bounds() {
    let body = moving(Interpolation::Linear);
    let mut random = Random(2);
    let points: Vec<_> = (0..100).map(|_| random.point(1.0)).collect();
    let mut many = Vec::new();
    body.sample_many(&points, 1.4, &mut many);
    assert_eq!(many.len(), points.len());
    for (p, s) in points.iter().zip(&many) {
        assert_eq!(body.sample(*p, 1.4), *s);
        assert!(s.distance > 0.0 || body.bounds(1.4).contains(*p));
    }
}

/// Times that do not increase, no keys and numbers that are not finite are refused.
#[test]
fn impossible_motions_are_refused() {
    let build = |keys: &[Keyframe]| {
        let ball = Shape::Sphere {
            center: [0.0; 3],
            radius: 0.1,
        }
        .build()
        .unwrap();
        RigidMotion::new(ball, keys, [0.0; 3], Interpolation::Linear).map(|_| ())
    };
    assert!(build(&[]).is_err());
    let [a, b, c] = keys();
    assert!(build(&[a, b, c]).is_ok());
    assert!(build(&[b, a]).is_err() && build(&[a, a]).is_err());
    assert!(
        build(&[Keyframe {
            rotation: [f64::NAN; 3],
            ..a
        }])
        .is_err()
    );
    assert!(
        build(&[Keyframe {
            time: f64::INFINITY,
            ..a
        }])
        .is_err()
    );
}
