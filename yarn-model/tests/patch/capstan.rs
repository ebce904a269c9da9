use std::f64::consts::PI;

use selvedge_energy::{Batch, EnergyBatch, StencilEnergy};
use selvedge_yarn_model::{
    CompressionSettings, FrictionSettings, NetworkBuilder, SlidingFriction, Visit, YarnMaterial,
    YarnNetwork, YarnStretch,
};

use crate::statics::{at, gradient, settle, state};

const RADIUS: f64 = 0.01;
const TAIL: f64 = 0.05;
const WIDTH: f64 = 2e-3;
/// Tension of the slack side [N].
const LOAD: f64 = 0.01;

fn yarn(friction: f64) -> YarnMaterial {
    YarnMaterial {
        radius: 1e-4,
        stretch_modulus: 1e9,
        bending_modulus: 0.0,
        friction,
        ..YarnMaterial::default()
    }
}

struct Capstan {
    network: YarnNetwork,
    /// Strands of the yarn that is pulled, from the slack to the tight end.
    yarn: Vec<u32>,
    /// Directions in which the yarn leaves at its slack and at its tight end.
    away: [[f64; 2]; 2],
}

/// A yarn around `n` yarns that are parallel to z and stretched at places on a
/// cylinder; it turns by `wrap/n` at each.
fn capstan(n: usize, wrap: f64, friction: f64) -> Capstan {
    let material = yarn(friction);
    let (turn, k) = (wrap / n as f64, material.stretch_stiffness());
    let slack = 1.0 / (1.0 + LOAD / k);
    let mut builder = NetworkBuilder::new(vec![material]);
    let out = |angle: f64| [angle.sin(), angle.cos(), 0.0];
    let angle = |i: usize| (i as f64 - 0.5 * (n - 1) as f64) * turn;
    let along = |angle: f64| [angle.cos(), -angle.sin()];
    let place = |i: usize| out(angle(i)).map(|x| RADIUS * x);
    for i in 0..n {
        builder.node(place(i), [i as f64, 0.0], out(angle(i)));
    }
    let first = along(angle(0) - 0.5 * turn).map(|x| -x);
    let last = along(angle(n - 1) + 0.5 * turn);
    let beyond = |p: [f64; 3], d: [f64; 2]| [p[0] + TAIL * d[0], p[1] + TAIL * d[1], 0.0];
    let ends = [(0, first), (n - 1, last)]
        .map(|(i, d)| builder.node(beyond(place(i), d), [i as f64, 1.0], out(angle(i))));
    let visit = |node, layer, arc, held| Visit {
        node,
        layer,
        arc,
        held,
    };
    let chord = 2.0 * RADIUS * (0.5 * turn).sin();
    let mut visits = vec![visit(ends[0], 0, 0.0, true)];
    for i in 0..n {
        let arc = slack * (TAIL + i as f64 * chord);
        visits.push(visit(i as u32, 0, arc, false));
    }
    let arc = slack * (2.0 * TAIL + (n - 1) as f64 * chord);
    visits.push(visit(ends[1], 0, arc, true));
    builder.yarn(0, visits);
    for i in 0..n {
        let [low, high] = [-WIDTH, WIDTH].map(|z| {
            let [x, y, _] = place(i);
            builder.node([x, y, z], [i as f64, z], out(angle(i)))
        });
        let arc = |k: f64| k * WIDTH / 1.02;
        let held = [
            visit(low, 0, 0.0, true),
            visit(i as u32, 1, arc(1.0), true),
            visit(high, 0, arc(2.0), true),
        ];
        builder.yarn(0, held.to_vec());
        builder.crossing(i as u32);
    }
    let network = builder.build().unwrap();
    Capstan {
        yarn: network.along(0).collect(),
        network,
        away: [first, last],
    }
}

struct Pulled {
    /// Tension of every segment on points and on arc lengths [N].
    tension: Vec<[f64; 2]>,
    /// Compression of every crossing [N].
    lambda: Vec<f64>,
    /// Turn of the yarn at every crossing [rad].
    turns: Vec<f64>,
    /// Force at the end that is pulled [N].
    force: f64,
}

