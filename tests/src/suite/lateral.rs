//! Lateral buckling of a cantilever that stands on its edge.

use std::fmt::Write;

use super::narrow::{Narrow, WIDTH, plate_bending, plate_torsion, poisson, rigidities};
use super::stability::onset;
use super::{Case, Effort, Judged, Ladder, Measured, Rung, climb, exact};

#[derive(Clone, Copy)]
enum Load {
    End,
    Weight,
}

/// Load at which a cantilever of `length` [m] falls sideways: `P L²` [N·m²]
/// for a load at its end, `q L³` for its weight `q` per length.
fn falls(columns: usize, length: f64, load: Load) -> f64 {
    let strip = Narrow::new(columns, length, 0.5);
    let last = strip.rows.len() - 1;
    let length = (last as f64 - 0.5) * strip.spacing;
    let held = strip.rows[..2].concat();
    // Down is −x. A row's force is spread by the width that its points have.
    let mut forces = vec![0.0; strip.flat.len()];
    for (k, row) in strip.rows.iter().enumerate() {
        let total = match load {
            Load::End if k == last => 1.0,
            Load::End => continue,
            Load::Weight if k == last || k == 0 => 0.5 * strip.spacing,
            Load::Weight => strip.spacing,
        };
        let x = |p: u32| strip.flat[3 * p as usize];
        for (i, &p) in row.iter().enumerate() {
            let left = row[i.saturating_sub(1)];
            let right = row[(i + 1).min(row.len() - 1)];
            let share = 0.5 * (x(right) - x(left)) / WIDTH;
            forces[3 * p as usize] = -total * share;
        }
    }
    let (power, guess) = match load {
        Load::End => (2, exact::lateral_end_load()),
        Load::Weight => (3, exact::lateral_weight()),
    };
    let per = (plate_bending() * plate_torsion()).sqrt() / length.powi(power);
    let mut q = strip.flat.clone();
    let found = onset(guess * per, |f| {
        let scaled: Vec<f64> = forces.iter().map(|x| f * x).collect();
        strip.shell.settle(&mut q, &scaled, &held);
        strip.shell.is_stable(&q, &held)
    });
    found * length.powi(power)
}

fn lateral(effort: Effort) -> Measured {
    let columns: &[usize] = effort.pick(&[2, 4], &[4, 6, 8, 12]);
    let slender = [16.0, 32.0, 64.0];
    let judged = effort.pick(Judged::Finest, Judged::Extrapolated);
    let measured: Vec<[f64; 2]> = columns.iter().map(|c| rigidities(*c)).collect();
    let plate = (plate_bending() * plate_torsion()).sqrt();
    let mut ladders = Vec::new();
    for (load, name, exact) in [
        (Load::End, "P L²/√(EI GJ)", exact::lateral_end_load()),
        (Load::Weight, "q L³/√(EI GJ)", exact::lateral_weight()),
    ] {
        let found: Vec<f64> = columns.iter().map(|c| falls(*c, 1.0, load)).collect();
        let rungs = |scale: &dyn Fn(usize) -> f64| -> Vec<Rung> {
            let rung = |(k, c): (usize, &usize)| Rung {
                label: c.to_string(),
                size: 1.0 / *c as f64,
                value: found[k] / scale(k),
            };
            columns.iter().enumerate().map(rung).collect()
        };
        let mut add = |what: &str, refined, rungs, judged| {
            let quantity = format!("{name}, {what}");
            ladders.push(Ladder::new(quantity, refined, exact, rungs).within(0.03, judged));
        };
        let by_mesh = rungs(&|k| (measured[k][0] * measured[k][1]).sqrt());
        add(
            "measured rigidities, L = 32 b",
            "cells across",
            by_mesh,
            judged,
        );
        if effort == Effort::Full {
            let as_plate = rungs(&|_| plate);
            add(
                "rigidities of the plate, L = 32 b",
                "cells across",
                as_plate,
                judged,
            );
        }
        let [ei, gj] = measured[0];
        let by_length = climb(
            &slender,
            |s| (format!("{s} b"), 1.0 / s),
            |s| falls(columns[0], s * WIDTH, load) / (ei * gj).sqrt(),
        );
        let what = format!("measured rigidities, {} cells across", columns[0]);
        add(&what, "length", by_length, Judged::Extrapolated);
    }
    let mut details = String::from(
        "Measured rigidities over those of the plate, and the Poisson's ratio that a bent strip \
         shows in its middle:\n\n\
         | cells across | EI / ((1 − ν²) B b) | GJ / (2 (1 − ν) B b) | ν |\n|---|---|---|---|\n",
    );
    for (c, [ei, gj]) in columns.iter().zip(&measured) {
        let _ = writeln!(
            details,
            "| {c} | {:.5} | {:.5} | {:.4} |",
            ei / plate_bending(),
            gj / plate_torsion(),
            poisson(*c)
        );
    }
    Measured { ladders, details }
}

pub(super) fn cases() -> [Case; 1] {
    [Case {
        name: "lateral",
        title: "Lateral buckling of a cantilever on its edge",
        text: "A strip of width b stands on its edge, clamped at one end over two rows, and \
               carries a dead load on its last row or its own weight. For each load the \
               equilibrium in its plane is found by Newton's method; the strip falls sideways \
               where the second derivative there stops being positive definite. The formula \
               needs the strip's bending rigidity EI about its weak axis and its torsional \
               rigidity GJ. Both are measured on the same mesh: strips of 8 and 16 widths are \
               bent or twisted between clamps in the linear theory, and the difference of their \
               compliances Θ²/2E is that of a strip without ends. Beside it, the same onset is \
               held against the rigidities of a plate, EI = (1 − ν²) B b and GJ = 2 (1 − ν) B b, \
               with the Poisson's ratio −1/3 that hinges on equilateral triangles have: an edge \
               is straight, so that a hinge sees κ_n − κ_t/3, and three directions make \
               4/3 H² + 8/3 d² of mean curvature H and deviation d, where a plate has \
               (1 + ν) H² + (1 − ν) d². A bent strip curls the same way across. The clamp \
               keeps the strip from warping and curling over about a width, which raises the \
               load by a part of b/L: the ladder over the length shows it.",
        formula: "P L²/√(EI GJ) = 2 z, J_{−1/4}(z) = 0;  q L³/√(EI GJ) = 6 z, J_{−1/6}(z) = 0",
        source: "[TimoshenkoGere1961]",
        run: lateral,
    }]
}
