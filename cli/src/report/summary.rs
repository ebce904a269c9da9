//! The head of the page: status, figures, remarks.

use std::fmt::Write as _;

use serde_json::Value;

use super::leaves::{flatten, num, plain, row, whole};
use super::text::{bytes, duration, escape, length, number, percent};

/// Status badge and reason.
pub(super) fn status(summary: &Value) -> String {
    let status = summary["status"].as_str().unwrap_or("unknown");
    let class = match status {
        "converged" | "finished" => "good",
        "failed" => "bad",
        _ => "warn",
    };
    let reason = ["reason", "status_reason"]
        .iter()
        .find_map(|k| summary[k].as_str());
    format!(
        "<p class=\"status\"><span class=\"badge {class}\">{}</span> {}</p>\n",
        escape(status),
        escape(reason.unwrap_or("")),
    )
}

/// Program version and hash of the final state.
pub(super) fn origin(summary: &Value) -> String {
    let entries = [("version", "selvedge"), ("final_state_hash", "final state")];
    let texts: Vec<String> = entries
        .iter()
        .filter_map(|(k, label)| {
            summary[k]
                .as_str()
                .map(|v| format!("{label} {}", escape(v)))
        })
        .collect();
    format!("<p class=\"small\">{}</p>\n", texts.join(" · "))
}

/// What an error estimate is made of, and the settings chosen for a wanted error.
pub(super) fn estimates(summary: &Value) -> String {
    let report = &summary["error"];
    if !report.is_object() {
        return String::new();
    }
    let known = |v: &Value| num(v).map_or("not known".to_owned(), length);
    let mut rows = String::new();
    for (key, label) in [
        ("space", "mesh"),
        ("time", "steps"),
        ("algebraic", "tolerances"),
        ("path", "path"),
    ] {
        let part = &report[key];
        let how = part["how"].as_str().unwrap_or("");
        row(
            &mut rows,
            label,
            &format!("{} · {how}", known(&part["error_m"])),
        );
    }
    let total = &summary["error_estimate"];
    row(&mut rows, "in all", &known(total));
    if let Some(target) = num(&report["target_m"]) {
        let met = num(total).is_some_and(|t| t <= target);
        let within = if met { "within" } else { "not within" };
        let text = format!("{}: {within} it", length(target));
        row(&mut rows, "asked for", &text);
    }
    let list = |key: &str| report[key].as_array().map_or(&[][..], Vec::as_slice);
    for chosen in list("decisions") {
        let setting = chosen["setting"].as_str().unwrap_or("");
        let why = chosen["why"].as_str().unwrap_or("");
        let text = format!("{} · {why}", plain(&chosen["value"]));
        row(&mut rows, setting, &text);
    }
    for measured in list("effectivity") {
        let case = measured["case"].as_str().unwrap_or("");
        if let Some(value) = num(&measured["value"]) {
            let text = format!(
                "{} of the error, where that is known exactly",
                number(value)
            );
            row(&mut rows, &format!("such an estimate of a {case}"), &text);
        }
    }
    format!("<table class=\"card keys\"><tbody>{rows}</tbody></table>\n")
}

type Format = fn(&Value) -> Option<String>;

/// Keys of the summary shown as tiles: key, label, format.
const TILES: [(&str, &str, Format); 22] = [
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
    ("max_penetration_m", "max penetration", |v| {
        num(v).map(length)
    }),
    ("max_seam_gap_m", "max seam gap", |v| num(v).map(length)),
    ("self_intersections", "self-intersections", whole),
    ("max_drop_m", "max drop", |v| num(v).map(length)),
    ("max_abs_edge_strain", "max |edge strain|", |v| {
        num(v).map(percent)
    }),
    ("mean_abs_edge_strain", "mean |edge strain|", |v| {
        num(v).map(percent)
    }),
    ("kinetic_energy_j", "kinetic energy", |v| {
        num(v).map(|v| format!("{} J", number(v)))
    }),
    ("residual", "residual", |v| num(v).map(number)),
    ("error_estimate", "error estimate", |v| num(v).map(length)),
    ("simulation_bytes", "simulation memory", |v| {
        num(v).map(bytes)
    }),
    ("peak_memory_bytes", "peak memory", |v| num(v).map(bytes)),
];

/// The summary's figures.
pub(super) fn tiles(summary: &Value) -> String {
    let mut out = String::from("<dl class=\"tiles\">\n");
    for (key, label, format) in TILES {
        if key == "scalars" && summary[key] == 0 {
            continue;
        }
        let Some(text) = format(&summary[key]) else {
            continue;
        };
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
    let elsewhere = [
        "status",
        "reason",
        "status_reason",
        "stages",
        "effects",
        "settings",
        "schema",
        "version",
        "final_state_hash",
        "error",
        "error_estimate",
        "assembly",
        "defects",
        "warnings",
    ];
    let Value::Object(map) = summary else {
        return String::new();
    };
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
    format!(
        "<details class=\"card\"><summary>Further figures</summary><table class=\"keys\"><tbody>{rows}</tbody></table></details>\n"
    )
}

/// Warnings and remarks.
pub(super) fn notes(notes: &[String], summary: &Value) -> String {
    const SHOWN: usize = 100;
    let told = summary["warnings"]
        .as_array()
        .map_or(&[][..], Vec::as_slice);
    let mut all: Vec<&str> = notes.iter().map(String::as_str).collect();
    for warning in told.iter().filter_map(Value::as_str) {
        if !all.contains(&warning) {
            all.push(warning);
        }
    }
    if all.is_empty() {
        return String::new();
    }
    let mut out = String::from("<aside class=\"card notes\"><h2>Warnings and remarks</h2><ul>\n");
    for n in all.iter().take(SHOWN) {
        let _ = writeln!(out, "<li>{}</li>", escape(n));
    }
    if all.len() > SHOWN {
        let _ = writeln!(out, "<li>and {} more</li>", all.len() - SHOWN);
    }
    out.push_str("</ul></aside>\n");
    out
}
