use nalgebra::{DMatrix, DVector};
use selvedge_energy::{Batch, Curvature, EnergyBatch, StencilEnergy};
use selvedge_yarn_model::{Draft, SlidingFriction, StickRule, Woven, YarnStretch};

use crate::common::{at, settings, state, yarn};

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
