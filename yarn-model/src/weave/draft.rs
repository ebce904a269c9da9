use super::{Family, WeaveError};

/// Most shafts and most treadles of a loom.
pub(super) const LIMIT: usize = 4096;
/// Most crossings of a repeat.
const REPEAT: usize = 1 << 24;

/// The repeat of a weave: which yarn is on top, for every warp over every weft.
///
/// Seen from the right side, warp `i` is the `i`-th from the left and weft `j`
/// the `j`-th from below; both families repeat without end.
///
/// # Text format
///
/// Either a picture of the cloth's right side, the last weft on top: `X`, `|`
/// or `1` where the warp is on top, `.`, `-` or `0` where the weft is; spaces
/// between symbols do not count.
///
/// ```text
/// # 2/2 twill
/// matrix
///   . X X .
///   X X . .
///   X . . X
///   . . X X
/// ```
///
/// Or the loom: the shaft of every warp from the left; for every treadle the
/// shafts that it raises; the treadle of every weft, the first woven (lowest)
/// first, `1+3` for two treadles at once. Lists may go on over several lines.
///
/// ```text
/// threading 1 2 3 4
/// tie-up
///   1: 1 2
///   2: 2 3
///   3: 3 4
///   4: 4 1
/// treadling 1 2 3 4
/// ```
///
/// `#` starts a comment. [`Display`](std::fmt::Display) writes the first form.
///
/// ```
/// use selvedge_yarn_model::Draft;
///
/// let twill = Draft::named("twill-2-2")?;
/// assert_eq!([twill.warps(), twill.wefts()], [4, 4]);
/// assert!(twill.warp_over(1, 0) && !twill.warp_over(2, 4));
/// # Ok::<(), selvedge_yarn_model::WeaveError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Draft {
    warps: usize,
    /// Whether the warp is on top; weft by weft.
    over: Vec<bool>,
}

