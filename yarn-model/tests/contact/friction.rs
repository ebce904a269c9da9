use selvedge_energy::{
    Batch, Curvature, EnergyBatch, EvalPoint, StencilEnergy, check_derivatives, check_projection,
};
use selvedge_yarn_model::{
    Draft, FrictionSettings, SlidingFriction, StickRule, Woven, YarnMaterial,
};

use crate::common::{at, crossing, double_stitch, number, oracle, settings, state, yarn};

const RULES: [StickRule; 2] = [StickRule::Iterate, StickRule::Start];

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
            // The other yarn is at its anchor.
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
        check_projection(&batch, &at, Curvature::Projected, 1e-12).unwrap();
        for e in 0..batch.len() {
            let stencil = batch.nodes(e);
            let (mut g, mut h) = ([0.0; 2], [0.0; 4]);
            batch.hessians(&at, Curvature::Exact, e..e + 1, &mut g, &mut h);
            for (a, s) in stencil.iter().enumerate() {
                let step = 1e-9;
                let moved = |by: f64| {
                    let mut q = q.clone();
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
    // Springs that never slip are linear, whatever the size of a difference.
    check_derivatives(&batch, &at(&network, &rest, &rest), 1e-9).unwrap();
}

/// Spring and anchor damping add up while a contact sticks.
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
