//! First modes of clamped and hanging strips.

use selvedge_shell_model::lumped_masses;
use selvedge_shell_model::sheet::{self, Sheet};

use super::stability::{Flat, Rows, onset};
use super::{Case, Effort, Judged, Ladder, Measured, climb, exact};
use crate::{plain_fabric, rows, tie_stiffness};

/// A strip of 1 m beyond `ends` of a cell, of 1 kg/m².
fn strip(columns: usize, cells: usize, ends: f64) -> (Sheet, Vec<f64>, f64) {
    let spacing = 1.0 / (cells as f64 - ends);
    let width = columns as f64 * spacing / 0.75_f64.sqrt();
    let size = [width, spacing * cells as f64];
    let sheet = sheet::equilateral(columns, cells, size).expect("sheet");
    let masses = lumped_masses(&sheet.mesh, &[plain_fabric(1.0, 1.0, 1.0)]).expect("masses");
    (sheet, masses, spacing)
}

/// `ω √(ρ L⁴/B)` of a cantilever with straight rows.
fn cantilever(cells: usize) -> f64 {
    let (sheet, masses, spacing) = strip(4, cells, 0.5);
    let (stiffness, rigidity) = (100.0, 1e-5);
    let ties = Rows::Straight(tie_stiffness(rigidity, spacing));
    let shell = Flat::new(&sheet, stiffness, rigidity, ties);
    let q = sheet.positions(|[u, v]| [u, v, 0.0]);
    let held = rows(&sheet)[..2].concat();
    let guess = exact::cantilever_mode().powi(2) * rigidity;
    let squared = onset(guess, |s| shell.is_faster(&q, &held, &masses, s));
    (squared / rigidity).sqrt()
}

/// `ω √(L/g)` of a strip that hangs from its first row, with next to no
/// rigidity, at g = 1 m/s².
fn chain(cells: usize) -> f64 {
    let (sheet, masses, _) = strip(cells / 8, cells, 0.0);
    let shell = Flat::new(&sheet, 1e5, 1e-9, Rows::Free);
    let mut q = sheet.positions(|[u, v]| [u, v, 0.0]);
    let held = rows(&sheet)[0].clone();
    let weight: Vec<f64> = masses.iter().flat_map(|m| [0.0, *m, 0.0]).collect();
    shell.settle(&mut q, &weight, &held);
    let guess = exact::chain_mode().powi(2);
    onset(guess, |s| shell.is_faster(&q, &held, &masses, s)).sqrt()
}

fn bending(effort: Effort) -> Measured {
    let meshes: &[usize] = effort.pick(&[8, 16, 32], &[8, 16, 32, 64]);
    let size = |n: usize| (n.to_string(), 1.0 / (n as f64 - 0.5));
    let found = climb(meshes, size, cantilever);
    let exact = exact::cantilever_mode();
    vec![
        Ladder::new("ω √(ρ L⁴/B)", "rows of cells", exact, found)
            .within(5e-3, Judged::Extrapolated),
    ]
    .into()
}

fn hanging(effort: Effort) -> Measured {
    let meshes: &[usize] = effort.pick(&[16, 32, 64], &[32, 64, 128, 256]);
    let found = climb(meshes, super::cells, chain);
    vec![
        Ladder::new("ω √(L/g)", "rows of cells", exact::chain_mode(), found)
            .within(5e-3, Judged::Extrapolated),
    ]
    .into()
}

pub(super) fn cases() -> [Case; 2] {
    [
        Case {
            name: "cantilever-mode",
            title: "First mode of a cantilever",
            text: "A flat strip of 1 m, clamped over two rows, rows kept straight, without \
                   gravity. The square of its first frequency is where K − ω² M stops being \
                   positive definite, with the exact second derivative K of the energy and the \
                   lumped masses M; bisected to a relative 1e-7. 4 cells across.",
            formula: "cos βL cosh βL = −1,  ω = (βL)² √(B/(ρ L⁴))",
            source: "Euler-Bernoulli beam",
            run: bending,
        },
        Case {
            name: "hanging-mode",
            title: "First mode of a hanging chain",
            text: "A strip of 1 m by 14 cm with next to no rigidity hangs from its first row. \
                   At the equilibrium under its weight the first frequency is found as for the \
                   cantilever. Its free edges swing more slowly than the rest on coarse meshes; \
                   the cells across are an eighth of those along.",
            formula: "ω √(L/g) = z/2,  J_0(z) = 0",
            source: "D. Bernoulli's hanging chain",
            run: hanging,
        },
    ]
}
