//! The scenes of `scenes/yarn` do what their descriptions say.

mod runs;

use std::path::Path;

use runs::{options, uninterrupted};
use selvedge_scene::build::BuiltScene;
use selvedge_scene::driver::RunResult;
use selvedge_scene::file;
use selvedge_scene::summary::{Status, TopologySummary};

/// A scene to its end.
fn run(name: &str) -> (BuiltScene, RunResult) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/yarn");
    let quiet = [("output.recording".to_owned(), "false".to_owned())];
    let parsed = file::read(&path.join(name), &quiet).expect("a scene");
    let built = BuiltScene::new(parsed).expect("cloth");
    let folder = tempfile::tempdir().expect("a folder");
    let result = uninterrupted(&built, &options("", folder.path(), false));
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

/// Three wales are cut, and loops above come free.
#[test]
fn cut_begins_a_ladder() {
    let (_, result) = run("cut.toml");
    let events = events(&result);
    assert!(events.cut >= 6 && events.drawn >= 2, "{events:?}");
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
