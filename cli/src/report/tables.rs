//! Tables and tiles of the page.

use std::fmt::Write as _;

use serde_json::Value;

use super::data::AssemblyStage;
use super::text::{bytes, count, duration, escape, length, number, percent};

/// A JSON number as `f64`.
fn num(v: &Value) -> Option<f64> {
    v.as_f64()
}

/// A count that may have been written as a float.
fn whole(v: &Value) -> Option<String> {
    v.as_u64().map(count).or_else(|| num(v).map(number))
}

/// A scalar JSON value as text.
fn plain(v: &Value) -> String {
    match v {
        Value::String(s) => s.clone(),
        Value::Null => "–".into(),
        Value::Bool(b) => if *b { "yes" } else { "no" }.into(),
        // Exactly as written: settings are to be copied.
        other => other.to_string(),
    }
}

/// Status badge and reason.
pub(super) fn status(summary: &Value) -> String {
    let status = summary["status"].as_str().unwrap_or("unknown");
    let class = match status {
        "converged" | "finished" => "good",
        "failed" => "bad",
        _ => "warn",
    };
    let reason = ["reason", "status_reason"].iter().find_map(|k| summary[k].as_str());
    format!(
        "<p class=\"status\"><span class=\"badge {class}\">{}</span> {}</p>\n",
        escape(status),
        escape(reason.unwrap_or("")),
    )
}

type Format = fn(&Value) -> Option<String>;

/// Keys of the summary shown as tiles: key, label, format.
const TILES: [(&str, &str, Format); 21] = [
    ("simulated_s", "simulated", |v| num(v).map(duration)),
    ("wall_s", "wall time", |v| num(v).map(duration)),
    ("cpu_s", "CPU time", |v| num(v).map(duration)),
    ("threads", "threads", whole),
    ("steps", "steps", whole),
    ("rejected_steps", "rejected steps", whole),
    ("newton_iterations", "Newton iterations", whole),
    ("linear_iterations", "linear iterations", whole),
    ("points", "points", whole),
    ("scalars", "scalars", whole),
    ("triangles", "triangles", whole),
    ("max_penetration_m", "max penetration", |v| num(v).map(length)),
    ("self_intersections", "self-intersections", whole),
    ("max_abs_edge_strain", "max |edge strain|", |v| num(v).map(percent)),
    ("mean_abs_edge_strain", "mean |edge strain|", |v| num(v).map(percent)),
    ("kinetic_energy_j", "kinetic energy", |v| num(v).map(|v| format!("{} J", number(v)))),
    ("residual", "residual", |v| num(v).map(number)),
    ("error_estimate", "error estimate", |v| num(v).map(number)),
    ("peak_memory_bytes", "peak memory", |v| num(v).map(bytes)),
    ("version", "version", |v| v.as_str().map(str::to_owned)),
    ("final_state_hash", "state hash", |v| v.as_str().map(|s| s.chars().take(12).collect())),
];

/// The summary's figures.
pub(super) fn tiles(summary: &Value) -> String {
    let mut out = String::from("<dl class=\"tiles\">\n");
    for (key, label, format) in TILES {
        if key == "scalars" && summary[key] == 0 {
            continue;
        }
        let Some(text) = format(&summary[key]) else { continue };
        let bad = key == "self_intersections" && num(&summary[key]).is_some_and(|v| v > 0.0);
        let _ = writeln!(
            out,
            "<div{}><dt>{label}</dt><dd>{}</dd></div>",
            if bad { " class=\"bad\"" } else { "" },
            escape(&text)
        );
    }
    out.push_str("</dl>\n");
    out
}

/// Summary entries that no other part of the page shows.
pub(super) fn further(summary: &Value) -> String {
    let elsewhere = ["status", "reason", "status_reason", "stages", "effects", "settings", "schema"];
    let Value::Object(map) = summary else { return String::new() };
    let mut rows = String::new();
    for (key, value) in map {
        let tile = TILES.iter().any(|(k, _, f)| k == key && f(value).is_some());
        let empty = value.is_null() || value.as_object().is_some_and(|m| m.is_empty());
        if !tile && !empty && !elsewhere.contains(&key.as_str()) {
            flatten(key, value, &mut |k, v| row(&mut rows, k, v));
        }
    }
    if rows.is_empty() {
        return String::new();
    }
    format!("<details class=\"card\"><summary>Further figures</summary><table class=\"keys\"><tbody>{rows}</tbody></table></details>\n")
}

