//! Compares a tree with the description of the keys: unknown keys, wrong types,
//! values out of range, names that do not exist; fills in the defaults.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::{Map, Value as Json, json};

use super::keys::SCENE;
use super::spec::{Default, Key, Kind, Range, Table, Variant};
use super::stand_in::{example, placeholder};
use super::suggest::{did_you_mean, number_in_text, show};
use super::tree::{Node, Place, Value};
use crate::diagnostic::{Diagnostics, Finding, SourceText};

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

    /// A value as its key takes it; `None` after a finding.
    fn value(&mut self, key: &Key, node: &Node, path: &str) -> Option<Json> {
        self.places.insert(path.to_owned(), node.place.clone());
        match key.kind {
            Kind::Bool => match node.value {
                Value::Bool(b) => Some(json!(b)),
                _ => self.wrong_type(node, path, "true or false", String::new()),
            },
            Kind::Text | Kind::Path => match text_of(node) {
                Some(text) if text.is_empty() && matches!(key.kind, Kind::Path) => {
                    self.wrong_type(node, path, "a path", String::new())
                }
                Some(text) => Some(json!(text)),
                None => self.wrong_type(node, path, "a text in quotes", String::new()),
            },
            Kind::Integer { min, max } => self.integer(node, path, min, max).map(Json::from),
            Kind::Number { unit, range } => self
                .number(node, path, unit, &range, key.hint)
                .map(Json::from),
            Kind::Vector { len, unit, range } => self
                .vector(key, node, path, len, unit, &range)
                .map(Json::from),
            Kind::Integers { len, min, max } => {
                let items = self.list(node, path, &format!("{len} whole numbers"), Some(len))?;
                self.collect(items, path, |w, n, p| {
                    w.integer(n, p, min, max).map(Json::from)
                })
            }
            Kind::Indices => {
                let items = self.list(node, path, "a list of whole numbers", None)?;
                let max = i64::from(u32::MAX);
                self.collect(items, path, |w, n, p| {
                    w.integer(n, p, 0, max).map(Json::from)
                })
            }
            Kind::Texts => {
                let items = self.list(node, path, "a list of texts", None)?;
                self.collect(items, path, |w, n, p| match text_of(n) {
                    Some(text) => Some(json!(text)),
                    None => w.wrong_type(n, p, "a text in quotes", String::new()),
                })
            }
            Kind::Choice(names) => {
                let word = text_of(node);
                match names.iter().find(|(n, _)| word.as_deref() == Some(*n)) {
                    Some((name, _)) => Some(json!(name)),
                    None => self.unknown_name(node, path, names.iter().map(|(n, _)| *n)),
                }
            }
            Kind::Switch => match (&node.value, text_of(node).as_deref()) {
                (Value::Bool(b), _) => Some(json!(b)),
                (_, Some("auto")) => Some(json!("auto")),
                _ => self.wrong_type(node, path, "true, false or \"auto\"", String::new()),
            },
            Kind::Rotation => self.rotation(key, node, path),
            Kind::Table(table) => Some(Json::Object(self.table(table, Some(node), path))),
            Kind::Tables(table) => match &node.value {
                Value::List(items) => {
                    let walk = |(i, item): (usize, &Node)| {
                        Json::Object(self.table(table, Some(item), &join(path, i)))
                    };
                    Some(Json::Array(items.iter().enumerate().map(walk).collect()))
                }
                _ => {
                    let help = format!("write `[[{path}]]`, with two brackets");
                    self.wrong_type(node, path, "a list of tables", help)
                }
            },
            Kind::Named(table) => match &node.value {
                Value::Table(entries) => {
                    let walk = |entry: &super::tree::Entry| {
                        let inner = self.table(table, Some(&entry.node), &join(path, &entry.key));
                        (entry.key.clone(), Json::Object(inner))
                    };
                    Some(Json::Object(entries.iter().map(walk).collect()))
                }
                _ => {
                    let help = format!("write `[{path}.NAME]`");
                    self.wrong_type(node, path, "tables by name", help)
                }
            },
            Kind::NamedTexts => {
                self.named(node, path, ("texts", "\"…\""), |w, n, p| {
                    match text_of(n) {
                        Some(text) => Some(json!(text)),
                        None => w.wrong_type(n, p, "a text in quotes", String::new()),
                    }
                })
            }
            Kind::NamedIntegers { max } => {
                self.named(node, path, ("whole numbers", "1"), |w, n, p| {
                    w.integer(n, p, 0, max).map(Json::from)
                })
            }
        }
    }

    /// Values under names of one's own; `what` says what they are, with an
    /// example.
    fn named(
        &mut self,
        node: &Node,
        path: &str,
        what: (&str, &str),
        mut read: impl FnMut(&mut Self, &Node, &str) -> Option<Json>,
    ) -> Option<Json> {
        let Value::Table(entries) = &node.value else {
            let help = format!("write `{path} = {{ NAME = {} }}`", what.1);
            return self.wrong_type(node, path, &format!("{} by name", what.0), help);
        };
        let mut out = Map::new();
        for entry in entries {
            let place = join(path, &entry.key);
            self.places.insert(place.clone(), entry.node.place.clone());
            if let Some(value) = read(self, &entry.node, &place) {
                out.insert(entry.key.clone(), value);
            }
        }
        Some(Json::Object(out))
    }

    fn wrong_type<T>(
        &mut self,
        node: &Node,
        path: &str,
        expected: &str,
        help: String,
    ) -> Option<T> {
        let found = node.value.describe();
        let message = format!("`{path}`: expected {expected}, found {found}");
        self.report("scene::type", &node.place, path, message, help);
        None
    }

    fn unknown_name<T>(
        &mut self,
        node: &Node,
        path: &str,
        names: impl Iterator<Item = &'static str>,
    ) -> Option<T> {
        let names: Vec<&str> = names.collect();
        let list = names.join(", ");
        let Some(word) = text_of(node) else {
            return self.wrong_type(node, path, "a name in quotes", format!("one of {list}"));
        };
        let message = format!("`{path}`: there is no {word:?}");
        let help = format!("{}one of {list}", did_you_mean(&word, names));
        self.report("scene::unknown-name", &node.place, path, message, help);
        None
    }

    fn list<'n>(
        &mut self,
        node: &'n Node,
        path: &str,
        expected: &str,
        len: Option<usize>,
    ) -> Option<&'n [Node]> {
        match &node.value {
            Value::List(items) if len.is_none_or(|n| items.len() == n) => Some(items),
            _ => {
                let zeros = vec!["…"; len.unwrap_or(2)].join(", ");
                let key = path.rsplit('.').next().unwrap_or(path);
                self.wrong_type(node, path, expected, format!("write `{key} = [{zeros}]`"))
            }
        }
    }

    /// All items of a list, so that each faulty one is reported.
    fn collect(
        &mut self,
        items: &[Node],
        path: &str,
        mut read: impl FnMut(&mut Self, &Node, &str) -> Option<Json>,
    ) -> Option<Json> {
        let read: Vec<Option<Json>> = items
            .iter()
            .enumerate()
            .map(|(i, item)| read(self, item, &join(path, i)))
            .collect();
        let values: Option<Vec<Json>> = read.into_iter().collect();
        values.map(Json::Array)
    }

    fn integer(&mut self, node: &Node, path: &str, min: i64, max: i64) -> Option<i64> {
        let upper = if max == i64::MAX {
            String::new()
        } else {
            format!(" and at most {max}")
        };
        match node.value {
            Value::Integer(i) if (min..=max).contains(&i) => Some(i),
            Value::Integer(i) => {
                let message = format!("`{path}` = {i} is out of range");
                let help = format!("it has to be at least {min}{upper}");
                self.report("scene::value", &node.place, path, message, help);
                None
            }
            _ => self.wrong_type(node, path, "a whole number", String::new()),
        }
    }

    fn number(
        &mut self,
        node: &Node,
        path: &str,
        unit: &'static str,
        range: &Range,
        hint: &str,
    ) -> Option<f64> {
        let in_unit = if unit.is_empty() {
            String::new()
        } else {
            format!(" {unit}")
        };
        let x = match &node.value {
            Value::Number(x) => *x,
            Value::Integer(i) => *i as f64,
            Value::Text(text) => {
                let help = number_in_text(text, unit).unwrap_or_default();
                let expected = if unit.is_empty() {
                    "a number".to_owned()
                } else {
                    format!("a number in {unit}")
                };
                return self.wrong_type(node, path, &expected, help);
            }
            _ => return self.wrong_type(node, path, "a number", String::new()),
        };
        if range.contains(x) {
            return Some(x);
        }
        let message = if x.is_finite() {
            format!("`{path}` = {}{in_unit} is out of range", show(x))
        } else {
            format!("`{path}` = {x} is not a finite number")
        };
        let mut help = format!("it has to be {}", range.describe());
        if range.describe() != "finite" {
            help.push_str(&in_unit);
        }
        if !hint.is_empty() {
            help.push_str("; ");
            help.push_str(hint);
        }
        self.report("scene::value", &node.place, path, message, help);
        None
    }

    fn vector(
        &mut self,
        key: &Key,
        node: &Node,
        path: &str,
        len: usize,
        unit: &'static str,
        range: &Range,
    ) -> Option<Vec<f64>> {
        let expected = if unit.is_empty() {
            format!("{len} numbers")
        } else {
            format!("{len} numbers in {unit}")
        };
        let items = self.list(node, path, &expected, Some(len))?;
        let read: Vec<Option<f64>> = items
            .iter()
            .enumerate()
            .map(|(i, item)| self.number(item, &join(path, i), unit, range, key.hint))
            .collect();
        read.into_iter().collect()
    }

    fn rotation(&mut self, key: &Key, node: &Node, path: &str) -> Option<Json> {
        use super::spec::{ANY, Table, number, required, vec3};
        static AXIS_ANGLE: Table = Table::new(
            "",
            &[
                required("axis", vec3("", ANY), "Direction of the axis."),
                required("angle", number("deg", ANY), "Angle."),
            ],
        );
        match &node.value {
            Value::Table(_) => {
                let before = self.findings.len();
                let table = self.table(&AXIS_ANGLE, Some(node), path);
                (self.findings.len() == before).then_some(Json::Object(table))
            }
            Value::List(_) => self
                .vector(key, node, path, 3, "deg", &super::spec::ANY)
                .map(Json::from),
            _ => self.wrong_type(
                node,
                path,
                "three Euler angles in deg",
                "or write `{ axis = [0, 1, 0], angle = 90 }`".to_owned(),
            ),
        }
    }
}

/// Text of a value; what the command line gives may look like something else.
fn text_of(node: &Node) -> Option<String> {
    match (&node.value, &node.raw) {
        (Value::Text(text), _) => Some(text.clone()),
        (_, Some(raw)) => Some(raw.trim().to_owned()),
        _ => None,
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
