//! Unions, and the mannequin made of one.

mod body_support;

use body_support::{Random, gradient_error, norm};
use selvedge_collision::body::{
    BakedBody, Body, FieldSettings, Shape, SmoothUnion, Union, girth, mannequin,
};

fn balls() -> Vec<Box<dyn Body>> {
    [
        ([-0.1, 0.0, 0.0], 0.2),
        ([0.15, 0.0, 0.05], 0.15),
        ([0.0, 0.3, 0.0], 0.1),
    ]
    .map(|(center, radius)| Shape::Sphere { center, radius }.build().unwrap())
    .into()
}

/// The smooth union stays between `min φ − k ln n` and `min φ`, its gradient
/// is that of its distance and at most one long; far from the crease it is the union.
#[test]
fn smooth_union_keeps_its_bounds() {
    let k = 0.02;
    let sharp = Union::new(balls()).unwrap();
    let smooth = SmoothUnion::new(balls(), k).unwrap();
    let mut random = Random(3);
    for _ in 0..5000 {
        let p = random.point(0.5);
        let (a, b) = (sharp.sample(p, 0.0), smooth.sample(p, 0.0));
        let low = a.distance - k * 3.0_f64.ln();
        assert!(b.distance <= a.distance + 1e-15 && b.distance >= low - 1e-15);
        assert!(norm(b.normal) <= 1.0 + 1e-12);
        assert!(gradient_error(&smooth, p, 0.0, 1e-5) < 1e-6, "{p:?}");
    }
    let far = [-0.4, 0.0, 0.0];
    assert!((sharp.sample(far, 0.0).distance - smooth.sample(far, 0.0).distance).abs() < 1e-7);
    // Equally near to two parts: exactly k ln 2 outside the plain union.
    let twice = || {
        Shape::Sphere {
            center: [0.0; 3],
            radius: 0.1,
        }
        .build()
        .unwrap()
    };
    let doubled = SmoothUnion::new(vec![twice(), twice()], k).unwrap();
    let d = doubled.sample([0.3, 0.0, 0.0], 0.0).distance;
    assert!((d - (0.2 - k * 2.0_f64.ln())).abs() < 1e-15);
}

/// The parts' order does not matter beyond rounding, and far points do not overflow.
#[test]
fn smooth_union_is_symmetric() {
    let forward = SmoothUnion::new(balls(), 1e-3).unwrap();
    let mut parts = balls();
    parts.reverse();
    let backward = SmoothUnion::new(parts, 1e-3).unwrap();
    for p in [[0.02, 0.15, 0.0], [0.0; 3], [50.0, -80.0, 20.0], [1e6; 3]] {
        let (a, b) = (forward.sample(p, 0.0), backward.sample(p, 0.0));
        assert!(a.distance.is_finite());
        assert!((a.distance - b.distance).abs() <= 1e-15 * (1.0 + a.distance.abs()));
    }
    assert!(forward.sample([f64::NAN; 3], 0.0).distance.is_nan());
    assert!(SmoothUnion::new(Vec::new(), 0.1).is_err());
    assert!(SmoothUnion::new(balls(), 0.0).is_err());
    assert!(Union::new(Vec::new()).is_err());
}

/// The mannequin has the measures it claims, is its own mirror image and
/// stands on the floor.
#[test]
fn mannequin_has_its_measures() {
    let body = mannequin().build().unwrap();
    let up = [0.0, 1.0, 0.0];
    let measures = [
        ([0.0, 1.470, -0.008], 0.36),
        ([0.0, 1.250, 0.0], 0.92),
        ([0.0, 1.060, 0.0], 0.76),
        ([0.0, 0.870, 0.0], 0.98),
    ];
    for (center, wanted) in measures {
        let tape = girth(&body, 0.0, center, up).unwrap().tape;
        assert!((tape - wanted).abs() < 0.01, "{center:?}: {tape}");
    }
    let mut random = Random(4);
    for _ in 0..500 {
        let p = [
            random.within(-0.8, 0.8),
            random.within(-0.1, 1.8),
            random.within(-0.3, 0.3),
        ];
        let (a, b) = (body.sample(p, 0.0), body.sample([-p[0], p[1], p[2]], 0.0));
        assert!((a.distance - b.distance).abs() < 1e-14);
        assert!(gradient_error(&body, p, 0.0, 1e-6) < 1e-5, "{p:?}");
        if p[1] < -0.003 {
            assert!(a.distance > 0.0);
        }
    }
    assert!(body.bounds(0.0).contains([0.0, 1.69, 0.02]));
}

/// A girth of a tilted cylinder is its circumference.
#[test]
fn girth_of_a_cylinder() {
    let shape = Shape::Cylinder {
        a: [0.0; 3],
        b: [0.3, 0.6, 0.1],
        radius: 0.1,
        rounding: 0.0,
    };
    let body = shape.build().unwrap();
    let found = girth(&body, 0.0, [0.15, 0.3, 0.05], [0.3, 0.6, 0.1]).unwrap();
    let exact = std::f64::consts::TAU * 0.1;
    assert!(
        (found.contour - exact).abs() < 1e-5 * exact && (found.tape - exact).abs() < 1e-5 * exact
    );
    assert_eq!(girth(&body, 0.0, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]), None);
    let floor = Shape::Plane {
        point: [0.0; 3],
        normal: [0.0, 1.0, 0.0],
    }
    .build()
    .unwrap();
    assert_eq!(girth(&floor, 0.0, [0.0, -1.0, 0.0], [0.0, 1.0, 0.0]), None);
}

/// Baking a sphere keeps its distance within `h²/8 · 2/r` near the surface.
#[test]
fn baked_sphere_meets_the_bound() {
    let (radius, h) = (0.15, 0.005);
    let ball = Shape::Sphere {
        center: [0.01, 0.0, 0.02],
        radius,
    }
    .build()
    .unwrap();
    let settings = FieldSettings::default();
    let baked = BakedBody::new(&ball, 0.0, &settings).unwrap();
    let mut random = Random(5);
    let mut worst = 0.0_f64;
    for _ in 0..50_000 {
        let p = random.point(0.2);
        let d = ball.sample(p, 0.0).distance;
        if d.abs() <= settings.band {
            worst = worst.max((baked.sample(p, 0.0).distance - d).abs());
        }
    }
    let bound = h * h / 8.0 * 2.0 / (radius - settings.band - h);
    assert!(
        worst < bound && worst > 0.2 * bound,
        "{worst:.2e} against {bound:.2e}"
    );
    let floor = Shape::Plane {
        point: [0.0; 3],
        normal: [0.0, 1.0, 0.0],
    }
    .build()
    .unwrap();
    assert!(BakedBody::new(&floor, 0.0, &settings).is_err());
}
