use std::fmt;
use std::ops::Range;

/// Where something stands in a text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// Bytes of the whole text.
    pub span: Range<usize>,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.line, self.column)
    }
}

/// What can be wrong with a stitch chart.
///
/// Rows are numbered as written, from 1; stitches in the order of working,
/// from 1, repeats written out. Charts that were not read from text have no
/// place.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ChartError {
    /// Text that does not follow the format.
    #[error("{at}: {message}")]
    Syntax {
        /// Where.
        at: Place,
        /// What is expected.
        message: String,
    },
    /// A word that is no operation.
    #[error(
        "{at}: row {row}, stitch {stitch}: unknown operation `{word}`{}",
        Suggest(nearest)
    )]
    UnknownOperation {
        /// Where.
        at: Place,
        /// The row.
        row: usize,
        /// Operations before it in the row as written, plus one.
        stitch: usize,
        /// The word.
        word: String,
        /// Most similar operation, when one is close.
        nearest: Option<&'static str>,
    },
    /// A stack that would split.
    #[error(
        "{at}: row {row}, stitch {stitch}: `{word}` draws {children} loops through {parents} at \
         once; the stack would split, work {parents} into one and then one into {children}"
    )]
    SplitStack {
        /// Where.
        at: Place,
        /// The row.
        row: usize,
        /// Operations before it in the row as written, plus one.
        stitch: usize,
        /// The word.
        word: String,
        /// Loops taken.
        parents: usize,
        /// Loops made.
        children: usize,
    },
    /// A row that takes more or fewer stitches than the one before leaves.
    #[error(
        "{}row {row}, stitch {stitch}: the row takes {takes} stitches, {} leaves {left}",
        At(at),
        Before(row)
    )]
    Unbalanced {
        /// Where.
        at: Option<Place>,
        /// The row.
        row: usize,
        /// Stitch at which it shows.
        stitch: usize,
        /// Stitches that the row takes.
        takes: usize,
        /// Stitches that are there.
        left: usize,
    },
    /// A repeat that does not fill the row.
    #[error(
        "{}row {row}, stitch {stitch}: the repeat takes {repeat} stitches and the rest of the row \
         {rest}; of the {left} that {} leaves {over} do not fit",
        At(at),
        Before(row)
    )]
    Repeat {
        /// Where the repeat is.
        at: Option<Place>,
        /// The row.
        row: usize,
        /// First stitch of the repeat.
        stitch: usize,
        /// Stitches that one repeat takes.
        repeat: usize,
        /// Stitches outside the repeat.
        rest: usize,
        /// Stitches that are there.
        left: usize,
        /// Stitches left over, or missing.
        over: usize,
    },
    /// A decrease whose loops would lie beyond the edge.
    #[error(
        "{}row {row}, stitch {stitch}: `{op}` at the border takes {needs} stitches, {left} are left",
        At(at)
    )]
    DecreaseAtBorder {
        /// Where.
        at: Option<Place>,
        /// The row.
        row: usize,
        /// The stitch.
        stitch: usize,
        /// Its operation.
        op: String,
        /// Stitches that it takes.
        needs: usize,
        /// Stitches that are left.
        left: usize,
    },
    /// A width that is not a multiple of the repeat.
    #[error("{width} stitches: the chart needs {multiple}·n + {plus} (for example {nearest})")]
    Width {
        /// The width asked for.
        width: usize,
        /// Stitches of a repeat.
        multiple: usize,
        /// Stitches at the edges.
        plus: usize,
        /// Nearest width that fits.
        nearest: usize,
    },
    /// Rows that are worked from the same side twice.
    #[error("{}row {row} is marked {}, but is worked from the other side", At(at), Side(*ws))]
    Side {
        /// Where.
        at: Option<Place>,
        /// The row.
        row: usize,
        /// Whether it is marked as a wrong-side row.
        ws: bool,
    },
    /// A row that is missing.
    #[error("row {row} is missing: rows are numbered from 1 to {last} without gaps")]
    MissingRow {
        /// The row.
        row: usize,
        /// The last row.
        last: usize,
    },
    /// More stitches than this program takes.
    #[error("{}{what}: {value} is more than {limit}", At(at))]
    TooLarge {
        /// Where.
        at: Option<Place>,
        /// What is too large.
        what: &'static str,
        /// Its size.
        value: usize,
        /// The largest possible.
        limit: usize,
    },
    /// A chart without stitches.
    #[error("{}the chart has no {what}", At(at))]
    Empty {
        /// Where.
        at: Option<Place>,
        /// What is missing.
        what: &'static str,
    },
    /// No built-in chart of that name.
    #[error("no chart `{name}`{}; known: {known}", Suggest(nearest))]
    UnknownChart {
        /// The name.
        name: String,
        /// Most similar name, when one is close.
        nearest: Option<&'static str>,
        /// All names.
        known: String,
    },
}

struct At<'a>(&'a Option<Place>);

impl fmt::Display for At<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Some(at) => write!(f, "{at}: "),
            None => Ok(()),
        }
    }
}

struct Before<'a>(&'a usize);

impl fmt::Display for Before<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self.0 {
            1 => "the row before or the cast-on",
            _ => "the row before",
        })
    }
}

struct Side(bool);

impl fmt::Display for Side {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.0 { "WS" } else { "RS" })
    }
}

pub(super) struct Suggest<'a>(pub &'a Option<&'static str>);

impl fmt::Display for Suggest<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Some(name) => write!(f, " (did you mean `{name}`?)"),
            None => Ok(()),
        }
    }
}

/// The most similar of `known`, when similar enough to be a misspelling.
pub(super) fn nearest(word: &str, known: &[&'static str]) -> Option<&'static str> {
    let word = word.to_lowercase();
    let mut best: Option<(f64, &'static str)> = None;
    for k in known {
        let score = strsim::jaro_winkler(&word, k);
        // The first of equals.
        if score > best.map_or(0.6, |b| b.0) {
            best = Some((score, k));
        }
    }
    best.map(|b| b.1)
}
