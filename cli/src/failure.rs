//! How the program fails: what was wrong, and with which exit status.

use std::io::IsTerminal;
use std::process::ExitCode;

use selvedge_record::RecordError;
use selvedge_scene::diagnostic::{Diagnostics, Severity};
use selvedge_scene::driver::RunError;
use selvedge_study::StudyError;

use crate::output::{complain, say};

/// Why a command did not do its work.
#[derive(Debug)]
pub enum Failure {
    /// The input is wrong: exit status 2.
    Input(Diagnostics),
    /// The input is wrong, in a sentence: exit status 2.
    Usage(String),
    /// Something else failed: exit status 1.
    Other(String),
}

impl Failure {
    /// Tells the user, and gives the exit status.
    pub fn report(&self, json: bool) -> ExitCode {
        let code = if matches!(self, Self::Other(_)) { 1 } else { 2 };
        if json {
            let errors = match self {
                Self::Input(findings) => findings.to_json(),
                Self::Usage(text) | Self::Other(text) => serde_json::json!([{ "message": text }]),
            };
            let event = serde_json::json!({ "event": "error", "findings": errors });
            // The exit status says it in any case.
            let _ = say!("{event}");
            return ExitCode::from(code);
        }
        match self {
            Self::Input(findings) => print_findings(findings),
            Self::Usage(text) | Self::Other(text) => complain(format_args!("error: {text}")),
        }
        ExitCode::from(code)
    }
}

/// Prints findings with their place in the text, and as `file:line:column`.
pub fn print_findings(findings: &Diagnostics) {
    let terminal = std::io::stderr().is_terminal();
    if terminal {
        complain(format_args!("{}", findings.render(100, true)));
    }
    for finding in findings.findings() {
        match finding.severity {
            // Warnings call themselves so.
            Severity::Warning => complain(format_args!("{finding}")),
            Severity::Error => complain(format_args!("error: {finding}")),
        }
    }
}

impl From<Diagnostics> for Failure {
    fn from(findings: Diagnostics) -> Self {
        Self::Input(findings)
    }
}

impl From<RunError> for Failure {
    fn from(error: RunError) -> Self {
        match error {
            RunError::Scene(findings) => Self::Input(findings),
            RunError::Record(error) => error.into(),
            other => Self::Other(other.to_string()),
        }
    }
}

impl From<StudyError> for Failure {
    fn from(error: StudyError) -> Self {
        use StudyError as E;
        let help = match &error {
            E::Scene(findings) => return Self::Input(findings.clone()),
            E::NotAStudy { .. } => "name the folder that `selvedge study -o` wrote",
            E::Exists { .. } => "add --resume to reuse its runs, or choose another folder with -o",
            E::Other { .. } => "choose another folder with -o",
            E::InUse { .. } => "wait for it, or choose another folder with -o",
            E::Axis { .. } | E::TooMany { .. } | E::Shard { .. } | E::Template { .. } => {
                return Self::Usage(error.to_string());
            }
            E::Reference { .. } => {
                let help = "what is finished is kept: choose other settings with --reference, or \
                            run what is missing, with --resume";
                return Self::Other(format!("{error} ({help})"));
            }
            _ => return Self::Other(error.to_string()),
        };
        Self::Usage(format!("{error} ({help})"))
    }
}

impl From<RecordError> for Failure {
    /// What cannot be read or resumed is wrong input; what cannot be written
    /// is not.
    fn from(error: RecordError) -> Self {
        use RecordError as E;
        let help = match &error {
            E::Read { .. } => "name a folder of results, its run.mcap, or an OBJ file",
            E::NotMcap { .. } | E::NoHeader { .. } => {
                "recordings are the run.mcap of a folder of results"
            }
            E::Format { .. } => "use the version of the program that wrote it, or a newer one",
            E::NothingToResume { .. } => "leave out --resume to start the run",
            E::AlreadyComplete { .. } => "leave out --resume to run it again",
            E::NoCheckpoint { .. } => "leave out --resume to start again",
            E::HeaderMismatch { .. } => {
                "resume with the same scene and settings, or leave out --resume to start again"
            }
            E::InUse { .. } => "wait for it, or choose another folder with -o",
            E::Surface { .. } | E::Export { .. } => "choose another result or format",
            _ => return Self::Other(error.to_string()),
        };
        Self::Usage(format!("{error} ({help})"))
    }
}
