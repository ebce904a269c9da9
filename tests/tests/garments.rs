//! Real sewing patterns on a scanned body, from the file to a drape at rest.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use selvedge_scene::build::BuiltScene;
use selvedge_scene::driver::{self, RunOptions, Silent};
use selvedge_scene::file;
use selvedge_scene::summary::{Status, Summary};

/// Data beside the checkout, which not everyone has.
fn data(path: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../shared/data")
        .join(path);
    if !path.exists() {
        println!("skipped: {} is absent", path.display());
        return None;
    }
    Some(path)
}

fn drape(pattern: &str, edge_length: f64) -> Option<Summary> {
    let pattern = data(pattern)?;
    let body = data("bodies/mean_all.obj")?;
    let text = format!(
        r#"
name = "garment"

[simulation]
duration = 3.0

[mesh]
edge_length = {edge_length}

[[cloth]]
kind = "pattern"
file = {pattern:?}
fabric = "cotton-jersey"

[[body]]
kind = "mesh"
file = {body:?}

[output]
report = false
"#
    );
    let parsed = file::parse(&text, Path::new("garment.toml"), &[]).expect("a valid scene");
    let built = BuiltScene::new(parsed).expect("a scene that can be built");
    let directory = tempfile::tempdir().expect("a folder");
    let options = RunOptions {
        directory: directory.path().to_owned(),
        resume: false,
        scene_text: text,
        version: "test".to_owned(),
    };
    let never = Arc::new(AtomicBool::new(false));
    let run = driver::run(&built, &options, &mut Silent, &never).expect("a run");
    Some(run.summary)
}

/// A top of four panels, a skirt that only its waist can hold, and a shirt
/// whose sleeves start crossed: at rest on the body, nothing in it, nothing
/// crossed.
#[test]
fn garments_come_to_rest_on_the_body() {
    for (pattern, edge_length) in [
        ("garments/g005.json", 0.02),
        ("garments/g018.json", 0.03),
        ("garments/shirt_mean.json", 0.03),
    ] {
        let Some(s) = drape(pattern, edge_length) else {
            return;
        };
        println!(
            "{pattern}: {} points, {:.2} s simulated, {:.1} s, {:?}",
            s.points, s.simulated_s, s.cpu_s, s.max_drop_m
        );
        assert_eq!(s.status, Status::Converged, "{pattern}: {}", s.reason);
        assert!(s.max_penetration_m < 1e-3, "{pattern}: {:?}", s.defects);
        assert!(s.max_seam_gap_m < 1e-3, "{pattern}");
        assert_eq!(s.self_intersections, 0, "{pattern}: {:?}", s.defects);
        let drop = s.max_drop_m.expect("a garment");
        assert!(drop < 0.05, "{pattern} sank by {drop} m");
    }
}
