//! Cloth of yarns: arc lengths that meet, segments without length, stacks,
//! folds, friction and stiffness at their limits, and charts that cannot be.

use std::error::Error;

use selvedge_yarn_model::{NONE, YarnNetwork};

use super::scenes::{BARE, scene};
use crate::case::{ALONE, Case, Expected, Figures, Pace, SLIDES, at_least, below, equal, told};
use crate::sim::Sim;
use crate::{Bench, HardError};

pub static CASES: [Case; 8] = [
    Case {
        number: 71,
        name: "yarn-scalars-meet",
        setup: "weave of 6 × 6 yarns; an arc length moved to 1e-9 and to 1e-3 of a spacing before \
                its neighbour, then past it; 30 steps",
        naive: "1/Δu",
        bounds: &[
            equal("finite", "1", 2.0),
            told("runs that ended with an error", "1"),
            told("errors that say that contacts have met", "1"),
            at_least(
                "least material between crossings without an error",
                "m",
                1e-5,
            ),
            equal("crossed arc lengths refused or undone", "1", 1.0),
        ],
        pace: Pace::Quick,
        axes: SLIDES,
        expected: Expected::Passes,
        run: scalars_meet,
    },
    Case {
        number: 72,
        name: "yarn-without-length",
        setup: "weave and stockinette; a point put onto its neighbour along the yarn; 30 steps",
        naive: "direction of a segment of length 0",
        bounds: &[
            equal("finite", "1", 2.0),
            at_least("least segment of the weave in the end", "m", 1e-5),
        ],
        pace: Pace::Quick,
        axes: SLIDES,
        expected: Expected::Passes,
        run: without_length,
    },
    Case {
        number: 73,
        name: "yarn-stack-of-five",
        setup: "four loops knitted together: 5 yarns in a contact, 100 steps under gravity",
        naive: "closed forms for two yarns",
        bounds: &[
            equal("finite", "1", 1.0),
            equal("yarns in the highest stack", "1", 5.0),
        ],
        pace: Pace::Quick,
        axes: SLIDES,
        expected: Expected::Passes,
        run: stack_of_five,
    },
    Case {
        number: 74,
        name: "yarn-folded-back",
        setup: "stockinette pressed onto a line along its courses, and onto one along its wales: \
                bends of 0 and π; 50 steps",
        naive: "1/sin θ",
        bounds: &[equal("finite", "1", 2.0), told("speed", "m/s")],
        pace: Pace::Quick,
        axes: SLIDES,
        expected: Expected::Passes,
        run: folded,
    },
    Case {
        number: 75,
        name: "yarn-friction-range",
        setup: "stockinette of 8 × 8 with friction 0, 0.3, 1 and 2 between yarns, 100 steps",
        naive: "stick and slip in turn",
        bounds: &[equal("finite", "1", 4.0), below("speed", "m/s", 5.0)],
        pace: Pace::Quick,
        axes: SLIDES,
        expected: Expected::Passes,
        run: friction_range,
    },
    Case {
        number: 76,
        name: "yarn-stiffness-ratio",
        setup: "weave of 8 × 8 with warps 1e6 times as stiff as its wefts, held at an edge, 100 steps",
        naive: "the linear solver stalls",
        bounds: &[equal("finite", "1", 1.0), below("drop", "m", 0.05)],
        pace: Pace::Quick,
        axes: SLIDES,
        expected: Expected::Passes,
        run: stiffness_ratio,
    },
    Case {
        number: 77,
        name: "yarn-all-slip",
        setup: "stockinette in which every arc length starts 0.1 radii off its anchor and moves at \
                0.1 m/s, 50 steps",
        naive: "anchors left behind pull without limit",
        bounds: &[equal("finite", "1", 1.0), below("speed", "m/s", 10.0)],
        pace: Pace::Quick,
        axes: SLIDES,
        expected: Expected::Passes,
        run: all_slip,
    },
    Case {
        number: 78,
        name: "yarn-charts",
        setup: "panels of one loop and of one crossing, 20 steps; seven charts that cannot be knitted, a wrong name \
                and an empty size",
        naive: "an index out of range",
        bounds: &[
            equal(
                "single loop and crossing simulated or refused by name",
                "1",
                2.0,
            ),
            equal("charts refused with their line", "1", 7.0),
            equal("names and sizes refused", "1", 2.0),
        ],
        pace: Pace::Quick,
        axes: ALONE,
        expected: Expected::Passes,
        run: charts,
    },
];

const WEAVE: &str = "[[cloth]]\nkind = \"woven\"\ndraft = \"plain\"\nyarns = [6, 6]\n\
                     spacing = 0.001\nyarn = \"weaving\"\n";
const KNIT: &str = "[[cloth]]\nkind = \"knit\"\nchart = \"stockinette\"\nstitches = [8, 8]\n\
                    yarn = \"sweater\"\n";

