use super::rows::{balance, checked, checked_total};
use super::{Chart, ChartError, ChartRow, Op, Place};

/// A row as written, in the order of working.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct WrittenRow {
    pub before: Vec<Word>,
    pub repeat: Option<Vec<Word>>,
    pub after: Vec<Word>,
    /// The whole row.
    pub place: Place,
}

/// An operation and the word that it comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Word {
    pub op: Op,
    /// Index into the places of the pattern.
    pub place: u32,
}

/// A chart as written: rows with a repeat, for any width that fits.
///
/// ```
/// use selvedge_yarn_model::chart::StitchPattern;
/// let lace = StitchPattern::parse(
///     "name: eyelets\nmultiple: 4\nplus: 1\nrow 1: k *yo k2tog k2*\nrow 2: *p*\n",
/// )?;
/// let chart = lace.chart(5, 2)?;
/// assert_eq!((chart.cast_on(), chart.rows().len()), (21, 4));
/// # Ok::<(), selvedge_yarn_model::chart::ChartError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StitchPattern {
    pub(super) name: String,
    pub(super) multiple: usize,
    pub(super) plus: usize,
    pub(super) first_ws: bool,
    /// Index of the written row of every row.
    pub(super) rows: Vec<u32>,
    pub(super) written: Vec<WrittenRow>,
    pub(super) places: Vec<Place>,
    /// Rows with a side mark: row, wrong side, place.
    pub(super) marks: Vec<(usize, bool, Place)>,
}

impl StitchPattern {
    /// What it is called; may be empty.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Stitches of a repeat at the cast-on; 0 for a fixed width.
    pub fn multiple(&self) -> usize {
        self.multiple
    }

    /// Stitches at the edges at the cast-on.
    pub fn plus(&self) -> usize {
        self.plus
    }

    /// Rows of one vertical repeat.
    pub fn rows(&self) -> usize {
        self.rows.len()
    }

    /// The chart for a number of repeats across and upwards.
    ///
    /// # Errors
    /// [`ChartError`] when a row does not fit the one before.
    pub fn chart(&self, across: usize, upwards: usize) -> Result<Chart, ChartError> {
        let width = across.saturating_mul(self.multiple);
        let rows = upwards.saturating_mul(self.rows.len());
        self.expand(width.saturating_add(self.plus), rows)
    }

    /// The chart for a number of stitches cast on and a number of rows, which
    /// may end within a vertical repeat.
    ///
    /// # Errors
    /// [`ChartError::Width`] when the width does not fit, others when a row
    /// does not fit the one before.
    pub fn chart_of(&self, stitches: usize, rows: usize) -> Result<Chart, ChartError> {
        let (multiple, plus) = (self.multiple, self.plus);
        let over = stitches.saturating_sub(plus);
        let fits = match multiple {
            0 => stitches == plus,
            m => stitches >= plus && over.is_multiple_of(m),
        };
        if !fits {
            let n = match multiple {
                0 => 0,
                m => (over + m / 2) / m,
            };
            let least = usize::from(plus == 0);
            let nearest = n.max(least) * multiple + plus;
            return Err(ChartError::Width {
                width: stitches,
                multiple,
                plus,
                nearest,
            });
        }
        self.expand(stitches, rows)
    }

    fn expand(&self, width: usize, rows: usize) -> Result<Chart, ChartError> {
        if width == 0 || rows == 0 {
            let what = if width == 0 { "stitches" } else { "rows" };
            return Err(ChartError::Empty { at: None, what });
        }
        let mut left = checked(width)?;
        let mut total = left;
        let mut made = Vec::new();
        for (row, ws, place) in &self.marks {
            if *ws != (self.first_ws ^ (row % 2 == 0)) {
                return Err(ChartError::Side {
                    at: Some(place.clone()),
                    row: *row,
                    ws: *ws,
                });
            }
        }
        // An odd number of rows changes side at every vertical repeat.
        if rows > self.rows.len()
            && self.rows.len() % 2 == 1
            && let Some((row, ws, place)) = self.marks.first()
        {
            return Err(ChartError::Side {
                at: Some(place.clone()),
                row: *row,
                ws: *ws,
            });
        }
        for r in 0..rows {
            let number = r % self.rows.len();
            let written = &self.written[self.rows[number] as usize];
            let words = self.fill(written, number + 1, left)?;
            let place = |k: usize| {
                let word = words.get(k).map(|w| self.place(w));
                word.or_else(|| Some(written.place.clone()))
            };
            let ops = words.iter().map(|w| w.op);
            left = checked(balance(ops.clone(), left, number + 1, place)?)?;
            total = checked_total(total + left)?;
            let ws = self.first_ws ^ (r % 2 == 1);
            let stitches = match ws {
                true => ops.map(Op::turned).collect(),
                false => ops.rev().collect(),
            };
            made.push(ChartRow { ws, stitches });
        }
        Chart::new(self.name.clone(), width, made)
    }

    fn place(&self, word: &Word) -> Place {
        self.places[word.place as usize].clone()
    }

    /// Words of a row with the repeat written out for `left` loops.
    fn fill(&self, row: &WrittenRow, number: usize, left: usize) -> Result<Vec<Word>, ChartError> {
        let takes = |words: &[Word]| -> usize { words.iter().map(|w| w.op.takes()).sum() };
        let mut words = row.before.clone();
        if let Some(body) = &row.repeat {
            let repeat = takes(body);
            let rest = takes(&row.before) + takes(&row.after);
            let free = left.checked_sub(rest);
            // The parser refuses repeats that take nothing.
            let over = match free {
                Some(free) => free % repeat.max(1),
                None => rest - left,
            };
            if over != 0 {
                let edge = self.decrease_across_edge(row, number, left);
                return Err(edge.unwrap_or_else(|| ChartError::Repeat {
                    at: body.first().map(|w| self.place(w)),
                    row: number,
                    stitch: row.before.len() + 1,
                    repeat,
                    rest,
                    left,
                    over,
                }));
            }
            let times = free.unwrap_or(0) / repeat.max(1);
            checked(times.saturating_mul(body.len()))?;
            for _ in 0..times {
                words.extend_from_slice(body);
            }
        }
        words.extend_from_slice(&row.after);
        Ok(words)
    }

    /// The decrease that would reach over the edge when the repeat is worked
    /// as often as it begins within the row.
    fn decrease_across_edge(
        &self,
        row: &WrittenRow,
        number: usize,
        left: usize,
    ) -> Option<ChartError> {
        if !row.after.is_empty() {
            return None;
        }
        let body = row.repeat.as_ref()?;
        let words = row.before.iter().chain(body.iter().cycle());
        let mut remaining = left;
        for (k, word) in words.enumerate() {
            let needs = word.op.takes();
            if needs > remaining {
                return (remaining > 0).then(|| ChartError::DecreaseAtBorder {
                    at: Some(self.place(word)),
                    row: number,
                    stitch: k + 1,
                    op: word.op.to_string(),
                    needs,
                    left: remaining,
                });
            }
            remaining -= needs;
            if remaining == 0 {
                return None;
            }
        }
        None
    }
}
