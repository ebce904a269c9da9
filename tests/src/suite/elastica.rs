//! Clamped strips against the elastica.

use std::fmt::Write;

use selvedge_integrator::Term;
use selvedge_shell_model::sheet;

use super::exact::Elastica;
use super::{Case, Effort, Judged, Ladder, Measured, Rung};
use crate::{GRAVITY, Setup, mean, plain_fabric, rows, run, straight_rows, tie_stiffness, to_rest};

/// What bends a [`Cantilever`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Load {
    /// Its own weight.
    Weight,
    /// A weight at its end; its own is a thousandth of that.
    Tip,
}

/// A strip clamped horizontally at one end.
///
/// Two rows are held. A hinge row stands for the curvature of half a cell on
/// either side, so that the clamp is half a cell before the second row and the
/// free length counts from there.
///
/// Rows are kept straight: the elastica bends to a cylinder. A free strip curls
/// across its width as well and is softer, by up to the `1 / (1 − ν²)` of a
/// plate, with `ν = −1/3` for hinges on equilateral triangles.
#[derive(Clone, Copy, Debug)]
pub struct Cantilever {
    /// Free length [m].
    pub length: f64,
    /// Density [kg/m²].
    pub density: f64,
    /// Membrane stiffness [N/m]; so high that the strip does not stretch.
    pub stiffness: f64,
    /// `w L³/B`, or `P L²/B` with a load at the end.
    pub gamma: f64,
    /// What bends it.
    pub load: Load,
}

/// Own weight of a strip with a load at its end, over that load.
const SHARE: f64 = 1e-3;

/// Cells across the strip.
const COLUMNS: usize = 4;

impl Cantilever {
    /// 20 cm of 200 g/m².
    pub fn new(gamma: f64, load: Load) -> Self {
        Self {
            length: 0.2,
            density: 0.2,
            stiffness: 2e5,
            gamma,
            load,
        }
    }

    /// Rigidity that `gamma` stands for [N·m].
    pub fn rigidity(&self) -> f64 {
        self.density * GRAVITY * self.length.powi(3) / self.gamma
    }

    /// The exact shape.
    pub fn exact(&self) -> Elastica {
        match self.load {
            Load::Weight => Elastica::new(self.gamma, 0.0),
            Load::Tip => Elastica::new(SHARE * self.gamma, self.gamma),
        }
    }

    /// Depth and reach of the end at rest, both relative to the length, with
    /// so many rows of cells.
    ///
    /// # Panics
    /// When the strip does not come to rest.
    pub fn end(&self, cells: usize) -> [f64; 2] {
        let spacing = self.length * size(cells);
        let edge = spacing / 0.75_f64.sqrt();
        let extent = [edge * COLUMNS as f64, spacing * cells as f64];
        let sheet = sheet::equilateral(COLUMNS, cells, extent).expect("sheet");
        let all = rows(&sheet);
        // Start from the elastica itself, without any strain of the cells.
        let shape = self.exact();
        let mut places = vec![[0.0; 2]];
        for k in 0..cells {
            let theta = shape.angle(k as f64 * size(cells));
            let [y, z] = places[k];
            places.push([y - spacing * theta.sin(), z + spacing * theta.cos()]);
        }
        let mut positions = vec![[0.0; 3]; sheet.flat.len()];
        for (row, [y, z]) in all.iter().zip(places) {
            for &p in row {
                positions[p as usize] = [sheet.flat[p as usize][0], y, z];
            }
        }
        let tip = all.last().expect("rows");
        let straight = straight_rows(&sheet, tie_stiffness(self.rigidity(), spacing));
        let fabric = plain_fabric(self.stiffness, self.rigidity(), self.density);
        let mut setup = Setup::new(sheet.mesh, positions, fabric);
        setup.pinned = all[..2].concat();
        to_rest(&mut setup, 1.0, 12);
        // Round-off of the strains leaves this much.
        setup.newton.tolerance = 5e-4 * self.length;
        setup.terms.push(Term::fixed(straight));
        let mut s = setup.simulation();
        if self.load == Load::Tip {
            // `Γ B / L²` per width at the end.
            let total = self.density * self.length * extent[0];
            let masses = &mut s.plan_mut().inertia.masses;
            let here: f64 = tip.iter().map(|p| masses[*p as usize]).sum();
            for (i, m) in masses.iter_mut().enumerate() {
                *m *= if tip.contains(&(i as u32)) {
                    total / here
                } else {
                    SHARE
                };
            }
        }
        run(&mut s).expect("a strip");
        let fastest = s.state().v.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        assert!(
            fastest < 5e-4 * self.length,
            "still moving at {fastest} m/s"
        );
        let end = mean(&s, tip);
        [
            -end[1] / self.length,
            (end[2] - 0.5 * spacing) / self.length,
        ]
    }

