//! Coarse meshes first: garments are sewn and draped with long edges, and the
//! drape with edges of half that length begins where the longer ones came to
//! rest.
//!
//! Which of the many ways a garment can fold is decided while it is sewn. Meshes
//! that are sewn on their own decide differently; meshes that follow each other
//! converge, and the fine ones have little left to do.

use std::sync::atomic::AtomicBool;

use selvedge_integrator::State;

use crate::assembly::{Assembled, carry};
use crate::build::BuiltScene;
use crate::driver::{Progress, RunError, RunOptions, drape_alone};
use crate::file::{Parsed, SceneFile, coarser};
use crate::summary::Status;

/// Whether a mesh of twice the edges comes before that of the scene: where all
/// cloth is garments, nothing moves, and the edges stay within
/// `assemble.coarsest`.
fn applies(scene: &SceneFile) -> bool {
    let edges = scene.cloth.iter().map(|c| {
        c.is_sewn()
            .then(|| c.edge_length().unwrap_or(scene.mesh.edge_length))
    });
    // Halving a length is exact but for its last digit.
    let longest = scene.assemble.coarsest * (1.0 + 1e-9);
    let still = |motion: &[_]| motion.is_empty();
    edges
        .into_iter()
        .all(|e| e.is_some_and(|e| 2.0 * e <= longest))
        && scene.body.iter().all(|b| still(&b.motion))
        && scene.pin.iter().all(|p| still(&p.motion))
        && scene.attachment.iter().all(|a| still(&a.motion))
}

/// The scene with twice the edges, if it comes first and can be built.
fn coarse_scene(built: &BuiltScene) -> Option<BuiltScene> {
    if !applies(built.scene()) {
        return None;
    }
    let mut scene = coarser(built.scene(), 2.0).ok()?;
    scene.stop.early = true;
    let parsed = Parsed {
        scene,
        ..built.parsed.clone()
    };
    let coarse = BuiltScene::new(parsed).ok()?;
    Some(coarse.displaced_like(built))
}

/// Cloth at rest on a mesh with edges twice as long.
#[derive(Clone, Copy)]
pub struct Coarser<'a> {
    /// The scene there; all but its edges as in the one that follows.
    pub built: &'a BuiltScene,
    /// Where its points rest, in the scene's order [m].
    pub positions: &'a [f64],
}

/// Garments carried over from a coarser mesh; `None` where the scene calls for
/// no coarser one, the coarser scene need not have come to rest, or they cross
/// themselves here.
pub(crate) fn carried(
    coarser: Coarser<'_>,
    built: &BuiltScene,
    state: &State,
    progress: &mut (dyn Progress + Send),
) -> Option<Assembled> {
    let scene = coarser.built.scene();
    let twice = scene.mesh.edge_length == 2.0 * built.scene().mesh.edge_length;
    if !(twice && scene.stop.early && applies(built.scene())) {
        return None;
    }
    let edge = 1e3 * scene.mesh.edge_length;
    let mut carried = state.clone();
    let last = carry(coarser.built, coarser.positions, built, &mut carried);
    if last.self_intersections > 0 {
        return None;
    }
    progress.note(&format!(
        "assembly: begun where the mesh of {edge} mm rests"
    ));
    Some(Assembled::Done {
        state: carried,
        summaries: vec![last],
        carried: true,
    })
}

/// Sews and drapes the garments on coarser meshes and carries them over to this
/// one; `None` where the scene calls for none, or where they lead to nothing
/// that can be used.
pub(crate) fn follow(
    built: &BuiltScene,
    state: &State,
    options: &RunOptions,
    progress: &mut (dyn Progress + Send),
    interrupt: &AtomicBool,
) -> Result<Option<Assembled>, RunError> {
    let Some(coarse) = coarse_scene(built) else {
        return Ok(None);
    };
    let edge = 1e3 * coarse.scene().mesh.edge_length;
    progress.note(&format!("assembly: first on a mesh of {edge} mm"));
    let draped = drape_alone(&coarse, options, progress, interrupt)?;
    let unusable = match draped.status {
        Status::Stopped => {
            return Ok(Some(Assembled::Cut {
                state: state.clone(),
                summaries: draped.stages,
                status: Status::Stopped,
                reason: format!("{} (on the mesh of {edge} mm)", draped.reason),
            }));
        }
        Status::Failed => Some(draped.reason),
        Status::Converged | Status::Finished => {
            let mut carried = state.clone();
            let last = carry(&coarse, &draped.positions, built, &mut carried);
            if last.self_intersections == 0 {
                progress.note(&format!(
                    "assembly: carried over from the mesh of {edge} mm"
                ));
                let mut summaries = draped.stages;
                summaries.push(last);
                return Ok(Some(Assembled::Done {
                    state: carried,
                    summaries,
                    carried: true,
                }));
            }
            Some(format!("{} crossings", last.self_intersections))
        }
    };
    if let Some(reason) = unusable {
        progress.note(&format!(
            "assembly: the drape on the mesh of {edge} mm is of no use here: {reason}"
        ));
    }
    Ok(None)
}
