//! Numbers at the ends of their ranges: ours.

use super::scenes::{BALL, BARE, DAMPED, FLOOR, GENTLE, SHEET, scene};
use crate::case::{Case, Expected, Figures, Pace, SOLVES, TOUCHES, at_least, below, equal, told};
use crate::{Bench, HardError};

pub static CASES: [Case; 8] = [
    Case {
        number: 59,
        name: "very-stiff",
        setup: "fabric of 1e7 N/m on a ball, 0.15 s",
        naive: "single precision and loose tolerances lose it",
        bounds: &[
            equal("finite", "1", 1.0),
            below("area error", "1", 1e-2),
            at_least("least step", "1", 1e-3),
        ],
        pace: Pace::Quick,
        axes: SOLVES,
        expected: Expected::Passes,
        run: stiff,
    },
    Case {
        number: 60,
        name: "densities",
        setup: "sheets of 1e-6 and of 5 kg/m² fall on the floor, 0.2 s; 1e3 kg/m²",
        naive: "contact stiffness against mass: 1e9 apart",
        bounds: &[
            equal("finite", "1", 1.0),
            below("speed", "m/s", 10.0),
            told("depth of the heavy one", "m"),
            equal("1e3 kg/m² refused by name", "1", 1.0),
        ],
        pace: Pace::Quick,
        axes: TOUCHES,
        expected: Expected::Passes,
        run: densities,
    },
    Case {
        number: 61,
        name: "gravities",
        setup: "no gravity and 1e3 m/s² on a ball, 0.2 s",
        naive: "a stop rule that never fires, cloth pressed through the body",
        bounds: &[
            equal("finite", "1", 1.0),
            below("speed at rest", "m/s", 1e-9),
            told("depth at 1e3 m/s²", "m"),
        ],
        pace: Pace::Quick,
        axes: TOUCHES,
        expected: Expected::Passes,
        run: gravities,
    },
    Case {
        number: 62,
        name: "steps",
        setup: "steps of 1e-12 s (100 of them) and of 0.5 s on a ball",
        naive: "round-off at the one, divergence at the other",
        bounds: &[
            equal("finite", "1", 1.0),
            below("rejected at 1e-12 s", "1", 1.0),
            told("rejected at 0.5 s", "1"),
        ],
        pace: Pace::Quick,
        axes: SOLVES,
        expected: Expected::Passes,
        run: steps,
    },
    Case {
        number: 63,
        name: "tolerance-below-round-off",
        setup: "linear and Newton tolerances of 1e-14 on a hanging sheet, 50 ms",
        naive: "the residual cannot go lower and the step is cut for ever",
        bounds: &[equal("finite", "1", 1.0), at_least("least step", "1", 1e-3)],
        pace: Pace::Quick,
        axes: SOLVES,
        expected: Expected::Passes,
        run: tolerance,
    },
    Case {
        number: 64,
        name: "needle",
        setup: "sheet of 2 cm cells falls on an upright capsule of 2 mm, `contact.body_faces`, 0.4 s",
        naive: "the needle passes between the points",
        bounds: &[
            equal("finite", "1", 1.0),
            at_least("cloth over the foot of the needle", "m", 0.0),
        ],
        pace: Pace::Quick,
        axes: TOUCHES,
        expected: Expected::Passes,
        run: needle,
    },
    Case {
        number: 65,
        name: "press-shut",
        setup: "two boxes close on a sheet until nothing is left between them, 0.3 s",
        naive: "the step goes to zero between two walls",
        bounds: &[
            equal("finite", "1", 1.0),
            below("speed", "m/s", 10.0),
            at_least("least step", "1", 1e-3),
        ],
        pace: Pace::Quick,
        axes: TOUCHES,
        expected: Expected::Passes,
        run: press,
    },
    Case {
        number: 66,
        name: "thrown",
        setup: "sheet hits the floor at 1e3 m/s, 20 ms",
        naive: "a metre a step: tunnelling, or NaN",
        bounds: &[
            equal("finite", "1", 1.0),
            at_least("lowest point", "m", -0.01),
            told("deepest below the thickness", "m"),
        ],
        pace: Pace::Quick,
        axes: TOUCHES,
        expected: Expected::Passes,
        run: thrown,
    },
];

fn stiff(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[GENTLE, DAMPED, SHEET, BALL]);
    let set = [
        ("simulation.duration", "0.15"),
        (
            "fabric.f.membrane",
            "{ form = \"isotropic\", stiffness = 1e7, poisson = 0.3 }",
        ),
    ];
    let mut sim = b.sim(&text, &set)?;
    sim.run()?;
    let mut figures = sim.usual();
    figures.push(("area error", (sim.area() - 1.0).abs()));
    Ok(figures)
}

