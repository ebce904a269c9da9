//! Pieces of cloth that nothing connects do not change each other.

use selvedge_energy::{Batch, DofLayout, EnergyBatch, EvalPoint};
use selvedge_yarn_model::chart::StitchPattern;
use selvedge_yarn_model::knit::{KnitOptions, knitted};
use selvedge_yarn_model::{
    Compression, CompressionSettings, Draft, JammingBending, LockedBending, PlainBending, Woven,
    YarnMaterial, YarnNetwork, YarnShear, YarnStretch, segment_damping, stencil_damping,
};

fn weave(material: YarnMaterial) -> YarnNetwork {
    let woven = Woven::new([5, 4], [2e-3; 2], material);
    woven.build(&Draft::named("plain").unwrap()).unwrap()
}

fn knit(material: YarnMaterial) -> YarnNetwork {
    let pattern = StitchPattern::built_in("stockinette").unwrap();
    let chart = pattern.chart_of(4, 4).unwrap();
    knitted(&chart, &KnitOptions::new(material))
        .unwrap()
        .network
}

fn material(alpha: f64, beta: f64) -> YarnMaterial {
    YarnMaterial {
        mass_damping: alpha,
        stiffness_damping: beta,
        ..YarnMaterial::default()
    }
}

/// A weave alone, and in front of a knit, with the damping of either.
fn pieces() -> (YarnNetwork, YarnNetwork) {
    let alone = weave(material(0.0, 1e-3));
    let mut both = alone.clone();
    both.append(&knit(material(50.0, 0.3)));
    (alone, both)
}

/// Every yarn of the weave folded onto itself, so that bends are past π/2.
fn folded(network: &YarnNetwork, pieces: usize) -> (Vec<f64>, Vec<f64>) {
    let mut points = network.points.clone();
    for p in &mut points[..pieces] {
        p[0] = 1e-3 * (1500.0 * p[0]).sin();
        p[1] = 1e-3 * (1700.0 * p[1]).sin();
    }
    (points.as_flattened().to_vec(), network.arcs())
}

#[test]
fn bends_of_wovens_do_not_jam_beside_knits() {
    let (alone, both) = pieces();
    assert!(alone.yarns.iter().all(|y| !y.jams));
    let value = |n: &YarnNetwork, batch: &dyn EnergyBatch, sliding: bool| {
        let (mut q, arcs) = folded(n, alone.nodes());
        let scalars = if sliding { arcs.len() } else { 0 };
        q.extend(&arcs[..scalars]);
        let at = EvalPoint {
            layout: DofLayout {
                points: n.nodes(),
                scalars,
            },
            q: &q,
            q_start: &q,
            dt: 1e-3,
        };
        batch.value(&at, 0..batch.len())
    };
    let plain = |n: &YarnNetwork| {
        let some = PlainBending::of_yarns(n, |y| !y.jams);
        let locked = LockedBending::<false>::of_yarns(n, |y| !y.jams);
        [
            value(n, &Batch::<_, 5, 11>::new("bending", some), true),
            value(n, &Batch::<_, 3, 9>::new("bending", locked), false),
        ]
    };
    assert_eq!(plain(&alone), plain(&both));
    // It would make a difference.
    let all = Batch::<_, 5, 11>::new("bending", JammingBending::new(&alone));
    assert!(value(&alone, &all, true) > 2.0 * plain(&alone)[0]);
    let jams = Batch::<_, 5, 11>::new("bending", JammingBending::of_yarns(&both, |y| y.jams));
    let knit = Batch::<_, 5, 11>::new("bending", JammingBending::new(&knit(material(0.0, 0.0))));
    assert!(jams.len() == knit.len() && !jams.is_empty());
}

#[test]
fn knits_elsewhere_do_not_press_on_wovens() {
    let (alone, both) = pieces();
    let lambda = |n: &YarnNetwork| {
        let mut compression = Compression::new(n, CompressionSettings::default());
        let normals: Vec<f64> = compression.normals().flatten().collect();
        let (q, arcs) = folded(n, alone.nodes());
        compression.update(&q, &arcs, &normals);
        compression.lambda().to_vec()
    };
    let (one, two) = (lambda(&alone), lambda(&both));
    assert!(one.iter().any(|l| *l > 0.0));
    assert_eq!(one, two[..one.len()]);
}

#[test]
fn every_yarn_has_its_own_damping() {
    let (alone, both) = pieces();
    let ends = |beta: Vec<f64>| [beta[0], beta[beta.len() - 1]];
    assert_eq!(
        ends(stencil_damping(&YarnStretch::new(&both), &both)),
        [1e-3, 0.3]
    );
    assert_eq!(
        ends(stencil_damping(&PlainBending::new(&both), &both)),
        [1e-3, 0.3]
    );
    let shear = stencil_damping(&YarnShear::new(&both), &both);
    assert!(shear.iter().all(|b| *b == 1e-3));
    assert_eq!(ends(segment_damping(&both)), [0.0, 50.0]);
    assert_eq!(segment_damping(&both).len(), both.segments().count());
    assert!(segment_damping(&alone).is_empty());
    // Warp and weft share their shear, and nothing else.
    let mut woven = Woven::new([5, 4], [2e-3; 2], material(1.0, 0.1));
    woven.materials.push(material(3.0, 0.3));
    woven.weft_materials = vec![1];
    let mixed = woven.build(&Draft::named("plain").unwrap()).unwrap();
    let shear = stencil_damping(&YarnShear::new(&mixed), &mixed);
    assert!(shear.iter().all(|b| (b - 0.2).abs() < 1e-15));
    let stretch = stencil_damping(&YarnStretch::new(&mixed), &mixed);
    assert_eq!(ends(stretch), [0.1, 0.3]);
}
