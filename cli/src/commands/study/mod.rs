//! `selvedge study`

mod args;
mod progress;

use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use selvedge_scene::diagnostic::Diagnostics;
use selvedge_study::{
    Axis, Clock, Executor, Halt, InProcess, Plan, Results, Sample, Shard, Store, StudyError,
    StudySpec, Subprocess, Table, fill, read_plan, serve, whole,
};

use super::run::{STOPPED, command_line};
use crate::output::{complain, say};
use crate::{Failure, report, signals};
pub use args::StudyArgs;
use args::{ClockKind, ExecutorKind};
use progress::Lines;

const VERSION: &str = env!("CARGO_PKG_VERSION");

/// `selvedge study`
pub fn study(args: &StudyArgs, json: bool) -> Result<ExitCode, Failure> {
    if let Some(template) = &args.document {
        return document(template, args.output.as_deref());
    }
    if let Some(folder) = &args.collect {
        let plan = read_plan(folder)?;
        return conclude(folder, &plan, args.time.into(), json);
    }
    let kind = executor_kind(args)?;
    let shard = shard(args)?;
    let plan = plan(args)?;
    let folder = match &args.output {
        Some(folder) => folder.clone(),
        None => PathBuf::from(format!("out/study-{}", plan.name)),
    };
    if folder.exists() && !folder.is_dir() {
        let folder = folder.display();
        return Err(Failure::Usage(format!(
            "`{folder}` is a file, not a folder: choose another folder for the results with -o"
        )));
    }
    let interrupt = signals::interrupt();
    let store = Store::open(&folder, &plan, shard, args.resume)?;
    let lines = Lines::new(json);
    let executor: Box<dyn Executor> = match kind {
        ExecutorKind::InProcess => Box::new(InProcess {
            alone: args.jobs == 1,
            watch: (args.jobs == 1).then_some(&lines),
            ..InProcess::new(store.scratch(), VERSION)
        }),
        ExecutorKind::Process => Box::new(Subprocess {
            program: std::env::current_exe().map_err(|e| Failure::Other(e.to_string()))?,
            arguments: vec!["study-job".to_owned()],
            scratch: store.scratch(),
            version: VERSION.to_owned(),
        }),
    };
    let at_once = usize::from(args.jobs);
    let tally = selvedge_study::run(
        &plan,
        &store,
        shard,
        executor.as_ref(),
        at_once,
        &lines,
        &interrupt,
    );
    lines.finish();
    drop(store);
    let tally = tally?;
    if tally.interrupted {
        let (done, jobs) = (tally.reused + tally.made, tally.jobs);
        let again = command_line();
        if json {
            let event = serde_json::json!({ "event": "stopped", "done": done, "runs": jobs, "resume": again });
            say!("{event}")?;
        } else {
            say!("stopped: {done} of {jobs} runs are done and kept")?;
            say!("  to go on: {again}")?;
        }
        return Ok(ExitCode::from(STOPPED));
    }
    if shard.count == 1 {
        return conclude(&folder, &plan, args.time.into(), json);
    }
    if json {
        let event = serde_json::json!({ "event": "part", "shard": shard.to_string(), "made": tally.made, "reused": tally.reused });
        say!("{event}")?;
    } else {
        let (made, reused) = (tally.made, tally.reused);
        say!("part {shard}: {made} runs made, {reused} reused")?;
        say!(
            "  when all parts are done: selvedge study --collect {}",
            folder.display()
        )?;
    }
    Ok(ExitCode::SUCCESS)
}

/// `selvedge study-job`: the other side of [`Subprocess`].
pub fn job() -> Result<ExitCode, Failure> {
    let mut order = String::new();
    std::io::stdin()
        .read_to_string(&mut order)
        .map_err(|e| Failure::Other(e.to_string()))?;
    let interrupt = signals::interrupt();
    match serve(&order, &interrupt) {
        Ok(()) => Ok(ExitCode::SUCCESS),
        Err(Halt::Interrupted) => Ok(ExitCode::from(STOPPED)),
        Err(e) => Err(Failure::Other(e.to_string())),
    }
}

/// Where simulations run: as asked for, or so that each has a time of its own.
fn executor_kind(args: &StudyArgs) -> Result<ExecutorKind, Failure> {
    let kind = args.executor.unwrap_or(match args.jobs {
        1 => ExecutorKind::InProcess,
        _ => ExecutorKind::Process,
    });
    if kind == ExecutorKind::InProcess && args.jobs > 1 && args.time == ClockKind::Cpu {
        return Err(Failure::Usage(
            "--time cpu: simulations that share a process have no processor time of their own; \
             use --executor process, --jobs 1 or --time wall"
                .to_owned(),
        ));
    }
    Ok(kind)
}

