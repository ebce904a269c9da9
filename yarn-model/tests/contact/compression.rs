use selvedge_energy::{Batch, EnergyBatch, EvalPoint, StencilEnergy};
use selvedge_yarn_model::chart::{BUILT_IN_CHARTS, StitchPattern};
use selvedge_yarn_model::knit::{KnitOptions, knitted};
use selvedge_yarn_model::{
    Compression, CompressionSettings, Draft, FrictionSettings, JammingBending, PlainBending,
    SlidingFriction, StitchWrapping, TensionRule, Woven, YarnNetwork, YarnStretch,
};

use crate::common::{at, double_stitch, state, yarn};

/// In a plain weave of yarns without bending, both yarns go up and down by `2 R`
/// over every spacing: the compression is `4 R T/l`, with the tension `T` of the
/// flat yarns or of the crimped ones. Without stretch the former press not.
#[test]
fn compression_of_a_stretched_plain_weave() {
    let mut material = yarn();
    material.bending_modulus = 0.0;
    let (radius, k_s) = (material.radius, material.stretch_stiffness());
    let network = Woven::new([6, 6], [4e-3; 2], material)
        .build(&Draft::named("plain").unwrap())
        .unwrap();
    for tension in [TensionRule::Network, TensionRule::Offset] {
        for stretch in [1.0, 1.01] {
            let settings = FrictionSettings {
                compression: CompressionSettings {
                    tension,
                    ..CompressionSettings::default()
                },
                ..FrictionSettings::default()
            };
            let mut friction = SlidingFriction::new(&network, settings).unwrap();
            let mut q = state(&network);
            for x in &mut q[..3 * network.nodes()] {
                *x *= stretch;
            }
            friction.begin_step(&at(&network, &q, &q));
            let flat = stretch * 4e-3;
            let l = (flat * flat + 4.0 * radius * radius).sqrt();
            let pulled = if tension == TensionRule::Offset {
                l
            } else {
                flat
            };
            let expected = 4.0 * radius * k_s * (pulled / 4e-3 - 1.0) / l;
            let lambda = friction.compression().unwrap().lambda();
            // Crossings come first, one interface each; the ring around is at
            // the rim.
            for j in 1..5 {
                for i in 1..5 {
                    let found = lambda[6 * j + i];
                    assert!((found - expected).abs() < 1e-12, "{found} {expected}");
                }
            }
            for (limit, lambda) in friction.limits().iter().zip(lambda) {
                assert!((limit - 0.3 * lambda).abs() < 1e-16);
            }
        }
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

fn knit(name: &str) -> YarnNetwork {
    let chart = StitchPattern::built_in(name).unwrap().chart(1, 1).unwrap();
    knitted(&chart, &KnitOptions::new(yarn())).unwrap().network
}

/// Normals of knits point from front to back in the layout, those of stacks
/// too, and stay on their side when the loops leave the plane.
#[test]
fn normals_of_knits() {
    for name in BUILT_IN_CHARTS {
        let network = knit(name);
        let mut friction = SlidingFriction::new(&network, FrictionSettings::default()).unwrap();
        let mut q = state(&network);
        for step in 0..3 {
            friction.begin_step(&at(&network, &q, &q));
            friction.commit(&at(&network, &q, &q));
            let compression = friction.compression().unwrap();
            let mut k = 0;
            let normals: Vec<_> = compression.normals().collect();
            for node in 0..network.nodes() as u32 {
                for _ in 1..network.strands_of(node).len() {
                    let front = network.front[node as usize];
                    let along: f64 = (0..3).map(|i| normals[k][i] * front[i]).sum();
                    // The layout is flat.
                    let most = if step == 0 { -1.0 + 1e-12 } else { 0.0 };
                    assert!(along < most, "{name} {step} {node} {along}");
                    k += 1;
                }
            }
            assert_eq!(k, compression.len());
            let radius = network.materials[0].radius;
            for x in q[..3 * network.nodes()].as_chunks_mut::<3>().0 {
                x[2] += 0.1 * radius * (1e3 * x[0] + 2e3 * x[1]).sin();
            }
        }
    }
}

/// A stockinette whose yarns are as long as they lie presses with a little
/// bending and wrapping; stretched by 5 %, all contacts press with a part of
/// the tension.
#[test]
fn stretched_stockinette_presses() {
    let network = knit("stockinette");
    let mut q = state(&network);
    let points = 3 * network.nodes();
    for yarn in 0..network.yarns.len() as u32 {
        let mut before: Option<(usize, f64)> = None;
        for s in network.along(yarn) {
            let node = network.strands[s as usize].node as usize;
            let arc = before.map_or(0.0, |(from, arc)| {
                let way = |i: usize| network.points[node][i] - network.points[from][i];
                arc + (0..3).map(|i| way(i).powi(2)).sum::<f64>().sqrt()
            });
            q[points + s as usize] = arc;
            before = Some((node, arc));
        }
    }
    let mut compression = Compression::new(&network, CompressionSettings::default());
    let normals: Vec<f64> = compression.normals().flatten().collect();
    let (x, arcs) = q.split_at(points);
    compression.update(x, arcs, &normals);
    // Loops at the borders bend more than the others.
    let mean = compression.lambda().iter().sum::<f64>() / compression.len() as f64;
    let stretched: Vec<f64> = x.iter().map(|x| 1.05 * x).collect();
    compression.update(&stretched, arcs, &normals);
    let tension = 0.05 * network.materials[0].stretch_stiffness();
    assert!(mean < 0.005 * tension, "{mean} {tension}");
    for l in compression.lambda() {
        assert!(*l > 0.1 * tension && *l < 2.0 * tension, "{l} {tension}");
    }
}

/// Without offsets, the forces on the strands of every node add up to what the
/// energies give.
#[test]
fn forces_are_those_of_the_energies() {
    let woven = Woven::new([4, 5], [2e-3; 2], yarn())
        .build(&Draft::named("twill-2-2").unwrap())
        .unwrap();
    let lace = knit("feather-and-fan");
    for network in [woven, double_stitch(yarn()), lace] {
        let mut q = state(&network);
        let points = 3 * network.nodes();
        for (k, x) in q.iter_mut().enumerate() {
            *x += if k < points { 2e-4 } else { 5e-5 } * (7.0 * k as f64).sin();
        }
        let settings = CompressionSettings {
            crimp: 0.0,
            ..CompressionSettings::default()
        };
        let mut compression = Compression::new(&network, settings);
        let normals: Vec<f64> = compression.normals().flatten().collect();
        let (x, arcs) = q.split_at(points);
        compression.update(x, arcs, &normals);
        let mut found = vec![0.0; points];
        for (s, strand) in network.strands.iter().enumerate() {
            let force = compression.force(s as u32);
            for k in 0..3 {
                found[3 * strand.node as usize + k] += force[k];
            }
        }
        let at = at(&network, &q, &q);
        let mut expected = vec![0.0; points];
        let stretch = Batch::<_, 4, 8>::new("stretch", YarnStretch::new(&network));
        add_forces(&stretch, &at, &mut expected);
        if network.stitches.is_empty() {
            let bending = Batch::<_, 5, 11>::new("bending", PlainBending::new(&network));
            add_forces(&bending, &at, &mut expected);
        } else {
            let bending = Batch::<_, 5, 11>::new("bending", JammingBending::new(&network));
            add_forces(&bending, &at, &mut expected);
            let before = expected.clone();
            let mut wrapping = Batch::<_, 4, 12>::new("wrapping", StitchWrapping::new(&network));
            // Fades by where the step starts.
            wrapping.begin_step(&at);
            add_forces(&wrapping, &at, &mut expected);
            let added = before.iter().zip(&expected).map(|(a, b)| (a - b).abs());
            assert!(added.fold(0.0, f64::max) > 1e-3);
        }
        let largest = expected.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
        for (f, e) in found.iter().zip(&expected) {
            assert!((f - e).abs() < 1e-12 * largest, "{f} {e} {largest}");
        }
    }
}

fn add_forces(batch: &dyn EnergyBatch, at: &EvalPoint<'_>, forces: &mut [f64]) {
    let mut g = vec![0.0; batch.local_dim()];
    for e in 0..batch.len() {
        batch.gradients(at, e..e + 1, &mut g);
        let mut from = 0;
        for (node, dim) in batch.nodes(e).iter().zip(batch.node_dims()) {
            if *dim == 3 {
                for k in 0..3 {
                    forces[3 * *node as usize + k] -= g[from + k];
                }
            }
            from += dim;
        }
    }
}
