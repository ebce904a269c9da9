//! Compares a tree with the description of the keys: unknown keys, wrong types,
//! values out of range, names that do not exist; fills in the defaults.

mod value;

use std::collections::{BTreeMap, BTreeSet};

use serde_json::{Map, Value as Json, json};

use super::keys::SCENE;
use super::spec::{Default, Key, Kind, Table, Variant};
use super::stand_in::{example, placeholder};
use super::suggest::did_you_mean;
use super::tree::{Node, Place, Value};
use crate::diagnostic::{Diagnostics, Finding, SourceText};
use value::text_of;

/// Reads a tree key by key, collecting findings on the way.
pub(crate) struct Walker<'a> {
    pub sources: &'a [SourceText],
    pub findings: Diagnostics,
    /// Place of every value, by dotted path; the root has the empty path.
    pub places: BTreeMap<String, Place>,
    /// Paths whose value is a placeholder because of a finding.
    pub broken: BTreeSet<String>,
}

pub(crate) fn join(path: &str, key: impl std::fmt::Display) -> String {
    if path.is_empty() {
        key.to_string()
    } else {
        format!("{path}.{key}")
    }
}

impl<'a> Walker<'a> {
    pub fn new(sources: &'a [SourceText]) -> Self {
        Self {
            sources,
            findings: Diagnostics::new(),
            places: BTreeMap::new(),
            broken: BTreeSet::new(),
        }
    }

    /// The effective values of the whole file.
    pub fn scene(&mut self, root: &Node) -> Map<String, Json> {
        self.table(&SCENE, Some(root), "")
    }

    fn report(
        &mut self,
        code: &'static str,
        place: &Place,
        path: &str,
        message: String,
        help: String,
    ) {
        let mut finding = Finding::error(code, "", message)
            .at(&self.sources[place.source], place.span.clone())
            .path(path);
        if !help.is_empty() {
            finding = finding.help(help);
        }
        self.findings.push(finding);
    }

    fn table(&mut self, spec: &Table, node: Option<&Node>, path: &str) -> Map<String, Json> {
        let mut out = Map::new();
        let node = match node {
            Some(node) => {
                self.places.insert(path.to_owned(), node.place.clone());
                if let Value::Table(_) = node.value {
                    Some(node)
                } else {
                    let help = format!("write `[{path}]`");
                    let _: Option<Json> = self.wrong_type(node, path, "a table", help);
                    self.broken.insert(path.to_owned());
                    None
                }
            }
            None => None,
        };
        let variant = self.variant(spec, node, path, &mut out);
        let keys = || spec.keys.iter().chain(variant.map_or(&[][..], |v| v.keys));
        if let Some(node) = node {
            self.unknown_keys(spec, variant, node, path);
            if spec.exactly_one {
                self.exactly_one(spec, node, path);
            }
        }
        for key in keys() {
            let place = join(path, key.name);
            let entry = node.and_then(|n| n.get(key.name));
            let value = match entry {
                Some(entry) => match self.value(key, &entry.node, &place) {
                    Some(value) => Some(value),
                    None => {
                        self.broken.insert(place.clone());
                        self.fallback(key, &place)
                    }
                },
                None => self.absent(key, node, path, &place),
            };
            if let Some(value) = value {
                out.insert(key.name.to_owned(), value);
            }
        }
        if spec.exactly_one && out.len() != 1 {
            out.clear();
            if let Some(first) = spec.keys.first() {
                out.insert(first.name.to_owned(), placeholder(&first.kind));
            }
        }
        out
    }

