//! Cloth of yarns that is cut, and more of it than fits into narrow numbers.

use selvedge_scene::driver::RunResult;

use super::program::{options, run};
use super::scenes::{BARE, scene};
use crate::case::{ALONE, Case, Expected, Figures, Pace, SLIDES, at_least, below, equal, told};
use crate::{Bench, HardError};

pub static CASES: [Case; 2] = [
    Case {
        number: 79,
        name: "yarn-cut",
        setup: "stockinette held at an edge and cut: one stitch; along a wale; all across; twice \
                in the same place; a weave all across; 60 steps",
        naive: "anchors and angles of contacts that are gone, unknowns counted as before",
        bounds: &[
            equal("finite", "1", 4.0),
            at_least("cuts", "1", 20.0),
            equal("cuts of what is cut already", "1", 0.0),
            at_least("fall of what is cut off over free fall", "1", 0.95),
            below("the same", "1", 1.05),
            equal("same bits on two threads", "1", 1.0),
        ],
        pace: Pace::Quick,
        axes: SLIDES,
        expected: Expected::Passes,
        run: cuts,
    },
    Case {
        number: 80,
        name: "yarn-million-contacts",
        setup: "plain weave of 1000 × 1000 yarns, 3 steps",
        naive: "places in lists that are counted in too few bits, memory without bound",
        bounds: &[
            equal("finite", "1", 1.0),
            at_least("contacts", "1", 1e6),
            told("bytes a contact", "1"),
        ],
        pace: Pace::Slow,
        axes: ALONE,
        expected: Expected::Passes,
        run: million,
    },
];

const CLOTH: &str = "[[cloth]]\nkind = \"knit\"\nchart = \"stockinette\"\nstitches = [10, 8]\n\
                     yarn = \"sweater\"\n[[pin]]\nselect = { edge = \"top\" }\n";

/// Lies still until it falls.
const WEAVE: &str = "[[cloth]]\nkind = \"woven\"\nyarns = [8, 8]\nspacing = 0.001\nyarn = \"light\"\n\
                     [yarn.light]\nlibrary = \"weaving\"\nmass_damping = 0.0\n\
                     [[pin]]\nselect = { edge = \"top\" }\n";

/// Of the whole run [s].
const TIME: f64 = 0.06;

fn cuts(b: &Bench) -> Result<Figures, HardError> {
    // 39 by 23 mm.
    let stitch = "[[cut]]\ntime = 0.01\nfrom = [0.019, 0.014]\nto = [0.023, 0.014]\n";
    let along = "[[cut]]\ntime = 0.02\nfrom = [0.019, -1]\nto = [0.019, 1]\n";
    let across = "[[cut]]\ntime = 0\nfrom = [-1, 0.014]\nto = [1, 0.014]\n";
    let again = [across, &across.replace("time = 0", "time = 0.02")].concat();
    let duration = TIME.to_string();
    let middle = "[[cut]]\ntime = 0\nfrom = [-1, 0.0065]\nto = [1, 0.0065]\n";
    let go = |name: &str, cloth: &str, cut: &str, threads: &str| {
        let set = [
            ("simulation.duration", &*duration),
            ("assembly.threads", threads),
        ];
        let built = b.built(&scene(&[BARE, cloth, cut]), &set)?;
        run(&built, &options(b, name))
    };
    let all = [
        go("stitch", CLOTH, stitch, "1")?,
        go("along", CLOTH, along, "1")?,
        go("across", CLOTH, across, "1")?,
        go("again", CLOTH, &again, "1")?,
    ];
    let finite = all
        .iter()
        .filter(|r| r.positions.iter().all(|x| x.is_finite()));
    let made = |r: &RunResult| r.summary.topology.map_or(0.0, |t| t.cut as f64);
    let [_, along_once, once, twice] = &all;
    let two = go("threads", CLOTH, along, "2")?;
    let same = two.summary.final_state_hash == along_once.summary.final_state_hash;
    let weave = go("weave", WEAVE, middle, "1")?;
    let heights = weave.positions.iter().skip(1).step_by(3);
    let fall = -heights.fold(0.0, |low, y| y.min(low)) / (0.5 * 9.81 * TIME * TIME);
    Ok(vec![
        ("finite", finite.count() as f64),
        ("cuts", all.iter().map(made).sum()),
        ("cuts of what is cut already", made(twice) - made(once)),
        ("fall of what is cut off over free fall", fall),
        ("the same", fall),
        ("same bits on two threads", f64::from(same)),
    ])
}

fn million(b: &Bench) -> Result<Figures, HardError> {
    let text = "[[cloth]]\nkind = \"woven\"\nyarns = [1000, 1000]\nspacing = 0.001\n\
                yarn = \"weaving\"\n";
    let mut sim = b.sim(&scene(&[BARE, text]), &[("simulation.duration", "0.003")])?;
    let yarns = sim
        .built
        .geometry
        .yarns
        .as_ref()
        .ok_or(HardError::NoYarns)?;
    let contacts = yarns.network.crossings.len() as f64;
    sim.run()?;
    Ok(vec![
        ("finite", sim.finite()),
        ("contacts", contacts),
        ("bytes a contact", sim.s.heap_bytes() as f64 / contacts),
    ])
}
