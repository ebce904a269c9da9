//! Cloth on cloth and on bodies: layers, pinches, tangles, twists.

use super::scenes::{BARE, DAMPED, FLOOR, GENTLE, STIFF, scene};
use crate::case::{Case, Expected, Figures, Pace, TOUCHES, at_least, at_most, below, equal, told};
use crate::sim::{distance, fastest, norm, sub};
use crate::{Bench, HardError};

pub static CASES: [Case; 8] = [
    Case {
        number: 15,
        name: "coincident-layers",
        setup: "two sheets in the same place, point on point, no gravity, 50 ms",
        naive: "the normal is 0/0",
        bounds: &[
            equal("finite", "1", 1.0),
            at_least("median distance over half a thickness", "1", 1.0),
            // Ten times what a thickness in the time of release makes.
            below("speed", "m/s", 0.5),
        ],
        pace: Pace::Quick,
        axes: TOUCHES,
        expected: Expected::Passes,
        run: coincident,
    },
    Case {
        number: 16,
        name: "thick-for-its-mesh",
        setup: "3 mm mesh with a contact thickness of 1 mm, no gravity, 0.2 s",
        naive: "the mesh repels itself and grows",
        bounds: &[
            at_least("warnings", "1", 1.0),
            at_most("area growth", "1", 1e-3),
        ],
        pace: Pace::Quick,
        axes: TOUCHES,
        expected: Expected::Passes,
        run: thick,
    },
    Case {
        number: 17,
        name: "ten-layers",
        setup: "ten sheets of 0.2 m² stacked 1 mm apart on a floor, 1 s, 5 cm mesh",
        naive: "layers creep through each other and change places",
        bounds: &[
            equal("points out of order", "1", 0.0),
            below("penetration over half a thickness", "1", 1.0),
            below("kinetic energy of the 99th percentile", "J", 1e-8),
        ],
        pace: Pace::Slow,
        axes: TOUCHES,
        expected: Expected::Passes,
        run: layers,
    },
    Case {
        number: 18,
        name: "pinch",
        setup: "sheet between two boxes with half a thickness of room, 0.3 s",
        naive: "jitter, points thrown out",
        bounds: &[
            equal("finite", "1", 1.0),
            below("jitter", "m", 1e-4),
            at_least("least step", "1", 1.0 / 64.0),
        ],
        pace: Pace::Quick,
        axes: TOUCHES,
        expected: Expected::Passes,
        run: pinch,
    },
    Case {
        number: 19,
        name: "fast-body",
        setup: "ball of 5 cm flies into hanging cloth at 2 m/s, then at 10 m/s",
        naive: "it tunnels through",
        bounds: &[
            equal("crossings at 2 m/s", "1", 0.0),
            below("depth in the ball at 2 m/s", "m", 1e-3),
            below("deepest over what is certain at 2 m/s", "1", 1.0),
            below("way in a step over the radius at 2 m/s", "1", 1.0),
            equal("crossings at 10 m/s", "1", 0.0),
            below("depth in the ball at 10 m/s", "m", 1e-3),
            below("deepest over what is certain at 10 m/s", "1", 1.0),
            below("way in a step over the radius at 10 m/s", "1", 1.0),
            told("most crossings on the way at 10 m/s", "1"),
        ],
        pace: Pace::Quick,
        axes: TOUCHES,
        expected: Expected::Passes,
        run: fast_body,
    },
    Case {
        number: 20,
        name: "tangled-start",
        setup: "two crossed sheets, 5 cm through each other, `contact.part_crossed`, 1 s",
        naive: "tangled for ever",
        bounds: &[
            equal("finite", "1", 1.0),
            told("crossings at the start", "1"),
            equal("crossings", "1", 0.0),
        ],
        pace: Pace::Quick,
        axes: TOUCHES,
        expected: Expected::Passes,
        run: tangled,
    },
    Case {
        number: 42,
        name: "light-cloth",
        setup: "1 g/m² falls on the floor at 1 ms",
        naive: "h² k / m is 1e3: it bounces for ever",
        bounds: &[
            equal("finite", "1", 1.0),
            below("energy gained over the largest", "1", 1e-2),
            below("depth", "m", 1.5e-3),
        ],
        pace: Pace::Quick,
        axes: TOUCHES,
        expected: Expected::Passes,
        run: light,
    },
    Case {
        number: 48,
        name: "many-contacts",
        setup: "eight layers of 40 × 40 points nine tenths of a thickness apart, 3 steps, twice",
        naive: "the contact matrix takes the memory and the sort the time",
        bounds: &[
            at_least("contact candidates", "1", 1e5),
            below("rebuild over step", "1", 0.3),
            equal("numbers that differ", "1", 0.0),
        ],
        pace: Pace::Slow,
        axes: TOUCHES,
        expected: Expected::Passes,
        run: many,
    },
];

