//! The same bits: on any number of threads, after a restart.

use super::scenes::{BALL, BARE, DAMPED, scene};
use crate::case::{Case, Expected, Figures, Pace, TOUCHES, equal};
use crate::{Bench, HardError};

pub static CASES: [Case; 2] = [
    Case {
        number: 40,
        name: "threads",
        setup: "two layers falling on a ball with friction on 1, 2 and 8 threads",
        naive: "sums in the order in which threads finish",
        bounds: &[equal("numbers that differ", "1", 0.0)],
        pace: Pace::Quick,
        axes: TOUCHES,
        expected: Expected::Passes,
        run: threads,
    },
    Case {
        number: 41,
        name: "restart",
        setup: "a drape with friction, saved, put into a new simulation and gone on with",
        naive: "hidden state: anchors, fold angles, step size",
        bounds: &[equal("numbers that differ", "1", 0.0)],
        pace: Pace::Quick,
        axes: TOUCHES,
        expected: Expected::Passes,
        run: restart,
    },
];

const TWO: &str = r#"
[simulation]
duration = 0.06
[[cloth]]
kind = "sheet"
size = [0.2, 0.2]
points = [14, 14]
fabric = "f"
[[cloth]]
kind = "sheet"
size = [0.2, 0.2]
points = [14, 14]
center = [0.003, 0.0009, 0.002]
layer = 1
fabric = "f"
"#;

fn threads(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[BARE, DAMPED, TWO, BALL]);
    let mut all = Vec::new();
    for threads in [1, 2, 8] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.map_err(std::io::Error::other)?;
        all.push(pool.install(|| -> Result<Vec<u64>, HardError> {
            let mut sim = b.sim(&text, &[("assembly.chunk", "16")])?;
            sim.run()?;
            Ok(sim.bits())
        })?);
    }
    let differ = |a: &[u64], b: &[u64]| a.iter().zip(b).filter(|(a, b)| a != b).count();
    let count = differ(&all[0], &all[1]) + differ(&all[0], &all[2]);
    Ok(vec![("numbers that differ", count as f64)])
}

fn restart(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[BARE, DAMPED, TWO, BALL]);
    let mut whole = b.sim(&text, &[])?;
    whole.run()?;
    let mut first = b.sim(&text, &[])?;
    first.until(0.031)?;
    let snapshot = first.s.snapshot();
    let mut second = b.sim(&text, &[])?;
    second.s.restore(&snapshot)?;
    second.run()?;
    let (a, b) = (whole.bits(), second.bits());
    let count = a.iter().zip(&b).filter(|(a, b)| a != b).count();
    Ok(vec![("numbers that differ", count as f64)])
}