fn densities(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[GENTLE, DAMPED, SHEET, FLOOR]);
    let refused = b.refusal(&text, &[("fabric.f.density", "1e3")]);
    let (mut finite, mut speed, mut depth) = (1.0, 0.0_f64, 0.0);
    for density in ["1e-6", "5"] {
        let set = [
            ("simulation.duration", "0.2"),
            ("fabric.f.density", density),
        ];
        let mut sim = b.sim(&text, &set)?;
        sim.run()?;
        finite *= sim.finite();
        speed = speed.max(sim.log.speed);
        depth = sim.inside();
    }
    Ok(vec![
        ("finite", finite),
        ("speed", speed),
        ("depth of the heavy one", depth),
        (
            "1e3 kg/m² refused by name",
            f64::from(u8::from(refused.is_some_and(|m| m.contains("density")))),
        ),
    ])
}

fn gravities(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[GENTLE, DAMPED, SHEET, BALL]);
    let run = |gravity: &str| -> Result<crate::Sim, HardError> {
        let set = [
            ("simulation.duration", "0.2"),
            ("simulation.gravity", gravity),
        ];
        let mut sim = b.sim(&text, &set)?;
        sim.run()?;
        Ok(sim)
    };
    let (none, much) = (run("[0, 0, 0]")?, run("[0, -1000, 0]")?);
    Ok(vec![
        ("finite", none.finite() * much.finite()),
        ("speed at rest", none.log.speed),
        ("depth at 1e3 m/s²", much.log.depth),
    ])
}

fn steps(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[BARE, DAMPED, SHEET, BALL]);
    let run = |step: &str, duration: &str| -> Result<crate::Sim, HardError> {
        let set = [
            ("simulation.duration", duration),
            ("integrator.max_step", step),
        ];
        let mut sim = b.sim(&text, &set)?;
        sim.run()?;
        Ok(sim)
    };
    let (short, long) = (run("1e-12", "1e-10")?, run("0.5", "2.0")?);
    Ok(vec![
        ("finite", short.finite() * long.finite()),
        ("rejected at 1e-12 s", short.log.rejected as f64),
        ("rejected at 0.5 s", long.log.rejected as f64),
    ])
}

fn tolerance(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[
        BARE,
        DAMPED,
        SHEET,
        "[[pin]]\nselect = { corner = \"top-left\" }\n",
    ]);
    let set = [
        ("simulation.duration", "0.05"),
        ("solver.tolerance", "1e-14"),
        ("integrator.newton_tolerance", "1e-14"),
        ("integrator.newton_iterations", "30"),
    ];
    let mut sim = b.sim(&text, &set)?;
    sim.run()?;
    Ok(sim.usual())
}

fn needle(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[
        GENTLE,
        DAMPED,
        SHEET,
        "[[body]]\nkind = \"capsule\"\nfrom = [0.004, -0.2, 0.003]\nto = [0.004, -0.01, \
         0.003]\nradius = 0.001\n",
    ]);
    let set = [
        ("simulation.duration", "0.4"),
        ("contact.body_faces", "true"),
    ];
    let mut sim = b.sim(&text, &set)?;
    sim.run()?;
    // Fallen through altogether: 0.3 s of free fall are 0.4 m.
    let highest = sim.points().iter().map(|p| p[1]).fold(f64::MIN, f64::max);
    Ok(vec![
        ("finite", sim.finite()),
        ("cloth over the foot of the needle", highest + 0.02),
    ])
}

fn press(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[
        BARE,
        DAMPED,
        SHEET,
        "[[body]]\nkind = \"box\"\nsize = [0.1, 0.1, 0.1]\ncenter = [0, 0.06, 0]\nmotion = [{ time = 0 }, { \
         time = 0.2, translation = [0, -0.01, 0] }]\n[[body]]\nkind = \"box\"\nsize = [0.1, 0.1, \
         0.1]\ncenter = [0, -0.06, 0]\nmotion = [{ time = 0 }, { time = 0.2, translation = [0, 0.01, 0] }]\n",
    ]);
    let mut sim = b.sim(&text, &[("simulation.duration", "0.3")])?;
    sim.run()?;
    Ok(sim.usual())
}

fn thrown(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[BARE, DAMPED, SHEET, FLOOR]);
    let set = [
        ("simulation.duration", "0.02"),
        ("cloth.0.center", "[0, 0.5, 0]"),
    ];
    let mut sim = b.sim(&text, &set)?;
    sim.push(|_| [0.0, -1e3, 0.0]);
    sim.run()?;
    let lowest = sim.points().iter().map(|p| p[1]).fold(f64::MAX, f64::min);
    Ok(vec![
        ("finite", sim.finite()),
        ("lowest point", lowest),
        ("deepest below the thickness", sim.log.depth),
    ])
}
