//! Input that is broken, empty or far away.

use super::integrator::names_not_finite;
use super::scenes::{BARE, SHEET, STIFF, obj, scene};
use crate::case::{ALONE, Case, Expected, Figures, Pace, SOLVES, at_least, below, equal};
use crate::{Bench, HardError};

pub static CASES: [Case; 5] = [
    Case {
        number: 8,
        name: "degenerate-mesh",
        setup: "meshes with a triangle of no area, a triangle twice, a point of no triangle",
        naive: "1/0",
        bounds: &[
            equal("errors that name the element", "1", 2.0),
            equal("isolated point told or simulated", "1", 1.0),
        ],
        pace: Pace::Quick,
        axes: ALONE,
        expected: Expected::Passes,
        run: degenerate,
    },
    Case {
        number: 29,
        name: "not-a-number",
        setup: "NaN in one velocity, in a material, in a vertex of a file",
        naive: "it spreads in silence",
        bounds: &[
            equal("found within one step, with its point", "1", 1.0),
            equal("other numbers changed", "1", 0.0),
            equal("material and file refused by name", "1", 2.0),
        ],
        pace: Pace::Quick,
        axes: SOLVES,
        expected: Expected::Passes,
        run: not_a_number,
    },
    Case {
        number: 30,
        name: "nothing-at-all",
        setup: "no time, no step, no cloth, no triangles, no points",
        naive: "division by zero",
        bounds: &[equal("clean errors and no-ops", "1", 5.0)],
        pace: Pace::Quick,
        axes: ALONE,
        expected: Expected::Passes,
        run: nothing_at_all,
    },
    Case {
        number: 31,
        name: "far-away",
        setup: "sheet 100 m and 1000 m from the origin, no gravity; 1e6 m",
        naive: "strains are differences of large numbers",
        bounds: &[
            below("strain noise at 100 m", "1", 1e-6),
            below("strain noise at 1000 m", "1", 1e-6),
            equal("1e6 m refused", "1", 1.0),
        ],
        pace: Pace::Quick,
        axes: SOLVES,
        expected: Expected::Passes,
        run: far_away,
    },
    Case {
        number: 45,
        name: "seam-two-to-three",
        setup: "two edges with 2 and 3 cells each sewn together, 0.3 s",
        naive: "points without a partner oscillate",
        bounds: &[below("gap", "m", 5e-4), at_least("points", "1", 8.0)],
        pace: Pace::Quick,
        axes: SOLVES,
        expected: Expected::Passes,
        run: seam,
    },
];

const MESH: &str =
    "[[cloth]]\nkind = \"mesh\"\nfile = \"cloth.obj\"\nrest = \"shape\"\nfabric = \"f\"\n";

fn degenerate(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[BARE, STIFF, MESH]);
    let square = [
        [0.0, 0.0, 0.0],
        [0.0, 0.0, 0.1],
        [0.1, 0.0, 0.0],
        [0.1, 0.0, 0.1],
        [0.05, 0.0, 0.05],
    ];
    let mut named = 0;
    // Points 1, 4 and 2 lie on a line; a triangle is there twice.
    for triangles in [
        vec![[0, 1, 2], [2, 4, 1], [2, 1, 3]],
        vec![[0, 1, 2], [0, 1, 2], [2, 1, 3]],
    ] {
        b.file("cloth.obj", &obj(&square, &triangles))?;
        if let Some(message) = b.refusal(&text, &[]) {
            named += i32::from(message.contains("triangle") || message.contains("cloth.obj:"));
        }
    }
    b.file("cloth.obj", &obj(&square, &[[0, 1, 2], [2, 1, 3]]))?;
    let isolated = match b.sim(&text, &[("simulation.duration", "0.01")]) {
        Ok(mut sim) => {
            sim.run()?;
            sim.finite()
        }
        Err(HardError::Scene(_)) => 1.0,
        Err(e) => return Err(e),
    };
    Ok(vec![
        ("errors that name the element", f64::from(named)),
        ("isolated point told or simulated", isolated),
    ])
}

