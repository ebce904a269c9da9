use selvedge_energy::{DofLayout, EvalPoint};
use selvedge_yarn_model::{
    Draft, FrictionSettings, NetworkBuilder, StickRule, StitchContact, Visit, Woven, YarnMaterial,
    YarnNetwork,
};
use serde_json::Value;

pub fn settings(stick: StickRule) -> FrictionSettings {
    FrictionSettings {
        stick,
        ..FrictionSettings::default()
    }
}

pub fn oracle() -> Value {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/oracles/friction.json");
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

pub fn number(case: &Value, key: &str) -> f64 {
    case[key].as_f64().unwrap()
}

/// `k_f` and `μ` of the reference values.
pub fn yarn() -> YarnMaterial {
    let oracle = oracle();
    YarnMaterial {
        anchor_stiffness: number(&oracle, "k_f"),
        friction: number(&oracle, "mu"),
        ..YarnMaterial::default()
    }
}

pub fn crossing() -> YarnNetwork {
    let cloth = Woven::new([1, 1], [1e-3; 2], yarn());
    cloth.build(&Draft::named("plain").unwrap()).unwrap()
}

/// A child drawn through two parents; nodes A, B, then the yarns' ends.
pub fn double_stitch(material: YarnMaterial) -> YarnNetwork {
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

pub fn layout(network: &YarnNetwork) -> DofLayout {
    DofLayout {
        points: network.nodes(),
        scalars: network.strands.len(),
    }
}

/// Points and arc lengths of a network.
pub fn state(network: &YarnNetwork) -> Vec<f64> {
    let points = network.points.iter().flatten().copied();
    points
        .chain(network.strands.iter().map(|s| s.arc))
        .collect()
}

pub fn at<'a>(network: &YarnNetwork, q: &'a [f64], q_start: &'a [f64]) -> EvalPoint<'a> {
    EvalPoint {
        layout: layout(network),
        q,
        q_start,
        dt: 1e-3,
    }
}