fn row(rows: &mut String, key: &str, value: &str) {
    let _ = writeln!(rows, "<tr><th>{}</th><td>{}</td></tr>", escape(key), escape(value));
}

/// Calls `each` with the dotted path and text of every leaf.
fn flatten(path: &str, value: &Value, each: &mut dyn FnMut(&str, &str)) {
    let join = |k: &str| if path.is_empty() { k.to_owned() } else { format!("{path}.{k}") };
    match value {
        Value::Object(map) if !map.is_empty() => {
            for (k, v) in map {
                flatten(&join(k), v, each);
            }
        }
        Value::Array(list) if list.iter().any(|v| v.is_object() || v.is_array()) => {
            for (i, v) in list.iter().enumerate() {
                flatten(&format!("{path}[{i}]"), v, each);
            }
        }
        Value::Array(list) => {
            let text: Vec<String> = list.iter().map(plain).collect();
            each(path, &format!("[{}]", text.join(", ")));
        }
        other => each(path, &plain(other)),
    }
}

/// Rows that the settings show at most.
const SETTINGS: usize = 2000;

/// All settings, one card a top-level table.
pub(super) fn settings(settings: &Value) -> String {
    let Value::Object(map) = settings else { return String::new() };
    let (mut rows, mut alone, mut out) = (0, String::new(), String::new());
    for (key, value) in map {
        let mut table = String::new();
        let nested = value.is_object();
        flatten(if nested { "" } else { key }, value, &mut |k, v| {
            rows += 1;
            if rows <= SETTINGS {
                row(if nested { &mut table } else { &mut alone }, k, v);
            }
        });
        if !table.is_empty() {
            let _ = write!(out, "<section class=\"card\"><h3>{}</h3><table class=\"keys\"><tbody>{table}</tbody></table></section>\n", escape(key));
        }
    }
    if !alone.is_empty() {
        out = format!("<section class=\"card\"><h3>general</h3><table class=\"keys\"><tbody>{alone}</tbody></table></section>\n{out}");
    }
    if rows > SETTINGS {
        let _ = write!(out, "<p class=\"small\">{} further settings are in summary.json.</p>", rows - SETTINGS);
    }
    if out.is_empty() { out } else { format!("<div class=\"columns\">{out}</div>\n") }
}

/// Seconds of each stage of the solver, as bars.
pub(super) fn cost(summary: &Value) -> String {
    let Value::Object(map) = &summary["stages"] else { return String::new() };
    let mut stages: Vec<(&str, f64)> = map
        .iter()
        .filter_map(|(k, v)| num(v).filter(|s| s.is_finite() && *s >= 0.0).map(|s| (k.as_str(), s)))
        .collect();
    if stages.is_empty() {
        return String::new();
    }
    stages.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(b.0)));
    let sum: f64 = stages.iter().map(|s| s.1).sum();
    let peak = stages[0].1.max(f64::MIN_POSITIVE);
    let mut out = String::from("<table class=\"card bars\"><thead><tr><th>stage</th><th></th><th>time</th><th>share</th></tr></thead><tbody>\n");
    for (name, s) in &stages {
        let _ = writeln!(
            out,
            "<tr><th>{}</th><td class=\"track\"><i style=\"width:{:.2}%\"></i></td><td>{}</td><td>{}</td></tr>",
            escape(name),
            100.0 * s / peak,
            duration(*s),
            if sum > 0.0 { format!("{:.1} %", 100.0 * s / sum) } else { "–".into() },
        );
    }
    let _ = write!(out, "</tbody><tfoot><tr><th>sum</th><td>");
    if let Some(wall) = num(&summary["wall_s"]).filter(|w| *w > 0.0) {
        let _ = write!(out, "{:.1} % of the wall time", 100.0 * sum / wall);
    }
    let _ = write!(out, "</td><td>{}</td><td></td></tr></tfoot></table>\n", duration(sum));
    out
}

