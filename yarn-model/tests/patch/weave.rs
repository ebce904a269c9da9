use selvedge_energy::{Batch, EnergyBatch};
use selvedge_yarn_model::{
    Draft, FrictionSettings, ParallelYarns, PlainBending, SlidingFriction, Woven, YarnMaterial,
    YarnNetwork, YarnShear, YarnStretch,
};

use crate::statics::{at, gradient, settle, state};

/// Distances of warps and of wefts [m].
const SPACING: [f64; 2] = [1e-3, 1.4e-3];

struct Patch {
    network: YarnNetwork,
    terms: Vec<Box<dyn EnergyBatch>>,
    counts: [usize; 2],
}

impl Patch {
    /// A plain weave whose yarns end in their outermost crossings, pressed
    /// together so that none slides: without friction a whole weft could be
    /// moved along the warps for nothing.
    fn new(counts: [usize; 2], yarn: YarnMaterial) -> Self {
        let mut woven = Woven::new(counts, SPACING, yarn);
        woven.fringe = [0.0; 2];
        let network = woven.build(&Draft::named("plain").unwrap()).unwrap();
        let pressed = vec![1.0; network.strands.len() - network.nodes()];
        let settings = FrictionSettings::default();
        let friction = SlidingFriction::prescribed(&network, settings, &pressed).unwrap();
        let terms: Vec<Box<dyn EnergyBatch>> = vec![
            Box::new(Batch::new("stretch", YarnStretch::new(&network))),
            Box::new(Batch::new("bending", PlainBending::new(&network))),
            Box::new(Batch::new("shear", YarnShear::new(&network))),
            Box::new(Batch::new("parallel", ParallelYarns::new(&network))),
            Box::new(Batch::new("friction", friction)),
        ];
        Self {
            network,
            terms,
            counts,
        }
    }

    fn terms(&self) -> Vec<&dyn EnergyBatch> {
        self.terms.iter().map(|t| &**t).collect()
    }

    /// Points of the `k`-th line across the yarns of a family: 0 warps, 1 wefts.
    fn line(&self, family: usize, k: usize) -> Vec<usize> {
        let [warps, wefts] = self.counts;
        match family {
            0 => (0..warps).map(|i| k * warps + i).collect(),
            _ => (0..wefts).map(|j| j * warps + k).collect(),
        }
    }

    /// All unknowns but the points given and the arc lengths that are held.
    fn free(&self, fixed: &[usize]) -> Vec<usize> {
        let n = self.network.nodes();
        let points = (0..n).filter(|p| !fixed.contains(p));
        let strands = self.network.strands.iter().enumerate();
        points
            .flat_map(|p| 3 * p..3 * p + 3)
            .chain(strands.filter(|(_, s)| !s.held).map(|(s, _)| 3 * n + s))
            .collect()
    }

    /// Moves the last line of crossings along `axis` by `way` [m], the first
    /// one held, and returns the force on it [N].
    fn pulled(&self, family: usize, axis: usize, way: f64) -> f64 {
        let last = self.line(family, self.counts[1 - family] - 1);
        let held = [self.line(family, 0), last.clone()].concat();
        let start = state(&self.network);
        let mut q = start.clone();
        for p in &last {
            q[3 * p + axis] += way;
        }
        let free = self.free(&held);
        let terms = self.terms();
        settle(&terms, &self.network, &mut q, &start, &free, &[], 1e-13);
        let (_, g) = gradient(&terms, &at(&self.network, &q, &start));
        last.iter().map(|p| g[3 * p + axis]).sum()
    }
}

fn close(what: &str, measured: f64, expected: f64) {
    let error = measured / expected - 1.0;
    println!(
        "{what}: {measured:.6e}, closed form {expected:.6e}, {:+.4} %",
        100.0 * error
    );
    assert!(error.abs() < 0.01, "{what}");
}

/// Force over width and strain along both families: `k_s/L`.
#[test]
fn stretch() {
    let yarn = YarnMaterial::weaving();
    for (family, name) in [(0, "warp"), (1, "weft")] {
        let patch = Patch::new([8, 7], yarn.clone());
        let across = SPACING[family] * patch.counts[family] as f64;
        let along = SPACING[1 - family] * (patch.counts[1 - family] - 1) as f64;
        let strain = 1e-3;
        let force = patch.pulled(family, 1 - family, strain * along);
        close(
            &format!("stretch along {name} [N/m]"),
            force / (across * strain),
            yarn.stretch_stiffness() / SPACING[family],
        );
    }
}

/// Shear force over width and angle: `4 k_x L̄/(L_1 L_2)`, `k_x = S R²`.
#[test]
fn shear() {
    for (name, yarn) in [
        ("weaving", YarnMaterial::weaving()),
        (
            "sweater's modulus",
            YarnMaterial {
                stretch_modulus: 1e7,
                ..YarnMaterial::weaving()
            },
        ),
    ] {
        let patch = Patch::new([13, 7], yarn.clone());
        let width = SPACING[0] * 12.0;
        let angle = 1e-3;
        let force = patch.pulled(0, 0, angle * SPACING[1] * 6.0);
        let k = yarn.shear_modulus * yarn.radius * yarn.radius;
        let mean = 0.5 * (SPACING[0] + SPACING[1]);
        close(
            &format!("shear, {name} [N/m]"),
            force / (width * angle),
            4.0 * k * mean / (SPACING[0] * SPACING[1]),
        );
    }
}

/// Deflection of a cantilever: `B = k_b/L`. The last fixed row clamps in the
/// middle of the segment before, as rotation sits in the nodes.
#[test]
fn bending() {
    let yarn = YarnMaterial::weaving();
    for (family, name) in [(0, "warp"), (1, "weft")] {
        let counts = match family {
            0 => [4, 14],
            _ => [14, 4],
        };
        let patch = Patch::new(counts, yarn.clone());
        let segments = 12.0;
        let load = 1e-9;
        let end = patch.line(family, 13);
        let fixed = [patch.line(family, 0), patch.line(family, 1)].concat();
        let loads: Vec<_> = end.iter().map(|p| (3 * p + 2, load)).collect();
        let start = state(&patch.network);
        let mut q = start.clone();
        let free = patch.free(&fixed);
        let terms = patch.terms();
        settle(&terms, &patch.network, &mut q, &start, &free, &loads, 1e-14);
        let sag = end.iter().map(|p| q[3 * p + 2]).sum::<f64>() / end.len() as f64;
        let length = (segments + 0.5) * SPACING[1 - family];
        let width = SPACING[family] * end.len() as f64;
        let force = load * end.len() as f64;
        close(
            &format!("bending of {name} [N m]"),
            force * length.powi(3) / (3.0 * sag * width),
            yarn.bending_stiffness() / SPACING[family],
        );
    }
}
