//! Cloth of yarns: arc lengths that meet, segments without length, stacks,
//! folds, friction and stiffness at their limits, and charts that cannot be.

use std::error::Error;

use selvedge_yarn_model::{NONE, YarnNetwork, lumped_point_masses};

use super::scenes::{BARE, scene};
use crate::case::{
    ALONE, Case, Expected, Figures, Pace, SLIDES, at_least, at_most, below, equal, told,
};
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
            equal(
                "closing crossings kept 1e-5 m apart, or refused as met",
                "1",
                2.0,
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
                bends of 0 and π; 50 steps. Nothing but what is stored at the start can move it: \
                a point of mass m is never faster than √(6 E/m), all of that energy in the \
                lightest one",
        naive: "1/sin θ",
        bounds: &[
            equal("finite", "1", 2.0),
            told("speed", "m/s"),
            at_most(FASTEST, "1", 1.0),
        ],
        pace: Pace::Quick,
        axes: SLIDES,
        expected: Expected::Fails(
            "one linear system a step, the default for yarns, gains energy on loops without \
             extent: the 3 J stored at the start grow to 1e5 J and more in 50 steps. All stays \
             finite. With Newton's method, `--set integrator.kind=backward-euler`, it passes: \
             0.38 m/s",
        ),
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
            equal("charts refused with their line", "1", 6.0),
            equal("missing rows refused with their number", "1", 1.0),
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

/// Material that has to stay between crossings of the weave, a hundredth of what
/// is there at rest [m].
const LEAST_MATERIAL: f64 = 1e-5;

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
    let (mut finite, mut undone, mut errors, mut answered) = (0.0, 0.0, 0.0, 0.0);
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
        if gap > 0.0 {
            finite += sim.finite();
            let answer = match gave_up {
                Some(_) => met,
                None => least_material(&sim, &n) >= LEAST_MATERIAL,
            };
            answered += f64::from(u8::from(answer));
        } else {
            let whole = least_material(&sim, &n) > 0.0 && sim.finite() == 1.0;
            let refused = gave_up.is_some() && met;
            undone = f64::from(u8::from(refused || (gave_up.is_none() && whole)));
        }
    }
    Ok(vec![
        ("finite", finite),
        ("runs that ended with an error", errors),
        (
            "closing crossings kept 1e-5 m apart, or refused as met",
            answered,
        ),
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

/// The speed over the largest that the energy E at the start allows. The kinetic
/// energy of velocities that take a point to speed v is at least m v²/6: the mass
/// matrix of a segment, μ/6 [2 1; 1 2], is nowhere below a third of its lumped
/// one, μ/2, and nor is their sum.
const FASTEST: &str = "speed over that of all energy in the lightest point";

fn folded(b: &Bench) -> Result<Figures, HardError> {
    let (mut finite, mut speed, mut share) = (0.0, 0.0_f64, 0.0_f64);
    for axis in [0, 2] {
        let mut sim = start(b, KNIT, 50, &[])?;
        let n = network(&sim)?;
        let points = 3 * n.nodes();
        let (x, _) = sim.s.state_mut().q[..points].as_chunks_mut::<3>();
        for p in x {
            p[1] = 0.0;
            p[axis] = 0.0;
        }
        let masses = lumped_point_masses(&n);
        let lightest = masses.into_iter().fold(f64::INFINITY, f64::min);
        let most = (6.0 * sim.stored() / lightest).sqrt();
        finite += runs(&mut sim)?;
        speed = speed.max(sim.log.speed);
        share = share.max(sim.log.speed / most);
    }
    Ok(vec![("finite", finite), ("speed", speed), (FASTEST, share)])
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
    let (mut lines, mut rows) = (0, 0);
    // After the header and row 1: the line of the chart that follows is the third.
    // A row that is missing stands on no line.
    for (row, place) in [
        ("row 2 WS: *k2tog*", Some("bad.chart:3:")),
        ("row 2 WS: *knot*", Some("bad.chart:3:")),
        ("row 2 WS: *k", Some("bad.chart:3:")),
        ("row 2 RS: *k*", Some("bad.chart:3:")),
        ("row 4 WS: *p*", None),
        ("row 2 WS: k99999999999", Some("bad.chart:3:")),
        ("row 2 WS: yo", Some("bad.chart:3:")),
    ] {
        b.file("bad.chart", &format!("name: bad\nrow 1 RS: *k*\n{row}\n"))?;
        let message = b.refusal(&scene(&[BARE, KNIT]), &[("cloth.0.chart", "bad.chart")]);
        let names = |part: &str| i32::from(message.as_ref().is_some_and(|m| m.contains(part)));
        match place {
            Some(place) => lines += names(place),
            None => rows += names("bad.chart:row 2 is missing"),
        }
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
        ("missing rows refused with their number", f64::from(rows)),
        ("names and sizes refused", f64::from(names)),
    ])
}
