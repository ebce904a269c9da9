mod accuracy;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use selvedge_estimate::Target;
use selvedge_record::{RecordError, Recording};
use selvedge_scene::build::BuiltScene;
use selvedge_scene::diagnostic::Diagnostics;
use selvedge_scene::driver::{self, Progress, RunError, RunOptions, RunResult};
use selvedge_scene::file::{self, Parsed};
use selvedge_scene::summary::Status;
use selvedge_scene::watchdog::{Dump, ReplayError};
use selvedge_scene::{check_results, write_whole};

use crate::Failure;
use crate::args::{AccuracyArgs, DrapeArgs, RunArgs};
use crate::failure::print_findings;
use crate::output::say;
use crate::progress::Reporter;
use crate::{report, report_data, signals};

const REPORT: &str = "report.html";

/// Exit status after Ctrl-C, as shells report it: 128 and the signal's number.
pub(super) const STOPPED: u8 = 130;

/// `selvedge run`
pub fn run(args: &RunArgs, json: bool) -> Result<ExitCode, Failure> {
    if Dump::is_at(&args.scene.scene) {
        return replay(args, json);
    }
    let parsed = file::read(&args.scene.scene, &args.scene.set)?;
    let text = std::fs::read_to_string(&args.scene.scene).unwrap_or_default();
    simulate(
        parsed,
        text,
        args.output.clone(),
        args.resume,
        &args.accuracy,
        json,
    )
}

/// `selvedge run DUMP`: takes a step again that the watchdog wrote down; exit
/// status 1 when it fails again.
fn replay(args: &RunArgs, json: bool) -> Result<ExitCode, Failure> {
    let (path, set) = (args.scene.scene.as_path(), args.scene.set.as_slice());
    let given = [
        ("--estimate-error", args.accuracy.estimate_error),
        ("--target-error", args.accuracy.target_error.is_some()),
        ("--output", args.output.is_some()),
        ("--resume", args.resume),
    ];
    if let Some((option, _)) = given.iter().find(|(_, given)| *given) {
        return Err(Failure::Usage(format!(
            "`{}` is a stopped step, which is taken once more and leaves nothing: {option} goes \
             with a scene; leave it out",
            path.display()
        )));
    }
    let dump = Dump::read(path).map_err(|e| Failure::Usage(e.to_string()))?;
    let replay = dump.replay(path, set).map_err(|e| match e {
        ReplayError::Scene(findings) => Failure::Input(findings),
        other => Failure::Usage(other.to_string()),
    })?;
    if json {
        say!(
            "{}",
            serde_json::json!({ "event": "replay", "replay": replay })
        )?;
    } else {
        let how = if replay.accepted {
            "accepted"
        } else {
            "refused"
        };
        say!("found: {}", replay.event.what)?;
        say!("step of {:.6e} s, {how}: {}", replay.dt_s, replay.outcome)?;
        if let Some(gain) = replay.energy_gain_j {
            say!("energy grew by {gain:.6e} J")?;
        }
    }
    Ok(ExitCode::from(u8::from(!replay.accepted)))
}

/// `selvedge drape`: makes a scene for the pattern and runs it.
pub fn drape(args: &DrapeArgs, json: bool) -> Result<ExitCode, Failure> {
    let text = drape_scene(args)?;
    let name = garment_name(args);
    let file = format!("{name}.toml");
    let parsed = file::parse(&text, Path::new(&file), &args.set)
        .map_err(|findings| by_option(&findings, &file))?;
    simulate(
        parsed,
        text,
        args.output.clone(),
        args.resume,
        &args.accuracy,
        json,
    )
    .map_err(|e| match e {
        Failure::Input(findings) => Failure::Input(by_option(&findings, &file)),
        other => other,
    })
}

/// Name of the scene that `drape` runs: that of the pattern's file.
fn garment_name(args: &DrapeArgs) -> String {
    let stem = args.pattern.file_stem().unwrap_or_default();
    stem.to_string_lossy().into_owned()
}

