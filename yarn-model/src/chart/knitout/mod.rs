//! Reader of knitout, the open file format of knitting machines
//! (textiles-lab.github.io/knitout).
//!
//! | operation | becomes |
//! |---|---|
//! | `knit` on a front or back needle | `k` or `p` |
//! | `xfer` onto a needle that holds loops, then `knit` | a decrease |
//! | `knit` or `tuck` on an empty needle | `yo`; a cast-on before the first row |
//! | `drop` after the last row | nothing; the top row is bound off |
//! | `miss`, `amiss`, `stitch`, `pause`, carriers in and out | nothing |
//!
//! A row is a run of loops in one direction. What a chart cannot say is an
//! error at its line: `tuck` on a needle with loops, `split` with yarn, `drop`
//! within the cloth, stitches that skip a row, crossed transfers (cables),
//! tubes and cloth on both beds at once, two rows in one direction. Several
//! carriers are taken for one yarn, with a warning.
//!
//! A loop that arrives on a needle lies nearer to the hook than those there,
//! that is behind them on the front bed and in front of them on the back bed.

mod machine;

use machine::Machine;

use super::error::Suggest;
use super::{Chart, ChartError, Place};

/// What stops a knitout file from becoming a chart.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum KnitoutError {
    /// The first line is not `;!knitout-2`.
    #[error("1:1: a knitout file begins with `;!knitout-2`")]
    Magic,
    /// An operation with wrong parameters.
    #[error("{at}: `{operation}`: {message}")]
    Syntax {
        /// Where.
        at: Place,
        /// The operation.
        operation: String,
        /// What is expected.
        message: String,
    },
    /// No operation of the format.
    #[error("{at}: unknown operation `{operation}`{}", Suggest(nearest))]
    UnknownOperation {
        /// Where.
        at: Place,
        /// The word.
        operation: String,
        /// Most similar operation, when one is close.
        nearest: Option<&'static str>,
    },
    /// An operation that a chart cannot say.
    #[error("{at}: `{operation}` cannot be charted: {why}")]
    DoesNotMap {
        /// Where.
        at: Place,
        /// The operation.
        operation: String,
        /// Why.
        why: String,
    },
    /// The rows do not make a chart.
    #[error(transparent)]
    Chart(#[from] ChartError),
}

/// Something that was left out or simplified.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KnitoutWarning {
    /// Where.
    pub at: Place,
    /// What.
    pub message: String,
}

/// A knitout file as a chart.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Knitout {
    /// The rows, seen from the front bed.
    pub chart: Chart,
    /// What was left out or simplified.
    pub warnings: Vec<KnitoutWarning>,
}

/// Reads a knitout file.
///
/// # Errors
/// [`KnitoutError`] for the first operation that does not fit.
pub fn read_knitout(text: &str) -> Result<Knitout, KnitoutError> {
    let first = text.lines().next().unwrap_or_default();
    let version = first.strip_prefix(";!knitout-").unwrap_or_default();
    if version.is_empty() || !version.bytes().all(|b| b.is_ascii_digit()) {
        return Err(KnitoutError::Magic);
    }
    let mut machine = Machine::default();
    let mut start = 0;
    for (k, line) in text.split('\n').enumerate() {
        let code = &line[..line.find(';').unwrap_or(line.len())];
        let words: Vec<&str> = code.split_whitespace().collect();
        let lead = code.len() - code.trim_start().len();
        let place = Place {
            line: k + 1,
            column: code[..lead].chars().count() + 1,
            span: start + lead..start + lead + code.trim().len(),
        };
        if k == 0 && version != "2" {
            machine.warn(&place, format!("version {version} is read as version 2"));
        }
        if !words.is_empty() {
            machine.place = Some(place);
            machine.operation = code.trim().to_owned();
            machine.execute(words[0], &words[1..])?;
        }
        start += line.len() + 1;
    }
    machine.finish()
}