fn not_a_number(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[BARE, STIFF, SHEET]);
    let mut sim = b.sim(&text, &[])?;
    sim.s.state_mut().v[3 * 17 + 1] = f64::NAN;
    let before = sim.bits();
    let found = match sim.s.advance() {
        Ok(selvedge_integrator::Outcome::Rejected { reason, .. }) => {
            names_not_finite(&reason) && reason.to_string().contains("point 17")
        }
        _ => false,
    };
    let changed = before
        .iter()
        .zip(sim.bits())
        .filter(|(a, b)| *a != b)
        .count();
    let mut refused = 0;
    if let Some(message) = b.refusal(&text, &[("fabric.f.density", "nan")]) {
        refused += i32::from(message.contains("density"));
    }
    b.file("cloth.obj", "v 0 0 0\nv 0 0 nan\nv 1 0 0\nf 1 2 3\n")?;
    if let Some(message) = b.refusal(&scene(&[BARE, STIFF, MESH]), &[]) {
        refused += i32::from(message.contains("cloth.obj:2"));
    }
    Ok(vec![
        (
            "found within one step, with its point",
            f64::from(u8::from(found)),
        ),
        ("other numbers changed", changed as f64),
        ("material and file refused by name", f64::from(refused)),
    ])
}

fn nothing_at_all(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[BARE, STIFF, SHEET]);
    let mut good = 0;
    let mut sim = b.sim(&text, &[("simulation.duration", "0")])?;
    sim.run()?;
    good += i32::from(sim.log.steps == 0 && sim.finite() == 1.0);
    for set in [("integrator.max_step", "0"), ("cloth.0.points", "[0, 0]")] {
        good += i32::from(b.refusal(&text, &[set]).is_some());
    }
    good += i32::from(b.refusal("name = \"empty\"\n", &[]).is_some());
    b.file("cloth.obj", "v 0 0 0\nv 1 0 0\nv 0 0 1\n")?;
    good += i32::from(b.refusal(&scene(&[BARE, STIFF, MESH]), &[]).is_some());
    Ok(vec![("clean errors and no-ops", f64::from(good))])
}

fn far_away(b: &Bench) -> Result<Figures, HardError> {
    let text = scene(&[BARE, STIFF, SHEET]);
    let noise = |center: &str| -> Result<f64, HardError> {
        let set = [
            ("simulation.duration", "0.05"),
            ("simulation.gravity", "[0, 0, 0]"),
            ("cloth.0.center", center),
        ];
        let mut sim = b.sim(&text, &set)?;
        sim.run()?;
        let [large, small] = sim.stretches();
        Ok((large - 1.0).abs().max((small - 1.0).abs()))
    };
    let refused = b.refusal(&text, &[("cloth.0.center", "[1e6, 0, 0]")]);
    Ok(vec![
        ("strain noise at 100 m", noise("[100, 100, 100]")?),
        ("strain noise at 1000 m", noise("[1000, 1000, 1000]")?),
        ("1e6 m refused", f64::from(u8::from(refused.is_some()))),
    ])
}

/// Two square panels of 20 cm in cm, sewn along one edge whose halves are cut
/// in two pieces on one side and in three on the other.
pub(super) fn two_panels(left: f64, right: f64) -> String {
    let panel = |height: f64, x: f64| {
        format!(
            "{{\"translation\": [{x:?}, 0, 0], \"rotation\": [0, 0, 0], \"vertices\": [[0, 0], \
             [20, 0], [20, {height:?}], [0, {height:?}]], \"edges\": [{{\"endpoints\": [0, 1]}}, \
             {{\"endpoints\": [1, 2]}}, {{\"endpoints\": [2, 3]}}, {{\"endpoints\": [3, 0]}}]}}"
        )
    };
    format!(
        "{{\"pattern\": {{\"panels\": {{\"left\": {}, \"right\": {}}}, \"stitches\": \
         [[{{\"panel\": \"left\", \"edge\": 1}}, {{\"panel\": \"right\", \"edge\": 3}}]]}}, \
         \"properties\": {{\"units_in_meter\": 100, \"curvature_coords\": \"relative\", \
         \"normalize_panel_translation\": false}}}}",
        panel(left, -22.0),
        panel(right, 2.0)
    )
}

fn seam(b: &Bench) -> Result<Figures, HardError> {
    b.file("pattern.json", &two_panels(20.0, 30.0))?;
    let text = scene(&[
        BARE,
        STIFF,
        "[[cloth]]\nkind = \"pattern\"\nfile = \"pattern.json\"\nedge_length = 0.1\nfabric = \
         \"f\"\n",
    ]);
    let built = b.built(&text, &[("simulation.duration", "0.3")])?;
    let options = super::program::options(b, "seam");
    let result = super::program::run(&built, &options)?;
    Ok(vec![
        ("gap", result.summary.max_seam_gap_m),
        ("points", result.summary.points as f64),
    ])
}
