use std::path::PathBuf;

use selvedge_scene::diagnostic::Diagnostics;

/// Why a study could not be planned, run or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StudyError {
    /// A varied setting that cannot be read.
    #[error("`{text}`: {reason}")]
    Axis {
        /// As it was given.
        text: String,
        /// What is wrong, and what would be right.
        reason: String,
    },
    /// One of the runs has a setting that no scene takes.
    #[error("{} error(s) in the settings", .0.len())]
    Scene(Diagnostics),
    /// More runs than a study holds.
    #[error("{count} runs, at most {most}: leave out values or take a sample of them")]
    TooMany {
        /// Runs asked for.
        count: usize,
        /// Runs that are possible.
        most: usize,
    },
    /// A part of a study that does not exist.
    #[error("`{text}` is no part of a study: {reason}")]
    Shard {
        /// As it was given.
        text: String,
        /// What is wrong, and what would be right.
        reason: String,
    },
    /// The folder holds no study.
    #[error("`{path}` holds no study: {reason}")]
    NotAStudy {
        /// The folder.
        path: PathBuf,
        /// What is missing or broken.
        reason: String,
    },
    /// The folder holds finished runs already.
    #[error("`{path}` holds a study already")]
    Exists {
        /// The folder.
        path: PathBuf,
    },
    /// The folder holds another study.
    #[error("`{path}` holds another study: {difference}")]
    Other {
        /// The folder.
        path: PathBuf,
        /// The first difference.
        difference: String,
    },
    /// Another process works on the same part.
    #[error("`{path}` is in use by another process")]
    InUse {
        /// The index of the part.
        path: PathBuf,
    },
    /// The study has no reference to measure against.
    #[error("the reference run {reason}")]
    Reference {
        /// What happened to it.
        reason: String,
    },
    /// A file could not be written.
    #[error("cannot write `{path}`: {source}")]
    Write {
        /// The file.
        path: PathBuf,
        /// The reason that the system gives.
        source: std::io::Error,
    },
    /// A file could not be read.
    #[error("cannot read `{path}`: {reason}")]
    Read {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// A document template asks for something that is not there.
    #[error("{place}: {reason}")]
    Template {
        /// File and line.
        place: String,
        /// What is wrong, and what there is.
        reason: String,
    },
}

impl From<Diagnostics> for StudyError {
    fn from(findings: Diagnostics) -> Self {
        Self::Scene(findings)
    }
}
