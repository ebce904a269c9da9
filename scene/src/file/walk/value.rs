//! Single values: their types, ranges and names.

use serde_json::{Map, Value as Json, json};

use super::super::spec::{ANY, Key, Kind, Range, Table, number, required, vec3};
use super::super::suggest::{did_you_mean, number_in_text, show};
use super::super::tree::{Entry, Node, Value};
use super::{Walker, join};

impl Walker<'_> {
    /// A value as its key takes it; `None` after a finding.
    pub(super) fn value(&mut self, key: &Key, node: &Node, path: &str) -> Option<Json> {
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
                    let walk = |entry: &Entry| {
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

    pub(super) fn wrong_type<T>(
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

    pub(super) fn unknown_name<T>(
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
            Value::List(_) => self.vector(key, node, path, 3, "deg", &ANY).map(Json::from),
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
pub(super) fn text_of(node: &Node) -> Option<String> {
    match (&node.value, &node.raw) {
        (Value::Text(text), _) => Some(text.clone()),
        (_, Some(raw)) => Some(raw.trim().to_owned()),
        _ => None,
    }
}
