//! Tables of the page: effects, cost, assembly, settings.

use std::fmt::Write as _;

use serde_json::Value;

use super::data::AssemblyStage;
use super::leaves::{flatten, num, row, whole};
use super::text::{bytes, duration, escape, length, minus, percent};

/// Rows that the settings show at most.
const SETTINGS: usize = 2000;

/// All settings, one card a top-level table.
pub(super) fn settings(settings: &Value) -> String {
    let Value::Object(map) = settings else {
        return String::new();
    };
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
            let _ = writeln!(
                out,
                "<section class=\"card\"><h3>{}</h3><table class=\"keys\"><tbody>{table}</tbody></table></section>",
                escape(key)
            );
        }
    }
    if !alone.is_empty() {
        out = format!(
            "<section class=\"card\"><h3>general</h3><table class=\"keys\"><tbody>{alone}</tbody></table></section>\n{out}"
        );
    }
    if rows > SETTINGS {
        let _ = write!(
            out,
            "<p class=\"small\">{} further settings are in summary.json.</p>",
            rows - SETTINGS
        );
    }
    if out.is_empty() {
        out
    } else {
        format!("<div class=\"columns\">{out}</div>\n")
    }
}

/// Where the result is not as it should be.
pub(super) fn defects(summary: &Value) -> String {
    let list = summary["defects"].as_array();
    let mut rows = String::new();
    for d in list.into_iter().flatten().filter(|d| d.is_object()) {
        let texts = |v: &Value, one: &dyn Fn(&Value) -> Option<String>| {
            let all = v.as_array().into_iter().flatten().filter_map(one);
            all.collect::<Vec<_>>().join(", ")
        };
        let place = texts(&d["at"], &|x| num(x).map(|x| minus(&format!("{x:.4}"))));
        let parts = texts(&d["parts"], &|p| p.as_str().map(str::to_owned));
        let _ = writeln!(
            rows,
            "<tr><th>{}</th><td>{}</td><td class=\"n\">{place}</td><td class=\"n\">{}</td></tr>",
            escape(d["kind"].as_str().unwrap_or("?")),
            escape(&parts),
            num(&d["depth_m"]).map_or_else(|| "–".into(), length),
        );
    }
    if rows.is_empty() {
        return rows;
    }
    format!(
        "<details class=\"card scroll\" open><summary>Defects</summary><table class=\"ledger\"><thead><tr><th>kind</th><th>parts</th><th class=\"n\">at (x, y, z) [m]</th><th class=\"n\">depth</th></tr></thead><tbody>\n{rows}</tbody></table></details>\n"
    )
}

/// Seconds of each stage of the solver, as bars.
pub(super) fn cost(summary: &Value) -> String {
    let Value::Object(map) = &summary["stages"] else {
        return String::new();
    };
    let mut stages: Vec<(&str, f64)> = map
        .iter()
        .filter_map(|(k, v)| {
            num(v)
                .filter(|s| s.is_finite() && *s >= 0.0)
                .map(|s| (k.as_str(), s))
        })
        .collect();
    if stages.is_empty() {
        return String::new();
    }
    stages.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(b.0)));
    let sum: f64 = stages.iter().map(|s| s.1).sum();
    let peak = stages[0].1.max(f64::MIN_POSITIVE);
    let mut out = String::from(
        "<table class=\"card bars\"><thead><tr><th>stage</th><th></th><th>time</th><th>share</th></tr></thead><tbody>\n",
    );
    for (name, s) in &stages {
        let _ = writeln!(
            out,
            "<tr><th>{}</th><td class=\"track\"><i style=\"width:{:.2}%\"></i></td><td>{}</td><td>{}</td></tr>",
            escape(name),
            100.0 * s / peak,
            duration(*s),
            if sum > 0.0 {
                format!("{:.1} %", 100.0 * s / sum)
            } else {
                "–".into()
            },
        );
    }
    let _ = write!(out, "</tbody><tfoot><tr><th>sum</th><td>");
    if let Some(wall) = num(&summary["wall_s"]).filter(|w| *w > 0.0) {
        let _ = write!(out, "{:.1} % of the wall time", 100.0 * sum / wall);
    }
    let _ = writeln!(
        out,
        "</td><td>{}</td><td></td></tr></tfoot></table>",
        duration(sum)
    );
    out
}

