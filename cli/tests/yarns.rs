//! Results of cloth made of yarns, from a run to exports.
#![cfg(unix)]

use std::fs;
use std::process::Command;

const SCENE: &str = r#"
name = "small knit"
[[cloth]]
name = "swatch"
kind = "knit"
chart = "stockinette"
stitches = [4, 4]
[simulation]
duration = 0.02
[integrator]
kind = "linearised-euler"
[relaxation]
enabled = false
[stop]
early = false
[output]
frame_rate = 200
"#;

/// A run leaves tubes, maps of strain and a view; every format takes them, and
/// what is exported of the last frame is what the run wrote.
#[test]
fn results_and_exports() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("knit.toml"), SCENE).unwrap();
    let program = |arguments: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_selvedge"))
            .current_dir(folder.path())
            .args(arguments)
            .output()
            .unwrap();
        let errors = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success(), "{arguments:?}: {errors}");
    };
    program(&["run", "knit.toml", "-o", "out"]);
    let summary = fs::read_to_string(at("out/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    let figure = |key: &str| summary[key].as_f64().unwrap();
    assert_eq!(figure("triangles"), 0.0);
    let (largest, mean) = (
        figure("max_abs_edge_strain"),
        figure("mean_abs_edge_strain"),
    );
    assert!(
        0.0 < mean && mean < largest && largest < 0.5,
        "{mean} {largest}"
    );

    let obj = fs::read_to_string(at("out/final.obj")).unwrap();
    let lines = |start: &str| obj.lines().filter(|l| l.starts_with(start)).count();
    assert!(lines("f ") > 1000 && lines("f ") <= 100_000);
    assert!(obj.contains("\ng swatch\n"));
    let page = fs::read_to_string(at("out/report.html")).unwrap();
    assert!(page.contains("strain of the yarns") && page.contains("id=\"b-yarn-offsets\""));
    assert!(!page.contains("NaN %") && !page.contains("id=\"b-topology\""));

    for format in ["obj", "ply", "gltf", "usd", "pc2"] {
        let file = format!("all.{format}");
        program(&["export", "out", "--format", format, "-o", &file]);
    }
    program(&[
        "export", "out", "--format", "obj", "--last", "-o", "last.obj",
    ]);
    assert!(fs::read_to_string(at("last.obj")).unwrap() == obj);
    let frames = 5; // at 0, 5, ..., 20 ms
    assert!(at(&format!("all.{:04}.ply", frames - 1)).is_file());
    let points = figure("points") as u64;
    let length = fs::metadata(at("all.pc2")).unwrap().len();
    assert_eq!(length, 32 + frames * points * 12);
    program(&["view", "out"]);
    let page = fs::read_to_string(at("out/report.html")).unwrap();
    assert!(page.contains("length of segments over that at rest"));
}
