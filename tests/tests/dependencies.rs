//! Direction of the dependencies between the crates.

use std::collections::BTreeMap;
use std::process::Command;

/// Who may depend on whom; `selvedge-` left out.
const ALLOWED: &[(&str, &[&str])] = &[
    ("energy", &[]),
    ("linsolve", &[]),
    ("record", &[]),
    ("shell-model", &["energy"]),
    ("yarn-model", &["energy"]),
    ("collision", &["energy"]),
    ("enrichment", &["energy", "linsolve"]),
    ("homogenize", &["linsolve", "shell-model", "yarn-model"]),
    ("integrator", &["energy", "linsolve", "collision"]),
    ("garment", &["shell-model"]),
];

/// Crates at the top, which may use all of the others but not each other
/// upwards.
const TOP: [&str; 6] = ["scene", "estimate", "study", "hard", "cli", "tests"];

/// Every arrow between crates points the way that the design draws it: energies
/// and solvers know nothing of ours, physics knows no solver, solvers and
/// bodies know no cloth, and nothing depends on the program. Dependencies of a
/// crate's own tests may point further, but not up to scenes or the program.
#[test]
fn arrows_point_down() {
    let output = Command::new(env!("CARGO"))
        .args([
            "metadata",
            "--format-version",
            "1",
            "--no-deps",
            "--offline",
        ])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo metadata");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let metadata: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let allowed: BTreeMap<&str, &[&str]> = ALLOWED.iter().copied().collect();
    let mut wrong = Vec::new();
    let mut seen = 0;
    for package in metadata["packages"].as_array().expect("packages") {
        let short = |name: &serde_json::Value| {
            let name = name.as_str().unwrap_or_default();
            if name == "selvedge" {
                "cli".to_owned()
            } else {
                name.replacen("selvedge-", "", 1)
            }
        };
        let from = short(&package["name"]);
        let level = TOP.iter().position(|t| *t == from);
        if level.is_none() && !allowed.contains_key(from.as_str()) {
            wrong.push(format!("{from} is not in the design"));
            continue;
        }
        for dependency in package["dependencies"].as_array().expect("dependencies") {
            let name = dependency["name"].as_str().unwrap_or_default();
            if !name.starts_with("selvedge") {
                continue;
            }
            seen += 1;
            let to = short(&dependency["name"]);
            let to_level = TOP.iter().position(|t| *t == to);
            let fine = match level {
                Some(mine) => to_level.is_none_or(|other| other < mine),
                None if dependency["kind"] == "dev" => to_level.is_none(),
                None => allowed[from.as_str()].contains(&to.as_str()),
            };
            if !fine {
                wrong.push(format!("{from} → {to} ({})", dependency["kind"]));
            }
        }
    }
    assert!(
        seen > 10,
        "only {seen} arrows: this does not look like the workspace"
    );
    assert!(wrong.is_empty(), "{wrong:#?}");
}