fn pull(c: &Capstan, steps: usize, way: f64) -> Pulled {
    let (network, n) = (&c.network, c.yarn.len() - 2);
    // Without thickness: the tension's directions are those of the nodes.
    let settings = FrictionSettings {
        compression: CompressionSettings {
            crimp: 1e-6,
            ..CompressionSettings::default()
        },
        ..FrictionSettings::default()
    };
    let mut friction = SlidingFriction::new(network, settings).expect("friction");
    let stretch = Batch::<_, 4, 8>::new("stretch", YarnStretch::new(network));
    let node = |s: u32| network.strands[s as usize].node as usize;
    let scalar = |s: u32| 3 * network.nodes() + s as usize;
    let slack = node(c.yarn[0]);
    let mut free: Vec<usize> = (0..3 * n).chain(3 * slack..3 * slack + 3).collect();
    free.extend(c.yarn[1..=n].iter().map(|s| scalar(*s)));
    let loads = [0, 1].map(|i| (3 * slack + i, LOAD * c.away[0][i]));
    let tight = 3 * node(c.yarn[n + 1]);
    let mut q = state(network);
    let mut force = 0.0;
    for _ in 0..steps {
        let start = q.clone();
        for i in 0..2 {
            q[tight + i] += way * c.away[1][i];
        }
        friction.begin_step(&at(network, &start, &start));
        let batch = Batch::<_, 2, 2>::new("friction", friction.clone());
        let terms: [&dyn EnergyBatch; 2] = [&stretch, &batch];
        settle(&terms, network, &mut q, &start, &free, &loads, 1e-10);
        let (_, g) = gradient(&terms, &at(network, &q, &start));
        force = g[tight].hypot(g[tight + 1]);
        friction.commit(&at(network, &q, &start));
    }
    let x = |s: u32| {
        let p = 3 * node(s);
        nalgebra::Vector3::new(q[p], q[p + 1], q[p + 2])
    };
    let k = network.materials[0].stretch_stiffness();
    let tension = c.yarn.windows(2).map(|s| {
        let w = (x(s[1]) - x(s[0])).norm() / (q[scalar(s[1])] - q[scalar(s[0])]);
        [k * (w - 1.0), 0.5 * k * (w * w - 1.0)]
    });
    let turns = c
        .yarn
        .windows(3)
        .map(|s| (x(s[1]) - x(s[0])).angle(&(x(s[2]) - x(s[1]))));
    let interface = |s: &u32| *s as usize - node(*s);
    let all = friction.compression().expect("computed").lambda();
    Pulled {
        tension: tension.collect(),
        turns: turns.collect(),
        lambda: c.yarn[1..=n].iter().map(|s| all[interface(s)]).collect(),
        force,
    }
}

/// `T_{i+1} = T_i + μ λ_i` with `λ_i = (T_i + T_{i+1}) sin(δ_i/2)` at every
/// crossing, in all `e^{μ φ}` for many, and the end carries the sum of friction.
#[test]
fn tension_around_a_cylinder() {
    for (n, wrap, mu) in [(40, PI, 0.3), (40, 0.5 * PI, 0.5), (20, 0.5 * PI, 0.1)] {
        let c = capstan(n, wrap, mu);
        let p = pull(&c, 120, 2e-6);
        assert_eq!(p.lambda.len(), n);
        let mut ratio = 1.0;
        for i in 0..n {
            let ([a, on_a], [b, on_b]) = (p.tension[i], p.tension[i + 1]);
            let taken = on_b - on_a - mu * p.lambda[i];
            assert!(taken.abs() < 1e-7 * b, "{i}: {taken} of {b}");
            let half = (0.5 * p.turns[i]).sin();
            let normal = (a + b) * half;
            let error = p.lambda[i] / normal - 1.0;
            // At the ends the neighbours lie at unlike distances, which tilts the
            // normal of the plane through them by half a turn.
            let limit = if i == 0 || i + 1 == n { 0.03 } else { 2e-3 };
            assert!(error.abs() < limit, "{i}: {} {normal}", p.lambda[i]);
            ratio *= (1.0 + mu * half) / (1.0 - mu * half);
        }
        let friction: f64 = p.lambda.iter().map(|l| mu * l).sum();
        let balance = p.force / (LOAD + friction) - 1.0;
        let phi: f64 = p.turns.iter().sum();
        let [measured, discrete, smooth] = [p.force / LOAD, ratio, (mu * wrap).exp()];
        println!(
            "n {n} wrap {wrap:.4} ({phi:.4}) mu {mu}: tension ratio {measured:.6}, of the \
             crossings {discrete:.6}, e^(mu phi) {smooth:.6}; balance {balance:.2e}"
        );
        assert!((phi / wrap - 1.0).abs() < 2e-3, "{phi}");
        assert!(balance.abs() < 0.01, "{balance}");
        assert!((measured / discrete - 1.0).abs() < 2e-3);
        assert!((measured / smooth - 1.0).abs() < 0.01);
    }
}
