//! Rest shapes against closed forms.

use approx::assert_relative_eq;
use selvedge_tests::suite::hanging::{SPAN, catenary, catenary_sag, hanging_length};
use selvedge_tests::{mean, rows};

/// A hanging strip of Saint-Venant-Kirchhoff cloth stretches to
/// `(k / 2ρg) [¾ (s⁴ − 1) − ½ (s² − 1)]` with `½ k (s³ − s) = ρ g L` at the
/// top: 1.0096247 m for 1 m at k = 100 N/m.
#[test]
fn hanging_strip() {
    let length = hanging_length(100.0, 50);
    println!(
        "hanging strip: {length} m, error {:.2e}",
        length / 1.009_624_7 - 1.0
    );
    assert_relative_eq!(length, 1.009_624_7, max_relative = 2e-6);
}

/// A strip of 1 m between supports 0.8 m apart hangs as a catenary, and left
/// and right are mirror images.
#[test]
fn catenary_and_its_mirror_image() {
    let (s, sheet) = catenary(60);
    let all = rows(&sheet);
    let sag = -mean(&s, &all[30])[1];
    let exact = catenary_sag();
    println!(
        "catenary: sag {sag} against {exact}, error {:.2e}",
        sag / exact - 1.0
    );
    assert_relative_eq!(sag, exact, max_relative = 1e-3);
    for k in 0..30 {
        let (l, r) = (mean(&s, &all[k]), mean(&s, &all[60 - k]));
        assert!(
            (l[1] - r[1]).abs() < 1e-4 && (l[2] + r[2] - SPAN).abs() < 1e-4,
            "row {k}"
        );
    }
}
