//! The page of a study: one HTML file that needs no network.

use std::fmt::Write as _;

use selvedge_study::{Clock, Measure, Results, Row, least};

use super::page::STYLE;
use super::study_plot::{by_setting, pareto};
use super::text::{bytes, count, duration, escape, length, number, percent};

/// What the report's style does not have.
const MORE: &str = "\
svg .below { fill: var(--soft); opacity: 0.09; } circle.behind { opacity: 0.55; }\n\
circle.best { fill: none; stroke: var(--c1); stroke-width: 2.4; } .whisker { stroke: var(--soft); stroke-width: 1.4; fill: none; }\n\
circle:hover { stroke: var(--ink); stroke-width: 2; }\n\
.legend i.dot { width: 9px; height: 9px; border: 0; border-radius: 50%; background: var(--c); vertical-align: 0; }\n\
.legend i.ring { width: 13px; height: 13px; border: 2.4px solid var(--c1); border-radius: 50%; vertical-align: -2px; }\n\
.runs td, .runs th { white-space: nowrap; padding-right: 16px; } .runs th[data-k] { cursor: pointer; } .runs th[data-k]:hover { color: var(--accent); }\n\
.runs tr.best th, .runs tr.best td { font-weight: 620; } .runs pre { margin: 4px 0 0; white-space: pre-wrap; overflow-wrap: anywhere; max-width: 60em; }\n\
.runs details { white-space: normal; } .runs summary { font-weight: 400; color: var(--accent); } .preset pre { white-space: pre-wrap; overflow-wrap: anywhere; }\n";

/// Sorts the table by a column; without scripts it stays in the order of the plan.
const SCRIPT: &str = "for (const table of document.querySelectorAll('.runs')) {\n\
  for (const head of table.querySelectorAll('th[data-k]')) head.addEventListener('click', () => {\n\
    const body = table.tBodies[0], k = +head.dataset.k, up = head.dataset.up !== '1';\n\
    head.dataset.up = up ? '1' : '0';\n\
    const key = row => { const v = row.cells[k].dataset.v ?? row.cells[k].textContent, x = parseFloat(v); return isNaN(x) ? v : x; };\n\
    const order = (a, b) => typeof a === typeof b ? (a < b ? -1 : a > b ? 1 : 0) : typeof a === 'number' ? -1 : 1;\n\
    [...body.rows].sort((a, b) => (up ? 1 : -1) * order(key(a), key(b))).forEach(row => body.append(row));\n\
  });\n}\n";

/// The whole page. A content security policy in it forbids every request.
pub fn render_study(r: &Results) -> String {
    let clock = match r.time {
        Clock::Wall => "wall time",
        Clock::Cpu => "processor time",
    };
    let title = escape(&r.name);
    let mut out = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n\
         <link rel=\"icon\" href=\"data:,\">\n\
         <title>{title} – selvedge study</title>\n<style>\n{STYLE}{MORE}</style>\n</head>\n<body>\n\
         <header>\n<p class=\"brand\">selvedge study</p>\n<h1>{title}</h1>\n"
    );
    head(&mut out, r);
    out.push_str("</header>\n<main>\n");
    let parts = [
        ("pareto", "Accuracy against time", pareto(r, clock)),
        ("preset", "Recommended preset", preset(r, clock)),
        (
            "settings",
            "Every setting",
            format!("<div class=\"plots\">{}</div>\n", by_setting(r, clock)),
        ),
        ("runs", "All runs", table(r)),
        ("how", "How to read this", notes(r, clock)),
    ];
    for (id, name, html) in parts {
        let _ = write!(
            out,
            "<section id=\"{id}\">\n<h2>{name}</h2>\n{html}</section>\n"
        );
    }
    let _ = write!(
        out,
        "</main>\n<script>\n{SCRIPT}</script>\n</body>\n</html>\n"
    );
    out
}