fn coincident(b: &Bench) -> Result<Figures, HardError> {
    let sheet = "[[cloth]]\nkind = \"sheet\"\nsize = [0.1, 0.1]\npoints = [8, 8]\nfabric = \"f\"\n";
    let text = scene(&[BARE, DAMPED, sheet, sheet]);
    let set = [
        ("simulation.duration", "0.05"),
        ("simulation.gravity", "[0, 0, 0]"),
    ];
    let mut sim = b.sim(&text, &set)?;
    sim.run()?;
    let x = sim.points();
    let (low, high) = x.split_at(x.len() / 2);
    let speed = sim.log.speed;
    let mut gaps: Vec<f64> = low
        .iter()
        .zip(high)
        .map(|(a, b)| norm(sub(*a, *b)))
        .collect();
    gaps.sort_by(f64::total_cmp);
    Ok(vec![
        ("finite", sim.finite()),
        ("speed", speed),
        (
            "median distance over half a thickness",
            gaps[gaps.len() / 2] / 5e-4,
        ),
    ])
}

fn thick(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[
        BARE,
        DAMPED,
        "[[cloth]]\nkind = \"sheet\"\nsize = [0.04, 0.04]\nedge_length = 0.003\nfabric = \"f\"\n",
    ]);
    let set = [
        ("simulation.duration", "0.2"),
        ("simulation.gravity", "[0, 0, 0]"),
        ("contact.self", "true"),
        ("contact.thickness", "1e-3"),
    ];
    let mut sim = b.sim(&text, &set)?;
    let warned = sim.built.warnings.len();
    sim.run()?;
    Ok(vec![
        ("warnings", warned as f64),
        ("area growth", sim.area() - 1.0),
    ])
}

fn layers(b: &Bench) -> Result<Figures, HardError> {
    let sheets: String = (0..10)
        .map(|k| {
            format!(
                "[[cloth]]\nkind = \"sheet\"\nsize = [0.447, 0.447]\nedge_length = 0.05\ncenter = \
                 [0, {}, 0]\nlayer = {k}\nfabric = \"f\"\n",
                1e-3 * f64::from(k)
            )
        })
        .collect();
    let text = scene(&[GENTLE, DAMPED, &sheets, FLOOR]);
    let mut sim = b.sim(&text, &[("simulation.duration", "1.0")])?;
    sim.run()?;
    let x = sim.points();
    let each = x.len() / 10;
    let wrong = (each..x.len())
        .filter(|i| x[*i][1] <= x[i - each][1])
        .count();
    Ok(vec![
        ("points out of order", wrong as f64),
        ("penetration over half a thickness", sim.log.depth / 7.5e-4),
        ("kinetic energy of the 99th percentile", sim.s.rest_energy()),
    ])
}

fn pinch(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[
        BARE,
        DAMPED,
        "[[cloth]]\nkind = \"sheet\"\nsize = [0.2, 0.2]\npoints = [10, 10]\nfabric = \"f\"\n",
        "[[body]]\nkind = \"box\"\nsize = [0.1, 0.1, 0.1]\ncenter = [0, 0.050375, 0]\n",
        "[[body]]\nkind = \"box\"\nsize = [0.1, 0.1, 0.1]\ncenter = [0, -0.050375, 0]\n",
    ]);
    let mut sim = b.sim(&text, &[("simulation.duration", "0.3")])?;
    let inside: Vec<usize> = {
        let x = sim.points();
        let near = |p: &[f64; 3]| p[0].abs() < 0.05 && p[2].abs() < 0.05;
        (0..x.len()).filter(|i| near(&x[*i])).collect()
    };
    sim.until(0.2)?;
    let held = |x: &[[f64; 3]]| inside.iter().map(|i| x[*i]).collect::<Vec<_>>();
    let (mut last, mut square, mut count) = (held(&sim.points()), 0.0, 0);
    while sim.step()? {
        let now = held(&sim.points());
        square += distance(&now, &last)[1].powi(2);
        count += 1;
        last = now;
    }
    let mut figures = sim.usual();
    figures.push(("jitter", (square / f64::from(count.max(1))).sqrt()));
    Ok(figures)
}

