use std::collections::{BTreeMap, BTreeSet};

use super::tree::Place;
use crate::diagnostic::{Finding, Severity, SourceText};

/// Where the values of a scene stand, by dotted path (`cloth.0.size`).
#[derive(Clone, Debug)]
pub struct Locations {
    sources: Vec<SourceText>,
    places: BTreeMap<String, Place>,
    broken: BTreeSet<String>,
}

impl Locations {
    pub(crate) fn new(
        sources: Vec<SourceText>,
        places: BTreeMap<String, Place>,
        broken: BTreeSet<String>,
    ) -> Self {
        Self {
            sources,
            places,
            broken,
        }
    }

    /// Name of the scene file.
    pub fn name(&self) -> &str {
        self.sources[0].name()
    }

    /// Whether the scene says something at `path`; else its default holds.
    pub fn is_set(&self, path: &str) -> bool {
        self.places.contains_key(path)
    }

    /// Name, line and column of the value at `path`.
    pub fn line_column(&self, path: &str) -> Option<(&str, usize, usize)> {
        let place = self.places.get(path)?;
        let source = &self.sources[place.source];
        let (line, column) = crate::diagnostic::line_column(source.text(), place.span.start);
        Some((source.name(), line, column))
    }

    /// An error about the value at `path`.
    ///
    /// It is placed at the value, or at the innermost table around it that the
    /// scene has.
    pub fn error(&self, code: &'static str, path: &str, message: impl Into<String>) -> Finding {
        self.finding(Severity::Error, code, path, message.into())
    }

    /// A warning about the value at `path`, placed as by [`error`](Self::error).
    pub fn warning(&self, code: &'static str, path: &str, message: impl Into<String>) -> Finding {
        self.finding(Severity::Warning, code, path, message.into())
    }

    fn finding(
        &self,
        severity: Severity,
        code: &'static str,
        path: &str,
        message: String,
    ) -> Finding {
        let mut finding = Finding::error(code, self.sources[0].name(), message).path(path);
        finding.severity = severity;
        let mut around = path;
        while !around.is_empty() {
            if let Some(place) = self.places.get(around) {
                return finding.at(&self.sources[place.source], place.span.clone());
            }
            around = around.rfind('.').map_or("", |dot| &around[..dot]);
        }
        finding
    }

    /// Whether the value at `path`, or something around it, has been refused.
    pub(crate) fn is_broken(&self, path: &str) -> bool {
        let mut around = path;
        loop {
            if self.broken.contains(around) {
                return true;
            }
            match around.rfind('.') {
                Some(dot) => around = &around[..dot],
                None => return false,
            }
        }
    }

    pub(crate) fn mark_broken(&mut self, path: String) {
        self.broken.insert(path);
    }
}
