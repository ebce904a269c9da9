//! The scenes of `scenes/yarn` do what their descriptions say.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use selvedge_scene::build::BuiltScene;
use selvedge_scene::driver::{self, RunOptions, RunResult, Silent};
use selvedge_scene::file;
use selvedge_scene::summary::{Status, TopologySummary};

/// A scene to its end.
fn run(name: &str) -> (BuiltScene, RunResult) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/yarn");
    let quiet = [("output.recording".to_owned(), "false".to_owned())];
    let parsed = file::read(&path.join(name), &quiet).expect("a scene");
    let built = BuiltScene::new(parsed).expect("cloth");
    let folder = tempfile::tempdir().expect("a folder");
    let options = RunOptions {
        directory: folder.path().to_owned(),
        resume: false,
        scene_text: String::new(),
        version: "test".to_owned(),
    };
    let never = AtomicBool::new(false);
    let result = driver::run(&built, &options, &mut Silent, &never).expect("a run");
    let status = result.summary.status;
    assert!(
        matches!(status, Status::Finished | Status::Converged),
        "{}",
        result.summary.reason
    );
    (built, result)
}

fn events(result: &RunResult) -> &TopologySummary {
    result
        .summary
        .topology
        .as_ref()
        .expect("yarns that may leave their contacts")
}

/// The last row unravels: its 8 loops, and with them most of those below.
#[test]
fn pull_out_unravels_rows() {
    let (_, result) = run("pull-out.toml");
    let events = events(&result);
    assert!(events.drawn >= 16, "{events:?}");
    assert!(events.removed > 4 * events.drawn, "{events:?}");
    assert!(events.energy_removed_j > 0.0, "{events:?}");
}

/// Both wefts leave all their 16 crossings.
#[test]
fn fray_loses_two_wefts() {
    let (_, result) = run("fray.toml");
    assert!(events(&result).released >= 32, "{:?}", events(&result));
}

/// Three wales are cut, and a hole opens.
#[test]
fn cut_opens_a_hole() {
    let (built, result) = run("cut.toml");
    assert!(events(&result).cut >= 6, "{:?}", events(&result));
    let start = built.geometry.flat_to_scene(&built.geometry.start().q);
    let (start, end) = (widest_gap(&start), widest_gap(&result.positions));
    println!("{start} m, {end} m");
    assert!(end > 2.0 * start && end > 5e-3, "{start} {end}");
}

/// Radius of the largest disc in the middle half of a flat patch without a point [m].
fn widest_gap(positions: &[f64]) -> f64 {
    let points = positions.as_chunks::<3>().0;
    let [x, z] = [0, 2].map(|k| {
        let all = || points.iter().map(move |p| p[k]);
        [
            all().fold(f64::INFINITY, f64::min),
            all().fold(f64::NEG_INFINITY, f64::max),
        ]
    });
    let at = |[low, high]: [f64; 2], n: u32| low + (high - low) * (0.25 + 0.01 * f64::from(n));
    let gap = |x: f64, z: f64| {
        let away = points.iter().map(|p| (p[0] - x).hypot(p[2] - z));
        away.fold(f64::INFINITY, f64::min)
    };
    let grid = (0..=50).flat_map(|i| (0..=50).map(move |j| (i, j)));
    grid.map(|(i, j)| gap(at(x, i), at(z, j)))
        .fold(0.0, f64::max)
}

/// The yarn whose crossing is drawn out draws its free ends in, its neighbours less.
#[test]
fn snag_draws_yarns_in() {
    let (built, result) = run("snag.toml");
    let start = built.geometry.flat_to_scene(&built.geometry.start().q);
    let (start, end) = (
        start.as_chunks::<3>().0,
        result.positions.as_chunks::<3>().0,
    );
    // How far the free end of the warp at `x` comes towards the middle.
    let drawn = |x: f64| {
        let along = (0..end.len()).filter(|&i| (start[i][0] - x).abs() < 3e-4);
        let last = along.max_by(|&a, &b| start[a][2].total_cmp(&start[b][2]));
        let i = last.expect("a warp");
        start[i][2] - end[i][2]
    };
    let [own, near, far] = [0.0, 2e-3, 5e-3].map(drawn);
    assert!(
        own > 5e-4 && own > near && near > far && far > 1e-4,
        "{own} {near} {far}"
    );
}
