//! Knits every built-in chart and prints what it is made of: `cargo run
//! --example knit`.

use selvedge_energy::{Batch, DofLayout, EnergyBatch, EvalPoint};
use selvedge_yarn_model::chart::{BUILT_IN_CHARTS, StitchPattern};
use selvedge_yarn_model::knit::{KnitOptions, knitted};
use selvedge_yarn_model::{StitchWrapping, YarnMaterial, YarnStretch};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("chart               loops  points  arcs  yarn [m]  wrapping [mJ]  stretch [mJ]");
    for name in BUILT_IN_CHARTS {
        let pattern = StitchPattern::built_in(name)?;
        let chart = pattern.chart(2, 2)?;
        let cloth = knitted(&chart, &KnitOptions::new(YarnMaterial::sweater()))?.network;
        let mut q = cloth.points.as_flattened().to_vec();
        q.extend(cloth.arcs());
        let at = EvalPoint {
            layout: DofLayout {
                points: cloth.nodes(),
                scalars: cloth.strands.len(),
            },
            q: &q,
            q_start: &q,
            dt: 1e-3,
        };
        let stretch = Batch::<_, 4, 8>::new("yarn stretch", YarnStretch::new(&cloth));
        let wrapping = Batch::<_, 4, 12>::new("stitch wrapping", StitchWrapping::new(&cloth));
        let length: f64 = cloth
            .segments()
            .map(|[a, b]| cloth.strands[b as usize].arc - cloth.strands[a as usize].arc)
            .sum();
        let wrapped = wrapping.value(&at, 0..wrapping.len());
        println!(
            "{name:18} {:6} {:7} {:5} {length:9.2} {:14.3} {:13.3}",
            chart.loops(),
            cloth.nodes(),
            cloth.strands.len(),
            1e3 * wrapped,
            1e3 * stretch.value(&at, 0..stretch.len()),
        );
        // A flat stitch is π/2 away from where its yarns want to wrap.
        assert!(wrapped > 0.0 && length > 0.0);
    }
    Ok(())
}
