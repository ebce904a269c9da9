//! Wrapping on knitted networks: its signs, and which way flat cloth curls.

use std::collections::BTreeMap;

use approx::assert_relative_eq;
use selvedge_energy::{DofLayout, EvalPoint, StencilEnergy};
use selvedge_yarn_model::chart::StitchPattern;
use selvedge_yarn_model::knit::{KnitOptions, knitted};
use selvedge_yarn_model::{
    StitchContact, StitchWrapping, WrapElement, WrapPair, YarnMaterial, YarnNetwork,
};
use serde_json::Value;

fn oracle() -> Value {
    serde_json::from_str(include_str!("oracles/knit.json")).unwrap()
}

/// A fabric with unit distances of loops and rows.
fn unit(name: &str, width: usize, rows: usize) -> YarnNetwork {
    let chart = StitchPattern::built_in(name).unwrap();
    let chart = chart.chart_of(width, rows).unwrap();
    let options = KnitOptions::with_gauge(YarnMaterial::default(), 1.0, 1.0, 1.0);
    knitted(&chart, &options).unwrap().network
}

/// Signs of the template, knit as tabulated and purl opposite, in the interior
/// of a garter.
#[test]
fn signs() {
    let oracle = oracle();
    let network = unit("garter", 5, 6);
    let mut seen = [0; 2];
    for e in StitchWrapping::elements(&network) {
        let contact = &network.stitches[e.contact as usize];
        if !(1..=3).contains(&contact.column) || contact.row > 5 {
            continue;
        }
        let pair = 1 + u8::from(e.pair == WrapPair::ChildAtB);
        let key = format!("knit side={:+} pair={pair}", contact.side);
        let knit = oracle["wrap_sign_table"][&key]["sigma"].as_f64().unwrap();
        let expected = if contact.purl { -knit } else { knit };
        assert_eq!(e.sigma, expected, "{key}, purl {}", contact.purl);
        seen[usize::from(contact.purl)] += 1;
    }
    assert_eq!(seen, [36, 36]);
}

/// `Σ F_z x²` and `Σ F_z y²` about the middle of all nodes touched, of the
/// wrapping elements of a square of stitches lying flat, with `k_w L = 1`.
fn moments(network: &YarnNetwork, size: u32) -> [f64; 2] {
    // Rows 1 to `size` of the chart, so that parents are loops of the chart.
    let chosen = |e: &WrapElement| {
        let StitchContact {
            side, row, column, ..
        } = network.stitches[e.contact as usize];
        let edge = match (e.pair, side) {
            (WrapPair::ChildAtA, -1) => column == 0,
            (WrapPair::ChildAtA, _) => column + 1 == size,
            (WrapPair::ChildAtB, _) => row == 1 || row == size,
        };
        (1..=size).contains(&row) && !edge
    };
    let mut elements = StitchWrapping::elements(network);
    elements.retain(chosen);
    for e in &mut elements {
        e.stiffness = 1.0;
    }
    let rest = std::f64::consts::FRAC_PI_2;
    let energy = StitchWrapping::from_elements(&elements, &network.points, rest);
    let q: Vec<f64> = network.points.iter().flatten().copied().collect();
    let at = EvalPoint {
        layout: DofLayout::points(network.nodes()),
        q: &q,
        q_start: &q,
        dt: 1e-3,
    };
    let mut force: BTreeMap<u32, f64> = BTreeMap::new();
    for (e, nodes) in energy.stencils().iter().enumerate() {
        let mut local = [0.0; 12];
        for (k, node) in nodes.iter().enumerate() {
            local[3 * k..3 * k + 3].copy_from_slice(&network.points[*node as usize]);
        }
        let mut gradient = [0.0; 12];
        energy.gradient(e, &local, &at, &mut gradient);
        for (k, node) in nodes.iter().enumerate() {
            *force.entry(*node).or_default() -= gradient[3 * k + 2];
        }
    }
    [0, 1].map(|k| {
        let x = |node: &u32| network.points[*node as usize][k];
        let middle = force.keys().map(x).sum::<f64>() / force.len() as f64;
        force.iter().map(|(n, f)| f * (x(n) - middle).powi(2)).sum()
    })
}

/// Side edges of stockinette curl to the back, top and bottom to the front, as
/// real stockinette does; garter and rib do not curl.
#[test]
fn curl() {
    let oracle = oracle();
    let golden = |name: &str, k: usize| oracle["curl"][name][k].as_f64().unwrap();
    let [x, y] = moments(&unit("stockinette", 6, 8), 6);
    assert!(x < 0.0 && y > 0.0);
    assert_relative_eq!(x, golden("stockinette", 0), max_relative = 1e-9);
    assert_relative_eq!(y, golden("stockinette", 1), max_relative = 1e-9);
    for (name, width) in [("garter", 6), ("rib-2x2", 8)] {
        let still = moments(&unit(name, width, width + 2), width as u32);
        assert!(still.iter().all(|m| m.abs() < 1e-9), "{name}: {still:?}");
    }
}
