use std::collections::BTreeMap;
use std::path::Path;
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;

use selvedge_hard::{Case, Expected, HardError, Pace, Report, Status, cases, find, modes};
use selvedge_scene::write_whole;

use crate::Failure;
use crate::args::HardArgs;
use crate::output::say;

/// `selvedge hard`
pub fn hard(args: &HardArgs, json: bool) -> Result<ExitCode, Failure> {
    let chosen = choose(args)?;
    if args.budget.is_nan() || args.budget <= 0.0 {
        return Err(Failure::Usage(format!(
            "--budget is {} s; it has to be greater than 0",
            args.budget
        )));
    }
    if args.list {
        return list(&chosen, json);
    }
    for file in args.report.iter().chain(&args.document) {
        writable(file)?;
    }
    let named = !args.cases.is_empty();
    let slow = named || args.slow || args.all;
    let mut results: BTreeMap<&str, Vec<Report>> = BTreeMap::new();
    let mut failed = false;
    if !json {
        say!("{:>3} {:<26} {:<8} {:>7}  figures", "no.", "case", "", "s")?;
    }
    let mut jobs: Vec<Job> = Vec::new();
    for case in &chosen {
        let skip = case.pace == Pace::Slow && !slow;
        jobs.push((case, "", (!skip).then(|| args.set.clone())));
        // Slow ones have their components changed only where all is asked for.
        let all = args.matrix && !skip && (case.pace == Pace::Quick || args.all);
        for mode in modes(case.axes).filter(|_| all) {
            let mut set = args.set.clone();
            set.extend(mode.overrides());
            jobs.push((case, mode.name, Some(set)));
        }
    }
    in_order(args.jobs, &jobs, args.budget, |mode, report| {
        failed |= report.status == Status::Fail;
        tell(&report, mode, json)?;
        results.entry(mode).or_default().push(report);
        Ok(())
    })?;
    let every = || results.values().flatten();
    let count = |s: Status| every().filter(|r| r.status == s).count();
    if !json {
        say!(
            "{} pass, {} fail, {} skipped",
            count(Status::Pass),
            count(Status::Fail),
            count(Status::Skipped)
        )?;
    }
    if let Some(path) = &args.report {
        let text = serde_json::to_string_pretty(&listed(&results)).unwrap_or_default() + "\n";
        write_whole(path, text.as_bytes())?;
    }
    if let Some(path) = &args.document {
        let page = selvedge_hard::markdown(&chosen, &results, &command());
        write_whole(path, page.as_bytes())?;
    }
    Ok(ExitCode::from(u8::from(failed)))
}

/// A case, the name of a mode, and the changed keys; `None` skips it.
type Job = (&'static Case, &'static str, Option<Vec<(String, String)>>);