fn head(out: &mut String, r: &Results) {
    let failed = r.rows.iter().filter(|row| row.status == "failed").count();
    let missing = r.missing();
    let (class, word) = match (missing, failed) {
        (0, 0) => ("good", "complete"),
        (0, _) => ("warn", "complete, some runs failed"),
        _ => ("warn", "incomplete"),
    };
    let _ = writeln!(
        out,
        "<p class=\"status\"><span class=\"badge {class}\">{word}</span> {}</p>",
        escape(&r.description)
    );
    let mut tiles = vec![
        ("scene", escape(file_name(&r.scene))),
        ("runs", count(r.rows.len() as u64)),
    ];
    if failed > 0 {
        tiles.push(("failed", count(failed as u64)));
    }
    if missing > 0 {
        tiles.push(("missing", count(missing as u64)));
    }
    let reference = r.reference.figures.as_ref();
    tiles.push((
        "points of the mesh",
        count(reference.map_or(0, |f| f.points as u64)),
    ));
    tiles.push((
        "repeatability floor",
        match r.floor {
            Some(_) => length(r.floor_m()),
            None => "not measured".to_owned(),
        },
    ));
    let seconds = |row: &Row| row.seconds(r.time);
    tiles.push((
        "reference",
        seconds(&r.reference).map_or("–".to_owned(), duration),
    ));
    if let Some(best) = &r.recommended {
        let row = &r.rows[best.row];
        tiles.push(("recommended", seconds(row).map_or("–".to_owned(), duration)));
        tiles.push((
            "its distance",
            row.error(r.measure).map_or("–".to_owned(), length),
        ));
    }
    out.push_str("<dl class=\"tiles\">");
    for (name, value) in tiles {
        let _ = write!(out, "<div><dt>{name}</dt><dd>{value}</dd></div>");
    }
    out.push_str("</dl>\n");
    if !r.remarks.is_empty() {
        out.push_str("<div class=\"card notes\"><h2>Left out</h2><ul>");
        for remark in &r.remarks {
            let _ = write!(out, "<li>{}</li>", escape(remark));
        }
        out.push_str("</ul></div>\n");
    }
}

/// The last part of a path.
fn file_name(path: &str) -> &str {
    path.rsplit('/').next().unwrap_or(path)
}

fn preset(r: &Results, clock: &str) -> String {
    let Some(best) = &r.recommended else {
        return "<p class=\"card\">No run has both a time and a distance.</p>\n".to_owned();
    };
    let row = &r.rows[best.row];
    let mut keys = String::new();
    for (key, value) in r.keys.iter().zip(&row.settings) {
        let _ = write!(
            keys,
            "<tr><th>{}</th><td>{}</td></tr>",
            escape(key),
            escape(value)
        );
    }
    let floor = if row.within_floor {
        ", within the floor"
    } else {
        ""
    };
    format!(
        "<div class=\"card preset\"><p>{} from the reference{floor}, {} of {clock}: {}.</p>\
         <table class=\"keys\"><tbody>{keys}</tbody></table><pre>{}</pre></div>\n",
        row.error(r.measure).map_or("–".to_owned(), length),
        row.seconds(r.time).map_or("–".to_owned(), duration),
        escape(&best.reason),
        escape(&row.command)
    )
}

/// A cell: what it says and what it is sorted by.
struct Cell {
    text: String,
    value: f64,
}

fn cell(value: Option<f64>, show: impl Fn(f64) -> String) -> Cell {
    Cell {
        text: value.map_or_else(|| "–".to_owned(), show),
        value: value.unwrap_or(f64::NAN),
    }
}

fn figures(row: &Row) -> Vec<(&'static str, Cell)> {
    let f = row.figures.as_ref();
    let d = row.distances;
    let v = d.and_then(|d| d.vertices);
    let whole = |x: f64| count(x as u64);
    let of = |pick: fn(&selvedge_study::Figures) -> f64| f.map(pick);
    vec![
        ("wall, median", cell(row.seconds(Clock::Wall), duration)),
        (
            "wall, least",
            cell(f.and_then(|f| least(&f.wall_s)), duration),
        ),
        ("processor, median", cell(row.seconds(Clock::Cpu), duration)),
        (
            "processor, least",
            cell(f.and_then(|f| least(&f.cpu_s)), duration),
        ),
        ("mean distance", cell(v.map(|v| v.mean_m), length)),
        ("95 %", cell(v.map(|v| v.p95_m), length)),
        ("largest", cell(v.map(|v| v.max_m), length)),
        (
            "mean of surfaces",
            cell(d.map(|d| d.surface_mean_m), length),
        ),
        ("Hausdorff", cell(d.map(|d| d.hausdorff_m), length)),
        ("steps", cell(of(|f| f.steps as f64), whole)),
        ("rejected", cell(of(|f| f.rejected_steps as f64), whole)),
        ("Newton", cell(of(|f| f.newton_iterations as f64), whole)),
        ("linear", cell(of(|f| f.linear_iterations as f64), whole)),
        (
            "intersections",
            cell(of(|f| f.self_intersections as f64), whole),
        ),
        ("penetration", cell(of(|f| f.max_penetration_m), length)),
        ("stretch 1 %", cell(of(|f| f.stretch.p1 - 1.0), percent)),
        ("50 %", cell(of(|f| f.stretch.p50 - 1.0), percent)),
        ("99 %", cell(of(|f| f.stretch.p99 - 1.0), percent)),
        (
            "Δ energy",
            cell(energy(row), |e| format!("{} J", number(e))),
        ),
        ("memory", cell(of(|f| f.simulation_bytes as f64), bytes)),
    ]
}

/// Sum of the differences of all energies [J].
fn energy(row: &Row) -> Option<f64> {
    let e = &row.energy_differences_j;
    (!e.is_empty()).then(|| e.values().sum())
}

