//! Leaves of JSON values as text and table rows.

use std::fmt::Write as _;

use serde_json::Value;

use super::text::{count, escape, number};

/// A JSON number as `f64`.
pub(super) fn num(v: &Value) -> Option<f64> {
    v.as_f64()
}

/// A count that may have been written as a float.
pub(super) fn whole(v: &Value) -> Option<String> {
    v.as_u64().map(count).or_else(|| num(v).map(number))
}

/// A scalar JSON value as text.
pub(super) fn plain(v: &Value) -> String {
    match v {
        Value::String(s) => s.clone(),
        Value::Null => "–".into(),
        Value::Bool(b) => if *b { "yes" } else { "no" }.into(),
        // Exactly as written: settings are to be copied.
        other => other.to_string(),
    }
}

/// Adds a row.
pub(super) fn row(rows: &mut String, key: &str, value: &str) {
    let _ = writeln!(
        rows,
        "<tr><th>{}</th><td>{}</td></tr>",
        escape(key),
        escape(value)
    );
}

/// Calls `each` with the dotted path and text of every leaf.
pub(super) fn flatten(path: &str, value: &Value, each: &mut dyn FnMut(&str, &str)) {
    let join = |k: &str| {
        if path.is_empty() {
            k.to_owned()
        } else {
            format!("{path}.{k}")
        }
    };
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
