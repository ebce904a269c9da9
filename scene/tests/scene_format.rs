//! The description of the keys, the schema, the reference and the structs agree;
//! damaged scenes are refused without a panic.

use std::path::Path;

use proptest::prelude::*;
use selvedge_scene::file::{self, json_schema, key_reference};
use serde_json::Value;

const SHEET: &str = "[[cloth]]\nkind = \"sheet\"\n";

fn parse(text: &str) -> file::Parsed {
    file::parse(text, Path::new("s.toml"), &[]).unwrap_or_else(|e| panic!("{e}"))
}

/// `docs/scene-file.md` is what the program says; `SELVEDGE_WRITE_DOCS=1` writes it.
#[test]
fn documentation_is_current() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/scene-file.md");
    let reference = key_reference();
    if std::env::var_os("SELVEDGE_WRITE_DOCS").is_some() {
        std::fs::write(path, &reference).unwrap();
    }
    let written = std::fs::read_to_string(path).unwrap_or_default();
    assert!(
        written == reference,
        "{path} is out of date: run this test with SELVEDGE_WRITE_DOCS=1"
    );
}

/// The example of the reference is a valid scene.
#[test]
fn documented_example_reads() {
    let reference = key_reference();
    let example = reference
        .split("```toml\n")
        .nth(1)
        .unwrap()
        .split("```")
        .next()
        .unwrap();
    let parsed = parse(example);
    assert!(parsed.warnings.is_empty(), "{}", parsed.warnings);
    assert_eq!(
        parsed
            .scene
            .fabric_named("soft-denim")
            .unwrap()
            .bending
            .warp,
        3e-5
    );
}

/// Every key of the settings tables that has a default has a field that holds
/// it, and every field is a key.
#[test]
fn structs_hold_what_the_keys_describe() {
    let schema = json_schema();
    let scene = serde_json::to_value(parse(SHEET).scene).unwrap();
    let properties = schema["properties"].as_object().unwrap();
    for (name, key) in properties {
        let Some(keys) = key["properties"].as_object() else {
            assert!(scene.get(name).is_some(), "{name}");
            continue;
        };
        let fields = scene[name].as_object().unwrap();
        for (field, value) in fields {
            let default = keys
                .get(field)
                .unwrap_or_else(|| panic!("{name}.{field} is no key"))
                .get("default");
            if let Some(default) = default {
                same(value, default, &format!("{name}.{field}"));
            }
        }
        for key in keys.keys() {
            let optional = [
                "drag",
                "membrane",
                "bending",
                "friction",
                "part_crossed",
                "body_faces",
                "point_tolerance",
            ]
            .contains(&key.as_str());
            assert!(
                optional || fields.contains_key(key),
                "{name}.{key} is no field"
            );
        }
    }
    assert_eq!(scene.as_object().unwrap().len(), properties.len());
}

fn same(a: &Value, b: &Value, what: &str) {
    match (a, b) {
        (Value::Number(a), Value::Number(b)) => assert_eq!(a.as_f64(), b.as_f64(), "{what}"),
        (Value::Array(a), Value::Array(b)) => {
            assert_eq!(a.len(), b.len(), "{what}");
            for (a, b) in a.iter().zip(b) {
                same(a, b, what);
            }
        }
        _ => assert_eq!(a, b, "{what}"),
    }
}

/// A value that a schema takes, with all keys or only the required ones.
fn instance(schema: &Value, all: bool, form: usize) -> Value {
    if let Some(value) = schema.get("const") {
        return value.clone();
    }
    if let Some(names) = schema["enum"].as_array() {
        return names[form % names.len()].clone();
    }
    if let Some(forms) = schema["oneOf"].as_array() {
        return instance(&forms[form % forms.len()], all, form);
    }
    match schema["type"].as_str().unwrap_or("") {
        "boolean" => Value::Bool(true),
        "string" => schema
            .get("default")
            .cloned()
            .unwrap_or_else(|| "linen".into()),
        "integer" => schema["minimum"].clone(),
        "number" => {
            let low = schema.get("minimum").or(schema.get("exclusiveMinimum"));
            let high = schema.get("maximum").or(schema.get("exclusiveMaximum"));
            let bound = |b: Option<&Value>, or: f64| b.and_then(Value::as_f64).unwrap_or(or);
            let (low, high) = (bound(low, -1.0).max(-1.0), bound(high, 1.0).min(1.0));
            schema
                .get("default")
                .cloned()
                .unwrap_or_else(|| (0.25 * low + 0.75 * high).into())
        }
        "array" => {
            let count = schema["minItems"].as_u64().unwrap_or(u64::from(all));
            let item = instance(&schema["items"], all, form);
            Value::Array(vec![item; count as usize])
        }
        _ => {
            let mut out = serde_json::Map::new();
            let required = schema["required"].as_array().cloned().unwrap_or_default();
            let mut most = schema["maxProperties"].as_u64().unwrap_or(u64::MAX);
            for (name, inner) in schema["properties"].as_object().into_iter().flatten() {
                let needed = required.contains(&name.as_str().into());
                let wanted = needed || all || schema["minProperties"] == 1;
                if wanted && most > 0 {
                    most -= 1;
                    out.insert(name.clone(), instance(inner, all, form));
                }
            }
            if all && schema["additionalProperties"].is_object() {
                let inner = instance(&schema["additionalProperties"], all, form);
                out.insert("mine".into(), inner);
            }
            Value::Object(out)
        }
    }
}

