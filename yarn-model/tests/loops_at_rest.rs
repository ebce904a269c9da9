//! Loops at rest in fabric without borders, and cloth that is laid with them.

use selvedge_energy::{Batch, DofLayout, EnergyBatch, EvalPoint};
use selvedge_yarn_model::chart::StitchPattern;
use selvedge_yarn_model::knit::{KnitOptions, Knitted, LoopsAtRest, knitted};
use selvedge_yarn_model::{
    JammingBending, NodeContact, ParallelYarns, StitchLength, StitchWrapping, YarnMaterial,
    YarnStretch,
};

const PATTERNS: [&str; 3] = ["stockinette", "garter", "rib-2x2"];

fn at_rest(name: &str) -> (KnitOptions, LoopsAtRest) {
    let pattern = StitchPattern::built_in(name).unwrap();
    let laid = KnitOptions::new(YarnMaterial::sweater());
    laid.at_rest(&pattern).unwrap()
}

fn patch(name: &str, options: &KnitOptions, size: usize) -> Knitted {
    let pattern = StitchPattern::built_in(name).unwrap();
    let chart = pattern.chart_of(size + pattern.plus(), size).unwrap();
    knitted(&chart, options).unwrap()
}

/// Largest force on a node or arc length of stitches at least `margin` from the
/// border, and anywhere [N].
fn forces(knit: &Knitted, size: u32, margin: u32) -> [f64; 2] {
    let n = &knit.network;
    let mut q = n.points.as_flattened().to_vec();
    q.extend(n.arcs());
    let layout = DofLayout {
        points: n.nodes(),
        scalars: n.strands.len(),
    };
    let at = EvalPoint {
        layout,
        q: &q,
        q_start: &q,
        dt: 1.0,
    };
    let terms: [Box<dyn EnergyBatch>; 5] = [
        Box::new(Batch::new("stretch", YarnStretch::new(n))),
        Box::new(Batch::new("bending", JammingBending::new(n))),
        Box::new(Batch::new("wrapping", StitchWrapping::new(n))),
        Box::new(Batch::new("parallel", ParallelYarns::new(n))),
        Box::new(Batch::new("length", StitchLength::new(n))),
    ];
    let mut force = vec![0.0; q.len()];
    for term in &terms {
        let mut g = vec![0.0; term.local_dim()];
        for e in 0..term.len() {
            term.gradients(&at, e..e + 1, &mut g);
            let mut k = 0;
            for (&node, &dim) in term.nodes(e).iter().zip(term.node_dims()) {
                for i in 0..dim {
                    force[layout.offset(node, dim) + i] -= g[k];
                    k += 1;
                }
            }
        }
    }
    let inside = |node: u32| match n.contacts[node as usize] {
        NodeContact::StitchA(c) | NodeContact::StitchB(c) => {
            let c = &n.stitches[c as usize];
            let within = |i: u32| (margin..size - margin).contains(&i);
            within(c.row) && within(c.column)
        }
        _ => false,
    };
    let mut worst = [0.0f64; 2];
    let mut see = |node: u32, f: f64| {
        worst[1] = worst[1].max(f);
        if inside(node) {
            worst[0] = worst[0].max(f);
        }
    };
    for node in 0..n.nodes() {
        (0..3).for_each(|k| see(node as u32, force[3 * node + k].abs()));
    }
    for (s, strand) in n.strands.iter().enumerate() {
        if !strand.held {
            see(strand.node, force[3 * n.nodes() + s].abs());
        }
    }
    worst
}

/// Rest is a minimum, and cloth laid with its loops has no force inside.
#[test]
fn cloth_of_loops_at_rest_is_free_of_force() {
    for name in PATTERNS {
        let (options, report) = at_rest(name);
        let template = &options.template;
        println!(
            "{name}: {report:?}, course {:.3} mm, row {:.3} mm",
            1e3 * template.course,
            1e3 * template.row
        );
        assert!(report.force < 1e-10, "{name}");
        assert!(report.energy < 0.1 * report.energy_laid, "{name}");
        assert!(report.stiffness > 0.0, "{name}: {}", report.stiffness);
        let [inside, anywhere] = forces(&patch(name, &options, 12), 12, 3);
        println!("  forces inside {inside:.2e} N, anywhere {anywhere:.2e} N");
        assert!(inside < 1e-7, "{name}: {inside} N");
        let laid = KnitOptions::new(YarnMaterial::sweater());
        let [flat, _] = forces(&patch(name, &laid, 12), 12, 3);
        println!("  as laid flat {flat:.2e} N");
        assert!(inside < 1e-4 * flat, "{name}: {inside} of {flat} N");
    }
}