/// Runs all jobs on `threads` threads and hands over the reports in order.
fn in_order(
    threads: usize,
    jobs: &[Job],
    budget: f64,
    mut take: impl FnMut(&'static str, Report) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let next = AtomicUsize::new(0);
    let (send, receive) = mpsc::channel();
    std::thread::scope(|scope| {
        for _ in 0..threads.clamp(1, jobs.len().max(1)) {
            let (send, next) = (send.clone(), &next);
            scope.spawn(move || {
                loop {
                    let k = next.fetch_add(1, Ordering::Relaxed);
                    let Some((case, _, set)) = jobs.get(k) else {
                        break;
                    };
                    let report = match set {
                        Some(set) => selvedge_hard::run(case, set, budget),
                        None => Report::skipped(case, "slow: run it by name, or with --slow"),
                    };
                    if send.send((k, report)).is_err() {
                        break;
                    }
                }
            });
        }
        drop(send);
        let mut waiting = BTreeMap::new();
        let mut due = 0;
        for (k, report) in receive {
            waiting.insert(k, report);
            while let Some(report) = waiting.remove(&due) {
                if let Err(e) = take(jobs[due].1, report) {
                    // Nobody listens any more: take no further case.
                    next.store(jobs.len(), Ordering::Relaxed);
                    return Err(e);
                }
                due += 1;
            }
        }
        Ok(())
    })
}

/// The reports as a list; those of a mode say which.
fn listed(results: &BTreeMap<&str, Vec<Report>>) -> serde_json::Value {
    let all = results.iter().flat_map(|(mode, reports)| {
        reports.iter().map(move |r| {
            let mut value = serde_json::to_value(r).unwrap_or_default();
            if !mode.is_empty() {
                value["mode"] = (*mode).into();
            }
            value
        })
    });
    all.collect()
}

/// The command that was given, as it can be given again.
fn command() -> String {
    let args = std::env::args().skip(1);
    let quoted = args.map(|a| if a.contains(' ') { format!("'{a}'") } else { a });
    format!("selvedge {}", quoted.collect::<Vec<_>>().join(" "))
}

fn choose(args: &HardArgs) -> Result<Vec<&'static Case>, Failure> {
    if args.cases.is_empty() {
        return Ok(cases::all().to_vec());
    }
    let found = args.cases.iter().map(|name| find(name));
    found
        .collect::<Result<Vec<_>, HardError>>()
        .map_err(|e| Failure::Usage(format!("{e} (`selvedge hard --list` has all)")))
}

/// Before minutes go into it.
fn writable(file: &Path) -> Result<(), Failure> {
    let folder = match file.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    if !folder.is_dir() || file.is_dir() {
        return Err(Failure::Usage(format!(
            "`{}` cannot be written: its folder does not exist, or it is one itself",
            file.display()
        )));
    }
    Ok(())
}

fn list(chosen: &[&Case], json: bool) -> Result<ExitCode, Failure> {
    for case in chosen {
        let bounds = case.bounds.iter().map(|b| match b.unit {
            "1" => format!("{} {}", b.figure, b.text()),
            unit => format!("{} {} {unit}", b.figure, b.text()),
        });
        let bounds: Vec<String> = bounds.collect();
        let note = match case.expected {
            Expected::Passes if case.pace == Pace::Slow => " (slow)".to_owned(),
            Expected::Passes => String::new(),
            Expected::Fails(why) => format!(" (fails: {why})"),
            Expected::NotYet(needs) => format!(" (not applicable yet: needs {needs})"),
        };
        if json {
            say!(
                "{}",
                serde_json::json!({
                    "case": case.name, "number": case.number, "setup": case.setup,
                    "naive": case.naive, "acceptance": bounds, "note": note.trim(),
                })
            )?;
            continue;
        }
        say!("{:>3} {}{note}", case.number, case.name)?;
        say!("    {}", case.setup)?;
        say!("    naive: {}", case.naive)?;
        say!("    accepted: {}", bounds.join("; "))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn tell(report: &Report, mode: &str, json: bool) -> Result<(), Failure> {
    if json {
        let mut value = serde_json::to_value(report).unwrap_or_default();
        value["event"] = "case".into();
        value["mode"] = mode.into();
        return say!("{value}");
    }
    let word = match report.status {
        Status::Pass => "pass",
        Status::Fail => "FAIL",
        Status::Skipped => "skipped",
    };
    let name = if mode.is_empty() {
        report.case.to_owned()
    } else {
        format!("  {mode}")
    };
    let figures = report.figures.iter().map(|f| {
        let mark = if f.holds { "" } else { "!" };
        let unit = if f.unit == "1" { "" } else { f.unit };
        let value = f.value.map_or("–".to_owned(), |v| format!("{v:.3e}"));
        format!("{mark}{} {value} {unit} ({})", f.name, f.bound).replace("  ", " ")
    });
    let text = match &report.note {
        Some(note) => note.replace('\n', " "),
        None => figures.collect::<Vec<_>>().join("; "),
    };
    say!(
        "{:>3} {name:<26} {word:<8} {:>7.2}  {text}",
        report.number,
        report.seconds
    )
}