fn fast_body(b: &Bench) -> Result<Figures, HardError> {
    // Up to three thicknesses in the ball the nearest surface is the one that
    // the cloth came through. Looked at after every step, and with less than a
    // radius on the way in each, nothing passes through the ball.
    let certain = 4.5e-3;
    let hit = |speed: f64| -> Result<[f64; 5], HardError> {
        let way = 0.3;
        let body = format!(
            "[[body]]\nkind = \"sphere\"\ncenter = [0, 0, -0.1]\nradius = 0.05\nmotion = [{{ time = 0 }}, {{ time \
             = {:?}, translation = [0, 0, {way}] }}]\n",
            way / speed
        );
        let text = scene(&[
            BARE,
            DAMPED,
            "[[cloth]]\nkind = \"sheet\"\nsize = [0.3, 0.3]\npoints = [24, 24]\nrotation = [90, \
             0, 0]\nfabric = \"f\"\n[[pin]]\nselect = { edge = \"top\" }\n",
            &body,
        ]);
        let duration = format!("{:?}", way / speed);
        let mut sim = b.sim(&text, &[("simulation.duration", &duration)])?;
        let (mut crossed, mut deepest, mut way) = (0.0_f64, 0.0_f64, 0.0_f64);
        loop {
            let time = sim.s.state().time;
            match sim.step() {
                Ok(true) => {}
                Ok(false) => {
                    let end = [sim.crossings(), sim.inside()];
                    return Ok([end[0], end[1], deepest / certain, way / 0.05, crossed]);
                }
                // To stop is allowed; to go on with wrong contact is not.
                Err(HardError::Simulation(_)) => return Ok([0.0; 5]),
                Err(e) => return Err(e),
            }
            let dt = sim.s.state().time - time;
            way = way.max((speed + fastest(&sim.s)) * dt);
            crossed = crossed.max(sim.crossings());
            deepest = deepest.max(sim.inside());
        }
    };
    let (slow, fast) = (hit(2.0)?, hit(10.0)?);
    Ok(vec![
        ("crossings at 2 m/s", slow[0]),
        ("depth in the ball at 2 m/s", slow[1]),
        ("deepest over what is certain at 2 m/s", slow[2]),
        ("way in a step over the radius at 2 m/s", slow[3]),
        ("crossings at 10 m/s", fast[0]),
        ("depth in the ball at 10 m/s", fast[1]),
        ("deepest over what is certain at 10 m/s", fast[2]),
        ("way in a step over the radius at 10 m/s", fast[3]),
        ("most crossings on the way at 10 m/s", fast[4]),
    ])
}

fn tangled(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[
        GENTLE,
        DAMPED,
        "[[cloth]]\nkind = \"sheet\"\nsize = [0.2, 0.2]\npoints = [12, 12]\nfabric = \"f\"\n",
        "[[cloth]]\nkind = \"sheet\"\nsize = [0.2, 0.2]\npoints = [12, 12]\nrotation = [90, 0, \
         0]\ncenter = [0.003, 0.05, 0.004]\nfabric = \"f\"\n",
    ]);
    let set = [
        ("simulation.duration", "1.0"),
        ("simulation.gravity", "[0, 0, 0]"),
    ];
    let as_put = b.sim(&text, &set)?.crossings();
    let parted = [&set[..], &[("contact.part_crossed", "true")]].concat();
    let mut sim = b.sim(&text, &parted)?;
    sim.run()?;
    Ok(vec![
        ("finite", sim.finite()),
        ("crossings at the start", as_put),
        ("crossings", sim.crossings()),
    ])
}

fn light(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[
        BARE,
        STIFF,
        "[[cloth]]\nkind = \"sheet\"\nsize = [0.2, 0.2]\npoints = [10, 10]\ncenter = [0, 0.02, \
         0]\nfabric = \"f\"\n",
        FLOOR,
    ]);
    let set = [
        ("simulation.duration", "0.3"),
        ("fabric.f.density", "1e-3"),
        ("contact.body_stiffness", "100"),
        ("contact.self", "false"),
    ];
    let mut sim = b.sim(&text, &set)?;
    sim.run()?;
    let mut figures = sim.usual();
    figures.push((
        "energy gained over the largest",
        sim.log.gained / sim.log.energy.max(f64::MIN_POSITIVE),
    ));
    Ok(figures)
}

fn many(b: &Bench) -> Result<Figures, HardError> {
    let sheets: String = (0..8)
        .map(|k| {
            format!(
                "[[cloth]]\nkind = \"sheet\"\nsize = [0.3, 0.3]\npoints = [40, 40]\ncenter = \
                 [{:?}, {:?}, 0]\nlayer = {k}\nfabric = \"f\"\n",
                1e-3 * f64::from(k % 3),
                9e-4 * f64::from(k)
            )
        })
        .collect();
    let text = scene(&[BARE, DAMPED, &sheets]);
    let once = || -> Result<(Vec<u64>, f64, f64), HardError> {
        let mut sim = b.sim(&text, &[("simulation.duration", "0.003")])?;
        sim.run()?;
        let ledger = sim.s.ledger();
        let all: f64 = ledger.entries().iter().map(|e| e.time.as_secs_f64()).sum();
        let share = ledger.seconds("assembly: contact") / all;
        Ok((sim.bits(), sim.log.candidates as f64, share))
    };
    let (first, pairs, share) = once()?;
    let (second, _, _) = once()?;
    let differ = first.iter().zip(&second).filter(|(a, b)| a != b).count();
    Ok(vec![
        ("contact candidates", pairs),
        ("rebuild over step", share),
        ("numbers that differ", differ as f64),
    ])
}
