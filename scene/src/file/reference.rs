use std::fmt::Write;

use super::keys::SCENE;
use super::schema::unit;
use super::spec::{Default, Key, Kind};

/// All keys of scene files with type, unit, default and meaning, as Markdown.
pub fn key_reference() -> String {
    let mut out = String::from(
        "# Scene files\n\n\
         A scene is a TOML file. Every key has a default unless it says *required*; all \
         quantities are in SI units, angles in degrees; `y` points up. Unknown keys, wrong types \
         and impossible values are errors that name file, line and column. Relative paths start \
         at the folder of the scene file. `--set path=value` on the command line overrides any \
         key: `--set solver.tolerance=1e-3 --set cloth.0.size='[1, 2]'`; items of lists go by \
         number or by `name`. `selvedge schema` prints the JSON schema for editors.\n\n\
         This page is generated from the program's own description of the keys.\n\n\
         ```toml\n\
         [simulation]\n\
         duration = 1.5\n\n\
         [[cloth]]\n\
         kind = \"sheet\"\n\
         size = [0.5, 0.5]\n\
         center = [0, 0.6, 0]\n\
         fabric = \"soft-denim\"\n\n\
         [fabric.soft-denim]\n\
         library = \"denim-12oz\"\n\
         bending = { warp = 3e-5, weft = 2e-5 }\n\n\
         [[body]]\n\
         kind = \"sphere\"\n\
         center = [0, 0.3, 0]\n\
         radius = 0.15\n\n\
         [[pin]]\n\
         select = { corner = \"top-left\" }\n\
         ```\n",
    );
    out.push_str("\n## Top level\n\n");
    rows(SCENE.keys.iter(), "", &mut out);
    for key in SCENE.keys {
        section(key, "", 2, &mut out);
    }
    out
}

/// The section of a key that holds tables, and those of the tables inside.
fn section(key: &Key, around: &str, level: usize, out: &mut String) {
    let (table, title) = match key.kind {
        Kind::Table(t) => (t, format!("{around}{}", key.name)),
        Kind::Tables(t) => (t, format!("{around}{}.N", key.name)),
        Kind::Named(t) => (t, format!("{around}{}.NAME", key.name)),
        _ => return,
    };
    let heading = match (key.kind, around) {
        (Kind::Tables(_), "") => format!("`[[{}]]`", key.name),
        (_, "") => format!("`[{title}]`"),
        _ => format!("`{title}`"),
    };
    let _ = write!(out, "\n{} {heading}\n\n", "#".repeat(level));
    let doc = if table.doc.is_empty() {
        key.doc
    } else {
        table.doc
    };
    let _ = write!(out, "{doc}\n\n");
    if !table.keys.is_empty() {
        rows(table.keys.iter(), "", out);
    }
    if let Some(variants) = &table.variants {
        for variant in variants.list {
            let default = if variants.default == Some(variant.name) {
                " (default)"
            } else {
                ""
            };
            let name = variant.name;
            let _ = write!(
                out,
                "\n**`{} = \"{name}\"`**{default}: {}\n",
                variants.tag, variant.doc
            );
            if !variant.keys.is_empty() {
                out.push('\n');
                rows(variant.keys.iter(), "", out);
            }
        }
    }
    // keyframes look the same everywhere: described once
    let inner = table.keys.iter().chain(
        table
            .variants
            .iter()
            .flat_map(|v| v.list)
            .flat_map(|v| v.keys),
    );
    for key in inner {
        let repeated = (key.name == "motion" && !title.starts_with("body"))
            || (key.name == "select" && !title.starts_with("pin"));
        if !repeated {
            section(key, &format!("{title}."), 3, out);
        }
    }
}

fn rows<'k>(keys: impl Iterator<Item = &'k Key>, prefix: &str, out: &mut String) {
    out.push_str("| key | type | unit | default | meaning |\n|---|---|---|---|---|\n");
    for key in keys {
        let default = match key.default {
            Default::Required => "*required*".to_owned(),
            Default::Absent => "–".to_owned(),
            Default::Json("{}") if matches!(key.kind, Kind::Table(_)) => "see below".to_owned(),
            Default::Json(text) => format!("`{text}`"),
            Default::Derived(text) => text.to_owned(),
        };
        let (kind, names) = kind(&key.kind);
        let _ = writeln!(
            out,
            "| `{prefix}{}` | {kind} | {} | {default} | {}{names} |",
            key.name,
            unit(&key.kind),
            key.doc,
        );
    }
}

fn kind(kind: &Kind) -> (String, String) {
    let plain = |text: &str| (text.to_owned(), String::new());
    match kind {
        Kind::Bool => plain("true or false"),
        Kind::Text => plain("text"),
        Kind::Path => plain("path"),
        Kind::Integer { min, max } if *max == i64::MAX => plain(&format!("whole number ≥ {min}")),
        Kind::Integer { min, max } => plain(&format!("whole number {min} to {max}")),
        Kind::Number { range, .. } => match range.describe().as_str() {
            "finite" => plain("number"),
            words => plain(&format!("number {words}")),
        },
        Kind::Vector { len, range, .. } => match range.describe().as_str() {
            "finite" => plain(&format!("{len} numbers")),
            words => plain(&format!("{len} numbers, each {words}")),
        },
        Kind::Integers { len, min, max } => {
            plain(&format!("{len} whole numbers, each {min} to {max}"))
        }
        Kind::Indices => plain("list of whole numbers"),
        Kind::Texts => plain("list of texts"),
        Kind::Choice(names) => {
            let list: Vec<String> = names
                .iter()
                .map(|(name, doc)| format!("`{name}`: {doc}"))
                .collect();
            ("name".to_owned(), format!(" {}.", list.join("; ")))
        }
        Kind::Switch => plain("`true`, `false` or `\"auto\"`"),
        Kind::Rotation => plain("`[x, y, z]` Euler angles or `{ axis, angle }`"),
        Kind::Table(_) => plain("table"),
        Kind::Tables(_) => plain("list of tables"),
        Kind::Named(_) => plain("tables by name"),
        Kind::NamedTexts => plain("texts by name"),
        Kind::NamedIntegers { max } => plain(&format!("whole numbers 0 to {max} by name")),
    }
}
