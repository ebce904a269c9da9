use serde_json::{Map, Value as Json, json};

use super::keys::SCENE;
use super::spec::{Default, Key, Kind, Range, Table};

/// JSON schema (draft 2020-12) of scene files, for editors.
pub fn json_schema() -> Json {
    let mut schema = table(&SCENE);
    if let Json::Object(root) = &mut schema {
        root.insert(
            "$schema".into(),
            json!("https://json-schema.org/draft/2020-12/schema"),
        );
        root.insert("title".into(), json!("Selvedge scene"));
    }
    schema
}

fn table(spec: &Table) -> Json {
    let Some(variants) = &spec.variants else {
        let mut schema = object(spec.keys.iter(), None, spec.doc);
        if spec.exactly_one {
            schema["minProperties"] = json!(1);
            schema["maxProperties"] = json!(1);
        }
        return schema;
    };
    let forms: Vec<Json> = variants
        .list
        .iter()
        .map(|variant| {
            let needed = variants.default != Some(variant.name);
            let tag = Some((variants.tag, variant.name, needed));
            object(spec.keys.iter().chain(variant.keys), tag, variant.doc)
        })
        .collect();
    json!({ "description": spec.doc, "oneOf": forms })
}

fn object<'k>(
    keys: impl Iterator<Item = &'k Key>,
    tag: Option<(&str, &str, bool)>,
    doc: &str,
) -> Json {
    let mut properties = Map::new();
    let mut required = Vec::new();
    if let Some((tag, name, needed)) = tag {
        properties.insert(tag.to_owned(), json!({ "const": name, "description": doc }));
        if needed {
            required.push(json!(tag));
        }
    }
    for key in keys {
        let mut schema = kind(&key.kind);
        if let Json::Object(schema) = &mut schema {
            let unit = unit(&key.kind);
            let doc = if unit.is_empty() {
                key.doc.to_owned()
            } else {
                format!("{} Unit: {unit}.", key.doc)
            };
            schema.insert("description".into(), json!(doc));
            if let Default::Json(text) = key.default
                && let Ok(default) = serde_json::from_str::<Json>(text)
            {
                schema.insert("default".into(), default);
            }
        }
        if let Default::Required = key.default {
            required.push(json!(key.name));
        }
        properties.insert(key.name.to_owned(), schema);
    }
    let mut schema = json!({
        "type": "object",
        "properties": properties,
        "additionalProperties": false,
    });
    if !doc.is_empty() {
        schema["description"] = json!(doc);
    }
    if !required.is_empty() {
        schema["required"] = Json::Array(required);
    }
    schema
}

fn kind(kind: &Kind) -> Json {
    match kind {
        Kind::Bool => json!({ "type": "boolean" }),
        Kind::Text | Kind::Path => json!({ "type": "string" }),
        Kind::Integer { min, max } => {
            json!({ "type": "integer", "minimum": min, "maximum": max })
        }
        Kind::Number { range, .. } => number(range),
        Kind::Vector { len, range, .. } => list(number(range), Some(*len)),
        Kind::Integers { len, min, max } => list(
            json!({ "type": "integer", "minimum": min, "maximum": max }),
            Some(*len),
        ),
        Kind::Indices => list(json!({ "type": "integer", "minimum": 0 }), None),
        Kind::Texts => list(json!({ "type": "string" }), None),
        Kind::Choice(names) => {
            let names: Vec<&str> = names.iter().map(|(n, _)| *n).collect();
            json!({ "enum": names })
        }
        Kind::Switch => json!({ "enum": ["auto", true, false] }),
        Kind::Rotation => {
            let three = list(json!({ "type": "number" }), Some(3));
            let axis_angle = json!({
                "type": "object",
                "properties": { "axis": three, "angle": { "type": "number" } },
                "required": ["axis", "angle"],
                "additionalProperties": false,
            });
            json!({ "oneOf": [three, axis_angle] })
        }
        Kind::Table(spec) => table(spec),
        Kind::Tables(spec) => list(table(spec), None),
        Kind::Named(spec) => json!({ "type": "object", "additionalProperties": table(spec) }),
        Kind::NamedTexts => {
            json!({ "type": "object", "additionalProperties": { "type": "string" } })
        }
        Kind::NamedIntegers { max } => {
            let inner = json!({ "type": "integer", "minimum": 0, "maximum": max });
            json!({ "type": "object", "additionalProperties": inner })
        }
    }
}

fn list(items: Json, len: Option<usize>) -> Json {
    match len {
        Some(n) => json!({ "type": "array", "items": items, "minItems": n, "maxItems": n }),
        None => json!({ "type": "array", "items": items }),
    }
}

fn number(range: &Range) -> Json {
    let mut schema = json!({ "type": "number" });
    if range.min.is_finite() {
        let word = if range.open_min {
            "exclusiveMinimum"
        } else {
            "minimum"
        };
        schema[word] = json!(range.min);
    }
    if range.max.is_finite() {
        let word = if range.open_max {
            "exclusiveMaximum"
        } else {
            "maximum"
        };
        schema[word] = json!(range.max);
    }
    schema
}

/// Unit of a key, "" when it has none.
pub(super) fn unit(kind: &Kind) -> &'static str {
    match kind {
        Kind::Number { unit, .. } | Kind::Vector { unit, .. } => unit,
        Kind::Rotation => "deg",
        _ => "",
    }
}
