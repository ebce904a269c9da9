//! Beginnings that break codes: ours.

use super::input::two_panels;
use super::scenes::{BALL, BARE, DAMPED, FLOOR, GENTLE, SHEET, icosphere, obj, scene};
use crate::case::{Case, Expected, Figures, Pace, SOLVES, TOUCHES, at_most, below, equal, told};
use crate::sim::distance;
use crate::{Bench, HardError};

pub static CASES: [Case; 9] = [
    Case {
        number: 49,
        name: "edge-on-fall",
        setup: "sheet falls exactly edge-on to the floor, 0.4 s",
        naive: "the exact vertical never buckles, or contact along one row throws it",
        bounds: &[
            equal("finite", "1", 1.0),
            below("depth in the floor", "m", 1.5e-3),
            below("speed", "m/s", 5.0),
        ],
        pace: Pace::Quick,
        axes: TOUCHES,
        expected: Expected::Passes,
        run: edge_on,
    },
    Case {
        number: 50,
        name: "ball-centre",
        setup: "a point of the sheet exactly at the centre of a ball, where the distance has no \
                gradient",
        naive: "a normal of NaN",
        bounds: &[equal("finite", "1", 1.0), below("speed", "m/s", 10.0)],
        pace: Pace::Quick,
        axes: TOUCHES,
        expected: Expected::Passes,
        run: centre,
    },
    Case {
        number: 51,
        name: "start-inside-body",
        setup: "a small sheet wholly inside a box of 0.2 m, 0.5 s",
        naive: "it is thrown out at any speed",
        bounds: &[
            equal("finite", "1", 1.0),
            below("speed", "m/s", 10.0),
            told("depth at the end", "m"),
        ],
        pace: Pace::Quick,
        axes: TOUCHES,
        expected: Expected::Passes,
        run: inside,
    },
    Case {
        number: 52,
        name: "unequal-seam",
        setup: "an edge of 0.2 m sewn to one of 0.55 m",
        naive: "the step goes to zero, or triangles turn over",
        bounds: &[
            equal("finite", "1", 1.0),
            below("gap", "m", 5e-4),
            told("largest strain", "1"),
        ],
        pace: Pace::Quick,
        axes: SOLVES,
        expected: Expected::Passes,
        run: unequal_seam,
    },
    Case {
        number: 53,
        name: "all-pinned",
        setup: "every point of a sheet is held, 20 steps",
        naive: "an empty linear system, a percentile of nothing",
        bounds: &[equal("finite", "1", 1.0), equal("displacement", "m", 0.0)],
        pace: Pace::Quick,
        axes: SOLVES,
        expected: Expected::Passes,
        run: all_pinned,
    },
    Case {
        number: 54,
        name: "single-triangle",
        setup: "one triangle falls flat on the floor, 0.3 s",
        naive: "no hinges, no pattern, no percentile",
        bounds: &[
            equal("finite", "1", 1.0),
            at_most("depth in the floor", "m", 1.5e-3),
        ],
        pace: Pace::Quick,
        axes: TOUCHES,
        expected: Expected::Passes,
        run: single,
    },
    Case {
        number: 55,
        name: "body-jump",
        setup: "a ball under a draped sheet is moved by 1 m within one step",
        naive: "the force over a metre of depth throws the cloth away",
        bounds: &[equal("finite", "1", 1.0), below("speed", "m/s", 50.0)],
        pace: Pace::Quick,
        axes: TOUCHES,
        expected: Expected::Passes,
        run: jump,
    },
    Case {
        number: 56,
        name: "duplicated-layer",
        setup: "two sheets in the same place fall together on the floor, 0.15 s",
        naive: "no side to push to: they stay one, or fly apart",
        bounds: &[
            equal("finite", "1", 1.0),
            below("speed", "m/s", 3.0),
            equal("crossings", "1", 0.0),
        ],
        pace: Pace::Quick,
        axes: TOUCHES,
        expected: Expected::Passes,
        run: duplicated,
    },
    Case {
        number: 57,
        name: "body-with-hole",
        setup: "a sheet falls on a ball of triangles with some missing",
        naive: "inside and outside are not defined, and nobody says so",
        bounds: &[
            equal("told or refused", "1", 1.0),
            equal("finite", "1", 1.0),
        ],
        pace: Pace::Quick,
        axes: TOUCHES,
        expected: Expected::Passes,
        run: hole,
    },
];

fn edge_on(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[BARE, DAMPED, SHEET, FLOOR]);
    let set = [
        ("simulation.duration", "0.4"),
        ("cloth.0.rotation", "[90, 0, 0]"),
        ("cloth.0.center", "[0, 0.11, 0]"),
    ];
    let mut sim = b.sim(&text, &set)?;
    sim.run()?;
    let mut figures = sim.usual();
    figures.push(("depth in the floor", sim.inside()));
    Ok(figures)
}

