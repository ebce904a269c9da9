//! Yarns of the library beside the table in the documentation.

use selvedge_yarn_model::YarnMaterial;

const PAGE: &str = include_str!("../../docs/yarn-formats.md");

/// Numbers of a yarn's row.
fn row(name: &str) -> Vec<f64> {
    let start = format!("| `{name}` |");
    let row = PAGE.lines().find_map(|l| l.strip_prefix(&start)).unwrap();
    let cells = row.trim_end_matches('|').split('|');
    cells.map(|c| c.trim().parse().unwrap()).collect()
}

#[test]
fn the_documented_table_is_the_code() {
    for yarn in [
        YarnMaterial::sweater(),
        YarnMaterial::shirt(),
        YarnMaterial::pullover(),
        YarnMaterial::weaving(),
    ] {
        let row = row(&yarn.name);
        let (given, derived) = row.split_at(10);
        let code = [
            yarn.radius,
            yarn.density,
            yarn.stretch_modulus,
            yarn.bending_modulus,
            yarn.shear_modulus,
            yarn.wrapping,
            yarn.friction,
            yarn.anchor_stiffness,
            yarn.mass_damping,
            yarn.stiffness_damping,
        ];
        assert_eq!(given, code, "{}", yarn.name);
        assert_eq!(yarn.spacing, None);
        let code = [
            yarn.line_density(),
            yarn.stretch_stiffness(),
            yarn.bending_stiffness(),
        ];
        assert_eq!(derived.len(), code.len());
        // Five digits are written.
        for (written, exact) in derived.iter().zip(code) {
            assert!((written / exact - 1.0).abs() < 1e-4, "{}", yarn.name);
        }
    }
}
