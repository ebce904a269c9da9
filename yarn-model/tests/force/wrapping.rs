//! Which yarns wrap, with which sign, and angles past a half turn.

use std::f64::consts::{FRAC_PI_2, PI};

use selvedge_energy::{Batch, EnergyBatch};
use selvedge_yarn_model::{
    NetworkBuilder, StitchContact, StitchLength, StitchWrapping, Visit, WrapPair, YarnMaterial,
    YarnNetwork,
};

use super::common::{at, close, flat, number, oracle, stitch, unknowns};

/// Wings, signs and folded angles of the flat template, knit and purl, on both
/// sides and with yarns running either way.
#[test]
fn template() {
    let signs = oracle("knit_wrap");
    for side in [-1, 1] {
        for purl in [false, true] {
            for backwards in [false, true] {
                let network = stitch(YarnMaterial::default(), side, purl, backwards);
                let elements = StitchWrapping::elements(&network);
                let energy = StitchWrapping::new(&network);
                assert_eq!(elements.len(), 2);
                for (e, element) in elements.iter().enumerate() {
                    let (pair, points, fold) = match element.pair {
                        WrapPair::ChildAtA => (1, [0, 1, 5, 2], -0.2),
                        WrapPair::ChildAtB => (2, [1, 0, 4, 3], 0.2),
                    };
                    assert_eq!(element.points, points);
                    assert_eq!(element.contact, 0);
                    let expected =
                        &signs["wrap_sign_table"][&format!("knit side={side:+} pair={pair}")];
                    let mirror = if purl { -1.0 } else { 1.0 };
                    assert_eq!(element.sigma, mirror * number(&expected["sigma"]));
                    assert_eq!(element.sigma, energy.sigma(e));
                    let mut q = [0.0; 12];
                    for (place, &point) in q.as_chunks_mut::<3>().0.iter_mut().zip(&points) {
                        *place = network.points[point as usize];
                    }
                    let flat = energy.angle(e, &q).unwrap();
                    assert!(flat.abs() < 1e-15);
                    // Purl folds the other way; σ makes both positive.
                    q[8] += mirror * fold;
                    q[11] += mirror * fold;
                    let angle = energy.angle(e, &q).unwrap();
                    assert!(angle > 0.0);
                    let expected = number(&expected["psi_folded"]).abs();
                    close("folded", &[angle], &[expected], 1e-12);
                }
                assert_ne!(elements[0].pair, elements[1].pair);
                let material = &network.materials[0];
                let stiffness = material.wrapping * network.stitches[0].rest;
                assert_eq!(elements[0].stiffness, stiffness);
                assert_eq!(energy.rest_angle(), FRAC_PI_2);
            }
        }
    }
}

/// Two parents and a child: a pair of elements with either parent, none between
/// the parents, and a length for each of the three.
#[test]
fn stack() {
    let mut builder = NetworkBuilder::new(vec![YarnMaterial::default()]);
    let places = [
        [-0.3, -0.1],
        [-0.2, 0.1],
        [-0.7, -0.1],
        [-0.3, 0.9],
        [-0.8, -0.9],
        [0.2, 0.1],
        [0.3, -0.9],
        [0.25, 0.1],
    ];
    for [x, y] in places {
        builder.node([x, y, 0.0], [x, y], [0.0, 0.0, 1.0]);
    }
    // Front to back: parents 0, 1, child at A; child, parents 0, 1 at B.
    let mut yarn = |nodes: [u32; 4], layers: [u8; 2]| {
        let visits = (0..4).map(|k| Visit {
            node: nodes[k],
            layer: if k == 1 || k == 2 { layers[k - 1] } else { 0 },
            arc: k as f64,
            held: false,
        });
        builder.yarn(0, visits.collect());
    };
    yarn([2, 0, 1, 3], [2, 0]);
    yarn([4, 0, 1, 5], [0, 1]);
    yarn([6, 0, 1, 7], [1, 2]);
    builder.stitch(StitchContact {
        a: 0,
        b: 1,
        purl: false,
        side: -1,
        parents: 2,
        rest: 0.3,
        row: 0,
        column: 0,
    });
    let network = builder.build().unwrap();
    let elements = StitchWrapping::elements(&network);
    let points: Vec<_> = elements.iter().map(|e| (e.pair, e.points)).collect();
    assert_eq!(
        points,
        [
            (WrapPair::ChildAtA, [0, 1, 5, 2]),
            (WrapPair::ChildAtA, [0, 1, 7, 2]),
            (WrapPair::ChildAtB, [1, 0, 4, 3]),
            (WrapPair::ChildAtB, [1, 0, 6, 3]),
        ]
    );
    // The leg of the first parent lies on the side of the child's, folded onto
    // it: the sign is that of the template, and the angle starts at +π
    // whatever the sign of zero.
    assert!(elements.iter().all(|e| e.sigma == 1.0));
    let energy = Batch::<_, 4, 12>::new("wrapping", StitchWrapping::new(&network));
    for (angle, expected) in energy.history().iter().zip([0.0, 0.0, PI, 0.0]) {
        assert!((angle - expected).abs() < 1e-14, "{angle}");
    }
    let length = Batch::<_, 2, 2>::new("length", StitchLength::new(&network));
    assert_eq!(length.len(), 3);
}

