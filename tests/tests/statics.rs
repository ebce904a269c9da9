//! Rest shapes against closed forms.

use approx::assert_relative_eq;
use selvedge_integrator::Simulation;
use selvedge_shell_model::sheet::{self, Sheet};
use selvedge_tests::{Setup, mean, plain_fabric, rows, run, to_rest};

const G: f64 = 9.81;
const DENSITY: f64 = 0.2;

/// A sheet at rest length with its rows along `z`, and its first `pinned`
/// rows held.
fn strip(sheet: &Sheet, stiffness: f64, rigidity: f64, pinned: usize) -> Setup {
    let q = sheet.positions(|[u, v]| [u, 0.0, v]);
    let fabric = plain_fabric(stiffness, rigidity, DENSITY);
    let mut setup = Setup::new(sheet.mesh.clone(), q.as_chunks::<3>().0.to_vec(), fabric);
    setup.pinned = rows(sheet).into_iter().take(pinned).flatten().collect();
    setup
}

fn at_rest(setup: Setup) -> Simulation {
    let mut s = setup.simulation();
    run(&mut s).expect("a strip");
    let fastest = s.state().v.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    assert!(fastest < 1e-7, "still moving at {fastest} m/s");
    s
}

/// A hanging strip of Saint-Venant-Kirchhoff cloth stretches to
/// `(k / 2ρg) [¾ (s⁴ − 1) − ½ (s² − 1)]` with `½ k (s³ − s) = ρ g L` at the
/// top: 1.0096247 m for 1 m at k = 100 N/m.
#[test]
fn hanging_strip() {
    let sheet = sheet::grid(4, 50, [0.08, 1.0]).expect("sheet");
    let mut setup = strip(&sheet, 100.0, 1e-9, 1);
    setup.positions = sheet.flat.iter().map(|[u, v]| [*u, -*v, 0.0]).collect();
    to_rest(&mut setup, 0.5, 30);
    let s = at_rest(setup);
    let length = -mean(&s, rows(&sheet).last().expect("rows"))[1];
    println!(
        "hanging strip: {length} m, error {:.2e}",
        length / 1.009_624_7 - 1.0
    );
    assert_relative_eq!(length, 1.009_624_7, max_relative = 2e-6);
}

/// A strip of 1 m between supports 0.8 m apart hangs as a catenary: its sag is
/// `a (cosh(D/2a) − 1)` with `L = 2 a sinh(D/2a)`, 0.265438 m without stretch,
/// and left and right are mirror images.
#[test]
fn catenary() {
    let (span, stiffness) = (0.8, 5000.0);
    let sheet = sheet::grid(2, 60, [1.0 / 30.0, 1.0]).expect("sheet");
    let mut setup = strip(&sheet, stiffness, 1e-9, 1);
    let all = rows(&sheet);
    setup.pinned.extend(all.last().expect("rows"));
    setup.positions = sheet
        .flat
        .iter()
        .map(|[u, v]| [*u, -0.8 * v * (1.0 - v), span * v])
        .collect();
    to_rest(&mut setup, 0.05, 400);
    let s = at_rest(setup);
    let sag = -mean(&s, &all[30])[1];
    // The tension is ρ g y with y from the directrix: its mean over the length
    // stretches the strip.
    let catenary = |length: f64| {
        let (mut low, mut high) = (0.05, 10.0);
        for _ in 0..100 {
            let a: f64 = 0.5 * (low + high);
            if 2.0 * a * (span / (2.0 * a)).sinh() > length {
                low = a
            } else {
                high = a
            }
        }
        (low, low * ((span / (2.0 * low)).cosh() - 1.0))
    };
    let (a, exact) = catenary(1.0);
    assert_relative_eq!(exact, 0.265_438, max_relative = 1e-5);
    let tension = DENSITY * G * a * 0.5 * (span + a * (span / a).sinh());
    let (_, corrected) = catenary(1.0 + tension / stiffness);
    println!(
        "catenary: sag {sag}, {corrected} with stretch, error {:.2e}",
        sag / corrected - 1.0
    );
    assert_relative_eq!(sag, corrected, max_relative = 1e-2);
    for k in 0..30 {
        let (l, r) = (mean(&s, &all[k]), mean(&s, &all[60 - k]));
        assert!(
            (l[1] - r[1]).abs() < 1e-4 && (l[2] + r[2] - span).abs() < 1e-4,
            "row {k}"
        );
    }
}
