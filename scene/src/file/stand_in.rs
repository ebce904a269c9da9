//! Values that stand in for what a scene should have said.

use serde_json::{Map, Value as Json, json};

use super::spec::{Default, Key, Kind, Range};

/// `key = …` as it would be written.
pub(crate) fn example(key: &Key) -> String {
    let value = match key.kind {
        Kind::Bool | Kind::Switch => "true".to_owned(),
        Kind::Text | Kind::Path => "\"…\"".to_owned(),
        Kind::Choice(names) => format!("\"{}\"", names.first().map_or("…", |(n, _)| *n)),
        Kind::Vector { len, .. } | Kind::Integers { len, .. } => {
            format!("[{}]", vec!["…"; len].join(", "))
        }
        Kind::Indices | Kind::Texts | Kind::Tables(_) => "[…]".to_owned(),
        Kind::Table(_) | Kind::Named(_) | Kind::NamedTexts | Kind::NamedIntegers { .. } => {
            "{ … }".to_owned()
        }
        Kind::Rotation => "[0, 0, 0]".to_owned(),
        Kind::Integer { .. } | Kind::Number { .. } => "…".to_owned(),
    };
    format!("`{} = {value}`", key.name)
}

/// Something of the right type for a key whose value is refused.
pub(crate) fn placeholder(kind: &Kind) -> Json {
    let inside = |range: &Range| {
        if range.contains(1.0) {
            1.0
        } else {
            0.5 * (range.min.max(-1.0) + range.max.min(1.0))
        }
    };
    match kind {
        Kind::Bool | Kind::Switch => json!(true),
        Kind::Text | Kind::Path => json!(""),
        Kind::Integer { min, .. } => json!(min),
        Kind::Number { range, .. } => json!(inside(range)),
        Kind::Vector { len, range, .. } => json!(vec![inside(range); *len]),
        Kind::Integers { len, min, .. } => json!(vec![*min; *len]),
        Kind::Indices | Kind::Texts | Kind::Tables(_) => json!([]),
        Kind::Choice(names) => json!(names.first().map(|(n, _)| *n)),
        Kind::Rotation => json!([0.0, 0.0, 0.0]),
        Kind::Named(_) | Kind::NamedTexts | Kind::NamedIntegers { .. } => json!({}),
        Kind::Table(table) if table.exactly_one => {
            let first = table.keys.first();
            json!({ first.map_or("", |k| k.name): first.map(|k| placeholder(&k.kind)) })
        }
        Kind::Table(table) => {
            let mut out = Map::new();
            let tag = table
                .variants
                .as_ref()
                .and_then(|v| Some((v.tag, v.list.first()?)));
            if let Some((tag, first)) = tag {
                out.insert(tag.to_owned(), json!(first.name));
            }
            let more = tag.map_or(&[][..], |(_, first)| first.keys);
            for key in table.keys.iter().chain(more) {
                match key.default {
                    Default::Absent | Default::Derived(_) => {}
                    _ => {
                        out.insert(key.name.to_owned(), placeholder(&key.kind));
                    }
                }
            }
            Json::Object(out)
        }
    }
}
