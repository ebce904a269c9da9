//! Friction of sliding contacts by anchored springs.

use nalgebra::{DMatrix, DVector};
use selvedge_energy::{
    Batch, Curvature, DofLayout, EnergyBatch, EvalPoint, StencilEnergy, check_derivatives,
    check_projection,
};
use selvedge_yarn_model::{
    Draft, FrictionSettings, NetworkBuilder, SlidingFriction, StickRule, StitchContact, Visit,
    Woven, YarnMaterial, YarnNetwork, YarnStretch,
};
use serde_json::Value;

const RULES: [StickRule; 2] = [StickRule::Iterate, StickRule::Start];

fn settings(stick: StickRule) -> FrictionSettings {
    FrictionSettings {
        stick,
        ..FrictionSettings::default()
    }
}

fn oracle() -> Value {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/oracles/friction.json");
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn number(case: &Value, key: &str) -> f64 {
    case[key].as_f64().unwrap()
}

/// `k_f` and `μ` of the reference values.
fn yarn() -> YarnMaterial {
    let oracle = oracle();
    YarnMaterial {
        anchor_stiffness: number(&oracle, "k_f"),
        friction: number(&oracle, "mu"),
        ..YarnMaterial::default()
    }
}

fn crossing() -> YarnNetwork {
    let cloth = Woven::new([1, 1], [1e-3; 2], yarn());
    cloth.build(&Draft::named("plain").unwrap()).unwrap()
}

/// A child drawn through two parents; nodes A, B, then the yarns' ends.
fn double_stitch(material: YarnMaterial) -> YarnNetwork {
    let mut builder = NetworkBuilder::new(vec![material]);
    let front = [0.0, 0.0, 1.0];
    let places = [
        [0.0, 0.0],
        [0.1e-3, 0.9e-3],
        [1.0e-3, -1.2e-3],
        [-0.9e-3, 2.0e-3],
        [1.3e-3, -1.0e-3],
        [-1.1e-3, 2.2e-3],
        [-1.2e-3, -0.3e-3],
        [-0.2e-3, 2.6e-3],
    ];
    for (k, [x, y]) in places.into_iter().enumerate() {
        // Not flat, so that wings have an angle.
        let z = 1e-4 * [0.0, 1.0, 2.0, -1.0, 3.0, 1.0, -2.0, 1.0][k];
        builder.node([x, y, z], [x, y], front);
    }
    let visit = |node, layer, arc: f64| Visit {
        node,
        layer,
        arc: 1e-3 * arc,
        held: false,
    };
    for (parent, ends) in [[2, 3], [4, 5]].into_iter().enumerate() {
        let parent = parent as u8;
        builder.yarn(
            0,
            vec![
                visit(ends[0], 0, 0.0),
                visit(0, parent, 1.5),
                visit(1, parent + 1, 2.5),
                visit(ends[1], 0, 4.0),
            ],
        );
    }
    let child = [(6, 0, 0.0), (0, 2, 1.2), (1, 0, 2.2), (7, 0, 4.0)];
    builder.yarn(0, child.map(|(n, l, a)| visit(n, l, a)).to_vec());
    builder.stitch(StitchContact {
        a: 0,
        b: 1,
        purl: false,
        side: -1,
        parents: 2,
        rest: 1.2e-3,
        row: 0,
        column: 0,
    });
    builder.build().unwrap()
}

fn layout(network: &YarnNetwork) -> DofLayout {
    DofLayout {
        points: network.nodes(),
        scalars: network.strands.len(),
    }
}

/// Points and arc lengths of a network.
fn state(network: &YarnNetwork) -> Vec<f64> {
    let points = network.points.iter().flatten().copied();
    points
        .chain(network.strands.iter().map(|s| s.arc))
        .collect()
}

fn at<'a>(network: &YarnNetwork, q: &'a [f64], q_start: &'a [f64]) -> EvalPoint<'a> {
    EvalPoint {
        layout: layout(network),
        q,
        q_start,
        dt: 1e-3,
    }
}

#[test]
fn golden_single_anchor() {
    let network = crossing();
    let first = 3 * network.nodes();
    for stick in RULES {
        for case in oracle()["single"].as_array().unwrap() {
            let lambda = number(case, "lam");
            let mut friction =
                SlidingFriction::prescribed(&network, settings(stick), &[lambda]).unwrap();
            let mut q = state(&network);
            let (u, anchor) = (number(case, "u"), number(case, "ubar"));
            // The other yarn one limit further, to tell the two apart.
            (q[first], q[first + 1]) = (u, u);
            friction.restore_history(&[anchor, u]);
            let at = at(&network, &q, &q);
            friction.begin_step(&at);
            let mut g = [f64::NAN; 2];
            friction.gradient(0, &[u, u], &at, &mut g);
            assert!((-g[0] - number(case, "F")).abs() < 1e-16, "{case} {g:?}");
            assert_eq!(g[1], 0.0);
            friction.commit(&at);
            let [moved, other] = friction.anchors()[0];
            assert!((moved - number(case, "ubar_new")).abs() < 1e-18, "{case}");
            assert_eq!(other, u);
        }
    }
}

#[test]
fn golden_parallel_pair() {
    let network = double_stitch(yarn());
    let first = 3 * network.nodes();
    let strands = network.parents_at_a(&network.stitches[0]);
    for stick in RULES {
        for case in oracle()["parallel_pair"].as_array().unwrap() {
            let mut lambda = vec![0.0; network.strands.len() - network.nodes()];
            lambda[0] = number(case, "lam");
            let mut friction =
                SlidingFriction::prescribed(&network, settings(stick), &lambda).unwrap();
            let e = friction
                .stencils()
                .iter()
                .position(|s| s[0] == strands.start);
            let e = e.unwrap();
            let mut q = state(&network);
            let u = [number(case, "ui"), number(case, "uj")];
            q[first + strands.start as usize] = u[0];
            q[first + strands.start as usize + 1] = u[1];
            let mut history = friction.history().to_vec();
            history[2 * e] = number(case, "ubar_i");
            history[2 * e + 1] = number(case, "ubar_j");
            friction.restore_history(&history);
            let at = at(&network, &q, &q);
            friction.begin_step(&at);
            let mut g = [f64::NAN; 2];
            friction.gradient(e, &u, &at, &mut g);
            assert!((-g[0] - number(case, "Fi")).abs() < 1e-16, "{case} {g:?}");
            assert!((-g[1] - number(case, "Fj")).abs() < 1e-16, "{case} {g:?}");
            friction.commit(&at);
            let [i, j] = friction.anchors()[e];
            assert!((i - number(case, "ubar_i_new")).abs() < 1e-18, "{case}");
            assert!((j - number(case, "ubar_j_new")).abs() < 1e-18, "{case}");
        }
    }
}

#[test]
fn stencils_only_where_yarns_slide() {
    let network = double_stitch(yarn());
    let all = vec![1.0; 4];
    let friction = SlidingFriction::prescribed(&network, settings(StickRule::Iterate), &all);
    let friction = friction.unwrap();
    let pairs: Vec<_> = friction.stencils().to_vec();
    assert_eq!(pairs, [[0, 1], [1, 2], [3, 4], [4, 5]]);
    // No friction, no object.
    let smooth = YarnMaterial {
        friction: 0.0,
        ..yarn()
    };
    assert!(SlidingFriction::new(&double_stitch(smooth), FrictionSettings::default()).is_none());
    // Without fringe the only strands are ends, which are held.
    let mut cloth = Woven::new([2, 2], [1e-3; 2], yarn());
    cloth.fringe = [0.0; 2];
    let held = cloth.build(&Draft::named("plain").unwrap()).unwrap();
    assert!(SlidingFriction::new(&held, FrictionSettings::default()).is_none());
}

/// Second derivatives against differences, in stick, in slip and without
/// compression, with damping; the gradient against the value, which holds as
/// long as the compression is frozen.
#[test]
fn derivatives() {
    let network = double_stitch(yarn());
    let rest = state(&network);
    let lambda = [0.5, 0.01, 0.0, 0.3];
    for stick in RULES {
        let settings = FrictionSettings {
            damping: 1.0,
            ..settings(stick)
        };
        let friction = SlidingFriction::prescribed(&network, settings, &lambda).unwrap();
        let batch = Batch::<_, 2, 2>::new("friction", friction);
        let mut q = rest.clone();
        let first = 3 * network.nodes();
        for (k, u) in q[first..].iter_mut().enumerate() {
            *u += 2e-5 * (k as f64 - 1.7);
        }
        let mut q_start = rest.clone();
        for (k, u) in q_start[first..].iter_mut().enumerate() {
            *u += 1.6e-5 * (k as f64 - 1.7);
        }
        let at = at(&network, &q, &q_start);
        // Scalars have no size of their own; the checks step by 3e-5 to 3e-3.
        let scaled: Vec<f64> = q.clone();
        let at = EvalPoint { q: &scaled, ..at };
        check_projection(&batch, &at, Curvature::Projected, 1e-12).unwrap();
        for e in 0..batch.len() {
            let stencil = batch.nodes(e);
            let (mut g, mut h) = ([0.0; 2], [0.0; 4]);
            batch.hessians(&at, Curvature::Exact, e..e + 1, &mut g, &mut h);
            for (a, s) in stencil.iter().enumerate() {
                let step = 1e-9;
                let moved = |by: f64| {
                    let mut q = scaled.clone();
                    q[first + *s as usize] += by;
                    let at = EvalPoint { q: &q, ..at };
                    let mut g = [0.0; 2];
                    let value = batch.gradients(&at, e..e + 1, &mut g);
                    (value, g)
                };
                let (plus, minus) = (moved(step), moved(-step));
                let slope = (plus.0 - minus.0) / (2.0 * step);
                assert!((slope - g[a]).abs() < 1e-7, "{stick:?} {e} {slope} {g:?}");
                for b in 0..2 {
                    let bend = (plus.1[b] - minus.1[b]) / (2.0 * step);
                    let scale = 1e-5 * batch.energy().limits()[e].max(1.0) * 1e3;
                    assert!((bend - h[2 * b + a]).abs() < scale, "{bend} {h:?}");
                }
            }
        }
    }
    let friction = SlidingFriction::prescribed(&network, settings(StickRule::Iterate), &[1e9; 4]);
    let batch = Batch::<_, 2, 2>::new("friction", friction.unwrap());
    check_derivatives(&batch, &at(&network, &rest, &rest), 1e-9).unwrap();
}

/// Twice the anchor damping is twice the force, in stick.
#[test]
fn damping_is_critical_by_default_scale() {
    let network = crossing();
    let settings = FrictionSettings {
        damping: 1.0,
        ..FrictionSettings::default()
    };
    let friction = SlidingFriction::prescribed(&network, settings, &[1e3]).unwrap();
    let start = state(&network);
    let first = 3 * network.nodes();
    let mut q = start.clone();
    q[first] += 1e-6;
    let mut g = [0.0; 2];
    let u = [q[first], q[first + 1]];
    friction.gradient(0, &u, &at(&network, &q, &start), &mut g);
    let m = yarn();
    // Segments beside the crossing are half a spacing long.
    let d_f = 2.0 * (m.anchor_stiffness * m.line_density() * 0.5e-3 / 3.0).sqrt();
    let expected = 1e-6 * (m.anchor_stiffness + d_f / 1e-3);
    assert!(
        (g[0] - expected).abs() < 1e-12 * expected,
        "{g:?} {expected}"
    );
}

/// A yarn that goes and comes back: it sticks below the limit, slips at it,
/// and the way back starts with twice the limit of elastic play.
#[test]
fn hysteresis() {
    let network = crossing();
    let first = 3 * network.nodes();
    let mut friction =
        SlidingFriction::prescribed(&network, FrictionSettings::default(), &[0.05]).unwrap();
    let rest = state(&network);
    let (k, limit) = (1e3, 0.3 * 0.05);
    let mut previous = rest.clone();
    let (mut travel, mut expected) = (0.0, 0.0);
    let moves = [3e-6; 20].into_iter().chain([-3e-6; 30]);
    for step in moves {
        travel += step;
        expected = f64::clamp(expected + k * step, -limit, limit);
        let mut q = rest.clone();
        q[first] += travel;
        let at = at(&network, &q, &previous);
        friction.begin_step(&at);
        let mut g = [0.0; 2];
        friction.gradient(0, &[q[first], q[first + 1]], &at, &mut g);
        assert!((g[0] - expected).abs() < 1e-12, "{travel} {g:?} {expected}");
        friction.commit(&at);
        previous = q;
    }
    assert_eq!(expected, -limit);
}

/// Tension [N] of every segment of the weft of a chain of crossings that is
/// pulled out by `pull` [m] a step, its other end free to slide in.
fn chain(stick: StickRule, lambda: &[f64], pull: f64, steps: usize) -> Vec<Vec<f64>> {
    let n = lambda.len();
    let mut network = Woven::new([n, 1], [1e-3; 2], yarn())
        .build(&Draft::named("plain").unwrap())
        .unwrap();
    let weft: Vec<u32> = network.along(n as u32).collect();
    // The near end carries no tension: its arc length is free.
    network.strands[weft[0] as usize].held = false;
    let mut friction = SlidingFriction::prescribed(&network, settings(stick), lambda).unwrap();
    let stretch = Batch::<_, 4, 8>::new("stretch", YarnStretch::new(&network));
    let scalars = weft[..=n].iter().map(|s| 3 * network.nodes() + *s as usize);
    let free: Vec<usize> = scalars.collect();
    let end = 3 * network.strands[weft[n + 1] as usize].node as usize;
    let stiffness = yarn().stretch_stiffness();

    let mut q = state(&network);
    let mut history = Vec::new();
    for _ in 0..steps {
        let start = q.clone();
        q[end] += pull;
        friction.begin_step(&at(&network, &start, &start));
        let batch = Batch::<_, 2, 2>::new("friction", friction.clone());
        let mut converged = false;
        for _ in 0..60 {
            let (mut g, mut h) = (
                DVector::<f64>::zeros(n + 1),
                DMatrix::<f64>::zeros(n + 1, n + 1),
            );
            let place = |at: usize| free.iter().position(|f| *f == at);
            let point = at(&network, &q, &start);
            for term in [&stretch as &dyn EnergyBatch, &batch] {
                let m = term.local_dim();
                let (mut lg, mut lh) = (vec![0.0; m], vec![0.0; m * m]);
                for e in 0..term.len() {
                    term.hessians(&point, Curvature::Projected, e..e + 1, &mut lg, &mut lh);
                    let unknowns: Vec<usize> = term
                        .nodes(e)
                        .iter()
                        .zip(term.node_dims())
                        .flat_map(|(node, d)| {
                            let from = point.layout.offset(*node, *d);
                            from..from + d
                        })
                        .collect();
                    for (i, u) in unknowns.iter().enumerate() {
                        let Some(row) = place(*u) else { continue };
                        g[row] += lg[i];
                        for (j, v) in unknowns.iter().enumerate() {
                            if let Some(column) = place(*v) {
                                h[(row, column)] += lh[m * i + j];
                            }
                        }
                    }
                }
            }
            if g.amax() < 1e-12 {
                converged = true;
                break;
            }
            let d = h.lu().solve(&g).unwrap();
            for (k, f) in free.iter().enumerate() {
                q[*f] -= d[k];
            }
        }
        assert!(converged, "{stick:?}");
        friction.commit(&at(&network, &q, &start));
        let segment = |s: &[u32]| {
            let [a, b] = [s[0], s[1]].map(|s| network.strands[s as usize].node as usize);
            let du =
                q[3 * network.nodes() + s[1] as usize] - q[3 * network.nodes() + s[0] as usize];
            let ratio = (q[3 * b] - q[3 * a]).abs() / du;
            // The force on an arc length.
            0.5 * stiffness * (ratio * ratio - 1.0)
        };
        history.push(weft.windows(2).map(segment).collect());
    }
    history
}

/// A yarn pulled through crossings: each takes `μ λ` off its tension, all of
/// them the sum.
#[test]
fn chain_of_crossings() {
    let lambda = [0.05, 0.02, 0.08, 0.0, 0.04, 0.06];
    let sum: f64 = lambda.iter().map(|l| 0.3 * l).sum();
    let history = chain(StickRule::Iterate, &lambda, 2e-6, 400);
    let tension = history.last().unwrap();
    assert!(tension[0].abs() < 1e-11, "{tension:?}");
    for (k, l) in lambda.iter().enumerate() {
        let drop = tension[k + 1] - tension[k];
        assert!((drop - 0.3 * l).abs() < 1e-11, "{k} {tension:?}");
    }
    assert!((tension[lambda.len()] - sum).abs() < 1e-11);
    // From the first step on the tension never exceeds what friction can hold.
    for tension in &history {
        assert!(tension[lambda.len()] <= sum + 1e-11);
    }
    // The rule of the paper pulls with up to k_f times the way of a step too
    // much in a step that it starts at the limit.
    let history = chain(StickRule::Start, &lambda, 2e-6, 400);
    let late = history[300..].iter().map(|t| t[lambda.len()]);
    let most = late.fold(0.0, f64::max);
    println!("tension {most} N at most, friction holds {sum} N");
    assert!(most > sum + 1e-4 && most < sum + 6.0 * 1e3 * 2e-6);
}

/// In a plain weave of yarns without bending, stretched by `ε`, the compression
/// is `4 R T/l`: both yarns bend by `2 R` over every spacing.
#[test]
fn compression_of_a_stretched_plain_weave() {
    let mut material = yarn();
    material.bending_modulus = 0.0;
    let (radius, k_s) = (material.radius, material.stretch_stiffness());
    let network = Woven::new([6, 6], [4e-3; 2], material)
        .build(&Draft::named("plain").unwrap())
        .unwrap();
    let mut friction = SlidingFriction::new(&network, FrictionSettings::default()).unwrap();
    let mut q = state(&network);
    for x in &mut q[..3 * network.nodes()] {
        *x *= 1.01;
    }
    let at = at(&network, &q, &q);
    friction.begin_step(&at);
    let l = ((1.01 * 4e-3_f64).powi(2) + 4.0 * radius * radius).sqrt();
    let expected = 4.0 * radius * k_s * (1.0 / 4e-3 - 1.0 / l);
    let lambda = friction.compression().unwrap().lambda();
    // Crossings come first, one interface each; the ring around is at the rim.
    for j in 1..5 {
        for i in 1..5 {
            let found = lambda[6 * j + i];
            assert!(
                (found - expected).abs() < 1e-12 * expected,
                "{found} {expected}"
            );
        }
    }
    for (limit, lambda) in friction.limits().iter().zip(lambda) {
        assert!((limit - 0.3 * lambda).abs() < 1e-16);
    }
}

/// Compressions and their normals turn with the cloth, upside down too; and
/// they point from front to back.
#[test]
fn compression_turns_with_the_cloth() {
    for name in Draft::NAMES {
        let network = Woven::new([8, 8], [2e-3; 2], yarn())
            .build(&Draft::named(name).unwrap())
            .unwrap();
        let mut friction = SlidingFriction::new(&network, FrictionSettings::default()).unwrap();
        let mut q = state(&network);
        let points = 3 * network.nodes();
        for (k, x) in q[..points].iter_mut().enumerate() {
            *x *= 1.05;
            if k % 3 == 2 {
                *x += 2e-4 * (k as f64).sin();
            }
        }
        friction.begin_step(&at(&network, &q, &q));
        let before = friction.compression().unwrap().clone();
        for n in before.normals() {
            assert!(n[2] < -0.9, "{n:?}");
        }
        assert!(before.lambda().iter().any(|l| *l > 1e-3));
        for p in q[..points].as_chunks_mut::<3>().0 {
            *p = [p[2], -p[1], p[0]];
        }
        friction.begin_step(&at(&network, &q, &q));
        let after = friction.compression().unwrap();
        for (a, b) in before.normals().zip(after.normals()) {
            let turned = [a[2], -a[1], a[0]];
            assert!(
                (0..3).all(|k| (turned[k] - b[k]).abs() < 1e-12),
                "{a:?} {b:?}"
            );
        }
        for (a, b) in before.lambda().iter().zip(after.lambda()) {
            assert!((a - b).abs() < 1e-10, "{a} {b}");
        }
    }
}

/// A fresh object with a restored history goes on bit for bit, and so do other
/// numbers of threads.
#[test]
fn history_and_threads() {
    let network = double_stitch(yarn());
    let woven = Woven::new([40, 40], [2e-3; 2], yarn())
        .build(&Draft::named("satin-5").unwrap())
        .unwrap();
    for network in [network, woven] {
        let run = |threads: usize, resume: bool| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.unwrap().install(|| {
                let new = || SlidingFriction::new(&network, FrictionSettings::default()).unwrap();
                let mut friction = new();
                let mut q = state(&network);
                for step in 0..6 {
                    let start = q.clone();
                    for (k, x) in q.iter_mut().enumerate() {
                        let size = if k < 3 * network.nodes() { 1e-4 } else { 2e-5 };
                        *x += size * ((k * (step + 3)) as f64).sin();
                    }
                    if resume && step == 3 {
                        let history = friction.history().to_vec();
                        friction = new();
                        friction.restore_history(&history);
                    }
                    friction.begin_step(&at(&network, &start, &start));
                    friction.commit(&at(&network, &q, &start));
                }
                let all = friction.history().iter().chain(friction.limits());
                all.map(|x| x.to_bits()).collect::<Vec<_>>()
            })
        };
        let reference = run(1, false);
        assert!(reference == run(1, true), "resumed");
        assert!(reference == run(2, false), "threads");
        let other = run(1, false).iter().filter(|b| **b != 0).count();
        assert!(other > network.nodes() / 2);
    }
}

/// Collapsed points, crossed arc lengths and numbers that are none give finite
/// limits.
#[test]
fn degenerate_states() {
    let network = double_stitch(yarn());
    let rest = state(&network);
    let points = 3 * network.nodes();
    let mut states = vec![rest.clone(); 4];
    states[0][..points].fill(0.0);
    states[1][points..].fill(1.0);
    states[2][points..].reverse();
    states[3][0] = f64::NAN;
    for q in &states {
        let mut friction = SlidingFriction::new(&network, FrictionSettings::default()).unwrap();
        friction.begin_step(&at(&network, q, q));
        assert!(friction.limits().iter().all(|l| l.is_finite() && *l >= 0.0));
    }
}
