//! All terms on knitted networks of the built-in charts.

use std::f64::consts::PI;

use selvedge_energy::{Batch, Curvature, EnergyBatch, check_derivatives, check_projection};
use selvedge_yarn_model::chart::{BUILT_IN_CHARTS, StitchPattern};
use selvedge_yarn_model::knit::{KnitOptions, knitted};
use selvedge_yarn_model::{
    JammingBending, ParallelYarns, StitchLength, StitchWrapping, YarnBending, YarnGravity,
    YarnNetwork, YarnStretch, lumped_point_masses, lumped_scalar_masses,
};

use super::common::{Random, at, layout, unknowns};

fn network(name: &str) -> YarnNetwork {
    let chart = StitchPattern::built_in(name).unwrap().chart(1, 1).unwrap();
    knitted(&chart, &KnitOptions::default()).unwrap().network
}

#[test]
fn built_in_charts() {
    for name in BUILT_IN_CHARTS {
        let network = network(name);
        let wraps = StitchWrapping::new(&network);
        let history = Batch::<_, 4, 12>::new("wrapping", wraps.clone())
            .history()
            .to_vec();
        // Flat, or folded where a leg comes from a neighbouring column; folds
        // start on the side of the rest angle whatever the sign of zero.
        for angle in &history {
            let off = angle.abs().min((angle - PI).abs());
            assert!(off < 1e-6, "{name}: {angle}");
        }
        // Two for every child and parent, but where a yarn ends.
        let parents = network.stitches.iter().map(|s| usize::from(s.parents));
        let full = 2 * parents.sum::<usize>();
        assert!(history.len() <= full && history.len() + 4 >= full, "{name}");
        let jamming: JammingBending = YarnBending::new(&network);
        let parallel = ParallelYarns::new(&network);
        let terms: Vec<Box<dyn EnergyBatch>> = vec![
            Box::new(Batch::<_, 4, 8>::new("stretch", YarnStretch::new(&network))),
            Box::new(Batch::<_, 5, 11>::new("jamming", jamming)),
            Box::new(Batch::<_, 4, 8>::new(
                "gravity",
                YarnGravity::new(&network, [0.0, -9.81, 0.0]),
            )),
            Box::new(Batch::<_, 4, 12>::new("wrapping", wraps)),
        ];
        let mut random = Random(9);
        let radius = network.materials[0].radius;
        let mut q = random.shake(&unknowns(&network), 0.2 * radius);
        for u in &mut q[3 * network.nodes()..] {
            *u += 0.1 * radius * random.next();
        }
        let at = at(&network, &q, &q);
        for term in &terms {
            assert!(!term.is_empty());
            if let Err(error) = check_derivatives(&**term, &at, 1e-5) {
                panic!("{name}: {error}");
            }
            if let Err(error) = check_projection(&**term, &at, Curvature::Projected, 1e-10) {
                panic!("{name}: {error}");
            }
        }
        // One length for every yarn of a contact, and space between contacts.
        let length = Batch::<_, 2, 2>::new("length", StitchLength::new(&network));
        let yarns: usize = network
            .stitches
            .iter()
            .map(|s| 1 + usize::from(s.parents))
            .sum();
        assert_eq!(length.len(), yarns, "{name}");
        let parallel = Batch::<_, 2, 2>::new("parallel", parallel);
        let rest = unknowns(&network);
        let rest = super::common::at(&network, &rest, &rest);
        assert!(!parallel.is_empty());
        assert_eq!(parallel.value(&rest, 0..parallel.len()), 0.0, "{name}");
        let masses = lumped_point_masses(&network);
        assert!(
            masses
                .iter()
                .chain(&lumped_scalar_masses(&network))
                .all(|m| *m > 0.0)
        );
        assert_eq!(layout(&network).points, masses.len());
    }
}
