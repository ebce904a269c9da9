//! How good an estimate is: the error that it tells beside the distance to a
//! run on a mesh twice as fine, with steps a quarter as long and
//! tolerances ten times tighter.
//!
//! `cargo run --release -p selvedge-estimate --example effectivity -- SCENE [KEY=VALUE]…`

use std::error::Error;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use selvedge_estimate::{MaterialMap, Session, coarser, estimate, scaled_step, scaled_tolerance};
use selvedge_scene::driver::Silent;
use selvedge_scene::file;

/// A sheet that falls on a ball.
const DEFAULT: &str = r#"
name = "on a ball"
simulation.duration = 0.3
integrator.max_step = 8e-3
[[cloth]]
name = "sheet"
kind = "sheet"
size = [0.4, 0.4]
points = [17, 17]
center = [0.0, 0.16, 0.0]
fabric = "linen"
[[body]]
name = "ball"
kind = "sphere"
radius = 0.15
[fabric.linen]
library = "linen"
"#;

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let scene = args.next();
    let sets: Vec<(String, String)> = args
        .filter_map(|a| a.split_once('=').map(|(k, v)| (k.to_owned(), v.to_owned())))
        .collect();
    let parsed = match &scene {
        Some(path) => file::read(Path::new(path), &sets)?,
        None => file::parse(DEFAULT, Path::new("ball.toml"), &sets)?,
    };
    let never = AtomicBool::new(false);
    let mut session = Session {
        parsed: &parsed,
        scene_text: "",
        version: env!("CARGO_PKG_VERSION"),
        directory: std::env::temp_dir().join(format!("effectivity-{}", std::process::id())),
        progress: &mut Silent,
        interrupt: &never,
        resume: false,
        cpu_s: 0.0,
    };
    let run = session.run("run", None, parsed.scene.clone(), false)?;
    let result = run.result.as_ref().ok_or("no result")?;
    let report = estimate(&mut session, &run.built, result)?;
    let fine = scaled_tolerance(&scaled_step(&coarser(&parsed.scene, 0.5)?, 0.25), 0.1);
    let fine = session.run("reference", None, fine, false)?;
    let error = MaterialMap::new(fine.surface())?.distance(&run.surface());
    let parts = [&report.space, &report.time, &report.algebraic, &report.path];
    let told = selvedge_estimate::total(&report).ok_or("no estimate")?;
    println!(
        "{}: {} points, estimate {:.4} mm (mesh {:.4}, steps {:.4}, tolerances {:.4}, path {:.4}), \
         distance to the reference {:.4} mm (largest {:.3} mm), effectivity {:.2}; \
         processor time {:.1} s, estimate {:.1} s, reference {:.1} s",
        parsed.scene.name,
        run.points(),
        1e3 * told,
        1e3 * parts[0].error_m.unwrap_or(f64::NAN),
        1e3 * parts[1].error_m.unwrap_or(f64::NAN),
        1e3 * parts[2].error_m.unwrap_or(f64::NAN),
        1e3 * parts[3].error_m.unwrap_or(f64::NAN),
        1e3 * error.mean,
        1e3 * error.max,
        told / error.mean,
        run.cpu_s,
        report.cpu_s,
        fine.cpu_s,
    );
    assert!(told > 0.0 && error.mean > 0.0);
    std::fs::remove_dir_all(&session.directory)?;
    Ok(())
}