fn centre(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[
        GENTLE,
        DAMPED,
        "[[cloth]]\nkind = \"sheet\"\nsize = [0.2, 0.2]\npoints = [11, 11]\nlattice = \
         \"alternating\"\nfabric = \"f\"\n[[body]]\nkind = \"sphere\"\nradius = 0.05\n",
    ]);
    let mut sim = b.sim(&text, &[("simulation.duration", "0.4")])?;
    sim.run()?;
    Ok(sim.usual())
}

fn inside(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[
        GENTLE,
        DAMPED,
        SHEET,
        "[[body]]\nkind = \"box\"\nsize = [0.2, 0.2, 0.2]\n",
    ]);
    let set = [
        ("simulation.duration", "0.5"),
        ("cloth.0.size", "[0.08, 0.08]"),
        ("cloth.0.center", "[0.01, 0.03, 0]"),
    ];
    let mut sim = b.sim(&text, &set)?;
    sim.run()?;
    let mut figures = sim.usual();
    figures.push(("depth at the end", sim.inside()));
    Ok(figures)
}

fn unequal_seam(b: &Bench) -> Result<Figures, HardError> {
    b.file("pattern.json", &two_panels(20.0, 55.0))?;
    let text = scene(&[
        BARE,
        DAMPED,
        "[[cloth]]\nkind = \"pattern\"\nfile = \"pattern.json\"\nedge_length = 0.04\nfabric = \
         \"f\"\n",
    ]);
    let built = b.built(&text, &[("simulation.duration", "0.1")])?;
    let result = super::program::run(&built, &super::program::options(b, "seam"))?;
    let s = &result.summary;
    let finite = result.positions.iter().all(|x| x.is_finite());
    let good = finite && s.status == selvedge_scene::summary::Status::Finished;
    Ok(vec![
        ("finite", f64::from(u8::from(good))),
        ("gap", s.max_seam_gap_m),
        ("largest strain", s.max_abs_edge_strain),
    ])
}

fn all_pinned(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[
        GENTLE,
        DAMPED,
        SHEET,
        "[[pin]]\nselect = { box = { min = [-1, -1, -1], max = [1, 1, 1] } }\n",
    ]);
    let set = [("simulation.duration", "0.3"), ("stop.early", "true")];
    let mut sim = b.sim(&text, &set)?;
    let start = sim.points();
    sim.run()?;
    Ok(vec![
        ("finite", sim.finite()),
        ("displacement", distance(&start, &sim.points())[0]),
    ])
}

fn single(b: &Bench) -> Result<Figures, HardError> {
    let points = [[0.0, 0.01, 0.0], [0.0, 0.01, 0.05], [0.05, 0.01, 0.0]];
    b.file("one.obj", &obj(&points, &[[0, 1, 2]]))?;
    let text = scene(&[
        BARE,
        DAMPED,
        "[[cloth]]\nkind = \"mesh\"\nfile = \"one.obj\"\nrest = \"shape\"\nfabric = \"f\"\n",
        FLOOR,
    ]);
    let mut sim = b.sim(&text, &[("simulation.duration", "0.3")])?;
    sim.run()?;
    let mut figures = sim.usual();
    figures.push(("depth in the floor", sim.inside()));
    Ok(figures)
}

fn jump(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[
        GENTLE,
        DAMPED,
        SHEET,
        BALL,
        "motion = [{ time = 0.2, translation = [0, 0, 0] }, { time = 0.2005, translation = [0, \
         1, 0] }]\n",
    ]);
    let mut sim = b.sim(&text, &[("simulation.duration", "0.4")])?;
    sim.run()?;
    Ok(sim.usual())
}

fn duplicated(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[GENTLE, DAMPED, SHEET, SHEET, FLOOR]);
    let mut sim = b.sim(&text, &[("simulation.duration", "0.15")])?;
    sim.run()?;
    let mut figures = sim.usual();
    figures.push(("crossings", sim.crossings()));
    Ok(figures)
}

fn hole(b: &Bench) -> Result<Figures, HardError> {
    let (points, mut triangles) = icosphere(2, 0.1);
    triangles.drain(40..52);
    b.file("body.obj", &obj(&points, &triangles))?;
    let text = scene(&[
        GENTLE,
        DAMPED,
        SHEET,
        "[[body]]\nkind = \"mesh\"\nfile = \"body.obj\"\ncenter = [0, -0.103, 0]\nvoxel = 0.01\n",
    ]);
    match b.sim(&text, &[("simulation.duration", "0.2")]) {
        Err(HardError::Scene(_)) => Ok(vec![("told or refused", 1.0), ("finite", 1.0)]),
        Err(e) => Err(e),
        Ok(mut sim) => {
            let told = f64::from(u8::from(!sim.built.warnings.is_empty()));
            sim.run()?;
            Ok(vec![("told or refused", told), ("finite", sim.finite())])
        }
    }
}
