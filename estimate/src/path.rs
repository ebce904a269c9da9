//! How well a scene repeats when it is begun another way.

use selvedge_record::compare::Distances;
use selvedge_scene::file::SceneFile;
use selvedge_scene::file::model::Cloth;
use selvedge_scene::summary::ErrorPart;

use crate::companion::Session;
use crate::estimator::{told, unknown};
use crate::{EstimateError, MaterialMap};

/// Steps of sewing in those of the scene. Sewing goes without velocities, so
/// that its end depends on its steps; none of them is more right than another.
const SEWING: [f64; 2] = [0.5, 0.75];
/// Standard deviation of the start's displacements \[m\] where nothing is sewn.
const DISPLACED_M: f64 = 1e-6;
const SEED: u64 = 1;

/// The scene begun in other ways.
fn beginnings(scene: &SceneFile) -> (Vec<SceneFile>, Option<(f64, u64)>, &'static str) {
    if scene.cloth.iter().any(Cloth::is_sewn) {
        let sewn = SEWING.map(|factor| {
            let mut other = scene.clone();
            other.assemble.max_step *= factor;
            other
        });
        (sewn.into(), None, "sewn with other steps")
    } else {
        let displaced = Some((DISPLACED_M, SEED));
        (vec![scene.clone()], displaced, "begun 1e-6 m apart")
    }
}

/// Distance from `end` to where the same scene ends when it is begun another way: the
/// largest of those that could be run. Nothing is extrapolated, for none of the
/// ends is nearer to the truth.
pub(crate) fn path_part(
    session: &mut Session<'_>,
    scene: &SceneFile,
    end: &MaterialMap<'_>,
    mesh: &str,
) -> Result<ErrorPart, EstimateError> {
    let (scenes, displaced, how) = beginnings(scene);
    let mut seen: Vec<Distances> = Vec::new();
    let mut failed = String::new();
    for (k, mut scene) in scenes.into_iter().enumerate() {
        scene.output.recording = false;
        let name = format!("estimate/path-{k}");
        match told(session.run_displaced(&name, None, scene, displaced))? {
            Ok(other) => seen.push(end.distance(&other.surface())),
            Err(why) => failed = why,
        }
    }
    let largest = seen.iter().max_by(|a, b| a.mean.total_cmp(&b.mean));
    Ok(largest.map_or_else(
        || unknown(&failed),
        |d| ErrorPart {
            error_m: Some(d.mean),
            distance_m: Some([d.mean, d.p95, d.max]),
            order: None,
            how: format!("the largest distance to {} runs {how}, {mesh}", seen.len()),
        },
    ))
}