/// The effect ledger.
pub(super) fn effects(summary: &Value) -> String {
    let Some(list) = summary["effects"].as_array().filter(|l| !l.is_empty()) else {
        return String::new();
    };
    let mut out = String::from("<div class=\"card scroll\"><table class=\"ledger\"><thead><tr><th>effect</th><th></th><th>why</th><th class=\"n\">stencils</th><th class=\"n\">memory</th><th class=\"n\">time</th></tr></thead><tbody>\n");
    for e in list {
        let on = e["on"].as_bool().unwrap_or(false);
        let cell = |text: Option<String>| text.map_or_else(|| "–".into(), |t| escape(&t));
        let _ = writeln!(
            out,
            "<tr{}><th>{}</th><td><span class=\"badge {}\">{}</span></td><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td></tr>",
            if on { "" } else { " class=\"off\"" },
            escape(e["name"].as_str().unwrap_or("?")),
            if on { "good" } else { "none" },
            if on { "on" } else { "off" },
            escape(e["reason"].as_str().unwrap_or("")),
            cell(whole(&e["stencils"])),
            cell(num(&e["bytes"]).map(bytes)),
            cell(num(&e["seconds"]).map(duration)),
        );
    }
    out.push_str("</tbody></table></div>\n");
    out
}

/// Named stages of an assembly.
pub(super) fn assembly(stages: &[AssemblyStage]) -> String {
    if stages.is_empty() {
        return String::new();
    }
    let mut out = String::from("<div class=\"card scroll\"><table class=\"ledger\"><thead><tr><th>stage</th><th class=\"n\">duration</th><th class=\"n\">wall time</th><th class=\"n\">max strain</th><th class=\"n\">max penetration</th><th>remark</th></tr></thead><tbody>\n");
    let cell = |v: Option<f64>, f: fn(f64) -> String| v.filter(|v| v.is_finite()).map_or_else(|| "–".into(), f);
    for (i, s) in stages.iter().enumerate() {
        let _ = writeln!(
            out,
            "<tr><th><span class=\"step\">{}</span>{}</th><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td>{}</td></tr>",
            i + 1,
            escape(&s.name),
            duration(s.duration_s),
            duration(s.wall_s),
            cell(s.max_strain, percent),
            cell(s.max_penetration_m, length),
            escape(&s.note),
        );
    }
    let total = |f: fn(&AssemblyStage) -> f64| duration(stages.iter().map(f).sum());
    let _ = write!(
        out,
        "</tbody><tfoot><tr><th>sum</th><td class=\"n\">{}</td><td class=\"n\">{}</td><td></td><td></td><td></td></tr></tfoot></table></div>\n",
        total(|s| s.duration_s),
        total(|s| s.wall_s),
    );
    out
}

/// Warnings and remarks.
pub(super) fn notes(notes: &[String]) -> String {
    const SHOWN: usize = 100;
    if notes.is_empty() {
        return String::new();
    }
    let mut out = String::from("<aside class=\"card notes\"><h2>Warnings and remarks</h2><ul>\n");
    for n in notes.iter().take(SHOWN) {
        let _ = writeln!(out, "<li>{}</li>", escape(n));
    }
    if notes.len() > SHOWN {
        let _ = writeln!(out, "<li>and {} more</li>", notes.len() - SHOWN);
    }
    out.push_str("</ul></aside>\n");
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    /// The ledger, the cost and the settings show what the summary says, escaped.
    #[test]
    fn tables_show_the_summary() {
        let s = json!({
            "status": "stopped", "reason": "<time>", "wall_s": 4.0, "points": 10000,
            "self_intersections": 3, "new_figure": 7.5,
            "stages": { "linear solve": 3.0, "<x>": 0.5, "broken": "no" },
            "effects": [{ "name": "drag", "on": false, "reason": "α = 0" }, 5],
        });
        assert!(status(&s).contains("badge warn") && status(&s).contains("&lt;time&gt;"));
        assert!(tiles(&s).contains("10\u{2009}000") && tiles(&s).contains("class=\"bad\""));
        assert!(further(&s).contains("new_figure"));
        let cost = cost(&s);
        assert!(cost.contains("87.5 % of the wall time") && !cost.contains("<x>"), "{cost}");
        assert!(cost.find("linear solve") < cost.find("&lt;x&gt;"));
        assert!(effects(&s).contains("α = 0"));
        let t = settings(&json!({ "solver": { "tolerance": 1e-4, "list": [1, 2] }, "name": "<n>" }));
        assert!(t.contains("0.0001") && t.contains("[1, 2]") && t.contains("&lt;n&gt;"), "{t}");
    }

    /// Nothing at all is no table, not an error.
    #[test]
    fn absent_parts_are_empty() {
        for v in [Value::Null, json!({}), json!([]), json!({ "stages": {}, "effects": [] })] {
            assert!(cost(&v).is_empty() && effects(&v).is_empty() && further(&v).is_empty());
            assert!(settings(&v["settings"]).is_empty());
            assert!(tiles(&v).contains("tiles"));
        }
    }
}
