//! Straight, folded back, collapsed and crossed states.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Vector3};
use selvedge_energy::{Batch, Curvature, EnergyBatch};
use selvedge_yarn_model::{
    CROSSED, JammingBending, StitchWrapping, YarnBending, YarnMaterial, YarnNetwork, YarnShear,
    YarnStretch,
};

use super::common::{at, chain, close, evaluate, stitch, unknowns, weave};

const MM: f64 = 1e-3;
const ALL: [Curvature; 3] = [
    Curvature::Exact,
    Curvature::Projected,
    Curvature::GaussNewton,
];

fn rod() -> (YarnNetwork, Batch<JammingBending, 5, 11>) {
    let points = [[0.0; 3], [MM, 0.0, 0.0], [2.5 * MM, 0.0, 0.0]];
    let network = chain(YarnMaterial::default(), &points, &[0.0, MM, 2.5 * MM]);
    let bending = Batch::new("bending", YarnBending::new(&network));
    (network, bending)
}

/// A straight rod: no force, and the stiffness of an elastic beam across it,
/// `V = (k_b/Δu) |b/l_b − a/l_a|²` for small deflections.
#[test]
fn straight() {
    let (network, bending) = rod();
    let q = unknowns(&network);
    for curvature in ALL {
        let (value, g, h) = evaluate(&bending, &at(&network, &q, &q), curvature, 0);
        assert_eq!(value, 0.0);
        assert!(g.iter().all(|g| *g == 0.0));
        let k = 2.0 * network.materials[0].bending_stiffness() / (2.5 * MM);
        let (a, b) = (1.0 / MM, 1.0 / (1.5 * MM));
        let turn = [a, -a - b, b];
        let mut expected = [0.0; 121];
        for i in 0..3 {
            for j in 0..3 {
                for axis in 1..3 {
                    expected[(3 * i + axis) * 11 + 3 * j + axis] = k * turn[i] * turn[j];
                }
            }
        }
        close(&format!("{curvature:?}"), &h, &expected, 1e-13);
    }
}

/// `½ EI κ²` of a circle: many short segments of a closed bend.
#[test]
fn circle() {
    let (n, radius) = (400, 0.02);
    let points: Vec<[f64; 3]> = (0..=n)
        .map(|i| {
            let a = PI * f64::from(i) / f64::from(n);
            [radius * a.cos(), radius * a.sin(), 0.0]
        })
        .collect();
    let arcs: Vec<f64> = (0..=n)
        .map(|i| PI * radius * f64::from(i) / f64::from(n))
        .collect();
    let network = chain(YarnMaterial::default(), &points, &arcs);
    let bending: JammingBending = YarnBending::new(&network);
    let bending = Batch::<_, 5, 11>::new("bending", bending);
    let q = unknowns(&network);
    let value = bending.value(&at(&network, &q, &q), 0..bending.len());
    let expected = 0.5 * network.materials[0].bending_stiffness() / radius * PI;
    // The half segments at either end bend nothing.
    let ends = f64::from(n) / f64::from(n - 1);
    assert!(
        (value * ends / expected - 1.0).abs() < 1e-4,
        "{}",
        value / expected
    );
}

/// Folded back on itself: finite, and the force fades out.
#[test]
fn folded_back() {
    let (network, bending) = rod();
    for (angle, limit) in [(PI, 1e-12), (PI - 1e-6, 0.011), (PI - 1e-3, 1.0)] {
        let mut q = unknowns(&network);
        q[6] = MM + 1.5 * MM * f64::cos(angle);
        q[7] = 1.5 * MM * f64::sin(angle);
        if angle == PI {
            q[7] = 0.0;
        }
        // Of the slope `(k_b/Δu) E'/l` before fading.
        let slope = 2.0 * angle + 1998.0 * (angle - 0.5 * PI - PI / 24.0);
        let full = network.materials[0].bending_stiffness() / (2.5 * MM) * slope / (1.5 * MM);
        for curvature in ALL {
            let (value, g, h) = evaluate(&bending, &at(&network, &q, &q), curvature, 0);
            assert!(value > 0.0 && value.is_finite());
            assert!(h.iter().all(|h| h.is_finite()));
            let force = Vector3::from_column_slice(&g[6..9]).norm();
            assert!(
                force <= full * limit * (1.0 + 1e-9),
                "{angle}: {}",
                force / full
            );
            assert!(limit < 1.0 || force > 0.999 * full);
        }
    }
}

/// A segment without length has no direction, but its sliding does.
#[test]
fn collapsed() {
    let (network, bending) = rod();
    let mut q = unknowns(&network);
    q[3] = 0.0;
    let stretch = Batch::<_, 4, 8>::new("stretch", YarnStretch::new(&network));
    let k = network.materials[0].stretch_stiffness();
    for curvature in ALL {
        let (value, g, h) = evaluate(&bending, &at(&network, &q, &q), curvature, 0);
        assert_eq!((value, g, h), (0.0, vec![0.0; 11], vec![0.0; 121]));
        let (value, g, h) = evaluate(&stretch, &at(&network, &q, &q), curvature, 0);
        close("value", &[value], &[0.5 * k * MM], 1e-14);
        close(
            "gradient",
            &g,
            &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -0.5 * k, 0.5 * k],
            1e-14,
        );
        assert!(h.iter().all(|h| h.is_finite()));
    }
}