/// A yarn that ends at the contact has no wing there.
#[test]
fn ends_have_no_wing() {
    let network = stitch(YarnMaterial::default(), -1, false, false);
    let mut cut = network.clone();
    // The child's sinker is strand 0 of its yarn: cut it off.
    let child = cut.child_at_a(&cut.stitches[0]) as usize;
    cut.strands[child].prev = selvedge_yarn_model::NONE;
    let elements = StitchWrapping::elements(&cut);
    assert_eq!(elements.len(), 1);
    assert_eq!(elements[0].pair, WrapPair::ChildAtB);
}

/// The angle goes on past a half turn, step by step, and so does the force; a
/// restored history goes on from there.
#[test]
fn past_a_half_turn() {
    let network = stitch(YarnMaterial::default(), -1, false, false);
    let mut energy = Batch::<_, 4, 12>::new("wrapping", StitchWrapping::new(&network));
    let element = StitchWrapping::elements(&network)[0];
    let state = |angle: f64| {
        // Both wings turn about the axis by half the angle, to the back.
        let mut q = unknowns(&network);
        let v = |i: usize| nalgebra::Vector3::from(network.points[i]);
        let axis = nalgebra::Unit::new_normalize(v(1) - v(0));
        for (point, way) in [(5, 1.0), (2, -1.0)] {
            let turn = nalgebra::Rotation3::from_axis_angle(&axis, way * 0.5 * angle);
            let place = v(0) + turn * (v(point) - v(0));
            q[3 * point..3 * point + 3].copy_from_slice(place.as_slice());
        }
        q
    };
    let psi = |energy: &Batch<StitchWrapping, 4, 12>, q: &[f64]| {
        let nodes = energy.nodes(0).to_vec();
        let local: Vec<f64> = nodes
            .iter()
            .flat_map(|&n| q[3 * n as usize..3 * n as usize + 3].to_vec())
            .collect();
        energy
            .energy()
            .angle(0, local[..].try_into().unwrap())
            .unwrap()
    };
    // Turns about the axis leave the wings' heights, beyond what fades.
    let stiffness = element.stiffness;
    // Which way is positive.
    let way = psi(&energy, &state(0.1)).signum();
    let steps = 40;
    for i in 0..=steps {
        let angle = 1.5 * PI * f64::from(i) / f64::from(steps);
        let q = state(way * angle);
        let at = at(&network, &q, &q);
        assert!((psi(&energy, &q) - angle).abs() < 1e-12, "{angle}");
        let value = energy.value(&at, 0..1);
        let expected = 0.5 * stiffness * (angle - FRAC_PI_2).powi(2);
        assert!((value - expected).abs() < 1e-12 * stiffness);
        energy.commit(&at);
    }
    let history = energy.history().to_vec();
    assert_eq!(history.len(), 2);
    let mut fresh = Batch::<_, 4, 12>::new("wrapping", StitchWrapping::new(&network));
    let q = state(way * 1.5 * PI);
    assert!((psi(&fresh, &q) + 0.5 * PI).abs() < 1e-12, "starts unwound");
    fresh.restore_history(&history);
    assert_eq!(psi(&fresh, &q), psi(&energy, &q));
}

