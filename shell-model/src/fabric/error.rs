use std::fmt;

/// What can be wrong with a fabric or a fabric file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FabricError {
    /// A quantity is outside its range.
    #[error("{field} = {value:?}: must be {allowed}")]
    Value {
        /// Name of the quantity, for example `membrane.shear`.
        field: String,
        /// What was given, in the unit of the field.
        value: f64,
        /// What is allowed.
        allowed: String,
    },
    /// No fabric of that name is in the library.
    #[error(
        "no fabric `{name}` in the library{}; known: {known}",
        Suggest(nearest)
    )]
    UnknownFabric {
        /// Name that was asked for.
        name: String,
        /// Most similar known name, when one is close.
        nearest: Option<String>,
        /// All known names.
        known: String,
    },
    /// A fabric file cannot be read.
    #[error("cannot read {path}: {reason}")]
    Unreadable {
        /// The file.
        path: String,
        /// What the operating system says.
        reason: String,
    },
    /// A fabric file is not valid TOML or JSON.
    #[error("{origin}:{line}:{column}: {message}")]
    Syntax {
        /// Name of the file or text.
        origin: String,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// What the parser found.
        message: String,
    },
    /// A key is not part of the format.
    #[error(
        "{origin}:{line}:{column}: unknown key `{key}`{}; known: {known}",
        Suggest(nearest)
    )]
    UnknownKey {
        /// Name of the file or text.
        origin: String,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// Key with its path.
        key: String,
        /// Most similar known key, when one is close.
        nearest: Option<String>,
        /// All keys known at that place.
        known: String,
    },
    /// A key that the format needs is absent.
    #[error("{origin}: `{key}` is missing: {help}")]
    MissingKey {
        /// Name of the file or text.
        origin: String,
        /// Key with its path.
        key: String,
        /// What to write.
        help: &'static str,
    },
    /// A value has the wrong type, or is a name that is not known.
    #[error("{origin}:{line}:{column}: `{key}`: expected {expected}, found {found}")]
    WrongType {
        /// Name of the file or text.
        origin: String,
        /// Line, from 1 (0 where the format keeps no positions).
        line: usize,
        /// Column, from 1 (0 where the format keeps no positions).
        column: usize,
        /// Key with its path.
        key: String,
        /// What is expected.
        expected: String,
        /// What was found.
        found: String,
    },
    /// A value at a known place of a file is outside its range.
    #[error("{origin}:{line}:{column}: {source}")]
    At {
        /// Name of the file or text.
        origin: String,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// What is wrong.
        source: Box<FabricError>,
    },
}

struct Suggest<'a>(&'a Option<String>);

impl fmt::Display for Suggest<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Some(name) => write!(f, " (did you mean `{name}`?)"),
            None => Ok(()),
        }
    }
}

pub(crate) fn value(field: &str, value: f64, allowed: impl Into<String>) -> FabricError {
    FabricError::Value {
        field: field.to_owned(),
        value,
        allowed: allowed.into(),
    }
}

pub(crate) fn positive(field: &str, x: f64) -> Result<(), FabricError> {
    if x.is_finite() && x > 0.0 {
        Ok(())
    } else {
        Err(value(field, x, "positive and finite"))
    }
}

pub(crate) fn not_negative(field: &str, x: f64) -> Result<(), FabricError> {
    if x.is_finite() && x >= 0.0 {
        Ok(())
    } else {
        Err(value(field, x, "zero or positive, and finite"))
    }
}

/// The most similar of `known`, when it is similar enough to be a misspelling.
pub(crate) fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<String> {
    let word = word.to_lowercase();
    known
        .into_iter()
        .map(|k| (strsim::jaro_winkler(&word, &k.to_lowercase()), k))
        .filter(|(score, _)| *score > 0.75)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, k)| k.to_owned())
}