/// Arc lengths that meet or cross are no state, and say so.
#[test]
fn crossed() {
    let (network, bending) = rod();
    let stretch = Batch::<_, 4, 8>::new("stretch", YarnStretch::new(&network));
    for u in [0.0, -MM] {
        let mut q = unknowns(&network);
        q[10] = u;
        q[11] = u;
        let at = at(&network, &q, &q);
        for term in [&stretch as &dyn EnergyBatch, &bending] {
            let m = term.local_dim();
            let (mut g, mut h) = (vec![0.0; m], vec![0.0; m * m]);
            assert_eq!(term.value(&at, 0..1), CROSSED);
            assert_eq!(
                term.hessians(&at, Curvature::Projected, 0..1, &mut g, &mut h),
                CROSSED
            );
            assert!(g.iter().chain(&h).all(|x| x.is_nan()));
            assert_eq!(term.gradients(&at, 0..1, &mut g), CROSSED);
        }
    }
}

/// NaN must reach whoever checks.
#[test]
fn nan_passes() {
    let (network, bending) = rod();
    let stretch = Batch::<_, 4, 8>::new("stretch", YarnStretch::new(&network));
    for unknown in [3, 10] {
        let mut q = unknowns(&network);
        q[unknown] = f64::NAN;
        let at = at(&network, &q, &q);
        assert!(stretch.value(&at, 0..1).is_nan());
        // The middle arc length is no unknown of bending.
        assert_eq!(bending.value(&at, 0..1).is_nan(), unknown == 3);
    }
}

/// Collinear wings have the energy of a flat stitch and no force; collapsed
/// arms are ignored.
#[test]
fn no_angle() {
    let network = stitch(YarnMaterial::default(), -1, false, false);
    let wrapping = Batch::<_, 4, 12>::new("wrapping", StitchWrapping::new(&network));
    let stiffness = network.materials[0].wrapping * network.stitches[0].rest;
    let [x0, x1, _, x4]: [u32; 4] = wrapping.nodes(0).try_into().unwrap();
    let point = |q: &[f64], i: u32| Vector3::from_column_slice(&q[3 * i as usize..][..3]);
    let mut collinear = unknowns(&network);
    let place = 2.0 * point(&collinear, x0) - point(&collinear, x1);
    collinear[3 * x4 as usize..][..3].copy_from_slice(place.as_slice());
    let mut collapsed = unknowns(&network);
    let place = point(&collapsed, x1);
    collapsed[3 * x0 as usize..][..3].copy_from_slice(place.as_slice());
    for q in [collinear, collapsed] {
        for curvature in ALL {
            let found = evaluate(&wrapping, &at(&network, &q, &q), curvature, 0);
            let flat = 0.5 * stiffness * (0.5 * std::f64::consts::PI).powi(2);
            assert_eq!(found, (flat, vec![0.0; 12], vec![0.0; 144]));
        }
    }

    let network = weave(YarnMaterial::default(), [2, 2], MM, |_, _| true);
    let shear = Batch::<_, 3, 9>::new("shear", YarnShear::new(&network));
    let mut q = unknowns(&network);
    q[5] = 0.0;
    q[4] = 0.0;
    let found = evaluate(&shear, &at(&network, &q, &q), Curvature::Exact, 0);
    assert_eq!(found, (0.0, vec![0.0; 9], vec![0.0; 81]));
    // Sheared flat: finite, no force across.
    let mut q = unknowns(&network);
    q[4] = 0.0;
    q[3] = MM;
    let (value, g, h) = evaluate(&shear, &at(&network, &q, &q), Curvature::Projected, 0);
    assert!(value > 0.0 && h.iter().all(|h| h.is_finite()));
    assert!(g.iter().all(|g| *g == 0.0));
}

/// A bend keeps its energy when the whole is turned; forces turn along.
#[test]
fn sliding_terms_turn() {
    let (network, bending) = rod();
    let stretch = Batch::<_, 4, 8>::new("stretch", YarnStretch::new(&network));
    let mut q = unknowns(&network);
    q[0] = -0.3 * MM;
    q[6..9].copy_from_slice(&[1.4 * MM, 0.9 * MM, -0.3 * MM]);
    let turn: Matrix3<f64> = *nalgebra::Rotation3::new(Vector3::new(0.3, -1.1, 0.7)).matrix();
    let mut turned = q.clone();
    for p in turned[..9].as_chunks_mut::<3>().0 {
        *p = (turn * Vector3::from(*p) + Vector3::new(0.01, 0.02, -0.03)).into();
    }
    for term in [&stretch as &dyn EnergyBatch, &bending] {
        for e in 0..term.len() {
            let (a, ga, _) = evaluate(term, &at(&network, &q, &q), Curvature::Exact, e);
            let (b, gb, _) = evaluate(term, &at(&network, &turned, &q), Curvature::Exact, e);
            close(term.name(), &[a], &[b], 1e-12);
            let mut expected = ga.clone();
            let points = term.node_dims().iter().filter(|d| **d == 3).count();
            for p in expected[..3 * points].as_chunks_mut::<3>().0 {
                *p = (turn * Vector3::from(*p)).into();
            }
            close(term.name(), &gb, &expected, 1e-11);
        }
    }
}