/// Loops in the flat template with unit pitches: contact `(j, r)` joins the
/// head of loop `(j, r)` of row `r` to the base of the one above.
fn patch(n: u32, purl: impl Fn(u32, u32) -> bool) -> YarnNetwork {
    let mut builder = NetworkBuilder::new(vec![YarnMaterial::default()]);
    let node = |j: u32, r: u32, right: u32, b: u32| ((r * n + j) * 2 + right) * 2 + b;
    for i in 0..4 * n * n {
        let (cell, right, b) = (i / 4, i / 2 % 2, i % 2);
        let across = [0.32, 0.18][b as usize] * [-1.0, 1.0][right as usize];
        let x = f64::from(cell % n) + across;
        let y = f64::from(cell / n) + [-0.1, 0.1][b as usize];
        builder.node([x, y, 0.0], [x, y], [0.0, 0.0, 1.0]);
    }
    for r in 0..=n {
        let mut visits = Vec::new();
        for j in 0..n {
            let mut visit = |row: u32, right: u32, b: u32, child: bool| {
                let behind = (child == (b == 0)) != purl(j, row);
                visits.push(Visit {
                    node: node(j, row, right, b),
                    layer: u8::from(behind),
                    arc: visits.len() as f64,
                    held: false,
                });
            };
            if r > 0 {
                visit(r - 1, 0, 0, true);
                visit(r - 1, 0, 1, true);
            }
            if r < n {
                for (right, b) in [(0, 0), (0, 1), (1, 1), (1, 0)] {
                    visit(r, right, b, false);
                }
            }
            if r > 0 {
                visit(r - 1, 1, 1, true);
                visit(r - 1, 1, 0, true);
            }
        }
        builder.yarn(0, visits);
    }
    for i in 0..2 * n * n {
        let (j, r, right) = (i / 2 % n, i / 2 / n, i % 2);
        builder.stitch(StitchContact {
            a: node(j, r, right, 0),
            b: node(j, r, right, 1),
            purl: purl(j, r),
            side: [-1, 1][right as usize],
            parents: 1,
            rest: 1.0,
            row: r,
            column: j,
        });
    }
    builder.build().unwrap()
}

/// `Σ F_z x²` and `Σ F_z y²` of a flat patch with `k_w L = 1`: stockinette
/// curls at its sides to the back and at top and bottom to the front, garter
/// and rib do not.
#[test]
fn curl() {
    let curl = &oracle("knit_wrap")["curl"];
    let moments = |n: u32, purl: &dyn Fn(u32, u32) -> bool| {
        let network = patch(n, purl);
        let mut elements = StitchWrapping::elements(&network);
        // The reference leaves out legs of the first and last row.
        elements.retain(|e| {
            let row = network.stitches[e.contact as usize].row;
            e.pair == WrapPair::ChildAtA || (row > 0 && row + 1 < n)
        });
        assert_eq!(elements.len() as u32, 2 * n * (n - 1) + 2 * n * (n - 2));
        for element in &mut elements {
            element.stiffness = 1.0;
        }
        let energy = StitchWrapping::from_elements(&elements, &network.points, FRAC_PI_2);
        let energy = Batch::<_, 4, 12>::new("wrapping", energy);
        let q = unknowns(&network);
        let mut force = vec![0.0; network.nodes()];
        let mut used = vec![false; network.nodes()];
        let mut g = [0.0; 12];
        for e in 0..energy.len() {
            energy.gradients(&at(&network, &q, &q), e..e + 1, &mut g);
            for (i, &node) in energy.nodes(e).iter().enumerate() {
                force[node as usize] -= g[3 * i + 2];
                used[node as usize] = true;
            }
        }
        let count = used.iter().filter(|u| **u).count() as f64;
        [0, 1].map(|axis| {
            let places = network.points.iter().zip(&used).filter(|(_, u)| **u);
            let mean = places.map(|(p, _)| p[axis]).sum::<f64>() / count;
            let each = network.points.iter().zip(&force);
            each.map(|(p, f)| f * (p[axis] - mean).powi(2)).sum::<f64>()
        })
    };
    let stockinette = moments(6, &|_, _| false);
    assert!(stockinette[0] < 0.0 && stockinette[1] > 0.0);
    close(
        "stockinette",
        &stockinette,
        &flat(&curl["stockinette"]),
        1e-11,
    );
    let garter = moments(6, &|_, r| r % 2 == 1);
    let rib = moments(8, &|j, _| j / 2 % 2 == 1);
    for (name, found) in [("garter", garter), ("rib_2x2", rib)] {
        for (found, expected) in found.iter().zip(flat(&curl[name])) {
            assert!(
                (found - expected).abs() < 1e-11 * stockinette[0].abs(),
                "{name}"
            );
        }
    }
}