/// Findings about the scene that `drape` made, which the user never sees, put
/// to the options it was made from.
fn by_option(findings: &Diagnostics, file: &str) -> Diagnostics {
    const OPTIONS: [(&str, &str); 6] = [
        ("simulation.duration", "--duration"),
        ("mesh.edge_length", "--edge-length"),
        ("cloth.0.hold", "--hold"),
        ("cloth.0.file", "PATTERN"),
        ("body.0", "--body"),
        ("fabric.garment", "--fabric"),
    ];
    let mut out = Diagnostics::new();
    for finding in findings.findings() {
        let mut finding = finding.clone();
        let path = finding.path.as_deref().unwrap_or("");
        let option = OPTIONS.iter().find(|(key, _)| path.starts_with(key));
        if finding.file == file {
            finding.file = option.map_or("drape", |(_, option)| option).to_owned();
            finding.line = None;
            finding.column = None;
            finding.span = None;
        }
        out.push(finding);
    }
    out
}

/// The scene that `drape` runs; paths are made absolute, so that it can be
/// kept and run from anywhere.
fn drape_scene(args: &DrapeArgs) -> Result<String, Failure> {
    let absolute = |path: &Path| {
        std::path::absolute(path).map_err(|e| Failure::Usage(format!("`{}`: {e}", path.display())))
    };
    let quoted = |path: PathBuf| toml_string(&path.display().to_string());
    let name = garment_name(args);
    let mut text = format!(
        "name = {}\n\n[simulation]\nduration = {}\n\n[mesh]\nedge_length = {}\n\n",
        toml_string(&name),
        toml_number(args.duration),
        toml_number(args.edge_length)
    );
    let holds = args.hold.iter().filter(|h| !h.is_empty());
    let holds: Vec<String> = holds.map(|h| toml_string(h)).collect();
    text += &format!(
        "[[cloth]]\nname = \"garment\"\nkind = \"pattern\"\nfile = {}\nfabric = \"garment\"\n\
         hold = [{}]\n\n",
        quoted(absolute(&args.pattern)?),
        holds.join(", ")
    );
    text += &match &args.body {
        Some(body) => format!(
            "[[body]]\nname = \"body\"\nkind = \"mesh\"\nfile = {}\n\n",
            quoted(absolute(body)?)
        ),
        None => "[[body]]\nname = \"mannequin\"\nkind = \"mannequin\"\n\n".to_owned(),
    };
    let is_file = Path::new(&args.fabric).extension().is_some();
    text += &if is_file {
        format!(
            "[fabric.garment]\nfile = {}\n",
            quoted(absolute(Path::new(&args.fabric))?)
        )
    } else {
        format!(
            "[fabric.garment]\nlibrary = {}\n",
            toml_string(&args.fabric)
        )
    };
    Ok(text)
}

/// A TOML float, `nan` and `inf` included.
fn toml_number(x: f64) -> String {
    if x.is_nan() {
        "nan".to_owned()
    } else {
        format!("{x:?}")
    }
}

