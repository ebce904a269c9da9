//! Typed access to a parsed TOML table that remembers where everything is.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::FabricError;
use super::error::nearest;

/// Line and column of a byte offset, both from 1; columns count characters.
pub(crate) fn line_column(text: &str, offset: usize) -> (usize, usize) {
    let mut end = offset.min(text.len());
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    let before = &text[..end];
    let start = before.rfind('\n').map_or(0, |i| i + 1);
    (
        before.matches('\n').count() + 1,
        before[start..].chars().count() + 1,
    )
}

/// A table of a fabric file with its path from the root.
pub(crate) struct Node<'t> {
    pub text: &'t str,
    pub origin: &'t str,
    pub path: String,
    pub span: Range<usize>,
    pub table: &'t DeTable<'t>,
}

/// A number of a fabric file with what the file says about it.
pub(crate) struct Quantity<'t> {
    pub value: f64,
    pub span: Range<usize>,
    pub about: Option<Node<'t>>,
}

impl<'t> Node<'t> {
    pub fn key(&self, key: &str) -> String {
        if self.path.is_empty() {
            key.to_owned()
        } else {
            format!("{}.{key}", self.path)
        }
    }

    /// Refuses keys that are not in `known`.
    pub fn allow(&self, known: &[&str]) -> Result<(), FabricError> {
        let unknown = self
            .table
            .keys()
            .filter(|k| !known.contains(&k.get_ref().as_ref()))
            .min_by_key(|k| k.span().start);
        let Some(key) = unknown else { return Ok(()) };
        let (line, column) = line_column(self.text, key.span().start);
        Err(FabricError::UnknownKey {
            origin: self.origin.to_owned(),
            line,
            column,
            key: self.key(key.get_ref()),
            nearest: nearest(key.get_ref(), known.iter().copied()),
            known: known.join(", "),
        })
    }

    pub fn missing(&self, key: &str, help: &'static str) -> FabricError {
        FabricError::MissingKey {
            origin: self.origin.to_owned(),
            key: self.key(key),
            help,
        }
    }

    /// An error about a value, with its place.
    pub fn at(&self, span: &Range<usize>, error: FabricError) -> FabricError {
        let (line, column) = line_column(self.text, span.start);
        FabricError::At {
            origin: self.origin.to_owned(),
            line,
            column,
            source: Box::new(error),
        }
    }

    pub fn wrong(&self, key: &str, value: &Spanned<DeValue<'_>>, expected: &str) -> FabricError {
        let (line, column) = line_column(self.text, value.span().start);
        FabricError::WrongType {
            origin: self.origin.to_owned(),
            line,
            column,
            key: self.key(key),
            expected: expected.to_owned(),
            found: describe(value.get_ref()),
        }
    }

    pub fn child(&self, key: &str) -> Result<Option<Node<'t>>, FabricError> {
        match self.table.get(key) {
            None => Ok(None),
            Some(value) => match value.get_ref().as_table() {
                Some(table) => Ok(Some(Node {
                    text: self.text,
                    origin: self.origin,
                    path: self.key(key),
                    span: value.span(),
                    table,
                })),
                None => Err(self.wrong(key, value, "a table")),
            },
        }
    }

    pub fn string(&self, key: &str) -> Result<Option<&'t str>, FabricError> {
        match self.table.get(key) {
            None => Ok(None),
            Some(value) => match value.get_ref().as_str() {
                Some(s) => Ok(Some(s)),
                None => Err(self.wrong(key, value, "a string in quotes")),
            },
        }
    }

    /// One of several names.
    pub fn choice(&self, key: &str, names: &[&str]) -> Result<Option<usize>, FabricError> {
        let Some(word) = self.string(key)? else {
            return Ok(None);
        };
        match names.iter().position(|n| *n == word) {
            Some(i) => Ok(Some(i)),
            None => Err(self.wrong(
                key,
                &self.table[key],
                &format!("one of {}", names.join(", ")),
            )),
        }
    }

    /// A number, or a table with the number as `value`.
    pub fn quantity(&self, key: &str) -> Result<Option<Quantity<'t>>, FabricError> {
        let Some(value) = self.table.get(key) else {
            return Ok(None);
        };
        if value.get_ref().is_table() {
            let about = self.child(key)?;
            let Some(node) = about else { return Ok(None) };
            node.allow(&["value", "source", "year", "kind"])?;
            let Some(inner) = node.table.get("value") else {
                return Err(node.missing("value", "the number itself, in SI units"));
            };
            let number =
                number(inner.get_ref()).ok_or_else(|| node.wrong("value", inner, "a number"))?;
            return Ok(Some(Quantity {
                value: number,
                span: inner.span(),
                about: Some(node),
            }));
        }
        let number = number(value.get_ref()).ok_or_else(|| self.wrong(key, value, "a number"))?;
        Ok(Some(Quantity {
            value: number,
            span: value.span(),
            about: None,
        }))
    }
}

fn number(value: &DeValue<'_>) -> Option<f64> {
    match value {
        DeValue::Integer(i) => i64::from_str_radix(i.as_str(), i.radix())
            .ok()
            .map(|i| i as f64),
        DeValue::Float(f) => f.as_str().parse().ok(),
        _ => None,
    }
}

fn describe(value: &DeValue<'_>) -> String {
    match value {
        DeValue::String(s) => format!("the string \"{s}\""),
        DeValue::Integer(i) => format!("the number {i}"),
        DeValue::Float(f) => format!("the number {f}"),
        DeValue::Boolean(b) => format!("{b}"),
        DeValue::Datetime(_) => "a date".to_owned(),
        DeValue::Array(_) => "a list".to_owned(),
        DeValue::Table(_) => "a table".to_owned(),
    }
}
