//! Hanging strips against closed forms.

use selvedge_integrator::Simulation;
use selvedge_shell_model::sheet::{self, Sheet};

use super::exact;
use super::{Case, Effort, Judged, Ladder, Measured, cells, climb};
use crate::{GRAVITY, Setup, mean, plain_fabric, rows, run, to_rest};

const DENSITY: f64 = 0.2;
const RIGIDITY: f64 = 1e-9;

fn settle(mut setup: Setup, step: f64, steps: usize) -> Simulation {
    to_rest(&mut setup, step, steps);
    let mut s = setup.simulation();
    run(&mut s).expect("a strip");
    let fastest = s.state().v.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    assert!(fastest < 1e-7, "still moving at {fastest} m/s");
    s
}

/// Length [m] at rest of a strip of 1 m that hangs under its own weight, with
/// so many rows of cells of 4, and a modulus of `stiffness` [N/m].
///
/// # Panics
/// When the strip does not come to rest.
pub fn hanging_length(stiffness: f64, cells: usize) -> f64 {
    let sheet = sheet::grid(4, cells, [0.08, 1.0]).expect("sheet");
    let positions = sheet.flat.iter().map(|[u, v]| [*u, -*v, 0.0]).collect();
    let all = rows(&sheet);
    let fabric = plain_fabric(stiffness, RIGIDITY, DENSITY);
    let mut setup = Setup::new(sheet.mesh, positions, fabric);
    setup.pinned = all[0].clone();
    let s = settle(setup, 0.5, 30);
    -mean(&s, all.last().expect("rows"))[1]
}

/// A strip of 1 m at rest between supports [`SPAN`] apart, with so many rows of
/// cells, an even number, and its sheet.
///
/// # Panics
/// When the strip does not come to rest.
pub fn catenary(cells: usize) -> (Simulation, Sheet) {
    let sheet = sheet::grid(2, cells, [2.0 / cells as f64, 1.0]).expect("sheet");
    let all = rows(&sheet);
    let positions = sheet
        .flat
        .iter()
        .map(|[u, v]| [*u, -0.8 * v * (1.0 - v), SPAN * v])
        .collect();
    let fabric = plain_fabric(STIFFNESS, RIGIDITY, DENSITY);
    let mut setup = Setup::new(sheet.mesh.clone(), positions, fabric);
    setup.pinned = [all[0].as_slice(), all.last().expect("rows")].concat();
    (settle(setup, 0.05, 400), sheet)
}

/// Distance of the supports of [`catenary`] [m].
pub const SPAN: f64 = 0.8;
const STIFFNESS: f64 = 5000.0;

/// Sag of [`catenary`] [m], stretch included.
pub fn catenary_sag() -> f64 {
    exact::catenary_sag(SPAN, 1.0, DENSITY * GRAVITY, STIFFNESS)
}

fn hanging(effort: Effort) -> Measured {
    let meshes: &[usize] = effort.pick(&[10, 20, 40], &[10, 20, 40, 80]);
    let moduli: &[f64] = effort.pick(&[100.0], &[100.0, 20.0]);
    let ladder = |&k: &f64| {
        let exact = exact::hanging(k, DENSITY * GRAVITY, 1.0) - 1.0;
        let rungs = climb(meshes, cells, |n| hanging_length(k, n) - 1.0);
        Ladder::new(
            format!("elongation of 1 m at {k} N/m [m]"),
            "rows of cells",
            exact,
            rungs,
        )
    };
    let ladders: Vec<Ladder> = moduli.iter().map(ladder).collect();
    ladders.into()
}

fn sag(effort: Effort) -> Measured {
    let meshes: &[usize] = effort.pick(&[16, 32, 64], &[16, 32, 64, 128]);
    let rungs = climb(meshes, cells, |n| {
        let (s, sheet) = catenary(n);
        -mean(&s, &rows(&sheet)[n / 2])[1]
    });
    vec![
        Ladder::new("sag [m]", "rows of cells", catenary_sag(), rungs)
            .within(5e-3, Judged::Extrapolated),
    ]
    .into()
}

pub(super) fn cases() -> [Case; 2] {
    [
        Case {
            name: "hanging",
            title: "Elongation of a hanging strip",
            text: "A strip of 1 m, 8 cm wide, 200 g/m², Poisson's ratio zero, hangs from its \
                   upper edge. Its elongation at rest is held against that of the Saint \
                   Venant-Kirchhoff law. Thirty steps of 0.5 s. Mesh: right triangles, 4 cells \
                   across.",
            formula: "L' = (k/2w) [¾ (s⁴ − 1) − ½ (s² − 1)],  ½ k (s³ − s) = w L",
            source: "Integration of the law in one dimension",
            run: hanging,
        },
        Case {
            name: "catenary",
            title: "Catenary",
            text: "A strip of 1 m with next to no rigidity and a modulus of 5000 N/m hangs \
                   between supports 0.8 m apart. Its sag is held against the elastic catenary \
                   (inextensible: 0.265438 m). 400 steps of 0.05 s. Mesh: right triangles, 2 \
                   cells across.",
            formula: "x(s) = H s/k + (H/w) asinh(w s/H),  y(s) = w s²/2k + (H/w) (√(1 + (w s/H)²) − 1)\n\
                      x(L/2) = D/2,  sag = y(L/2)",
            source: "[Irvine1981]",
            run: sag,
        },
    ]
}
