//! Analytic shapes against definitions, differences and other libraries.

mod body_support;

use body_support::{Random, add_scaled, gradient_error, norm, sub};
use proptest::prelude::*;
use selvedge_collision::body::{Body, Named, Placed, Pose, Shape};

fn shapes() -> Vec<Shape> {
    let rotation = [0.3, -0.7, 0.4];
    vec![
        Shape::Sphere {
            center: [0.1, 0.2, -0.1],
            radius: 0.3,
        },
        Shape::Capsule {
            a: [-0.2, 0.0, 0.1],
            b: [0.3, 0.2, 0.0],
            radius: [0.1, 0.1],
        },
        Shape::Capsule {
            a: [-0.2, 0.0, 0.1],
            b: [0.3, 0.2, 0.0],
            radius: [0.25, 0.07],
        },
        Shape::Ellipsoid {
            center: [0.05, 0.0, 0.0],
            axes: [0.4, 0.15, 0.25],
            rotation,
        },
        Shape::Ellipsoid {
            center: [0.0; 3],
            axes: [0.3, 0.3, 0.1],
            rotation: [0.0; 3],
        },
        Shape::Box {
            center: [0.1, 0.0, 0.0],
            half: [0.3, 0.2, 0.1],
            rounding: 0.0,
            rotation,
        },
        Shape::Box {
            center: [0.1, 0.0, 0.0],
            half: [0.3, 0.2, 0.1],
            rounding: 0.04,
            rotation,
        },
        Shape::Cylinder {
            a: [0.0; 3],
            b: [0.1, 0.4, 0.2],
            radius: 0.15,
            rounding: 0.0,
        },
        Shape::Cylinder {
            a: [0.0; 3],
            b: [0.1, 0.4, 0.2],
            radius: 0.15,
            rounding: 0.03,
        },
        Shape::Plane {
            point: [0.0, 0.1, 0.0],
            normal: [0.2, 2.0, -0.3],
        },
    ]
}

/// The gradient is that of the distance; it has unit length, the point
/// `p − φ n` is on the surface, and φ is 1-Lipschitz: φ is the distance.
#[test]
fn distances_are_exact() {
    let mut random = Random(1);
    for shape in shapes() {
        let body = shape.build().unwrap();
        let mut kinks = 0;
        for _ in 0..2000 {
            let p = random.point(0.6);
            let s = body.sample(p, 0.0);
            assert!(
                (norm(s.normal) - 1.0).abs() < 1e-12,
                "{shape:?} {p:?} {s:?}"
            );
            let foot = body
                .sample(add_scaled(p, s.normal, -s.distance), 0.0)
                .distance;
            assert!(
                foot.abs() < 1e-12,
                "{shape:?} {p:?}: {foot:.1e} off the surface"
            );
            let q = random.point(0.6);
            let other = body.sample(q, 0.0).distance;
            assert!(
                (s.distance - other).abs() <= norm(sub(p, q)) + 1e-12,
                "{shape:?}"
            );
            // A difference across the medial surface shows the jump, not an error.
            kinks += usize::from(gradient_error(&*body, p, 0.0, 1e-6) > 1e-6);
        }
        assert!(
            kinks <= 2,
            "{shape:?}: {kinks} of 2000 gradients differ from differences"
        );
    }
}

/// Bounds hold every point of the inside, and touch the surface on each side.
#[test]
fn bounds_are_tight() {
    let mut random = Random(2);
    for shape in shapes() {
        let body = shape.build().unwrap();
        let b = body.bounds(0.0);
        for _ in 0..2000 {
            let p = random.point(0.7);
            assert!(
                b.contains(p) || body.sample(p, 0.0).distance > 0.0,
                "{shape:?} {p:?}"
            );
        }
        if matches!(shape, Shape::Box { .. } | Shape::Plane { .. }) {
            continue; // the box of a rotated rounded box is that of the sharp one
        }
        for axis in 0..3 {
            let mut near = f64::INFINITY;
            for _ in 0..4000 {
                let mut p: [f64; 3] = std::array::from_fn(|a| random.within(b.min[a], b.max[a]));
                p[axis] = b.max[axis];
                near = near.min(body.sample(p, 0.0).distance);
            }
            assert!(
                (-1e-12..0.02).contains(&near),
                "{shape:?}: axis {axis}, {near}"
            );
        }
    }
}

