//! Buckling of compressed and standing strips.

use selvedge_shell_model::sheet;

use super::narrow::{Narrow, WIDTH, plate_bending, rigidities};
use super::stability::{Flat, Rows, onset};
use super::{Case, Effort, Judged, Ladder, Measured, Rung, exact};
use crate::{rows, tie_stiffness};

const RIGIDITY: f64 = 1e-5;
const STIFFNESS: f64 = 100.0;
/// Cells across a strip whose rows are kept straight.
const COLUMNS: usize = 4;
const EULER: f64 = 4.0 * std::f64::consts::PI * std::f64::consts::PI;

/// A strip of 1 m between `ends` half cells taken by clamps, rows straight.
fn strip(cells: usize, ends: f64) -> (sheet::Sheet, Flat, f64) {
    let spacing = 1.0 / (cells as f64 - ends);
    let edge = spacing / 0.75_f64.sqrt();
    let size = [edge * COLUMNS as f64, spacing * cells as f64];
    let sheet = sheet::equilateral(COLUMNS, cells, size).expect("sheet");
    let springs = tie_stiffness(RIGIDITY, spacing);
    let flat = Flat::new(&sheet, STIFFNESS, RIGIDITY, Rows::Straight(springs));
    (sheet, flat, size[0])
}

/// Force [N] in a strip pressed together by a strain at which it buckles
/// between clamps, found from a guess of the force. Uniform compression is the
/// equilibrium in the plane, Poisson's ratio being zero there.
fn pressed(shell: &Flat, rest: &[f64], rows: &[Vec<u32>], guess: f64, per_strain: f64) -> f64 {
    let last = rows.len() - 1;
    let held = [&rows[..2], &rows[last - 1..]].concat().concat();
    let shortened = |strain: f64| -> Vec<f64> {
        let mut q = rest.to_vec();
        q.iter_mut()
            .skip(1)
            .step_by(3)
            .for_each(|y| *y *= 1.0 - strain);
        q
    };
    let strain = onset(guess / per_strain, |s| {
        shell.is_stable(&shortened(s), &held)
    });
    let (gradient, _) = shell.derivatives(&shortened(strain));
    let pushed = rows[..2].iter().flatten();
    pushed
        .map(|p| gradient[3 * *p as usize + 1])
        .sum::<f64>()
        .abs()
}

/// `N L²/B` of a strip with straight rows between clamps.
fn euler(cells: usize) -> f64 {
    let (sheet, shell, width) = strip(cells, 1.0);
    let rest = sheet.positions(|[u, v]| [u, v, 0.0]);
    let guess = EULER * RIGIDITY * width;
    let force = pressed(&shell, &rest, &rows(&sheet), guess, STIFFNESS * width);
    force / (width * RIGIDITY)
}

/// `P L²` over measured `EI` of a free narrow strip of `length` [m] between
/// clamps.
fn euler_free(columns: usize, length: f64) -> f64 {
    let strip = Narrow::new(columns, length, 1.0);
    let length = (strip.rows.len() - 2) as f64 * strip.spacing;
    let guess = EULER * plate_bending() / length.powi(2);
    let per_strain = super::narrow::STIFFNESS * WIDTH;
    let force = pressed(&strip.shell, &strip.flat, &strip.rows, guess, per_strain);
    force * length.powi(2) / rigidities(columns)[0]
}

/// `w L³/B` at which a strip that stands on a clamp falls over.
fn standing(cells: usize) -> f64 {
    let (sheet, shell, width) = strip(cells, 0.5);
    let all = rows(&sheet);
    let held = all[..2].concat();
    let rest = sheet.positions(|[u, v]| [u, v, 0.0]);
    // Weights of the rows by area; those of one row in equal parts.
    let area = width / (cells as f64 - 0.5);
    let mut weights = vec![0.0; rest.len()];
    for (k, row) in all.iter().enumerate() {
        let part = if k == 0 || k + 1 == all.len() {
            0.5
        } else {
            1.0
        };
        for p in row {
            weights[3 * *p as usize + 1] = -part * area / row.len() as f64;
        }
    }
    let mut q = rest.clone();
    onset(exact::standing_strip() * RIGIDITY, |w| {
        let forces: Vec<f64> = weights.iter().map(|f| w * f).collect();
        shell.settle(&mut q, &forces, &held);
        shell.is_stable(&q, &held)
    }) / RIGIDITY
}

fn rungs<T: Copy + std::fmt::Display>(
    choices: &[T],
    size: impl Fn(T) -> f64,
    value: impl Fn(T) -> f64,
) -> Vec<Rung> {
    super::climb(choices, |c| (c.to_string(), size(c)), value)
}

fn compressed(effort: Effort) -> Measured {
    let meshes: &[usize] = effort.pick(&[8, 16, 32], &[16, 32, 64, 128]);
    let columns: &[usize] = effort.pick(&[2, 4], &[4, 8, 16]);
    let straight = rungs(meshes, |n| 1.0 / (n as f64 - 1.0), euler);
    let free = rungs(columns, |c| 1.0 / c as f64, |c| euler_free(c, 1.0));
    let across = columns[0];
    let by_length = super::climb(
        &[16.0, 32.0, 64.0],
        |s| (format!("{s} b"), 1.0 / s),
        |s| euler_free(across, s * WIDTH),
    );
    let judged = effort.pick(Judged::Finest, Judged::Extrapolated);
    vec![
        Ladder::new("N L²/B, straight rows", "rows of cells", EULER, straight)
            .within(0.03, Judged::Extrapolated),
        Ladder::new(
            "P L²/EI, free strip with L = 32 b, EI measured",
            "cells across",
            EULER,
            free,
        )
        .within(0.03, judged),
        Ladder::new(
            format!("P L²/EI, free strip, {across} cells across, EI measured"),
            "length",
            EULER,
            by_length,
        )
        .within(0.03, Judged::Extrapolated),
    ]
    .into()
}

fn own_weight(effort: Effort) -> Measured {
    let meshes: &[usize] = effort.pick(&[8, 16, 32], &[16, 32, 64, 128]);
    let found = rungs(meshes, |n| 1.0 / (n as f64 - 0.5), standing);
    vec![
        Ladder::new("w L³/B", "rows of cells", exact::standing_strip(), found)
            .within(0.03, Judged::Extrapolated),
    ]
    .into()
}

pub(super) fn cases() -> [Case; 2] {
    [
        Case {
            name: "euler",
            title: "Euler buckling between clamps",
            text: "A flat strip of 1 m is pressed together between two clamps of two rows each. \
                   It buckles where the exact second derivative of its energy stops being \
                   positive definite, which the Cholesky factorisation tells; the strain is \
                   bisected to a relative 1e-7, and the force is the one on the held rows. With \
                   rows kept straight the strip is held against its cylindrical rigidity B \
                   (4 cells across); free, 32 widths long, against the rigidity EI that the same \
                   mesh shows when it is bent (see lateral buckling for how).",
            formula: "N L²/B = 4 π²",
            source: "[TimoshenkoGere1961]",
            run: compressed,
        },
        Case {
            name: "standing",
            title: "Standing strip under its own weight",
            text: "A strip of 1 m stands on a clamp of two rows, rows kept straight. For each \
                   weight the equilibrium in its plane is found by Newton's method; the strip \
                   falls over where the second derivative there stops being positive definite. \
                   4 cells across.",
            formula: "w L³/B = 9/4 z²,  J_{−1/3}(z) = 0",
            source: "[TimoshenkoGere1961]",
            run: own_weight,
        },
    ]
}
