//! The estimate of one finished run.

use selvedge_scene::build::BuiltScene;
use selvedge_scene::driver::RunResult;
use selvedge_scene::file::{SceneFile, coarser};
use selvedge_scene::summary::{ErrorPart, ErrorReport, Status};

use crate::companion::{Companion, Session, scaled_step, scaled_tolerance, surface};
use crate::parts::{EFFECTIVITY, algebraic_part, space_part, time_part};
use crate::path::path_part;
use crate::{EstimateError, MaterialMap};

/// Folders of the companions.
const COARSE: &str = "estimate/mesh-2x";
const COARSEST: &str = "estimate/mesh-4x";
const HALF_STEP: &str = "estimate/half-step";
const TIGHT: &str = "estimate/tight";

/// Estimates the error of a run from up to six companions.
///
/// Steps, tolerances and other beginnings are compared on the mesh twice as coarse, or on the
/// run's own where there is no other. A part that cannot be known is `None`
/// and says why: a companion that fails costs its part, not the estimate.
///
/// # Errors
/// [`EstimateError::Interrupted`] and what stops all companions alike;
/// [`EstimateError::Empty`] for a scene without triangles.
pub fn estimate(
    session: &mut Session<'_>,
    built: &BuiltScene,
    result: &RunResult,
) -> Result<ErrorReport, EstimateError> {
    let before = session.cpu_s;
    let scene = built.scene();
    if !matches!(result.summary.status, Status::Converged | Status::Finished) {
        let none = unknown("the run did not come to its end");
        return Ok(ErrorReport {
            space: none.clone(),
            time: none.clone(),
            algebraic: none.clone(),
            path: none,
            cpu_s: 0.0,
            target_m: None,
            decisions: Vec::new(),
            effectivity: &EFFECTIVITY,
        });
    }
    let own = MaterialMap::new(surface(built, &result.positions))?;
    let mut coarse = Err(String::new());
    let space = match coarser(scene, 2.0) {
        Err(why) => unknown(&why),
        Ok(twice) => {
            // The finer of the two may begin where the coarser rests.
            let coarsest = match coarser(scene, 4.0) {
                Err(_) => None,
                Ok(four) => attempt(session, COARSEST, None, four, false)?.ok(),
            };
            coarse = attempt(session, COARSE, coarsest.as_ref(), twice, false)?;
            match &coarse {
                Err(why) => unknown(why),
                Ok(coarse) => {
                    let near = own.distance(&coarse.surface());
                    let map = MaterialMap::new(coarse.surface())?;
                    let far = coarsest.map(|c| map.distance(&c.surface()));
                    space_part(near, far)
                }
            }
        }
    };
    let (base, reference, mesh) = match &coarse {
        Ok(c) => (
            c.built.scene(),
            MaterialMap::new(c.surface())?,
            "on the mesh twice as coarse",
        ),
        Err(_) => (scene, own, "on the same mesh"),
    };
    let time = match attempt(session, HALF_STEP, None, scaled_step(base, 0.5), false)? {
        Ok(c) => time_part(reference.distance(&c.surface()), mesh),
        Err(why) => unknown(&why),
    };
    let algebraic = match attempt(session, TIGHT, None, scaled_tolerance(base, 0.1), false)? {
        Ok(c) => algebraic_part(reference.distance(&c.surface()), mesh),
        Err(why) => unknown(&why),
    };
    let path = path_part(session, base, &reference, mesh)?;
    Ok(ErrorReport {
        space,
        time,
        algebraic,
        path,
        cpu_s: session.cpu_s - before,
        target_m: None,
        decisions: Vec::new(),
        effectivity: &EFFECTIVITY,
    })
}

/// Runs a companion; the inner error says why there is none.
pub(crate) fn attempt(
    session: &mut Session<'_>,
    name: &str,
    coarser: Option<&Companion>,
    scene: SceneFile,
    record: bool,
) -> Result<Result<Companion, String>, EstimateError> {
    told(session.run(name, coarser, scene, record))
}

/// Takes a run that failed for one that tells why.
pub(crate) fn told<T>(run: Result<T, EstimateError>) -> Result<Result<T, String>, EstimateError> {
    match run {
        Ok(run) => Ok(Ok(run)),
        Err(e @ EstimateError::Interrupted { .. }) => Err(e),
        Err(e) => Ok(Err(e.to_string())),
    }
}

pub(crate) fn unknown(why: &str) -> ErrorPart {
    ErrorPart {
        error_m: None,
        distance_m: None,
        order: None,
        how: format!("not known: {why}"),
    }
}