impl Draft {
    /// Names of the built-in weaves.
    pub const NAMES: [&'static str; 4] = ["plain", "twill-2-2", "satin-5", "basket-2-2"];

    /// A built-in weave. Warp `i` is over weft `j` where
    ///
    /// ```text
    /// plain        (i + j) mod 2 = 0
    /// twill-2-2    (i − j) mod 4 < 2
    /// satin-5      (i + 2 j) mod 5 = 0
    /// basket-2-2   (⌊i/2⌋ + ⌊j/2⌋) mod 2 = 0
    /// ```
    ///
    /// # Errors
    /// [`WeaveError::UnknownWeave`].
    pub fn named(name: &str) -> Result<Self, WeaveError> {
        let (period, over): (usize, fn(usize, usize) -> bool) = match name {
            "plain" => (2, |i, j| (i + j) % 2 == 0),
            "twill-2-2" => (4, |i, j| (i + 4 - j) % 4 < 2),
            "satin-5" => (5, |i, j| (i + 2 * j) % 5 == 0),
            "basket-2-2" => (4, |i, j| (i / 2 + j / 2) % 2 == 0),
            _ => {
                return Err(WeaveError::UnknownWeave {
                    name: name.into(),
                    known: Self::NAMES.join(", "),
                });
            }
        };
        let row = |j| (0..period).map(|i| over(i, j)).collect::<Vec<_>>();
        Self::from_rows(&(0..period).map(row).collect::<Vec<_>>())
    }

    /// A draft from its wefts, the lowest first: for every warp, whether it is
    /// on top.
    ///
    /// # Errors
    /// [`WeaveError`] for an empty or ragged matrix, or a yarn that floats over
    /// the whole repeat.
    pub fn from_rows<R: AsRef<[bool]>>(rows: &[R]) -> Result<Self, WeaveError> {
        let warps = rows.first().map_or(0, |row| row.as_ref().len());
        let mut over = Vec::with_capacity(rows.len() * warps);
        for (j, row) in rows.iter().enumerate() {
            let row = row.as_ref();
            if row.len() != warps {
                return Err(WeaveError::RowLength {
                    row: j + 1,
                    length: row.len(),
                    expected: warps,
                });
            }
            over.extend_from_slice(row);
        }
        if rows.is_empty() {
            return Err(WeaveError::Empty { what: "weft" });
        }
        if warps == 0 {
            return Err(WeaveError::Empty { what: "warp" });
        }
        let draft = Self { warps, over };
        match draft.floating() {
            Some((family, index)) => Err(draft.float_error(family, index)),
            None => Ok(draft),
        }
    }

    /// A draft from a loom: the shaft that carries every warp, the shafts that
    /// every treadle raises, and the treadles pressed for every weft, lowest
    /// first. Shafts and treadles count from 1. A warp is on top where its
    /// shaft is raised.
    ///
    /// # Errors
    /// [`WeaveError`] as for [`from_rows`](Self::from_rows), and for a shaft
    /// that carries no warp or does not exist, or a treadle that does not
    /// exist.
    pub fn from_loom(
        threading: &[usize],
        tie_up: &[Vec<usize>],
        treadling: &[Vec<usize>],
    ) -> Result<Self, WeaveError> {
        let shafts = threading.iter().copied().max().unwrap_or(0);
        limit("shafts", shafts, LIMIT)?;
        limit("treadles", tie_up.len(), LIMIT)?;
        limit(
            "crossings in the repeat",
            threading.len().saturating_mul(treadling.len()),
            REPEAT,
        )?;
        for shaft in threading {
            exists("shaft", *shaft, shafts)?;
        }
        for shaft in tie_up.iter().flatten() {
            exists("shaft", *shaft, shafts)?;
        }
        let mut rows = Vec::with_capacity(treadling.len());
        for pressed in treadling {
            let mut raised = vec![false; shafts];
            for treadle in pressed {
                exists("treadle", *treadle, tie_up.len())?;
                for shaft in &tie_up[treadle - 1] {
                    raised[shaft - 1] = true;
                }
            }
            rows.push(threading.iter().map(|s| raised[s - 1]).collect::<Vec<_>>());
        }
        Self::from_rows(&rows)
    }

    /// Warps of the repeat.
    pub fn warps(&self) -> usize {
        self.warps
    }

    /// Wefts of the repeat.
    pub fn wefts(&self) -> usize {
        self.over.len() / self.warps
    }

    /// Whether the warp is on top; any numbers from 0, taken modulo the repeat.
    pub fn warp_over(&self, warp: usize, weft: usize) -> bool {
        self.over[(weft % self.wefts()) * self.warps + warp % self.warps]
    }

    /// First yarn that never changes sides, numbered from 0.
    fn floating(&self) -> Option<(Family, usize)> {
        let (warps, wefts) = (self.warps, self.wefts());
        let warp = |i: &usize| (0..wefts).all(|j| self.warp_over(*i, j) == self.warp_over(*i, 0));
        let weft = |j: &usize| (0..warps).all(|i| self.warp_over(i, *j) == self.warp_over(0, *j));
        let warp = (0..warps).find(warp).map(|i| (Family::Warp, i));
        warp.or_else(|| (0..wefts).find(weft).map(|j| (Family::Weft, j)))
    }

    fn float_error(&self, family: Family, index: usize) -> WeaveError {
        let (over, other) = match family {
            Family::Warp => (self.warp_over(index, 0), Family::Weft),
            Family::Weft => (!self.warp_over(0, index), Family::Warp),
        };
        WeaveError::Float {
            family,
            index: index + 1,
            side: if over { "over" } else { "under" },
            other,
        }
    }
}

pub(super) fn limit(what: &'static str, count: usize, limit: usize) -> Result<(), WeaveError> {
    match count > limit {
        true => Err(WeaveError::TooMany { what, count, limit }),
        false => Ok(()),
    }
}

fn exists(what: &'static str, index: usize, count: usize) -> Result<(), WeaveError> {
    match index == 0 || index > count {
        true => Err(WeaveError::OutOfRange { what, index, count }),
        false => Ok(()),
    }
}
