use nalgebra::{DMatrix, DVector};
use selvedge_energy::{Curvature, DofLayout, EnergyBatch, EvalPoint};
use selvedge_yarn_model::YarnNetwork;

/// Points and arc lengths of a network.
pub fn state(network: &YarnNetwork) -> Vec<f64> {
    let points = network.points.iter().flatten().copied();
    points
        .chain(network.strands.iter().map(|s| s.arc))
        .collect()
}

pub fn at<'a>(network: &YarnNetwork, q: &'a [f64], q_start: &'a [f64]) -> EvalPoint<'a> {
    EvalPoint {
        layout: DofLayout {
            points: network.nodes(),
            scalars: network.strands.len(),
        },
        q,
        q_start,
        dt: 1e-3,
    }
}

/// Unknowns of an element, in its order.
fn unknowns(term: &dyn EnergyBatch, e: usize, layout: &DofLayout) -> Vec<usize> {
    let nodes = term.nodes(e).iter().zip(term.node_dims());
    let each = nodes.flat_map(|(node, d)| {
        let from = layout.offset(*node, *d);
        from..from + d
    });
    each.collect()
}

/// Energy [J] and gradient [N] of all terms.
pub fn gradient(terms: &[&dyn EnergyBatch], point: &EvalPoint<'_>) -> (f64, Vec<f64>) {
    let mut sum = vec![0.0; point.q.len()];
    let mut energy = 0.0;
    for term in terms {
        let mut g = vec![0.0; term.local_dim()];
        for e in 0..term.len() {
            energy += term.gradients(point, e..e + 1, &mut g);
            for (u, g) in unknowns(*term, e, &point.layout).into_iter().zip(&g) {
                sum[u] += g;
            }
        }
    }
    (energy, sum)
}

/// Newton's method in the free unknowns under dead loads [N], until no force
/// exceeds the tolerance [N].
pub fn settle(
    terms: &[&dyn EnergyBatch],
    network: &YarnNetwork,
    q: &mut [f64],
    q_start: &[f64],
    free: &[usize],
    loads: &[(usize, f64)],
    tolerance: f64,
) {
    let mut row = vec![None; q.len()];
    for (k, f) in free.iter().enumerate() {
        row[*f] = Some(k);
    }
    for _ in 0..60 {
        let point = at(network, q, q_start);
        let mut g = DVector::<f64>::zeros(free.len());
        let mut h = DMatrix::<f64>::zeros(free.len(), free.len());
        for (u, load) in loads {
            if let Some(i) = row[*u] {
                g[i] -= load;
            }
        }
        for term in terms {
            let m = term.local_dim();
            let (mut lg, mut lh) = (vec![0.0; m], vec![0.0; m * m]);
            for e in 0..term.len() {
                term.hessians(&point, Curvature::Exact, e..e + 1, &mut lg, &mut lh);
                let places: Vec<_> = unknowns(*term, e, &point.layout)
                    .into_iter()
                    .map(|u| row[u])
                    .collect();
                for (a, i) in places.iter().enumerate() {
                    let Some(i) = *i else { continue };
                    g[i] += lg[a];
                    for (b, j) in places.iter().enumerate() {
                        if let Some(j) = *j {
                            h[(i, j)] += lh[m * a + b];
                        }
                    }
                }
            }
        }
        if g.amax() < tolerance {
            return;
        }
        let d = h.lu().solve(&g).expect("a regular matrix");
        for (k, f) in free.iter().enumerate() {
            q[*f] -= d[k];
        }
    }
    panic!("no equilibrium");
}
