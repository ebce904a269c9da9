//! Checks to run on broad phases of your own.

use crate::{Aabb, BroadPhase, BruteForce};

/// The first disagreement with brute force.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("broad phase `{broad_phase}`, case `{case}`: {what} pair {pair:?}")]
pub struct Disagreement {
    /// Name of the broad phase.
    pub broad_phase: String,
    /// Kind of boxes.
    pub case: &'static str,
    /// "missing", "wrong", "repeated" or "misordered".
    pub what: &'static str,
    /// The pair.
    pub pair: [u32; 2],
}

/// Compares a broad phase with brute force on random and degenerate boxes:
/// clusters, points, slabs, needles, coincident and touching boxes, huge and
/// empty ones, far from the origin, none at all, and a scene that moves, grows
/// and changes its count. Some 20 calls of up to `count` boxes.
///
/// # Errors
/// The first [`Disagreement`].
pub fn conformance(
    broad_phase: &mut dyn BroadPhase,
    seed: u64,
    count: usize,
) -> Result<(), Disagreement> {
    let mut random = Random(seed ^ 0x9e37_79b9_7f4a_7c15);
    for case in CASES {
        for n in [0, 1, 2, 3, count / 3, count] {
            let boxes: Vec<Aabb> = (0..n).map(|i| sample(case, i, &mut random)).collect();
            compare(broad_phase, case, &boxes)?;
        }
    }
    // One structure through a motion: what it keeps between calls must not show.
    let mut boxes: Vec<Aabb> = (0..count)
        .map(|i| sample("uniform", i, &mut random))
        .collect();
    for frame in 0..12 {
        for b in &mut boxes {
            let d: [f64; 3] = std::array::from_fn(|_| random.within(-0.1, 0.1));
            let grow = if frame % 4 == 3 { 0.05 } else { 0.0 };
            for k in 0..3 {
                b.min[k] += d[k] - grow;
                b.max[k] += d[k] + grow;
            }
        }
        if frame == 6 {
            boxes.truncate(count / 2);
        }
        compare(broad_phase, "moving", &boxes)?;
    }
    Ok(())
}

const CASES: [&str; 9] = [
    "uniform",
    "clustered",
    "points",
    "coincident",
    "touching",
    "slabs",
    "mixed sizes",
    "far",
    "special",
];

fn sample(case: &str, i: usize, random: &mut Random) -> Aabb {
    let place = |r: &mut Random, s: f64| -> [f64; 3] { std::array::from_fn(|_| r.within(-s, s)) };
    let size = |r: &mut Random, s: f64| -> [f64; 3] { std::array::from_fn(|_| r.within(0.0, s)) };
    let make = |p: [f64; 3], e: [f64; 3]| Aabb {
        min: p,
        max: std::array::from_fn(|k| p[k] + e[k]),
    };
    match case {
        "clustered" => {
            let c = (i % 4) as f64 * 5.0;
            make(place(random, 0.2).map(|x| x + c), size(random, 0.1))
        }
        "points" => make(place(random, 1e-3), [0.0; 3]),
        "coincident" => make([(i % 3) as f64; 3], [0.5; 3]),
        "touching" => {
            let cell = [(i % 7) as f64, (i / 7 % 7) as f64, (i / 49) as f64];
            make(cell, [1.0; 3])
        }
        "slabs" => {
            let mut e = size(random, 0.01);
            e[i % 3] = 2.0;
            make(place(random, 1.0), e)
        }
        "mixed sizes" => {
            let s = 10f64.powf(random.within(-4.0, 0.5));
            make(place(random, 1.0), size(random, s))
        }
        "far" => make(place(random, 1.0).map(|x| x + 1e6), size(random, 0.2)),
        "special" => match i % 8 {
            0 => Aabb::EMPTY,
            1 => Aabb {
                min: [f64::NAN; 3],
                max: [1.0; 3],
            },
            2 if i < 20 => Aabb {
                min: [f64::NEG_INFINITY; 3],
                max: [f64::INFINITY; 3],
            },
            3 => Aabb {
                min: [0.2; 3],
                max: [0.1; 3],
            },
            4 => Aabb {
                min: [f64::NEG_INFINITY, 0.0, 0.0],
                max: [0.0, 0.1, 0.1],
            },
            _ => make(place(random, 1.0), size(random, 0.3)),
        },
        _ => make(place(random, 1.0), size(random, 0.3)),
    }
}

fn compare(
    broad_phase: &mut dyn BroadPhase,
    case: &'static str,
    boxes: &[Aabb],
) -> Result<(), Disagreement> {
    let (mut expected, mut found) = (Vec::new(), vec![[7, 7]]);
    BruteForce.overlaps(boxes, &mut expected);
    broad_phase.overlaps(boxes, &mut found);
    let fail = |what, pair| {
        let broad_phase = broad_phase.name().into();
        Err(Disagreement {
            broad_phase,
            case,
            what,
            pair,
        })
    };
    if let Some(p) = found.iter().find(|p| p[0] >= p[1]) {
        return fail("misordered", *p);
    }
    expected.sort_unstable();
    found.sort_unstable();
    if let Some(w) = found.windows(2).find(|w| w[0] == w[1]) {
        return fail("repeated", w[0]);
    }
    if let Some(p) = expected.iter().find(|p| found.binary_search(p).is_err()) {
        return fail("missing", *p);
    }
    if let Some(p) = found.iter().find(|p| expected.binary_search(p).is_err()) {
        return fail("wrong", *p);
    }
    Ok(())
}

/// SplitMix64: reproducible, and no dependency for users of this module.
struct Random(u64);

impl Random {
    fn within(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        low + (high - low) * ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
}