/// A TOML basic string: JSON's escapes are a subset of TOML's.
fn toml_string(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

fn simulate(
    parsed: Parsed,
    scene_text: String,
    output: Option<PathBuf>,
    resume: bool,
    accuracy: &AccuracyArgs,
    json: bool,
) -> Result<ExitCode, Failure> {
    let directory = output.unwrap_or_else(|| parsed.scene.output.directory.clone());
    if directory.exists() && !directory.is_dir() {
        return Err(Failure::Usage(format!(
            "`{}` is a file, not a folder: choose another folder for the results with -o",
            directory.display()
        )));
    }
    if resume && !parsed.scene.output.recording {
        return Err(Failure::Usage(
            "--resume needs the recording, and `output.recording` is false".to_owned(),
        ));
    }
    let asked = accuracy.estimate_error || accuracy.target_error.is_some();
    let yarns = parsed.scene.cloth.iter().find(|c| c.is_of_yarns());
    if let Some(cloth) = yarns.filter(|_| asked) {
        return Err(Failure::Usage(format!(
            "`{}` is made of yarns, and errors are estimated by coarser meshes, which it has not: \
             `selvedge study` tells what its steps and tolerances change",
            cloth.name
        )));
    }
    if let Some(error) = accuracy.target_error {
        let target = Target {
            error,
            max_points: accuracy.max_points,
        };
        return accuracy::within(&parsed, &scene_text, &directory, target, resume, json);
    }
    let mut reporter = Reporter::new(json);
    let built = BuiltScene::watched(parsed, &mut reporter);
    let built = built.inspect_err(|_| reporter.finish())?;
    if !built.warnings.is_empty() && !json {
        print_findings(&built.warnings);
    }
    let mut options = RunOptions {
        directory: directory.clone(),
        resume,
        scene_text,
        version: env!("CARGO_PKG_VERSION").to_owned(),
    };
    if built.scene().output.report {
        check_results(&directory, &[REPORT])?;
    }
    let interrupt = signals::interrupt();
    let mut result = driver::run(&built, &options, &mut reporter, &interrupt);
    if resume
        && matches!(
            result,
            Err(RunError::Record(RecordError::NoCheckpoint { .. }))
        )
        && no_frames(&directory)
    {
        // Cut off while sewing: the same steps again lead to the same result.
        reporter.note("nothing was recorded yet: starting from the beginning");
        options.resume = false;
        result = driver::run(&built, &options, &mut reporter, &interrupt);
    }
    let mut result = match result {
        Ok(result) => result,
        Err(e) => {
            reporter.finish();
            return Err(e.into());
        }
    };
    if accuracy.estimate_error {
        accuracy::estimate(&built, &mut result, &options, &mut reporter, &interrupt)?;
    }
    reporter.finish();
    finish(&built, &result, &directory, &options.scene_text, json)
}

/// Writes the report of a run, tells how it ended, and says so by the exit
/// status.
fn finish(
    built: &BuiltScene,
    result: &RunResult,
    directory: &Path,
    scene_text: &str,
    json: bool,
) -> Result<ExitCode, Failure> {
    if built.scene().output.report {
        let data = report_data::of_run(built, result, scene_text);
        write_whole(&directory.join(REPORT), report::render(&data).as_bytes())?;
    }
    tell(built, result, directory, json)?;
    Ok(match result.summary.status {
        Status::Failed => ExitCode::from(1),
        Status::Stopped => ExitCode::from(STOPPED),
        _ => ExitCode::SUCCESS,
    })
}

/// Whether an unfinished recording holds no frame.
fn no_frames(directory: &Path) -> bool {
    Recording::open(&directory.join("run.mcap.part")).is_ok_and(|r| r.frames().is_empty())
}

fn tell(
    built: &BuiltScene,
    result: &RunResult,
    directory: &Path,
    json: bool,
) -> Result<(), Failure> {
    let s = &result.summary;
    let resumable = s.status == Status::Stopped && built.scene().output.recording;
    let again = resumable.then(command_line);
    if json {
        return say!(
            "{}",
            serde_json::json!({ "event": "end", "summary": s, "resume": again })
        );
    }
    let status = serde_json::to_value(s.status).unwrap_or_default();
    say!(
        "{}: {} ({})",
        built.scene().name,
        status.as_str().unwrap_or("?"),
        s.reason
    )?;
    say!(
        "  {:.3} s simulated in {:.1} s ({:.1} s of processor time on {} threads), {} steps, \
         {} rejected",
        s.simulated_s,
        s.wall_s,
        s.cpu_s,
        s.threads,
        s.steps,
        s.rejected_steps
    )?;
    say!(
        "  {} points, {} triangles; edge strain mean {:.2e}, largest {:.2e}; \
         deepest penetration {:.3} mm; {} self-intersections",
        s.points,
        s.triangles,
        s.mean_abs_edge_strain,
        s.max_abs_edge_strain,
        1e3 * s.max_penetration_m,
        s.self_intersections
    )?;
    if let Some(error) = &s.error {
        for line in accuracy::lines(s.error_estimate, error) {
            say!("  {line}")?;
        }
    }
    say!("  results in {}", directory.display())?;
    if let Some(again) = again {
        say!("  to go on: {again}")?;
    }
    Ok(())
}

/// The command that was given, for the shell, with `--resume`.
pub(super) fn command_line() -> String {
    let quoted = std::env::args_os().map(|arg| {
        let arg = arg.to_string_lossy().into_owned();
        let plain = |c: char| c.is_alphanumeric() || "-_=./,:".contains(c);
        if !arg.is_empty() && arg.chars().all(plain) {
            arg
        } else {
            format!("'{}'", arg.replace('\'', r"'\''"))
        }
    });
    let mut line = quoted.collect::<Vec<_>>().join(" ");
    if !std::env::args_os().any(|a| a == "--resume") {
        line += " --resume";
    }
    line
}
