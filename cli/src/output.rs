//! Standard output and error: a reader that has gone is no error.

use std::fmt::Arguments;
use std::io::{ErrorKind, Write};

use crate::Failure;

/// A line on standard output: `say!("…", …)?`.
macro_rules! say {
    ($($arg:tt)*) => {
        $crate::output::write(format_args!("{}\n", format_args!($($arg)*)))
    };
}
pub(crate) use say;

/// Writes to standard output.
///
/// # Errors
/// [`Failure::Other`] when it cannot be written, for example to a full disk.
pub fn write(text: Arguments<'_>) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    match out.write_fmt(text).and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(Failure::Other(format!(
            "cannot write to standard output: {e}"
        ))),
        _ => Ok(()),
    }
}

/// Writes a line to standard error; there is nowhere left to say that it failed.
pub fn complain(text: Arguments<'_>) {
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}

/// A value on standard output: on one line for programs, indented for people.
///
/// # Errors
/// As [`write`].
pub fn value(value: &serde_json::Value, json: bool) -> Result<(), Failure> {
    if json {
        return say!("{value}");
    }
    let text = serde_json::to_string_pretty(value).map_err(|e| Failure::Other(e.to_string()))?;
    say!("{text}")
}