/// The part to run: as asked for, or that of a Slurm task.
fn shard(args: &StudyArgs) -> Result<Shard, Failure> {
    if let Some(text) = &args.shard {
        return Ok(Shard::parse(text)?);
    }
    let variable = |name: &str| std::env::var(name).ok();
    let [id, count, least] =
        ["ID", "COUNT", "MIN"].map(|n| variable(&format!("SLURM_ARRAY_TASK_{n}")));
    let shard = Shard::of_array(id.as_deref(), count.as_deref(), least.as_deref())?;
    Ok(shard.unwrap_or(Shard::WHOLE))
}

fn plan(args: &StudyArgs) -> Result<Plan, Failure> {
    if args.vary.is_empty() {
        return Err(Failure::Usage(
            "nothing to vary: add for example --vary solver.tolerance=1e-3,1e-2".to_owned(),
        ));
    }
    if args.sample == Some(0) {
        return Err(Failure::Usage("--sample has to be at least 1".to_owned()));
    }
    let mut axes = Vec::new();
    for text in &args.vary {
        axes.push(Axis::parse(text)?);
    }
    let scene = args.scene.clone().unwrap_or_default();
    let seed = args.seed;
    let spec = StudySpec {
        set: args.set.clone(),
        axes,
        sample: args.sample.map(|count| Sample { count, seed }),
        reference: args.reference.clone(),
        plain_reference: args.plain_reference,
        repeat: usize::from(args.repeat),
        floor: usize::from(args.floor),
        ..StudySpec::new(scene, VERSION)
    };
    Plan::new(spec).map_err(|e| match e {
        StudyError::Scene(findings) => Failure::Input(by_option(&findings, args)),
        other => other.into(),
    })
}

/// Findings about `--set` put to the option that they come from.
fn by_option(findings: &Diagnostics, args: &StudyArgs) -> Diagnostics {
    let mut out = Diagnostics::new();
    for finding in findings.findings() {
        let mut finding = finding.clone();
        if let Some(text) = finding.file.strip_prefix("--set ") {
            let key = text.split_once('=').map_or(text, |(key, _)| key);
            let given = |list: &[(String, String)]| list.iter().any(|(k, _)| k == key);
            let varied = |v: &String| {
                let keys = v.split_once('=').map_or("", |(keys, _)| keys);
                keys.split('&').any(|k| k.trim() == key)
            };
            let reference = |(k, v): &(String, String)| format!("{k}={v}") == text;
            let option = if args.reference.iter().any(reference) {
                "--reference"
            } else if args.vary.iter().any(varied) {
                "--vary"
            } else if given(&args.reference) {
                "--reference"
            } else if given(&args.set) {
                "--set"
            } else {
                "the reference's own"
            };
            finding.file = format!("{option} {text}");
        }
        out.push(finding);
    }
    out
}

/// Compares what is there and writes the results.
fn conclude(folder: &Path, plan: &Plan, time: Clock, json: bool) -> Result<ExitCode, Failure> {
    let results = Results::of_folder(folder, plan, time)?;
    for remark in &results.remarks {
        complain(format_args!("warning: {remark}"));
    }
    let table = Table::of(&results);
    let text = serde_json::to_string_pretty(&results).map_err(|e| Failure::Other(e.to_string()))?;
    whole(&folder.join("study.csv"), table.to_csv().as_bytes())?;
    whole(&folder.join("study.json"), (text + "\n").as_bytes())?;
    let page = report::render_study(&results);
    whole(&folder.join("study.html"), page.as_bytes())?;
    progress::tell(&results, folder, json)?;
    Ok(match results.missing() {
        0 => ExitCode::SUCCESS,
        _ => ExitCode::from(1),
    })
}

/// `selvedge study --document`
fn document(template: &Path, output: Option<&Path>) -> Result<ExitCode, Failure> {
    let Some(output) = output else {
        return Err(Failure::Usage(
            "--document needs -o with the name of the page".to_owned(),
        ));
    };
    let name = template.display().to_string();
    let text = std::fs::read_to_string(template)
        .map_err(|e| Failure::Usage(format!("cannot read `{name}`: {e}")))?;
    let folder = template.parent().unwrap_or(Path::new(""));
    let page = fill(&text, &name, folder)?;
    whole(output, page.as_bytes())?;
    Ok(ExitCode::SUCCESS)
}