fn time(steps: usize) -> [(&'static str, String); 1] {
    [("simulation.duration", format!("{:?}", 1e-3 * steps as f64))]
}

fn start(b: &Bench, text: &str, steps: usize, set: &[(&str, &str)]) -> Result<Sim, HardError> {
    let own = time(steps);
    let own = own.iter().map(|(k, v)| (*k, v.as_str()));
    let all: Vec<_> = own.chain(set.iter().copied()).collect();
    b.sim(&scene(&[BARE, text]), &all)
}

fn network(sim: &Sim) -> Result<YarnNetwork, HardError> {
    let yarns = sim.built.geometry.yarns.as_ref();
    Ok(yarns.ok_or(HardError::NoYarns)?.network.clone())
}

/// A strand that slides, as does the one after it on its yarn.
fn inner(n: &YarnNetwork) -> Result<(usize, usize), HardError> {
    let free = |s: u32| s != NONE && !n.strands[s as usize].held;
    // In the middle of the cloth.
    let middle = n.strands.len() / 3;
    let found = (middle as u32..n.strands.len() as u32)
        .find(|&s| free(s) && free(n.strands[s as usize].next));
    let s = found.ok_or(HardError::NoYarns)?;
    Ok((s as usize, n.strands[s as usize].next as usize))
}

/// Whether a run ended with numbers, or gave up and kept its numbers.
fn runs(sim: &mut Sim) -> Result<f64, HardError> {
    sim.run_or_give_up()?;
    Ok(sim.finite())
}

fn least_material(sim: &Sim, n: &YarnNetwork) -> f64 {
    let u = &sim.s.state().q[3 * n.nodes()..];
    let all = n.segments().map(|[a, b]| u[b as usize] - u[a as usize]);
    all.fold(f64::INFINITY, f64::min)
}

fn scalars_meet(b: &Bench) -> Result<Figures, HardError> {
    let (mut finite, mut least) = (0.0, f64::INFINITY);
    let (mut undone, mut errors, mut named) = (0.0, 0.0, 0.0);
    for gap in [1e-6, 1e-12, -1e-5] {
        let mut sim = start(b, WEAVE, 30, &[])?;
        let n = network(&sim)?;
        let (s, next) = inner(&n)?;
        let first = 3 * n.nodes();
        let q = &mut sim.s.state_mut().q;
        q[first + s] = q[first + next] - gap;
        let gave_up = sim.run_or_give_up()?;
        errors += f64::from(u8::from(gave_up.is_some()));
        let why = gave_up.as_ref().and_then(|e| e.source());
        let met = why.is_some_and(|w| w.to_string().contains("the contacts have met"));
        named += f64::from(u8::from(met));
        if gap > 0.0 {
            finite += sim.finite();
            if gave_up.is_none() {
                least = least.min(least_material(&sim, &n));
            }
        } else {
            let whole = least_material(&sim, &n) > 0.0 && sim.finite() == 1.0;
            undone = f64::from(u8::from(gave_up.is_some() || whole));
        }
    }
    Ok(vec![
        ("finite", finite),
        ("runs that ended with an error", errors),
        ("errors that say that contacts have met", named),
        ("least material between crossings without an error", least),
        ("crossed arc lengths refused or undone", undone),
    ])
}

fn without_length(b: &Bench) -> Result<Figures, HardError> {
    let (mut finite, mut least) = (0.0, f64::INFINITY);
    for (text, woven) in [(WEAVE, true), (KNIT, false)] {
        let mut sim = start(b, text, 30, &[])?;
        let n = network(&sim)?;
        let (s, next) = inner(&n)?;
        let point = |s: usize| 3 * n.strands[s].node as usize;
        let (from, to) = (point(next), point(s));
        let q = &mut sim.s.state_mut().q;
        q.copy_within(from..from + 3, to);
        finite += runs(&mut sim)?;
        if woven {
            let q = &sim.s.state().q;
            let gap = (0..3)
                .map(|i| (q[from + i] - q[to + i]).powi(2))
                .sum::<f64>();
            least = least.min(gap.sqrt());
        }
    }
    Ok(vec![
        ("finite", finite),
        ("least segment of the weave in the end", least),
    ])
}

fn stack_of_five(b: &Bench) -> Result<Figures, HardError> {
    b.file(
        "five.chart",
        "name: five\nmultiple: 6\nrow 1 RS: *k*\nrow 2 WS: *p*\nrow 3 RS: *k1 yo k4tog yo k1 yo*\n\
         row 4 WS: *p*\n",
    )?;
    let set = [
        ("cloth.0.chart", "five.chart"),
        ("cloth.0.stitches", "[12, 6]"),
    ];
    let mut sim = start(b, KNIT, 100, &set)?;
    let n = network(&sim)?;
    let highest = (0..n.nodes() as u32).map(|p| n.strands_of(p).len()).max();
    Ok(vec![
        ("finite", runs(&mut sim)?),
        ("yarns in the highest stack", highest.unwrap_or(0) as f64),
    ])
}

fn folded(b: &Bench) -> Result<Figures, HardError> {
    let (mut finite, mut speed) = (0.0, 0.0_f64);
    for axis in [0, 2] {
        let mut sim = start(b, KNIT, 50, &[])?;
        let points = 3 * network(&sim)?.nodes();
        let (x, _) = sim.s.state_mut().q[..points].as_chunks_mut::<3>();
        for p in x {
            p[1] = 0.0;
            p[axis] = 0.0;
        }
        finite += runs(&mut sim)?;
        speed = speed.max(sim.log.speed);
    }
    Ok(vec![("finite", finite), ("speed", speed)])
}

fn friction_range(b: &Bench) -> Result<Figures, HardError> {
    let (mut finite, mut speed) = (0.0, 0.0_f64);
    for mu in ["0", "0.3", "1", "2"] {
        let text = format!("{KNIT}[yarn.y]\nlibrary = \"sweater\"\nfriction = {mu}\n");
        let mut sim = start(b, &text, 100, &[("cloth.0.yarn", "y")])?;
        sim.run()?;
        finite += sim.finite();
        speed = speed.max(sim.log.speed);
    }
    Ok(vec![("finite", finite), ("speed", speed)])
}

fn stiffness_ratio(b: &Bench) -> Result<Figures, HardError> {
    let text = format!(
        "{WEAVE}weft_yarn = \"soft\"\n[yarn.stiff]\nlibrary = \"weaving\"\nstretch_modulus = 1e11\n\
         [yarn.soft]\nlibrary = \"weaving\"\nstretch_modulus = 1e5\n\
         [[pin]]\nselect = {{ edge = \"top\" }}\n"
    );
    let set = [("cloth.0.yarn", "stiff"), ("cloth.0.yarns", "[8, 8]")];
    let mut sim = start(b, &text, 100, &set)?;
    sim.run()?;
    let lowest = sim
        .points()
        .iter()
        .map(|p| p[1])
        .fold(f64::INFINITY, f64::min);
    Ok(vec![("finite", sim.finite()), ("drop", -lowest)])
}

fn all_slip(b: &Bench) -> Result<Figures, HardError> {
    let mut sim = start(b, KNIT, 50, &[])?;
    let n = network(&sim)?;
    let (first, off) = (3 * n.nodes(), 0.1 * n.materials[0].radius);
    let state = sim.s.state_mut();
    for (k, s) in n.strands.iter().enumerate().filter(|(_, s)| !s.held) {
        // Neighbours along a yarn go the same way, other yarns the other way.
        let sign = if s.yarn % 2 == 0 { 1.0 } else { -1.0 };
        state.q[first + k] += sign * off;
        state.v[first + k] = sign * 0.1;
    }
    sim.run()?;
    Ok(vec![("finite", sim.finite()), ("speed", sim.log.speed)])
}

fn charts(b: &Bench) -> Result<Figures, HardError> {
    let mut single = 0;
    for (text, key, size) in [
        (KNIT, "cloth.0.stitches", "[1, 1]"),
        (WEAVE, "cloth.0.yarns", "[1, 1]"),
    ] {
        single += match start(b, text, 20, &[(key, size)]) {
            Ok(mut sim) => i32::from(runs(&mut sim)? == 1.0),
            Err(e) => {
                i32::from(e.to_string().contains("stitches") || e.to_string().contains("yarns"))
            }
        };
    }
    let mut lines = 0;
    for row in [
        "row 2 WS: *k2tog*",
        "row 2 WS: *knot*",
        "row 2 WS: *k",
        "row 2 RS: *k*",
        "row 4 WS: *p*",
        "row 2 WS: k99999999999",
        "row 2 WS: yo",
    ] {
        b.file("bad.chart", &format!("name: bad\nrow 1 RS: *k*\n{row}\n"))?;
        let message = b.refusal(&scene(&[BARE, KNIT]), &[("cloth.0.chart", "bad.chart")]);
        lines += i32::from(message.is_some_and(|m| m.contains("bad.chart")));
    }
    let mut names = 0;
    for (key, value, part) in [
        ("cloth.0.chart", "stockinete", "stockinette"),
        ("cloth.0.stitches", "[0, 4]", "stitches"),
    ] {
        let message = b.refusal(&scene(&[BARE, KNIT]), &[(key, value)]);
        names += i32::from(message.is_some_and(|m| m.contains(part)));
    }
    Ok(vec![
        (
            "single loop and crossing simulated or refused by name",
            f64::from(single),
        ),
        ("charts refused with their line", f64::from(lines)),
        ("names and sizes refused", f64::from(names)),
    ])
}
