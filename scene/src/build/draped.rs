//! A sewing pattern draped as a shell, for yarns to be laid on.

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use super::BuiltScene;
use super::alone::alone;
use super::bodies::cache_folder;
use crate::driver::{self, Progress, RunOptions, Tick};
use crate::file::Parsed;
use crate::file::model::{BodyShape, Cloth, ClothShape, IntegratorKind, Switch};
use crate::summary::Status;

/// Changes with anything that changes the shells' shape.
const VERSION: &str = "shells-1";
const FINAL: &str = "final.obj";

/// Tells of a run of shells by names of stages that say so.
struct OfShells<'a>(&'a mut (dyn Progress + Send));

impl Progress for OfShells<'_> {
    fn tick(&mut self, tick: &Tick<'_>) {
        let stage = &format!("shells, {}", tick.stage);
        self.0.tick(&Tick { stage, ..*tick });
    }

    fn note(&mut self, text: &str) {
        self.0.note(text);
    }
}

/// The draped shells as an OBJ file in the cache, made if it is not there.
///
/// Pattern, fabric, bodies at their start and gravity are those of the scene;
/// what holds the yarns does not hold the shells. Cloth keeps `clearance` [m]
/// from bodies, and from cloth where yarns touch. The drape ends at rest or after `time` [s].
///
/// # Errors
/// A sentence, for shells that cannot be sewn and draped.
pub(super) fn draped(
    parsed: &Parsed,
    cloth: &Cloth,
    time: f64,
    clearance: f64,
    progress: &mut (dyn Progress + Send),
) -> Result<PathBuf, String> {
    let ClothShape::KnitPattern {
        file, edge_length, ..
    } = &cloth.shape
    else {
        return Err("not a pattern".to_owned());
    };
    let shape = ClothShape::Pattern {
        file: file.clone(),
        edge_length: *edge_length,
        panel_fabric: Default::default(),
        panel_layer: Default::default(),
        hold: vec!["auto".to_owned()],
    };
    let shell = Cloth {
        shape,
        noise: 0.0,
        stretch: 1.0,
        ..cloth.clone()
    };
    let shells = alone(parsed, shell, |scene| {
        scene.simulation.duration = time;
        scene.stop.early = true;
        scene.stop.kinetic_energy = 1e-8;
        scene.integrator.kind = IntegratorKind::BackwardEuler;
        scene.relaxation.enabled = true;
        scene.contact.body_thickness = scene.contact.body_thickness.max(clearance);
        if scene.contact.self_contact == Switch::On {
            // Yarns of two layers begin as far apart as they will keep.
            scene.contact.thickness = scene.contact.thickness.max(clearance);
        }
        scene.output.report = false;
        for body in &mut scene.body {
            body.motion.clear();
        }
    });
    let scene = &shells.scene;
    let mut key = blake3::Hasher::new();
    key.update(VERSION.as_bytes());
    key.update(env!("CARGO_PKG_VERSION").as_bytes());
    let mut about = scene.clone();
    about.output.directory = PathBuf::new();
    about.simulation.duration = time;
    about.assembly.threads = Default::default(); // the same bits for any number
    key.update(about.effective().to_string().as_bytes());
    let bodies = scene.body.iter().filter_map(|b| match &b.shape {
        BodyShape::Mesh { file, .. } => Some(file),
        _ => None,
    });
    for file in std::iter::once(file).chain(bodies) {
        let path = scene.resolve(file);
        let bytes = std::fs::read(&path);
        let bytes = bytes.map_err(|e| format!("cannot read `{}`: {e}", path.display()))?;
        key.update(&(bytes.len() as u64).to_le_bytes());
        key.update(&bytes);
    }
    let folder = cache_folder().join(format!("{}.shells", key.finalize().to_hex()));
    let kept = folder.join(FINAL);
    if kept.is_file() {
        return Ok(kept);
    }
    let told = |e: &crate::diagnostic::Diagnostics| {
        e.findings()
            .first()
            .map(ToString::to_string)
            .unwrap_or_default()
    };
    let built = BuiltScene::new(shells.clone()).map_err(|e| told(&e))?;
    let working = folder.with_extension(format!("shells-{}", std::process::id()));
    let options = RunOptions {
        directory: working.clone(),
        resume: false,
        scene_text: String::new(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
    };
    let made = std::fs::create_dir_all(&working);
    made.map_err(|e| format!("cannot write `{}`: {e}", working.display()))?;
    progress.note("draping the shells that the yarns are laid on; they are kept for the next time");
    let run = driver::run(
        &built,
        &options,
        &mut OfShells(progress),
        &AtomicBool::new(false),
    );
    let run = run.map_err(|e| match e {
        driver::RunError::Scene(findings) => told(&findings),
        other => other.to_string(),
    })?;
    if matches!(run.summary.status, Status::Failed | Status::Stopped) {
        let _ = std::fs::remove_dir_all(&working); // of no use to anybody
        return Err(format!("the shells did not drape: {}", run.summary.reason));
    }
    // Another run may have put it there in the meantime: the same file.
    if std::fs::rename(&working, &folder).is_err() && !kept.is_file() {
        return Ok(working.join(FINAL));
    }
    Ok(kept)
}
