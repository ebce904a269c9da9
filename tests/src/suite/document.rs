//! The page of all validations.

use std::fmt::Write;

use super::{Case, Finding, Judged, Ladder, Measured};

/// The page: one table of every quantity, then each case with its text and
/// ladders. `results` are the cases with what they measured and their seconds;
/// `command` is what made it.
pub fn markdown(results: &[(Case, Measured, f64)], command: &str) -> String {
    let mut out = String::new();
    let all = || results.iter().flat_map(|(_, m, _)| &m.ladders);
    let missed = all().filter(|l| !l.finding().holds).count();
    let seconds: f64 = results.iter().map(|(_, _, s)| s).sum();
    let _ = write!(
        out,
        "# Validation\n\nThe shell engine against closed forms: every quantity on ladders of \
         meshes and steps, with the order that is seen and the error that is left. What misses \
         its limit stays in the table with its figure.\n\nThis page is written by the \
         program:\n\n```sh\n{command}\n```\n\n{} quantities in {} cases, {missed} missed. \
         {seconds:.0} s of wall time in the dev profile.\n\n",
        all().count(),
        results.len(),
    );
    out += INTRODUCTION;
    out += "\n## Results\n\n| case | quantity | exact | found | order | error | limit | |\n\
            |---|---|---|---|---|---|---|---|\n";
    for (case, measured, _) in results {
        for ladder in &measured.ladders {
            let f = ladder.finding();
            let _ = writeln!(
                out,
                "| [{}](#{}) | {} | {} | {} | {} | {} | {} | {} |",
                case.name,
                anchor(case.title),
                ladder.quantity,
                number(ladder.exact),
                judged(ladder, &f),
                order(&f),
                percent(f.error),
                percent(ladder.limit).trim_start_matches('+'),
                if f.holds { "met" } else { "**missed**" },
            );
        }
    }
    for (case, measured, seconds) in results {
        let _ = write!(
            out,
            "\n## {}\n\n{}\n\n```text\n{}\n```\n\nSource: {}. Time: {seconds:.1} s.\n",
            case.title, case.text, case.formula, case.source
        );
        for ladder in &measured.ladders {
            table(&mut out, ladder);
        }
        if !measured.details.is_empty() {
            out += "\n";
            out += &measured.details;
        }
    }
    out
}

const INTRODUCTION: &str = "\
Exact values are computed by the program from the formulas below, not read from tables. Errors are \
relative to the exact value, or to the size named in the text where that is zero. The order is \
fitted to the three finest rungs without use of the exact value; a dash means that they differ by \
round-off alone or do not approach each other steadily. Where there is an order, the value is \
extrapolated to size zero [Richardson1911] with that order, but none below 1 or above that of the \
scheme (2 in the mesh, 1 in the step), and where a case is judged by its extrapolated value the \
finest one takes its place otherwise. \"Found\" is the value that is judged: extrapolated (e), \
finest (f) or the worst of all rungs (w).
";

fn table(out: &mut String, ladder: &Ladder) {
    let f = ladder.finding();
    let _ = write!(
        out,
        "\n**{}**, exact {}:\n\n| {} |",
        ladder.quantity,
        number(ladder.exact),
        ladder.refined
    );
    let mut line = |head: &str, cells: Vec<String>| {
        let _ = write!(out, "{head}");
        for cell in cells {
            let _ = write!(out, " {cell} |");
        }
        *out += "\n";
    };
    let each = |f: &dyn Fn(&super::Rung) -> String| ladder.rungs.iter().map(f).collect::<Vec<_>>();
    let with = |mut cells: Vec<String>, last: String| {
        cells.push(last);
        cells
    };
    line("", with(each(&|r| r.label.clone()), "extrapolated".into()));
    line("| --- |", vec!["---".into(); ladder.rungs.len() + 1]);
    let limit = f.extrapolated;
    line(
        "| value |",
        with(each(&|r| number(r.value)), limit.map_or("–".into(), number)),
    );
    line(
        "| error |",
        with(
            each(&|r| percent(ladder.error(r.value))),
            limit.map_or("–".into(), |v| percent(ladder.error(v))),
        ),
    );
}

fn judged(ladder: &Ladder, f: &Finding) -> String {
    let finest = ladder.rungs.last().map_or(f64::NAN, |r| r.value);
    match (ladder.judged, f.extrapolated) {
        (Judged::Extrapolated, Some(value)) => format!("{} (e)", number(value)),
        (Judged::Extrapolated | Judged::Finest, _) => format!("{} (f)", number(finest)),
        (Judged::Every, _) => format!("{} (w)", number(ladder.exact + f.error * ladder.scale)),
    }
}

fn order(f: &Finding) -> String {
    f.order.map_or("–".into(), |p| format!("{p:.2}"))
}

/// A number with seven digits at most.
fn number(x: f64) -> String {
    if x == 0.0 {
        return "0".into();
    }
    if !(1e-3..1e5).contains(&x.abs()) {
        return format!("{x:.3e}");
    }
    let digits = (5 - x.abs().log10().floor() as i32).max(0) as usize;
    format!("{x:.digits$}")
}

fn percent(error: f64) -> String {
    let p = 100.0 * error;
    if p == 0.0 {
        "0 %".into()
    } else if p.abs() < 1e-3 {
        format!("{p:+.1e} %")
    } else {
        let digits = (1 - p.abs().log10().floor() as i32).clamp(0, 4) as usize;
        format!("{p:+.digits$} %")
    }
}

/// Anchor of a heading.
fn anchor(title: &str) -> String {
    let kept = title
        .chars()
        .filter(|c| c.is_alphanumeric() || " -".contains(*c));
    kept.collect::<String>().to_lowercase().replace(' ', "-")
}