    /// [`end`](Self::end) on several meshes.
    fn ends(&self, meshes: &[usize]) -> Vec<[f64; 2]> {
        meshes.iter().map(|n| self.end(*n)).collect()
    }
}

/// Size of a cell over the free length.
fn size(cells: usize) -> f64 {
    1.0 / (cells as f64 - 0.5)
}

fn rungs(meshes: &[usize], ends: &[[f64; 2]], value: impl Fn([f64; 2]) -> f64) -> Vec<Rung> {
    let rung = |(n, end): (&usize, &[f64; 2])| Rung {
        label: n.to_string(),
        size: size(*n),
        value: value(*end),
    };
    meshes.iter().zip(ends).map(rung).collect()
}

const REFINED: &str = "rows of cells";

fn aspect(quantity: String, strip: Cantilever, meshes: &[usize]) -> Ladder {
    let exact = strip.exact();
    let rungs = rungs(meshes, &strip.ends(meshes), |[y, x]| y / x);
    Ladder::new(quantity, REFINED, exact.depth / exact.reach, rungs)
}

fn heavy(effort: Effort) -> Measured {
    let meshes: &[usize] = effort.pick(&[8, 16, 32], &[8, 16, 32, 64]);
    let ladder = |gamma| {
        let strip = Cantilever::new(gamma, Load::Weight);
        aspect(format!("H/W at Γ = {gamma}"), strip, meshes)
    };
    [1.0, 10.0, 100.0].map(ladder).to_vec().into()
}

fn tip(effort: Effort) -> Measured {
    let meshes: &[usize] = effort.pick(&[8, 16, 32], &[8, 16, 32, 64]);
    let loads: &[f64] = effort.pick(&[2.0], &[1.0, 2.0, 5.0, 10.0]);
    let mut ladders = Vec::new();
    for &load in loads {
        let strip = Cantilever::new(load, Load::Tip);
        let (exact, ends) = (strip.exact(), strip.ends(meshes));
        let mut add = |what: &str, value: f64, found: fn([f64; 2]) -> f64| {
            let name = format!("{what} at P L²/B = {load}");
            ladders.push(Ladder::new(
                name,
                REFINED,
                value,
                rungs(meshes, &ends, found),
            ));
        };
        add("1 − x/L", 1.0 - exact.reach, |[_, x]| 1.0 - x);
        add("y/L", exact.depth, |[y, _]| y);
    }
    ladders.into()
}

/// Strips whose lengths differ 16-fold, densities 5-fold, and stiffnesses
/// 4-fold; the rigidities follow from `Γ`.
const STRIPS: [(f64, f64, f64); 3] = [(0.2, 0.2, 2e5), (0.05, 0.08, 1e5), (0.8, 0.4, 4e5)];