    /// The form of a tagged table; its tag goes to `out`.
    fn variant(
        &mut self,
        spec: &Table,
        node: Option<&Node>,
        path: &str,
        out: &mut Map<String, Json>,
    ) -> Option<&'static Variant> {
        let variants = spec.variants.as_ref()?;
        let names = || variants.list.iter().map(|v| v.name);
        let find = |name: &str| variants.list.iter().find(|v| v.name == name);
        let place = join(path, variants.tag);
        let found = match (node.and_then(|n| n.get(variants.tag)), variants.default) {
            (Some(entry), _) => {
                self.places.insert(place.clone(), entry.node.place.clone());
                let word = text_of(&entry.node);
                let variant = word.as_deref().and_then(find);
                if variant.is_none() {
                    let _: Option<Json> = self.unknown_name(&entry.node, &place, names());
                }
                variant
            }
            (None, Some(default)) => find(default),
            (None, None) => {
                if let Some(node) = node {
                    let message = format!("`{}` is missing in `{path}`", variants.tag);
                    let list: Vec<_> = names().collect();
                    let help =
                        format!("add `{} = \"…\"`, one of {}", variants.tag, list.join(", "));
                    self.report("scene::missing-key", &node.place, &place, message, help);
                }
                None
            }
        };
        if found.is_none() {
            self.broken.insert(path.to_owned());
        }
        // any form will do for a table that is refused anyway
        let used = found.or(variants.list.first())?;
        out.insert(variants.tag.to_owned(), json!(used.name));
        Some(used)
    }

    fn unknown_keys(&mut self, spec: &Table, variant: Option<&Variant>, node: &Node, path: &str) {
        let Value::Table(entries) = &node.value else {
            return;
        };
        let tag = spec.variants.as_ref().map(|v| v.tag);
        let known: Vec<&str> = tag
            .into_iter()
            .chain(spec.keys.iter().map(|k| k.name))
            .chain(variant.into_iter().flat_map(|v| v.keys).map(|k| k.name))
            .collect();
        let form_unknown = self.broken.contains(path);
        for entry in entries.iter().filter(|e| !known.contains(&e.key.as_str())) {
            let elsewhere = spec.variants.iter().flat_map(|v| v.list).find(|v| {
                let has = |k: &Key| k.name == entry.key;
                v.keys.iter().any(has)
            });
            if form_unknown && elsewhere.is_some() {
                continue; // the form itself has been reported
            }
            let place = join(path, &entry.key);
            let message = if path.is_empty() {
                format!("unknown key `{}`", entry.key)
            } else {
                format!("unknown key `{}` in `{path}`", entry.key)
            };
            let help = match (elsewhere, variant, home_of(&entry.key, spec)) {
                (Some(other), Some(this), _) => format!(
                    "`{}` belongs to {tag} = \"{}\", this is \"{}\"",
                    entry.key,
                    other.name,
                    this.name,
                    tag = tag.unwrap_or("kind"),
                ),
                (_, _, Some(table)) => format!("`{}` belongs into `[{table}]`", entry.key),
                _ => format!(
                    "{}known keys: {}",
                    did_you_mean(&entry.key, known.iter().copied()),
                    known.join(", ")
                ),
            };
            self.report("scene::unknown-key", &entry.place, &place, message, help);
        }
    }

    fn exactly_one(&mut self, spec: &Table, node: &Node, path: &str) {
        let names: Vec<&str> = spec.keys.iter().map(|k| k.name).collect();
        let present: Vec<_> = names.iter().filter(|n| node.get(n).is_some()).collect();
        if present.len() != 1 {
            let message = format!("`{path}` needs exactly one key, it has {}", present.len());
            let help = format!("one of {}", names.join(", "));
            self.report("scene::value", &node.place, path, message, help);
            self.broken.insert(path.to_owned());
        }
    }

    /// The value of a key that is not there.
    fn absent(
        &mut self,
        key: &Key,
        table: Option<&Node>,
        table_path: &str,
        path: &str,
    ) -> Option<Json> {
        match key.default {
            Default::Absent | Default::Derived(_) => None,
            Default::Json(text) => Some(self.default(key, text, path)),
            Default::Required => {
                if let Some(node) = table
                    && !self.broken.contains(table_path)
                {
                    let message = format!("`{}` is missing in `{table_path}`", key.name);
                    let help = format!("add {}: {}", example(key), key.doc);
                    self.report("scene::missing-key", &node.place, path, message, help);
                }
                self.broken.insert(path.to_owned());
                Some(placeholder(&key.kind))
            }
        }
    }

    /// The value that stands in for a faulty one.
    fn fallback(&mut self, key: &Key, path: &str) -> Option<Json> {
        match key.default {
            Default::Absent | Default::Derived(_) => None,
            Default::Json(text) => Some(self.default(key, text, path)),
            Default::Required => Some(placeholder(&key.kind)),
        }
    }

    fn default(&mut self, key: &Key, text: &str, path: &str) -> Json {
        match key.kind {
            Kind::Table(table) => Json::Object(self.table(table, None, path)),
            // a malformed default is caught by the test of all defaults
            _ => serde_json::from_str(text).unwrap_or(Json::Null),
        }
    }
}

/// The settings table that a key belongs to, when it stands in another one.
fn home_of(key: &str, here: &Table) -> Option<&'static str> {
    SCENE.keys.iter().find_map(|k| match k.kind {
        Kind::Table(table) if !std::ptr::eq(table, here) => {
            let unlike = !matches!(
                key,
                "kind" | "friction" | "membrane" | "bending" | "stiffness"
            );
            (unlike && table.keys.iter().any(|inner| inner.name == key)).then_some(k.name)
        }
        _ => None,
    })
}
