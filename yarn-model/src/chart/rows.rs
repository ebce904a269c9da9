use super::{ChartError, Op, Place};

/// Most stitches of a row.
pub(super) const MAX_WIDTH: usize = 100_000;
/// Most stitches of a chart.
pub(super) const MAX_STITCHES: usize = 20_000_000;

/// A row of a chart as the right side shows it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ChartRow {
    /// Worked from the wrong side, left to right.
    pub ws: bool,
    /// Operations from left to right.
    pub stitches: Vec<Op>,
}

/// Rows of operations, each of which takes the loops that the row before
/// leaves.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Chart {
    name: String,
    cast_on: usize,
    rows: Vec<ChartRow>,
}

impl Chart {
    /// A chart on a number of loops cast on. Sides must alternate.
    ///
    /// # Errors
    /// [`ChartError`] with row and stitch, both from 1; stitches count in the
    /// order of working.
    pub fn new(
        name: impl Into<String>,
        cast_on: usize,
        rows: Vec<ChartRow>,
    ) -> Result<Self, ChartError> {
        let at = None;
        if cast_on == 0 || rows.is_empty() {
            let what = if rows.is_empty() { "rows" } else { "stitches" };
            return Err(ChartError::Empty { at, what });
        }
        let mut left = checked(cast_on)?;
        let mut total = left;
        for (r, row) in rows.iter().enumerate() {
            if row.ws != (rows[0].ws ^ (r % 2 == 1)) {
                let (row, ws) = (r + 1, row.ws);
                return Err(ChartError::Side { at, row, ws });
            }
            let stitches = || row.stitches.iter().copied();
            left = match row.ws {
                true => balance(stitches(), left, r + 1, |_| None)?,
                false => balance(stitches().rev(), left, r + 1, |_| None)?,
            };
            total = checked_total(total + checked(left)?)?;
        }
        let name = name.into();
        Ok(Self {
            name,
            cast_on,
            rows,
        })
    }

    /// What it is called.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Loops cast on.
    pub fn cast_on(&self) -> usize {
        self.cast_on
    }

    /// Rows from the cast-on up.
    pub fn rows(&self) -> &[ChartRow] {
        &self.rows
    }

    /// Number of loops of all rows, cast-on not counted.
    pub fn loops(&self) -> usize {
        let stitches = self.rows.iter().flat_map(|r| &r.stitches);
        stitches.map(|s| s.makes()).sum()
    }
}

/// Loops that a row leaves, given in the order of working on `left` loops.
pub(super) fn balance(
    stitches: impl Iterator<Item = Op> + Clone,
    left: usize,
    row: usize,
    place: impl Fn(usize) -> Option<Place>,
) -> Result<usize, ChartError> {
    let takes = stitches.clone().map(Op::takes).sum();
    let (mut remaining, mut made, mut last) = (left, 0, 0);
    for (k, op) in stitches.enumerate() {
        let needs = op.takes();
        if needs > remaining {
            let (at, stitch) = (place(k), k + 1);
            return Err(if needs > 1 && remaining > 0 {
                ChartError::DecreaseAtBorder {
                    at,
                    row,
                    stitch,
                    op: op.to_string(),
                    needs,
                    left: remaining,
                }
            } else {
                ChartError::Unbalanced {
                    at,
                    row,
                    stitch,
                    takes,
                    left,
                }
            });
        }
        remaining -= needs;
        made += op.makes();
        last = k;
    }
    if remaining > 0 || made == 0 {
        return Err(ChartError::Unbalanced {
            at: place(last),
            row,
            stitch: last + 1,
            takes,
            left,
        });
    }
    Ok(made)
}

/// A width that is not too large.
pub(super) fn checked(width: usize) -> Result<usize, ChartError> {
    limited("stitches of a row", width, MAX_WIDTH)
}

/// A number of stitches that is not too large.
pub(super) fn checked_total(stitches: usize) -> Result<usize, ChartError> {
    limited("stitches of the chart", stitches, MAX_STITCHES)
}

fn limited(what: &'static str, value: usize, limit: usize) -> Result<usize, ChartError> {
    if value <= limit {
        return Ok(value);
    }
    Err(ChartError::TooLarge {
        at: None,
        what,
        value,
        limit,
    })
}
