use std::collections::BTreeMap;
use std::path::Path;
use std::process::ExitCode;

use selvedge_hard::{Case, Expected, HardError, Pace, Report, Status, cases, find, modes};
use selvedge_scene::write_whole;

use crate::Failure;
use crate::args::HardArgs;
use crate::output::say;

/// `selvedge hard`
pub fn hard(args: &HardArgs, json: bool) -> Result<ExitCode, Failure> {
    let chosen = choose(args)?;
    if !(args.budget > 0.0) {
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
    for case in &chosen {
        let skip = case.pace == Pace::Slow && !slow;
        let mut one = |mode: &'static str, set: Vec<(String, String)>| -> Result<(), Failure> {
            let report = if skip {
                Report::skipped(case, "slow: run it by name, or with --slow")
            } else {
                selvedge_hard::run(case, &set, args.budget)
            };
            failed |= report.status == Status::Fail;
            tell(&report, mode, json)?;
            results.entry(mode).or_default().push(report);
            Ok(())
        };
        one("", args.set.clone())?;
        let all = args.matrix && !skip;
        for mode in modes(case.axes).filter(|_| all) {
            let mut set = args.set.clone();
            set.extend(mode.overrides());
            one(mode.name, set)?;
        }
    }
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