fn collapse(effort: Effort) -> Measured {
    let meshes: &[usize] = effort.pick(&[8, 16, 32], &[16, 32, 64]);
    let gammas: &[f64] = effort.pick(
        &[0.3, 10.0, 300.0],
        &[0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0],
    );
    let mut details = String::from(
        "| Γ | exact H/W | found, extrapolated (L [m], w [N/m²], B [N·m]) | spread | largest error |\n\
         |---|---|---|---|---|\n",
    );
    let mut spreads = vec![0.0_f64; meshes.len()];
    let mut worst: Option<Ladder> = None;
    for &gamma in gammas {
        let (mut cell, mut found) = (String::new(), Vec::new());
        for (length, density, stiffness) in STRIPS {
            let strip = Cantilever {
                length,
                density,
                stiffness,
                ..Cantilever::new(gamma, Load::Weight)
            };
            let name = format!("H/W at Γ = {gamma}, L = {length} m");
            let ladder = aspect(name, strip, meshes);
            let value = ladder.finding().extrapolated.unwrap_or(f64::NAN);
            let _ = write!(
                cell,
                "{}{value:.5} ({length}, {:.3}, {:.3e})",
                if cell.is_empty() { "" } else { "; " },
                density * GRAVITY,
                strip.rigidity()
            );
            found.push(ladder);
        }
        let exact = found[0].exact;
        let relative = |values: Vec<f64>| {
            let (low, high) = values
                .iter()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
                    (l.min(*v), h.max(*v))
                });
            (high - low) / exact
        };
        for (k, spread) in spreads.iter_mut().enumerate() {
            let here = relative(found.iter().map(|l| l.rungs[k].value).collect());
            *spread = spread.max(here);
        }
        let extrapolated: Vec<f64> = found
            .iter()
            .map(|l| l.finding().extrapolated.unwrap_or(f64::NAN))
            .collect();
        found.sort_by(|a, b| {
            let error = |l: &Ladder| l.finding().error.abs();
            error(b).total_cmp(&error(a))
        });
        let far = found.swap_remove(0);
        let error = far.finding().error;
        let _ = writeln!(
            details,
            "| {gamma} | {exact:.5} | {cell} | {:.1e} | {:+.4} % |",
            relative(extrapolated),
            100.0 * error
        );
        if worst
            .as_ref()
            .is_none_or(|w| error.abs() > w.finding().error.abs())
        {
            worst = Some(far);
        }
    }
    let zip = meshes.iter().zip(&spreads);
    let rungs = zip.map(|(n, s)| Rung {
        label: n.to_string(),
        size: size(*n),
        value: *s,
    });
    let spread = Ladder::new(
        "largest spread of H/W between strips",
        REFINED,
        0.0,
        rungs.collect(),
    );
    let mut ladders = vec![spread.relative_to(1.0).within(0.01, Judged::Every)];
    ladders.extend(worst.map(|w| {
        let w = w.within(0.01, Judged::Extrapolated);
        Ladder {
            quantity: format!("{}, the worst of all", w.quantity),
            ..w
        }
    }));
    Measured { ladders, details }
}

pub(super) fn cases() -> [Case; 3] {
    [
        Case {
            name: "heavy-elastica",
            title: "Heavy elastica",
            text: "A strip of 0.2 m and 200 g/m² is clamped horizontally and sags under its own \
                   weight. Its depth H over its reach W at rest is held against the planar \
                   elastica. Rows of points are kept straight, because the elastica bends to a \
                   cylinder; two rows are held, and the free length begins half a cell before \
                   the second. Strips start in the exact shape and take twelve steps of 1 s. \
                   Mesh: equilateral, 4 cells across.",
            formula: "B θ'' = −w (L − s) cos θ,  θ(0) = 0,  θ'(L) = 0,  Γ = w L³/B",
            source: "Shooting with Runge-Kutta of fourth order, 4000 steps; test of \
                     [Romero2021], bending length of [Peirce1930]",
            run: heavy,
        },
        Case {
            name: "collapse",
            title: "Collapse on the master curve",
            text: "The heavy elastica depends on Γ alone. Three strips whose lengths differ \
                   16-fold, weights 5-fold, stiffnesses 4-fold and, at equal Γ, rigidities \
                   20 000-fold run at each Γ over three decades. The spread is the difference \
                   between the strips over the exact value, on each mesh; the table below has \
                   the extrapolated values.",
            formula: "H/W = f(w L³/B)",
            source: "Dimensional analysis; f as for the heavy elastica [Romero2021]",
            run: collapse,
        },
        Case {
            name: "tip-load",
            title: "Elastica with a load at its end",
            text: "The same strip with a dead load on its last row, and a weight of its own of \
                   a thousandth of that, which the exact values contain: horizontal shortening \
                   and depth of the end.",
            formula: "B θ'' = −(P + w (L − s)) cos θ,  θ(0) = 0,  θ'(L) = 0",
            source: "Shooting with Runge-Kutta of fourth order, 4000 steps",
            run: tip,
        },
    ]
}
