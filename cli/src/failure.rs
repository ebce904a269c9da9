//! How the program fails: what was wrong, and with which exit status.

use std::io::IsTerminal;
use std::process::ExitCode;

use selvedge_record::RecordError;
use selvedge_scene::diagnostic::Diagnostics;
use selvedge_scene::driver::RunError;

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
            println!(
                "{}",
                serde_json::json!({ "event": "error", "findings": errors })
            );
            return ExitCode::from(code);
        }
        match self {
            Self::Input(findings) => print_findings(findings),
            Self::Usage(text) | Self::Other(text) => eprintln!("error: {text}"),
        }
        ExitCode::from(code)
    }
}

/// Prints findings with their place in the text, and as `file:line:column`.
pub fn print_findings(findings: &Diagnostics) {
    let terminal = std::io::stderr().is_terminal();
    if terminal {
        eprint!("{}", findings.render(100, true));
    }
    for finding in findings.findings() {
        eprintln!("{}: {finding}", finding.severity);
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
            other => Self::Other(other.to_string()),
        }
    }
}

impl From<RecordError> for Failure {
    fn from(error: RecordError) -> Self {
        Self::Other(error.to_string())
    }
}