/// Points where a formula divides by zero: centres, axes, corners, medial sets.
#[test]
fn special_points_are_finite() {
    for shape in shapes() {
        let body = shape.build().unwrap();
        let center = match shape {
            Shape::Sphere { center, .. }
            | Shape::Ellipsoid { center, .. }
            | Shape::Box { center, .. } => center,
            Shape::Capsule { a, .. } | Shape::Cylinder { a, .. } => a,
            Shape::Plane { point, .. } => point,
            _ => [0.0; 3],
        };
        for p in [
            center,
            [0.0; 3],
            [0.05, 0.2, 0.1],
            [1e6, -1e6, 1e6],
            [1e-300; 3],
        ] {
            let s = body.sample(p, 0.0);
            assert!(
                s.distance.is_finite() && (norm(s.normal) - 1.0).abs() < 1e-9,
                "{shape:?} {p:?}"
            );
        }
    }
    // At the centre of an ellipsoid the smallest axis is the distance.
    let flat = Shape::Ellipsoid {
        center: [0.0; 3],
        axes: [0.3, 0.3, 0.1],
        rotation: [0.0; 3],
    };
    assert!((flat.build().unwrap().sample([0.0; 3], 0.0).distance + 0.1).abs() < 1e-12);
}

/// NaN and infinite positions give a distance that is not finite, and no panic.
#[test]
fn bad_positions_do_not_pass_unseen() {
    for shape in shapes() {
        let body = shape.build().unwrap();
        for axis in 0..3 {
            for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                let mut p = [0.1; 3];
                p[axis] = bad;
                let d = body.sample(p, 0.0).distance;
                assert!(!d.is_finite(), "{shape:?} {p:?}: {d}");
            }
        }
    }
}

/// Impossible numbers are refused by name.
#[test]
fn impossible_shapes_are_named() {
    let o = [0.0; 3];
    let x = [0.1, 0.0, 0.0];
    let nan = [f64::NAN, 0.0, 0.0];
    let cases = [
        (
            Shape::Sphere {
                center: nan,
                radius: 1.0,
            },
            "sphere center = NaN",
        ),
        (
            Shape::Sphere {
                center: o,
                radius: 0.0,
            },
            "sphere radius = 0",
        ),
        (
            Shape::Capsule {
                a: o,
                b: x,
                radius: [0.1, -0.1],
            },
            "capsule radius = -0.1",
        ),
        (
            Shape::Ellipsoid {
                center: o,
                axes: [1.0, 0.0, 1.0],
                rotation: o,
            },
            "ellipsoid axis = 0",
        ),
        (
            Shape::Ellipsoid {
                center: o,
                axes: [1.0, 1e-4, 1.0],
                rotation: o,
            },
            "ellipsoid axis ratio = 10000",
        ),
        (
            Shape::Box {
                center: o,
                half: [1.0; 3],
                rounding: 2.0,
                rotation: o,
            },
            "box rounding = 2",
        ),
        (
            Shape::Box {
                center: o,
                half: x,
                rounding: 0.0,
                rotation: o,
            },
            "box half length = 0",
        ),
        (
            Shape::Cylinder {
                a: o,
                b: o,
                radius: 1.0,
                rounding: 0.0,
            },
            "cylinder length = 0",
        ),
        (
            Shape::Plane {
                point: o,
                normal: o,
            },
            "plane normal length = 0",
        ),
    ];
    for (shape, message) in cases {
        let error = shape
            .build()
            .err()
            .map(|e| e.to_string())
            .unwrap_or_default();
        assert!(error.starts_with(message), "{shape:?}: `{error}`");
    }
}

