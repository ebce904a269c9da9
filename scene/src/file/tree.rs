//! The scene file as an owned tree in which every key and value knows where it
//! stands, with `--set` overrides merged in.

use std::ops::Range;

use toml::de::{DeTable, DeValue};

use crate::diagnostic::{Finding, SourceText};

/// Where something stands: which text, which bytes of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Place {
    /// 0 is the file, `1 + i` the `i`-th override.
    pub source: usize,
    pub span: Range<usize>,
}

/// A value with its place.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    pub value: Value,
    pub place: Place,
    /// Text of an override that is also acceptable as a plain string.
    pub raw: Option<String>,
}

#[derive(Clone, Debug)]
pub(crate) enum Value {
    Text(String),
    Integer(i64),
    Number(f64),
    Bool(bool),
    List(Vec<Node>),
    Table(Vec<Entry>),
    /// Something that no key takes: a date, or a number that does not fit.
    Other(String),
}

/// A key of a table with its value.
#[derive(Clone, Debug)]
pub(crate) struct Entry {
    pub key: String,
    pub place: Place,
    pub node: Node,
}

impl Value {
    /// What it is, for "found …".
    pub fn describe(&self) -> String {
        match self {
            Value::Text(s) => format!("the string {s:?}"),
            Value::Integer(i) => format!("the number {i}"),
            Value::Number(x) => format!("the number {x:?}"),
            Value::Bool(b) => format!("the word {b}"),
            Value::List(items) => format!("a list of {}", items.len()),
            Value::Table(_) => "a table".to_owned(),
            Value::Other(what) => what.clone(),
        }
    }
}

impl Node {
    pub fn from_toml(value: &toml::Spanned<DeValue<'_>>, source: usize, shift: usize) -> Self {
        let span = value.span();
        let place = Place {
            source,
            span: span.start + shift..span.end + shift,
        };
        let value = match value.get_ref() {
            DeValue::String(s) => Value::Text(s.clone().into_owned()),
            DeValue::Integer(i) => match i64::from_str_radix(i.as_str(), i.radix()) {
                Ok(i) => Value::Integer(i),
                Err(_) => Value::Other(format!("the number {i}, too large")),
            },
            DeValue::Float(x) => match x.as_str().parse() {
                Ok(x) => Value::Number(x),
                Err(_) => Value::Other(format!("the number {x}")),
            },
            DeValue::Boolean(b) => Value::Bool(*b),
            DeValue::Datetime(_) => Value::Other("a date".to_owned()),
            DeValue::Array(items) => Value::List(
                items
                    .iter()
                    .map(|item| Node::from_toml(item, source, shift))
                    .collect(),
            ),
            DeValue::Table(table) => Value::Table(entries(table, source, shift)),
        };
        Node {
            value,
            place,
            raw: None,
        }
    }

    /// The entry of a table under `key`.
    pub fn get(&self, key: &str) -> Option<&Entry> {
        match &self.value {
            Value::Table(entries) => entries.iter().find(|e| e.key == key),
            _ => None,
        }
    }
}

/// Entries in the order of the text.
fn entries(table: &DeTable<'_>, source: usize, shift: usize) -> Vec<Entry> {
    let mut entries: Vec<Entry> = table
        .iter()
        .map(|(key, value)| {
            let span = key.span();
            Entry {
                key: key.get_ref().clone().into_owned(),
                place: Place {
                    source,
                    span: span.start + shift..span.end + shift,
                },
                node: Node::from_toml(value, source, shift),
            }
        })
        .collect();
    entries.sort_by_key(|e| (e.place.span.start, e.place.span.end));
    entries
}

/// The text of an override as it stands in messages, and where its value
/// starts in it.
pub(crate) fn override_text(path: &str, value: &str) -> (String, usize) {
    (format!("{path}={value}"), path.len() + 1)
}

/// Merges `--set path=value` into the tree.
///
/// Items of lists are addressed by number or, where they have one, by `name`.
pub(crate) fn apply_override(
    root: &mut Node,
    path: &str,
    value: &str,
    source: usize,
    text: &SourceText,
) -> Result<(), Box<Finding>> {
    let fail = |code, span: Range<usize>, message: String| {
        let finding = Finding::error(code, "", message).at(text, span);
        Err(Box::new(finding.path(path)))
    };
    let shift = path.len() + 1;
    let node = match DeValue::parse(value) {
        Ok(parsed) => Node {
            raw: Some(value.to_owned()),
            ..Node::from_toml(&parsed, source, shift)
        },
        // a bare word, as shells make of it: text
        Err(_) if !value.trim().starts_with(['[', '{', '"', '\'']) => Node {
            value: Value::Text(value.to_owned()),
            place: Place {
                source,
                span: shift..shift + value.len(),
            },
            raw: None,
        },
        Err(e) => {
            let span = e.span().unwrap_or(0..value.len());
            return fail(
                "scene::syntax",
                span.start + shift..span.end + shift,
                format!("the value is not valid TOML: {}", e.message()),
            );
        }
    };
    let parts: Vec<&str> = path.split('.').collect();
    let mut current = root;
    let mut start = 0;
    for (depth, part) in parts.iter().enumerate() {
        let span = start..start + part.len();
        start = span.end + 1;
        let last = depth + 1 == parts.len();
        if part.is_empty() {
            let message = format!("`{path}` is not a path of keys joined by dots");
            return fail("scene::set", 0..path.len(), message);
        }
        let place = Place { source, span };
        let next = match &mut current.value {
            Value::Table(entries) => {
                let index = match entries.iter().position(|e| e.key == *part) {
                    Some(index) => index,
                    None => {
                        entries.push(Entry {
                            key: (*part).to_owned(),
                            place: place.clone(),
                            node: Node {
                                value: Value::Table(Vec::new()),
                                place: place.clone(),
                                raw: None,
                            },
                        });
                        entries.len() - 1
                    }
                };
                if last {
                    entries[index].place = place;
                }
                &mut entries[index].node
            }
            Value::List(items) => {
                let count = items.len();
                let index = part.parse::<usize>().ok().or_else(|| {
                    let named = |n: &Node| match n.get("name").map(|e| &e.node.value) {
                        Some(Value::Text(name)) => name == part,
                        _ => false,
                    };
                    items.iter().position(named)
                });
                match index.filter(|i| *i < count) {
                    Some(index) => &mut items[index],
                    None => {
                        return fail(
                            "scene::set",
                            place.span,
                            format!("no item `{part}`: the list has {count}, numbered from 0"),
                        );
                    }
                }
            }
            other => {
                let found = other.describe();
                return fail(
                    "scene::set",
                    place.span,
                    format!("`{}` is {found} and has no keys", parts[..depth].join(".")),
                );
            }
        };
        current = next;
    }
    *current = node;
    Ok(())
}
