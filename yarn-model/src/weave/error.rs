use crate::YarnError;
use crate::chart::Place;

/// Which of the two families of yarns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// Along the length of the cloth.
    Warp,
    /// Across.
    Weft,
}

impl std::fmt::Display for Family {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Warp => "warp",
            Self::Weft => "weft",
        })
    }
}

/// What can be wrong with a weave draft or the cloth woven from it.
///
/// Warps, wefts, shafts and treadles are counted from 1.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum WeaveError {
    /// A mistake in a text, and where.
    #[error("{at}: {source}")]
    At {
        /// The place.
        at: Place,
        /// The mistake.
        source: Box<WeaveError>,
    },
    /// No warp or no weft.
    #[error("the draft has no {what}")]
    Empty {
        /// What there is none of.
        what: &'static str,
    },
    /// Rows of a matrix that differ in length.
    #[error("row {row} has {length} symbols, the rows before have {expected}")]
    RowLength {
        /// The row, from the first one given.
        row: usize,
        /// Its symbols.
        length: usize,
        /// Symbols of the first row.
        expected: usize,
    },
    /// A symbol of a matrix that is neither warp nor weft.
    #[error("unknown symbol `{symbol}`: X, | or 1 is the warp on top, . - or 0 the weft")]
    Symbol {
        /// The symbol.
        symbol: char,
    },
    /// A word that is not understood where it stands.
    #[error("`{found}`: expected {expected}")]
    Expected {
        /// The word.
        found: String,
        /// What could stand there.
        expected: &'static str,
    },
    /// A part given twice.
    #[error("{what} is given twice")]
    Twice {
        /// The part.
        what: String,
    },
    /// A part that is missing.
    #[error("{what} is missing: a draft is a matrix, or threading, tie-up and treadling")]
    Missing {
        /// The part.
        what: &'static str,
    },
    /// A matrix next to shafts and treadles.
    #[error("a draft is either a matrix, or threading, tie-up and treadling; not both")]
    Mixed,
    /// A shaft or treadle that the loom does not have.
    #[error("{what} {index} does not exist: there are {count}, numbered from 1")]
    OutOfRange {
        /// Shaft or treadle.
        what: &'static str,
        /// Its number.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// More than can be handled.
    #[error("{count} {what}: at most {limit} are allowed")]
    TooMany {
        /// Of what.
        what: &'static str,
        /// Wanted.
        count: usize,
        /// Allowed.
        limit: usize,
    },
    /// A yarn that stays on one side over the whole repeat and is not held.
    #[error("{family} {index} floats {side} every {other} of the repeat: nothing holds it")]
    Float {
        /// Its family.
        family: Family,
        /// Its number.
        index: usize,
        /// Over or under.
        side: &'static str,
        /// The other family.
        other: Family,
    },
    /// A name that is no built-in weave.
    #[error("there is no weave `{name}`; there are {known}")]
    UnknownWeave {
        /// The name.
        name: String,
        /// All names.
        known: String,
    },
    /// A measure of the cloth outside its range.
    #[error("{what} = {value}: must be {allowed}")]
    Parameter {
        /// The measure.
        what: &'static str,
        /// Its value, in SI units.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// The network does not fit together.
    #[error(transparent)]
    Network(#[from] YarnError),
}

impl WeaveError {
    /// Place in the text, if the mistake has one.
    pub fn place(&self) -> Option<&Place> {
        match self {
            Self::At { at, .. } => Some(at),
            _ => None,
        }
    }

    pub(super) fn at(self, at: impl Into<Place>) -> Self {
        let (at, source) = (at.into(), Box::new(self));
        Self::At { at, source }
    }
}
