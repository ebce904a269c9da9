//! What the yarns of a scene are like before the first step: counts, strains,
//! turns, stretch energy. `cargo run --example yarn_start SCENE [key=value]...`

mod common;

use std::error::Error;

use selvedge_yarn_model::{NONE, YarnNetwork};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let scene = arguments.next().ok_or("a scene is needed")?;
    let overrides = common::overrides(arguments);
    let clock = std::time::Instant::now();
    let built = common::build(&scene, &overrides)?;
    let yarns = built.geometry.yarns.as_ref().ok_or("no yarns")?;
    let n = &yarns.network;
    println!(
        "{} points, {} strands, {} yarns, {} stitch contacts, built in {:.2} s",
        n.nodes(),
        n.strands.len(),
        n.yarns.len(),
        n.stitches.len(),
        clock.elapsed().as_secs_f64()
    );
    let (energy, worst) = stretch(n);
    println!("stretch {energy:.3e} J, largest strain {worst:.3e}");
    let turns: Vec<f64> = turns(n);
    let beyond = |limit: f64| turns.iter().filter(|t| **t > limit.to_radians()).count();
    println!(
        "turns beyond 90, 108, 150 degrees: {} {} {} of {}",
        beyond(90.0),
        beyond(108.0),
        beyond(150.0),
        turns.len()
    );
    if std::env::var_os("DETAIL").is_some() {
        detail(n);
    }
    Ok(())
}

fn detail(n: &YarnNetwork) {
    use std::collections::BTreeMap;
    let kind = |s: u32| {
        let node = n.strands[s as usize].node;
        let c = format!("{:?}", n.contacts[node as usize]);
        format!("{}{}", &c[..1], n.strands_of(node).len().min(9))
    };
    let mut segs: BTreeMap<String, (usize, f64)> = BTreeMap::new();
    for [a, b] in n.segments() {
        let k = n.material_of(a).stretch_stiffness();
        let r = n.material_of(a).radius;
        let key = format!("{}-{}", kind(a), kind(b));
        let [a, b] = [a, b].map(|s| n.strands[s as usize]);
        let rest = b.arc - a.arc;
        let strain = distance(n.points[a.node as usize], n.points[b.node as usize]) / rest - 1.0;
        let e = segs.entry(key.clone()).or_default();
        e.0 += 1;
        e.1 += 0.5 * k * rest * strain * strain;
        if strain.abs() > 0.05 {
            println!("{key} rest {:.2} R strain {strain:.3}", rest / r);
        }
    }
    for (k, (c, e)) in segs {
        if e > 1e-4 {
            println!("{k}: {c} segments {e:.3e} J");
        }
    }
    for s in n
        .strands
        .iter()
        .filter(|s| s.prev != NONE && s.next != NONE)
    {
        let node = |s: u32| n.points[n.strands[s as usize].node as usize];
        let (a, b, c) = (node(s.prev), n.points[s.node as usize], node(s.next));
        let dot: f64 = (0..3).map(|k| (b[k] - a[k]) * (c[k] - b[k])).sum();
        let turn = (dot / (distance(a, b) * distance(b, c)))
            .acos()
            .to_degrees();
        if turn > 108.0 {
            let me = n.strands[s.prev as usize].next;
            let r = n.material_of(me).radius;
            println!(
                "turn {turn:.0} {} {} {} lengths {:.2} {:.2} R arcs {:.2} {:.2}",
                kind(s.prev),
                kind(me),
                kind(s.next),
                distance(a, b) / r,
                distance(b, c) / r,
                (s.arc - n.strands[s.prev as usize].arc) / r,
                (n.strands[s.next as usize].arc - s.arc) / r,
            );
        }
    }
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

/// Stretch energy [J] and the largest strain.
fn stretch(n: &YarnNetwork) -> (f64, f64) {
    let (mut energy, mut worst) = (0.0, 0.0_f64);
    for [a, b] in n.segments() {
        let k = n.material_of(a).stretch_stiffness();
        let [a, b] = [a, b].map(|s| n.strands[s as usize]);
        let rest = b.arc - a.arc;
        let length = distance(n.points[a.node as usize], n.points[b.node as usize]);
        let strain = length / rest - 1.0;
        energy += 0.5 * k * rest * strain * strain;
        worst = worst.max(strain.abs());
    }
    (energy, worst)
}

/// By how much yarns turn at their nodes [rad].
fn turns(n: &YarnNetwork) -> Vec<f64> {
    let inner = n
        .strands
        .iter()
        .filter(|s| s.prev != NONE && s.next != NONE);
    inner
        .map(|s| {
            let node = |s: u32| n.points[n.strands[s as usize].node as usize];
            let (a, b, c) = (node(s.prev), n.points[s.node as usize], node(s.next));
            let dot: f64 = (0..3).map(|k| (b[k] - a[k]) * (c[k] - b[k])).sum();
            (dot / (distance(a, b) * distance(b, c)))
                .clamp(-1.0, 1.0)
                .acos()
        })
        .collect()
}
