use std::collections::BTreeMap;
use std::fmt::Write;

use crate::case::Expected;
use crate::{Case, Report, Status, matrix, modes};

/// The document of a run over the matrix: cases with their figures, then every
/// case with every choice of components. `results` are the reports by mode
/// name, with the defaults under the empty name; `command` is what made it.
pub fn markdown(cases: &[&Case], results: &BTreeMap<&str, Vec<Report>>, command: &str) -> String {
    let mut out = String::new();
    let defaults = results.get("").map(Vec::as_slice).unwrap_or_default();
    let by =
        |reports: &[Report], case: &Case| reports.iter().find(|r| r.case == case.name).cloned();
    let count = |s: Status| defaults.iter().filter(|r| r.status == s).count();
    let _ = write!(
        out,
        "# Robustness\n\nWhat breaks cloth simulators, and what it does to this one. Every case \
         has a set-up, the failure of a naive code and an acceptance in figures; what fails stays \
         listed with the figure that was measured. Cases from 49 on are our own.\n\nThis page is \
         written by the program:\n\n```sh\n{command}\n```\n\nWith default components: {} pass, \
         {} fail, {} were not run, of {}.\n\n",
        count(Status::Pass),
        count(Status::Fail),
        count(Status::Skipped),
        cases.len()
    );
    out += "## Cases\n\n| no. | case | set-up | naive failure | figures (acceptance) | | s |\n";
    out += "|---|---|---|---|---|---|---|\n";
    for case in cases {
        let report = by(defaults, case);
        let figures = report.as_ref().map(figures).unwrap_or_default();
        let _ = writeln!(
            out,
            "| {} | `{}` | {} | {} | {} | {} | {} |",
            case.number,
            case.name,
            case.setup,
            case.naive,
            figures,
            report.as_ref().map_or("", |r| word(r.status)),
            report
                .as_ref()
                .filter(|r| r.status != Status::Skipped)
                .map_or(String::new(), |r| format!("{:.1}", r.seconds)),
        );
    }
    out += "\n## What fails, and why\n\n";
    for case in cases {
        let failed = by(defaults, case).is_some_and(|r| r.status == Status::Fail);
        match case.expected {
            Expected::Fails(why) => {
                let _ = writeln!(out, "- `{}`: {why}.", case.name);
            }
            Expected::NotYet(needs) => {
                let _ = writeln!(out, "- `{}`: not applicable yet; needs {needs}.", case.name);
            }
            Expected::Passes if failed => {
                let _ = writeln!(out, "- `{}`: was expected to pass.", case.name);
            }
            Expected::Passes => {}
        }
    }
    out += "\n## Cases by component\n\nOne component changed at a time; everything else as by \
            default. A dash: the case does not depend on it, or was not run; n/a: the case \
            has unknowns that the component does not take (arc lengths of yarns).\n\n| case | default";
    for mode in matrix::all() {
        let _ = write!(out, " | {}", mode.name);
    }
    out += " |\n|---|---";
    out += &"|---".repeat(matrix::all().len());
    out += "|\n";
    for case in cases.iter().filter(|c| modes(c.axes).next().is_some()) {
        let _ = write!(out, "| `{}`", case.name);
        for mode in std::iter::once(None).chain(matrix::all().iter().map(Some)) {
            let name = mode.map_or("", |m| m.name);
            let report = results.get(name).and_then(|r| by(r, case));
            let text = match report {
                _ if mode.is_some_and(|m| !m.applies(case.axes)) => "n/a",
                Some(r) if r.status != Status::Skipped => word(r.status),
                _ => "–",
            };
            let _ = write!(out, " | {text}");
        }
        out += " |\n";
    }
    out += "\n| component | settings |\n|---|---|\n";
    for mode in matrix::all() {
        let set = mode.set.iter().map(|(k, v)| format!("`{k} = {v}`"));
        let set: Vec<String> = set.collect();
        let _ = writeln!(out, "| {} | {} |", mode.name, set.join(", "));
    }
    let unexpected = failures(cases, results);
    if !unexpected.is_empty() {
        out += "\n## Failures with single components\n\n";
        out += &unexpected;
    }
    out
}

/// What fails with one component where it passes by default, with its figures.
fn failures(cases: &[&Case], results: &BTreeMap<&str, Vec<Report>>) -> String {
    let mut out = String::new();
    let passes = |case: &Case| {
        let mut all = results.get("").into_iter().flatten();
        all.any(|r| r.case == case.name && r.status == Status::Pass)
    };
    for case in cases.iter().filter(|c| passes(c)) {
        for mode in matrix::all() {
            let reports = results.get(mode.name).into_iter().flatten();
            for r in reports.filter(|r| r.case == case.name && r.status == Status::Fail) {
                let _ = writeln!(out, "- `{}`, {}: {}", case.name, mode.name, broken(r));
            }
        }
    }
    out
}

fn broken(r: &Report) -> String {
    let bad: Vec<String> = r
        .figures
        .iter()
        .filter(|f| !f.holds && r.note.is_none())
        .map(|f| format!("{} {} ({})", f.name, value(f.value, f.unit), f.bound))
        .collect();
    r.note.clone().unwrap_or_else(|| bad.join("; "))
}

fn figures(r: &Report) -> String {
    if let Some(note) = &r.note {
        return note.replace('|', "/").replace('\n', " ");
    }
    let all = r.figures.iter().map(|f| {
        let wrong = if f.holds { "" } else { "**" };
        let bound = if f.bound == "told" {
            String::new()
        } else {
            format!(" ({})", f.bound)
        };
        format!(
            "{wrong}{}: {}{wrong}{bound}",
            f.name,
            value(f.value, f.unit)
        )
    });
    all.collect::<Vec<_>>().join("; ")
}

/// A figure with its unit, three digits.
pub(crate) fn value(value: Option<f64>, unit: &str) -> String {
    let Some(v) = value else {
        return "not measured".to_owned();
    };
    let number = if v == v.round() && v.abs() < 1e6 {
        format!("{v}")
    } else {
        format!("{v:.3e}")
    };
    if unit == "1" {
        number
    } else {
        format!("{number} {unit}")
    }
}

fn word(status: Status) -> &'static str {
    match status {
        Status::Pass => "pass",
        Status::Fail => "**fail**",
        Status::Skipped => "not run",
    }
}