/// The effect ledger.
pub(super) fn effects(summary: &Value) -> String {
    let Some(list) = summary["effects"].as_array().filter(|l| !l.is_empty()) else {
        return String::new();
    };
    let mut out = String::from(
        "<div class=\"card scroll\"><table class=\"ledger\"><thead><tr><th>effect</th><th></th><th>why</th><th class=\"n\">stencils</th><th class=\"n\">memory</th><th class=\"n\">time</th></tr></thead><tbody>\n",
    );
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

/// The assembly's stages as the summary tells them.
fn stages_of(summary: &Value) -> Vec<AssemblyStage> {
    let list = summary["assembly"]
        .as_array()
        .map_or(&[][..], Vec::as_slice);
    let text = |v: &Value| v.as_str().unwrap_or_default().to_owned();
    list.iter()
        .map(|s| AssemblyStage {
            name: text(&s["name"]),
            duration_s: num(&s["simulated_s"]).unwrap_or(f64::NAN),
            wall_s: num(&s["wall_s"]).unwrap_or(f64::NAN),
            max_strain: num(&s["max_abs_edge_strain"]),
            max_penetration_m: num(&s["max_penetration_m"]),
            note: match s["self_intersections"].as_u64() {
                Some(n) => format!("{}; {n} self-intersections", text(&s["what"])),
                None => text(&s["what"]),
            },
        })
        .collect()
}

/// Named stages of an assembly.
pub(super) fn assembly(stages: &[AssemblyStage], summary: &Value) -> String {
    let told;
    let stages = if stages.is_empty() {
        told = stages_of(summary);
        &told[..]
    } else {
        stages
    };
    if stages.is_empty() {
        return String::new();
    }
    let mut out = String::from(
        "<div class=\"card scroll\"><table class=\"ledger\"><thead><tr><th>stage</th><th class=\"n\">duration</th><th class=\"n\">wall time</th><th class=\"n\">max strain</th><th class=\"n\">max penetration</th><th>remark</th></tr></thead><tbody>\n",
    );
    let cell = |v: Option<f64>, f: fn(f64) -> String| {
        v.filter(|v| v.is_finite()).map_or_else(|| "–".into(), f)
    };
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
    let _ = writeln!(
        out,
        "</tbody><tfoot><tr><th>sum</th><td class=\"n\">{}</td><td class=\"n\">{}</td><td></td><td></td><td></td></tr></tfoot></table></div>",
        total(|s| s.duration_s),
        total(|s| s.wall_s),
    );
    out
}

#[cfg(test)]
mod tests {
    use super::super::summary::{further, status, tiles};
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
        assert!(
            cost.contains("87.5 % of the wall time") && !cost.contains("<x>"),
            "{cost}"
        );
        assert!(cost.find("linear solve") < cost.find("&lt;x&gt;"));
        assert!(effects(&s).contains("α = 0"));
        let t =
            settings(&json!({ "solver": { "tolerance": 1e-4, "list": [1, 2] }, "name": "<n>" }));
        assert!(
            t.contains("0.0001") && t.contains("[1, 2]") && t.contains("&lt;n&gt;"),
            "{t}"
        );
    }

    /// Defects are listed with their place; a garment's drop is a figure.
    #[test]
    fn defects_are_listed() {
        let s = json!({
            "max_drop_m": 0.012,
            "defects": [
                { "kind": "penetration", "at": [0.1, -0.25, 1.0], "parts": ["<front>"], "depth_m": 0.002 },
                { "kind": "self-intersection", "at": [0.0, 0.5, 0.0], "parts": ["a", "b"], "depth_m": null },
                7,
            ],
        });
        let table = defects(&s);
        assert!(
            table.contains("&lt;front&gt;") && table.contains("a, b"),
            "{table}"
        );
        assert!(table.contains("0.1000, −0.2500, 1.0000"), "{table}");
        assert!(table.contains("2 mm"), "{table}");
        assert_eq!(table.matches("<tr><th>").count(), 3, "{table}");
        assert!(tiles(&s).contains("max drop") && further(&s).is_empty());
    }

    /// Nothing at all is no table, not an error.
    #[test]
    fn absent_parts_are_empty() {
        for v in [
            Value::Null,
            json!({}),
            json!([]),
            json!({ "stages": {}, "effects": [], "defects": [] }),
        ] {
            assert!(assembly(&[], &v).is_empty() && defects(&v).is_empty());
            assert!(cost(&v).is_empty() && effects(&v).is_empty() && further(&v).is_empty());
            assert!(settings(&v["settings"]).is_empty());
            assert!(tiles(&v).contains("tiles"));
        }
    }
}
