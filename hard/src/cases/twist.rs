//! Twisted cloth.

use super::scenes::{BARE, DAMPED, scene};
use crate::case::{Case, Expected, Figures, Pace, TOUCHES, at_least, at_most, equal, told};
use crate::{Bench, HardError};

pub static CASES: [Case; 2] = [
    Case {
        number: 25,
        name: "twist",
        setup: "1 m² between two clamps turned by 0.75 π in 1.5 s, held to 3 s, 5 cm mesh, stiff",
        naive: "the step collapses, cloth passes through itself",
        bounds: &[
            equal("finite", "1", 1.0),
            at_most("crossings over edges", "1", 1e-3),
            at_least("mean step", "s", 3e-4),
        ],
        pace: Pace::Slow,
        axes: TOUCHES,
        expected: Expected::Passes,
        run: twist,
    },
    Case {
        number: 26,
        name: "ten-turns",
        setup: "strip of 0.2 × 0.6 m twisted by ten turns in 3 s, one end drawn in by 0.25 m, 2.5 cm mesh",
        naive: "contact with itself breaks down",
        bounds: &[equal("finite", "1", 1.0), told("crossings", "1")],
        pace: Pace::Slow,
        axes: TOUCHES,
        expected: Expected::Passes,
        run: ten_turns,
    },
];

fn clamps(size: [f64; 2], edge: f64, angle: f64, time: f64, slides: bool) -> String {
    format!(
        "[[cloth]]\nkind = \"sheet\"\nsize = [{:?}, {:?}]\nedge_length = {edge:?}\nfabric = \
         \"f\"\n[[pin]]\nselect = {{ edge = \"left\" }}\n[[pin]]\nselect = {{ edge = \"right\" \
         }}\nmotion = [{{ time = 0 }}, {{ time = {time:?}, rotation = {{ axis = [1, 0, 0], angle = {angle:?} }}{} \
         }}]\n",
        size[0],
        size[1],
        if slides {
            ", translation = [-0.25, 0, 0]"
        } else {
            ""
        }
    )
}

fn twist(b: &Bench) -> Result<Figures, HardError> {
    let cloth = clamps([1.0, 1.0], 0.05, 135.0, 1.5, false);
    let text = scene(&[BARE, DAMPED, &cloth]);
    let set = [
        ("simulation.duration", "3.0"),
        ("simulation.gravity", "[0, 0, 0]"),
        ("contact.self", "true"),
    ];
    let mut sim = b.sim(&text, &set)?;
    sim.run()?;
    let edges = sim.built.geometry.mesh.edges().len() as f64;
    Ok(vec![
        ("finite", sim.finite()),
        ("crossings over edges", sim.crossings() / edges),
        ("mean step", 3.0 / sim.log.steps as f64),
    ])
}

fn ten_turns(b: &Bench) -> Result<Figures, HardError> {
    let cloth = clamps([0.6, 0.2], 0.025, 3600.0, 3.0, true);
    let text = scene(&[BARE, DAMPED, &cloth]);
    let set = [
        ("simulation.duration", "3.0"),
        ("simulation.gravity", "[0, 0, 0]"),
        ("contact.self", "true"),
    ];
    let mut sim = b.sim(&text, &set)?;
    sim.run()?;
    Ok(vec![
        ("finite", sim.finite()),
        ("crossings", sim.crossings()),
    ])
}