fn table(r: &Results) -> String {
    let mut heads: Vec<String> = vec!["run".to_owned()];
    heads.extend(
        r.keys
            .iter()
            .map(|k| k.rsplit('.').next().unwrap_or(k).to_owned()),
    );
    heads.push("status".to_owned());
    heads.extend(figures(&r.reference).into_iter().map(|f| f.0.to_owned()));
    heads.push("command".to_owned());
    let mut out = String::from("<div class=\"card scroll\"><table class=\"runs\"><thead><tr>");
    for (i, head) in heads.iter().enumerate() {
        let class = if i > r.keys.len() + 1 && i + 1 < heads.len() {
            " class=\"n\""
        } else {
            ""
        };
        let _ = write!(out, "<th data-k=\"{i}\"{class}>{}</th>", escape(head));
    }
    out.push_str("</tr></thead><tbody>\n");
    let best = r.recommended.as_ref().map(|b| b.row);
    let others = [&r.reference]
        .into_iter()
        .chain(&r.floor_runs)
        .map(|row| (None, row));
    let points = r.rows.iter().enumerate().map(|(i, row)| (Some(i), row));
    for (index, row) in points.chain(others) {
        let role = match index {
            None if row.role == "floor" => "displaced".to_owned(),
            None => row.role.clone(),
            Some(i) => (i + 1).to_string(),
        };
        let class = if index.is_some() && index == best {
            " class=\"best\""
        } else {
            ""
        };
        let _ = write!(out, "<tr{class}><th>{}</th>", escape(&role));
        for k in 0..r.keys.len() {
            let value = row.settings.get(k).map_or("", String::as_str);
            let _ = write!(out, "<td>{}</td>", escape(value));
        }
        let front = index.is_some_and(|i| r.front.contains(&i));
        let (badge, word) = match row.status.as_str() {
            "failed" => ("bad", "failed"),
            "missing" => ("none", "missing"),
            _ if index.is_none() => ("none", "–"),
            _ if index == best => ("good", "recommended"),
            _ if front => ("good", "front"),
            _ if row.within_floor => ("none", "within floor"),
            other => ("none", other),
        };
        let _ = write!(
            out,
            "<td title=\"{}\"><span class=\"badge {badge}\">{}</span></td>",
            escape(&row.reason),
            escape(word)
        );
        for (_, c) in figures(row) {
            let _ = write!(
                out,
                "<td class=\"n\" data-v=\"{:e}\">{}</td>",
                c.value,
                escape(&c.text)
            );
        }
        let _ = writeln!(
            out,
            "<td><details><summary>show</summary><pre>{}</pre></details></td></tr>",
            escape(&row.command)
        );
    }
    out.push_str("</tbody></table></div>\n");
    for row in r.rows.iter().filter(|row| row.status == "failed") {
        let _ = writeln!(
            out,
            "<p class=\"small\">{} failed: {}</p>",
            escape(&row.settings.join(", ")),
            escape(&row.reason)
        );
    }
    out
}

fn notes(r: &Results, clock: &str) -> String {
    let measure = match r.measure {
        Measure::Vertices => "mean distance between points of equal index at the end of the runs",
        Measure::Surfaces => {
            "mean distance of the surfaces at the end of the runs, since their meshes differ"
        }
    };
    let mut reference = String::new();
    for (key, value) in &r.reference_settings {
        let _ = write!(
            reference,
            "<tr><th>{}</th><td>{}</td></tr>",
            escape(key),
            escape(value)
        );
    }
    let floor = match r.floor {
        Some(f) => format!(
            "The floor is the largest distance between any two of {} runs of the reference whose starts \
             differ by 10⁻⁹ m: mean {}, 95 % {}, largest {}, Hausdorff {}. A run closer to the reference than \
             this is as good as it, never better, and runs whose distances differ by no more are not told apart: \
             each run of the front is more accurate by more than the floor than the one before it, and where \
             only one is left, the fastest, it is recommended.",
            f.runs,
            length(f.mean_m),
            length(f.p95_m),
            length(f.max_m),
            length(f.hausdorff_m)
        ),
        None => "The floor was not measured.".to_owned(),
    };
    format!(
        "<div class=\"card\"><p>Distance: {measure}. Time: {clock} of the stepping, the median of the \
         repetitions; whiskers reach from the least to the largest. Memory: heap of the simulation \
         itself; the peak of the process is in study.csv where each run had its own.</p><p>{floor}</p><p>The reference differs from the scene in:</p>\
         <table class=\"keys\"><tbody>{reference}</tbody></table><pre>{}</pre>\
         <p class=\"small\">selvedge {}</p></div>\n",
        escape(&r.reference.command),
        escape(&r.version)
    )
}
