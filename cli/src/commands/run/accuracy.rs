//! `--estimate-error` and `--target-error`.

use std::path::Path;
use std::process::ExitCode;
use std::sync::atomic::AtomicBool;

use selvedge_estimate::{EstimateError, Session, Target, drape_within, total};
use selvedge_scene::build::BuiltScene;
use selvedge_scene::driver::{RunOptions, RunResult};
use selvedge_scene::effects::{ESTIMATE, EffectRow};
use selvedge_scene::file::Parsed;
use selvedge_scene::summary::{ErrorPart, ErrorReport};
use selvedge_scene::{check_results, write_summary, write_whole};

use super::{REPORT, STOPPED, finish};
use crate::Failure;
use crate::output::complain;
use crate::progress::Reporter;
use crate::signals;

impl From<EstimateError> for Failure {
    fn from(error: EstimateError) -> Self {
        match error {
            EstimateError::Run { source, .. } => (*source).into(),
            other => Self::Other(other.to_string()),
        }
    }
}

/// Estimates the error of a finished run and adds it to its summary. A run
/// whose estimate was interrupted keeps its result, without an estimate.
pub(super) fn estimate(
    built: &BuiltScene,
    result: &mut RunResult,
    options: &RunOptions,
    reporter: &mut Reporter,
    interrupt: &AtomicBool,
) -> Result<(), Failure> {
    let mut session = Session {
        parsed: &built.parsed,
        scene_text: &options.scene_text,
        version: &options.version,
        directory: options.directory.clone(),
        progress: reporter,
        interrupt,
        resume: false,
        cpu_s: 0.0,
    };
    match selvedge_estimate::estimate(&mut session, built, result) {
        Ok(report) => {
            add(result, report);
            Ok(write_summary(&options.directory, &result.summary)?)
        }
        Err(e @ EstimateError::Interrupted { .. }) => {
            complain(format_args!("{e}: the result has no error estimate"));
            Ok(())
        }
        Err(e) => Err(e.into()),
    }
}

/// Adds an estimate to a run's summary.
fn add(result: &mut RunResult, report: ErrorReport) {
    let summary = &mut result.summary;
    let effects = &mut summary.effects;
    if let Some(row) = effects.iter_mut().find(|e| e.name == ESTIMATE) {
        let reason = match report.target_m {
            Some(target) => format!("asked for {}", millimetres(target)),
            None => "asked for".to_owned(),
        };
        *row = EffectRow::on(ESTIMATE, reason, 0, 0);
        row.seconds = report.cpu_s;
    }
    summary.error_estimate = total(&report);
    summary.error = Some(report);
}

/// There while a search for settings has not come to its end.
const UNFINISHED: &str = "estimate/unfinished";

/// Runs a scene with settings chosen for a wanted error.
pub(super) fn within(
    parsed: &Parsed,
    scene_text: &str,
    directory: &Path,
    target: Target,
    resume: bool,
    json: bool,
) -> Result<ExitCode, Failure> {
    let scene = parsed.scene.clone();
    let mut names = vec!["final.obj", "summary.json"];
    names.extend(scene.output.recording.then_some("run.mcap"));
    names.extend(scene.output.report.then_some(REPORT));
    check_results(directory, &names)?;
    let unfinished = directory.join(UNFINISHED);
    if resume && !unfinished.exists() {
        return Err(Failure::Usage(format!(
            "nothing to resume: no search for settings was interrupted in `{}`",
            directory.display()
        )));
    }
    if let Some(folder) = unfinished.parent() {
        check_results(folder, &[])?;
    }
    write_whole(&unfinished, b"")?;
    let interrupt = signals::interrupt();
    let mut reporter = Reporter::new(json);
    let mut session = Session {
        parsed,
        scene_text,
        version: env!("CARGO_PKG_VERSION"),
        directory: directory.to_owned(),
        progress: &mut reporter,
        interrupt: &interrupt,
        resume,
        cpu_s: 0.0,
    };
    let found = drape_within(&mut session, &scene, target);
    let found = match found {
        Ok(found) => {
            let from = session.folder(&found.name);
            reporter.finish();
            (found, from)
        }
        Err(EstimateError::Interrupted { name }) => {
            reporter.finish();
            complain(format_args!(
                "interrupted while running `{name}`; the runs made so far are in `{}`\n  to go \
                 on: {}",
                directory.join("estimate").display(),
                super::command_line()
            ));
            return Ok(ExitCode::from(STOPPED));
        }
        Err(e) => {
            reporter.finish();
            return Err(e.into());
        }
    };
    let (mut within, from) = found;
    let result = &mut within.result;
    for name in ["run.mcap", "final.obj"] {
        let (source, target) = (from.join(name), directory.join(name));
        if source.exists() {
            std::fs::rename(&source, &target).map_err(|error| EstimateError::Move {
                from: source,
                to: target,
                source: error,
            })?;
        }
    }
    result.recording = result.recording.take().map(|_| directory.join("run.mcap"));
    add(result, within.report);
    write_summary(directory, &result.summary)?;
    // The same summary would otherwise stand in two places.
    let _ = std::fs::remove_dir_all(&from);
    let _ = std::fs::remove_file(&unfinished);
    finish(&within.built, result, directory, scene_text, json)
}

/// The estimate in words.
pub(super) fn lines(total: Option<f64>, report: &ErrorReport) -> Vec<String> {
    let part = |p: &ErrorPart| p.error_m.map_or("not known".to_owned(), millimetres);
    let mut lines = vec![format!(
        "error {}: mesh {}, steps {}, tolerances {}, path {} ({:.1} s of processor time for the estimate)",
        total.map_or("not known".to_owned(), millimetres),
        part(&report.space),
        part(&report.time),
        part(&report.algebraic),
        part(&report.path),
        report.cpu_s
    )];
    for (what, part) in [
        ("mesh", &report.space),
        ("steps", &report.time),
        ("tolerances", &report.algebraic),
        ("path", &report.path),
    ] {
        if part.error_m.is_none() {
            lines.push(format!("  {what}: {}", part.how));
        }
    }
    for d in &report.decisions {
        lines.push(format!("  {} = {}: {}", d.setting, d.value, d.why));
    }
    if let Some(target) = report.target_m {
        let met = total.is_some_and(|t| t <= target);
        lines.push(format!(
            "  {} the {} asked for",
            if met { "within" } else { "NOT within" },
            millimetres(target)
        ));
        // From here on the path takes more of the target than all else may.
        let half = 0.5_f64.sqrt() * target;
        if !met && let Some(path) = report.path.error_m.filter(|path| *path > half) {
            lines.push(format!(
                "  this scene does not determine its end any better: begun another way it ends \
                 {} away, whatever the mesh, the steps and the tolerances",
                millimetres(path)
            ));
        }
    }
    lines
}

fn millimetres(metres: f64) -> String {
    format!("{:.3} mm", 1e3 * metres)
}
