//! Defaults that depend on other values.

use std::path::Path;

use serde_json::{Map, Value as Json, json};

use super::locate::Locations;
use crate::diagnostic::Diagnostics;

/// Fills in what the keys describe as derived.
pub(crate) fn derive(
    tree: &mut Map<String, Json>,
    path: &Path,
    locations: &mut Locations,
    findings: &mut Diagnostics,
) {
    if !tree.contains_key("name") {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let name = if stem.is_empty() { "scene" } else { &*stem };
        tree.insert("name".into(), json!(name));
    }
    number_names(tree, "cloth");
    number_names(tree, "body");
    number_names(tree, "button");
    for (kind, key) in [
        ("pin", "cloth"),
        ("attachment", "cloth"),
        ("button", "cloth"),
        ("buttonhole", "cloth"),
        ("buttonhole", "button"),
        ("cut", "cloth"),
    ] {
        only_one(tree, kind, key, locations, findings);
    }
    let name = tree.get("name").and_then(Json::as_str).unwrap_or("scene");
    let directory = Path::new("out").join(name).display().to_string();
    set(tree, "output", "directory", || json!(directory));
    let read = |table: &str, key: &str| tree.get(table).and_then(|t| t.get(key)).cloned();
    let kinds = items(tree, "cloth").iter().filter_map(|c| c.get("kind"));
    let yarns = kinds
        .filter_map(Json::as_str)
        .any(|k| OF_YARNS.contains(&k));
    let max_step = read("integrator", "max_step").and_then(|s| s.as_f64());
    let norm = read("integrator", "residual_norm");
    let statics = read("integrator", "kind") == Some(json!("static"));
    let matrix_free = read("solver", "product") == Some(json!("matrix-free"));
    let cut = !items(tree, "cut").is_empty();
    set(tree, "topology", "changes", || json!(cut));
    set(tree, "relaxation", "enabled", || json!(!yarns && !statics));
    set(tree, "solver", "kind", || {
        json!(if statics && !matrix_free {
            "direct"
        } else {
            "cg"
        })
    });
    set(tree, "solver", "precision", || {
        json!(if statics { "f64" } else { "mixed" })
    });
    set(tree, "stop", "kinetic_energy", || {
        json!(if yarns { 1e-14 } else { 1e-8 })
    });
    set(tree, "integrator", "kind", || {
        json!(if yarns {
            "linearised-euler"
        } else {
            "backward-euler"
        })
    });
    set(tree, "integrator", "min_step", || {
        json!(max_step.unwrap_or(1e-3) / (1u32 << 20) as f64)
    });
    set(tree, "integrator", "newton_tolerance", || {
        json!(if norm == Some(json!("paper")) {
            1e-3
        } else {
            1e-2
        })
    });
}

/// Kinds of cloth that are made of yarns.
const OF_YARNS: [&str; 5] = ["knit", "woven", "knit-mesh", "knit-pattern", "woven-mesh"];

/// The name of the only cloth or button, for those that do not say which.
fn only_one(
    tree: &mut Map<String, Json>,
    kind: &str,
    key: &str,
    locations: &mut Locations,
    findings: &mut Diagnostics,
) {
    let known: Vec<Json> = items(tree, key)
        .iter()
        .filter_map(|c| c.get("name").cloned())
        .collect();
    let Some(Json::Array(list)) = tree.get_mut(kind) else {
        return;
    };
    for (i, item) in list.iter_mut().enumerate() {
        let Json::Object(item) = item else { continue };
        if item.contains_key(key) {
            continue;
        }
        let path = format!("{kind}.{i}.{key}");
        if let [only] = known.as_slice() {
            item.insert(key.into(), only.clone());
            continue;
        }
        // A scene without cloth is told so elsewhere.
        let told = known.is_empty() && key == "cloth";
        if !told && !locations.is_broken(&path) {
            let names: Vec<&str> = known.iter().filter_map(Json::as_str).collect();
            let message = format!(
                "`{kind}.{i}` does not say which of {} {key}s it belongs to",
                known.len()
            );
            findings.push(
                locations
                    .error("scene::missing-key", &path, message)
                    .help(format!("add `{key} = \"…\"`, one of {}", names.join(", "))),
            );
        }
        item.insert(key.into(), json!(""));
        locations.mark_broken(path);
    }
}

fn items<'t>(tree: &'t Map<String, Json>, key: &str) -> &'t [Json] {
    match tree.get(key) {
        Some(Json::Array(items)) => items,
        _ => &[],
    }
}

/// `cloth`, `cloth-1`, … for those without a name.
fn number_names(tree: &mut Map<String, Json>, kind: &str) {
    let Some(Json::Array(items)) = tree.get_mut(kind) else {
        return;
    };
    for (i, item) in items.iter_mut().enumerate() {
        if let Json::Object(item) = item
            && !item.contains_key("name")
        {
            let name = match i {
                0 => kind.to_owned(),
                _ => format!("{kind}-{i}"),
            };
            item.insert("name".into(), json!(name));
        }
    }
}

fn set(tree: &mut Map<String, Json>, table: &str, key: &str, value: impl FnOnce() -> Json) {
    if let Some(Json::Object(table)) = tree.get_mut(table)
        && !table.contains_key(key)
    {
        table.insert(key.into(), value());
    }
}
