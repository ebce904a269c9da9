//! Stiffness-proportional damping.

use selvedge_energy::{
    Batch, Curvature, DofLayout, EnergyBatch, EvalPoint, check_derivatives, check_projection,
};
use selvedge_yarn_model::{
    Draft, PlainBending, RayleighDamping, Woven, YarnMaterial, YarnNetwork, YarnShear, YarnStretch,
};

const BETA: f64 = 0.02;

fn network() -> YarnNetwork {
    Woven::new([4, 5], [2e-3; 2], YarnMaterial::default())
        .build(&Draft::named("plain").unwrap())
        .unwrap()
}

/// The network bent and slid by two amounts.
fn state(network: &YarnNetwork, size: f64) -> Vec<f64> {
    let points = network.points.iter().flatten().copied();
    let rest = points.chain(network.strands.iter().map(|s| s.arc));
    let moved = |(k, x): (usize, f64)| x + size * (5.0 * k as f64).sin();
    rest.enumerate().map(moved).collect()
}

type Make = fn(&YarnNetwork) -> Box<dyn EnergyBatch>;

const ENERGIES: [Make; 3] = [
    |n| Box::new(Batch::<_, 4, 8>::new("stretch", YarnStretch::new(n))),
    |n| Box::new(Batch::<_, 5, 11>::new("bending", PlainBending::new(n))),
    |n| Box::new(Batch::<_, 3, 9>::new("shear", YarnShear::new(n))),
];

/// Values, forces and matrices of the damping are those of the definition, by
/// ranges too; and they add to those of the energy.
#[test]
fn definition() {
    let network = network();
    let (q, q_start) = (state(&network, 2e-4), state(&network, -1e-4));
    let layout = DofLayout {
        points: network.nodes(),
        scalars: network.strands.len(),
    };
    let at = EvalPoint {
        layout,
        q: &q,
        q_start: &q_start,
        dt: 1e-3,
    };
    let start = EvalPoint { q: &q_start, ..at };
    for make in ENERGIES {
        let energy = make(&network);
        // Of each stencil its own, zero among them.
        let beta: Vec<f64> = (0..energy.len()).map(|e| BETA * (e % 3) as f64).collect();
        let damping = RayleighDamping::new(make(&network), beta.clone());
        let both = RayleighDamping::added_to(make(&network), beta.clone());
        let (m, n) = (energy.local_dim(), energy.len());
        assert!(n > 16 && damping.len() == n && damping.name() != energy.name());
        let (mut g0, mut k) = (vec![0.0; n * m], vec![0.0; n * m * m]);
        energy.hessians(&start, Curvature::Projected, 0..n, &mut g0, &mut k);
        let (mut ge, mut he) = (vec![0.0; n * m], vec![0.0; n * m * m]);
        let value = energy.hessians(&at, Curvature::Exact, 0..n, &mut ge, &mut he);
        let run = |batch: &dyn EnergyBatch| {
            let (mut g, mut h) = (vec![f64::NAN; n * m], vec![f64::NAN; n * m * m]);
            let value = batch.hessians(&at, Curvature::Exact, 0..n, &mut g, &mut h);
            let mut again = vec![f64::NAN; 3 * m];
            let part = batch.gradients(&at, 7..10, &mut again);
            assert_eq!(again, g[7 * m..10 * m]);
            assert!((batch.value(&at, 7..10) - part).abs() < 1e-15 * part.abs());
            assert!((batch.value(&at, 0..n) - value).abs() < 1e-13 * value.abs());
            (value, g, h)
        };
        let (d, dg, dh) = run(&damping);
        let (b, bg, bh) = run(&both);
        assert!((b - value - d).abs() < 1e-12 * b && d > 0.0);
        let largest = |v: &[f64]| v.iter().fold(0.0_f64, |a, x| a.max(x.abs()));
        let (gs, hs) = (largest(&bg).max(largest(&dg)), largest(&bh));
        let mut expected = 0.0;
        for e in 0..n {
            let mut change = Vec::new();
            for (node, dim) in energy.nodes(e).iter().zip(energy.node_dims()) {
                let from = layout.offset(*node, *dim);
                change.extend((from..from + dim).map(|u| q[u] - q_start[u]));
            }
            for i in 0..m {
                let row = e * m + i;
                let product = (0..m).map(|j| k[row * m + j] * change[j]).sum::<f64>();
                let force = beta[e] / 1e-3 * product;
                expected += 0.5 * force * change[i];
                assert!((dg[row] - force).abs() < 1e-12 * gs);
                assert!((bg[row] - ge[row] - force).abs() < 1e-12 * gs);
                for j in row * m..row * m + m {
                    let stiffness = beta[e] / 1e-3 * k[j];
                    assert!((dh[j] - stiffness).abs() < 1e-12 * hs);
                    assert!((bh[j] - he[j] - stiffness).abs() < 1e-12 * hs);
                }
            }
        }
        assert!((d - expected).abs() < 1e-12 * d);
        for batch in [&damping, &both] {
            check_derivatives(batch, &at, 1e-7).unwrap();
            check_projection(batch, &at, Curvature::Projected, 1e-9).unwrap();
        }
        // No motion, no damping.
        assert_eq!(damping.value(&start, 0..n), 0.0);
    }
}