/// A placed body is its body in another frame, forth and back.
#[test]
fn placed_moves_everything() {
    let shape = Shape::Box {
        center: [0.0; 3],
        half: [0.3, 0.2, 0.1],
        rounding: 0.0,
        rotation: [0.0; 3],
    };
    let pose = Pose::new([1.0, 2.0, 3.0], [0.0, 0.0, std::f64::consts::FRAC_PI_2]).unwrap();
    let body = Placed::new(Named::new("crate", shape.build().unwrap()), pose);
    // Local x is world y.
    let s = body.sample([1.0, 2.5, 3.0], 0.0);
    assert!((s.distance - 0.2).abs() < 1e-12 && (s.normal[1] - 1.0).abs() < 1e-12);
    assert_eq!(body.name(), "crate");
    let b = body.bounds(0.0);
    assert!((b.max[1] - 2.3).abs() < 1e-12 && (b.max[0] - 1.2).abs() < 1e-12);
    let p = [0.7, -0.2, 0.9];
    let back = body.from_body(body.to_body(p, 0.0), 0.0);
    assert!(norm(sub(p, back)) < 1e-14);
    assert!(Named::new("x", body).with_friction(f64::NAN).is_err());
}

fn point() -> impl Strategy<Value = [f64; 3]> {
    prop::array::uniform3(-2.0..2.0_f64)
}

proptest! {
    /// The nearest point of an ellipsoid is on it, no sampled surface point is
    /// nearer, and the sign follows the implicit equation.
    #[test]
    fn ellipsoid_distance_is_least(
        axes in prop::array::uniform3(0.01..1.0_f64),
        p in point(),
        flatten in 0..4_usize,
    ) {
        let mut p = p;
        if flatten < 3 { p[flatten] = 0.0; } // symmetry planes
        let body = Shape::Ellipsoid { center: [0.0; 3], axes, rotation: [0.0; 3] }.build().unwrap();
        let s = body.sample(p, 0.0);
        let level = |x: [f64; 3]| (0..3).map(|i| (x[i] / axes[i]).powi(2)).sum::<f64>() - 1.0;
        let foot = add_scaled(p, s.normal, -s.distance);
        prop_assert!(body.sample(foot, 0.0).distance.abs() < 1e-11);
        prop_assert!(level(foot).abs() < 1e-8);
        if level(p).abs() > 1e-9 {
            prop_assert_eq!(level(p) > 0.0, s.distance > 0.0);
        }
        let mut random = Random(7);
        for _ in 0..200 {
            let d = random.point(1.0);
            let on = std::array::from_fn(|i| axes[i] * d[i] / norm(d));
            prop_assert!(s.distance.abs() <= norm(sub(p, on)) + 1e-11);
        }
    }

    /// A rounded cone is the union of the balls along its axis.
    #[test]
    fn round_cone_is_an_envelope(
        a in point(), b in point(), p in point(),
        radius in prop::array::uniform2(0.01..1.0_f64),
    ) {
        let body = Shape::Capsule { a, b, radius }.build().unwrap();
        let found = body.sample(p, 0.0).distance;
        let steps = 2000;
        let least = (0..=steps).map(|i| {
            let s = f64::from(i) / f64::from(steps);
            let c = add_scaled(a, sub(b, a), s);
            norm(sub(p, c)) - radius[0] - s * (radius[1] - radius[0])
        }).fold(f64::INFINITY, f64::min);
        let step = (norm(sub(b, a)) + 1.0) / f64::from(steps);
        prop_assert!(found <= least + 1e-12 && found >= least - step, "{} {}", found, least);
    }
}

/// Any number, half of them of a size that shapes may have.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![prop::num::f64::ANY, -2.0..2.0_f64, 1e-9..1e9_f64, Just(0.0)]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4000))]

    /// Any numbers at all build or are refused; what is built samples finitely.
    #[test]
    fn any_numbers_are_safe(
        v in prop::array::uniform9(number()), kind in 0..6, p in point(),
    ) {
        let (a, b, c) = ([v[0], v[1], v[2]], [v[3], v[4], v[5]], [v[6], v[7], v[8]]);
        let shape = match kind {
            0 => Shape::Sphere { center: a, radius: v[3] },
            1 => Shape::Capsule { a, b, radius: [v[6], v[7]] },
            2 => Shape::Ellipsoid { center: a, axes: b, rotation: c },
            3 => Shape::Box { center: a, half: b, rounding: v[6], rotation: [v[7], v[8], 0.0] },
            4 => Shape::Cylinder { a, b, radius: v[6], rounding: v[7] },
            _ => Shape::Plane { point: a, normal: b },
        };
        if let Ok(body) = shape.build() {
            let s = body.sample(p, 0.0);
            prop_assert!(!s.distance.is_nan(), "{:?} {:?}", shape, s);
        }
    }
}