/// What the schema allows, the reader understands: instances of every form of
/// every table have no unknown key, wrong type or value out of range.
#[test]
fn schema_and_reader_agree() {
    let schema = json_schema();
    for all in [false, true] {
        for form in 0..8 {
            let mut scene = instance(&schema, all, form);
            // the sheet keeps the semantic checks about cloth quiet
            scene["cloth"] = serde_json::json!([{ "kind": "sheet", "fabric": "linen" }]);
            scene["name"] = "x".into();
            let toml = toml::to_string(&scene).unwrap();
            let Err(findings) = file::parse(&toml, Path::new("s.toml"), &[]) else {
                continue;
            };
            for finding in findings.findings() {
                let formal = ["unknown-key", "type", "missing-key", "syntax", "internal"];
                let bad = formal.iter().any(|c| finding.code.ends_with(c))
                    || finding.message.contains("out of range");
                // fabrics may need a base: semantics
                let semantic = finding.message.contains("lacks");
                assert!(!bad || semantic, "{finding}\n{toml}");
            }
        }
    }
}

const SCENE: &str = r#"name = "fuzz"
[simulation]
duration = 1.5
[[cloth]]
kind = "sheet"
size = [0.5, 0.5]
points = [11, 11]
fabric = "mine"
rotation = { axis = [1, 0, 0], angle = 90 }
[fabric.mine]
library = "linen"
membrane = { form = "moduli", warp = 900.0, bias = 50 }
[[body]]
kind = "union"
shapes = [{ kind = "sphere", radius = 0.1 }, { kind = "box", size = [1, 1, 1] }]
motion = [{ time = 0 }, { time = 1, translation = [0, 1, 0] }]
[[pin]]
kind = "plane"
normal = [0, 1, 0]
select = { points = [0, 1] }
[contact]
self = "auto"
"#;

const PIECES: &[&str] = &[
    "[",
    "]",
    "{",
    "}",
    "=",
    ",",
    "\"",
    ".",
    "\n",
    "nan",
    "-inf",
    "1e400",
    "-1",
    "0",
    "true",
    "[[cloth]]\n",
    "[[pin]]\n",
    "kind = \"mesh\"\n",
    "\"\"",
    "[]",
    "{}",
    "2026-01-01",
    "é",
    "\0",
    "9223372036854775808",
    "0x1F",
    "select = {}\n",
    "motion = [[]]\n",
    "'''",
    "#",
];

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Cut, doubled and spliced scenes and arbitrary overrides give findings or
    /// a scene with finite values, never a panic.
    #[test]
    fn never_panics(
        from in 0usize..700,
        len in 0usize..40,
        at in 0usize..700,
        pieces in prop::collection::vec(0usize..PIECES.len(), 0..4),
        key in "[a-z.0-9]{0,12}|cloth\\.0\\.[a-z]{0,8}|(solver|pin\\.0|fabric\\.mine)\\.(kind|tolerance|select|motion)",
        value in "[a-z0-9\\[\\]{}=., \"-]{0,12}",
        with_override in any::<bool>(),
    ) {
        let mut text = SCENE.to_owned();
        let clamp = |text: &str, i: usize| {
            let mut i = i.min(text.len());
            while !text.is_char_boundary(i) { i -= 1; }
            i
        };
        let (a, b) = (clamp(&text, from), clamp(&text, from + len));
        text.replace_range(a..b, "");
        let splice: String = pieces.iter().map(|i| PIECES[*i]).collect();
        let place = clamp(&text, at);
        text.insert_str(place, &splice);
        let set = if with_override { vec![(key, value)] } else { Vec::new() };
        match file::parse(&text, Path::new("f.toml"), &set) {
            Ok(parsed) => {
                prop_assert!(!parsed.warnings.has_errors());
                let flat = parsed.scene.effective();
                prop_assert!(flat.as_object().is_some_and(|f| f.values().all(|v| !v.is_null())));
            }
            Err(findings) => {
                prop_assert!(findings.has_errors());
                for finding in findings.findings() {
                    prop_assert!(finding.code != "scene::internal", "{finding}");
                    prop_assert!(!finding.to_string().contains('\n'));
                }
                let _ = findings.render(80, false);
            }
        }
    }
}
