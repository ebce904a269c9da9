use std::ops::Range;

use super::error::nearest;
use super::expand::WrittenRow;
use super::rows::MAX_WIDTH;
use super::{ChartError, Place, StitchPattern};

/// Most rows of a written chart.
const MAX_ROWS: usize = 10_000;

impl StitchPattern {
    /// Reads the [text format](super), and checks with two and three repeats that
    /// every row fits the one before.
    ///
    /// # Errors
    /// [`ChartError`] for the first mistake, with its place in the text.
    pub fn parse(text: &str) -> Result<Self, ChartError> {
        let mut reader = Reader::new(text);
        let mut start = 0;
        for (k, line) in text.split('\n').enumerate() {
            reader.line = k + 1;
            reader.line_start = start;
            reader.read_line(start..start + line.len())?;
            start += line.len() + 1;
        }
        let pattern = reader.finish()?;
        // A repeat of the wrong size may fit one of the widths by chance.
        for across in 2..=3 {
            pattern.chart(across, 1)?;
        }
        Ok(pattern)
    }
}

/// Text read so far.
pub(super) struct Reader<'t> {
    pub(super) text: &'t str,
    line: usize,
    line_start: usize,
    name: String,
    multiple: Option<usize>,
    plus: Option<usize>,
    /// Written row of every row number, from 1.
    numbered: Vec<Option<u32>>,
    written: Vec<WrittenRow>,
    pub(super) places: Vec<Place>,
    marks: Vec<(usize, bool, Place)>,
    pub(super) operations: usize,
}

impl<'t> Reader<'t> {
    fn new(text: &'t str) -> Self {
        Self {
            text,
            line: 1,
            line_start: 0,
            name: String::new(),
            multiple: None,
            plus: None,
            numbered: Vec::new(),
            written: Vec::new(),
            places: Vec::new(),
            marks: Vec::new(),
            operations: 0,
        }
    }

    pub(super) fn place(&self, span: Range<usize>) -> Place {
        let before = &self.text[self.line_start..span.start];
        Place {
            line: self.line,
            column: before.chars().count() + 1,
            span,
        }
    }

    pub(super) fn syntax<T>(
        &self,
        span: Range<usize>,
        message: impl Into<String>,
    ) -> Result<T, ChartError> {
        Err(ChartError::Syntax {
            at: self.place(span),
            message: message.into(),
        })
    }

    fn trimmed(&self, span: Range<usize>) -> Range<usize> {
        let text = &self.text[span.clone()];
        let start = span.start + (text.len() - text.trim_start().len());
        start..(start + text.trim().len())
    }

    fn read_line(&mut self, line: Range<usize>) -> Result<(), ChartError> {
        let text = &self.text[line.clone()];
        let end = line.start + text.find('#').unwrap_or(text.len());
        let line = self.trimmed(line.start..end);
        if line.is_empty() {
            return Ok(());
        }
        let text = &self.text[line.clone()];
        let Some(colon) = text.find(':') else {
            return self.syntax(line, "expected `key: value` or `row 1: stitches`");
        };
        let key = self.trimmed(line.start..line.start + colon);
        let value = self.trimmed(line.start + colon + 1..line.end);
        let word = self.text[key.clone()].to_ascii_lowercase();
        match word.as_str() {
            "name" => self.name = self.text[value].to_owned(),
            "multiple" => self.multiple = Some(self.header(self.multiple, key, value)?),
            "plus" => self.plus = Some(self.header(self.plus, key, value)?),
            _ if word.starts_with("row") => return self.read_row(key, value),
            _ => {
                let known = ["name", "multiple", "plus", "row"];
                let hint = match nearest(&word, &known) {
                    Some(k) => format!(" (did you mean `{k}`?)"),
                    None => String::new(),
                };
                let message = format!("unknown key `{word}`{hint}; known: {}", known.join(", "));
                return self.syntax(key, message);
            }
        }
        Ok(())
    }

    fn header(
        &self,
        old: Option<usize>,
        key: Range<usize>,
        value: Range<usize>,
    ) -> Result<usize, ChartError> {
        if old.is_some() {
            return self.syntax(key, "given twice");
        }
        self.number(value, MAX_WIDTH)
    }

    pub(super) fn number(&self, span: Range<usize>, limit: usize) -> Result<usize, ChartError> {
        let text = &self.text[span.clone()];
        if text.is_empty() || !text.bytes().all(|b| b.is_ascii_digit()) {
            return self.syntax(span, format!("expected a whole number, found `{text}`"));
        }
        match text.parse() {
            Ok(n) if n <= limit => Ok(n),
            n => Err(ChartError::TooLarge {
                at: Some(self.place(span)),
                what: "number",
                value: n.unwrap_or(usize::MAX),
                limit,
            }),
        }
    }

    /// `row 1, 3, 5-8 RS`
    fn read_row(&mut self, head: Range<usize>, body: Range<usize>) -> Result<(), ChartError> {
        let text = &self.text[head.clone()];
        let skip = if text[3..].starts_with(['s', 'S']) {
            4
        } else {
            3
        };
        let mut rest = self.trimmed(head.start + skip..head.end);
        let upper = self.text[rest.clone()].to_ascii_uppercase();
        let ws = match (upper.ends_with("RS"), upper.ends_with("WS")) {
            (true, _) => Some(false),
            (_, true) => Some(true),
            _ => None,
        };
        if ws.is_some() {
            rest = self.trimmed(rest.start..rest.end - 2);
        }
        let index = self.written.len() as u32;
        let mut number = None;
        let mut start = rest.start;
        for part in self.text[rest.clone()].split(',') {
            let span = self.trimmed(start..start + part.len());
            start += part.len() + 1;
            let part = &self.text[span.clone()];
            let (from, to) = match part.find('-') {
                Some(dash) => (
                    self.trimmed(span.start..span.start + dash),
                    self.trimmed(span.start + dash + 1..span.end),
                ),
                None => (span.clone(), span.clone()),
            };
            let from = self.number(from, MAX_ROWS)?;
            let to = self.number(to, MAX_ROWS)?;
            if from == 0 || to < from {
                return self.syntax(span, "rows are numbered from 1, ranges from low to high");
            }
            if self.numbered.len() < to {
                self.numbered.resize(to, None);
            }
            for row in from..=to {
                if self.numbered[row - 1].is_some() {
                    return self.syntax(span, format!("row {row} is given twice"));
                }
                self.numbered[row - 1] = Some(index);
                if let Some(ws) = ws {
                    self.marks.push((row, ws, self.place(span.clone())));
                }
            }
            number.get_or_insert(from);
        }
        let row = self.read_stitches(number.unwrap_or(1), body)?;
        self.written.push(row);
        Ok(())
    }

    fn finish(self) -> Result<StitchPattern, ChartError> {
        let last = self.numbered.len();
        let mut rows = Vec::with_capacity(last);
        for (k, row) in self.numbered.iter().enumerate() {
            let row = row.ok_or(ChartError::MissingRow { row: k + 1, last })?;
            rows.push(row);
        }
        if rows.is_empty() {
            let what = "rows";
            return Err(ChartError::Empty { at: None, what });
        }
        let mut marks = self.marks;
        marks.sort_by_key(|m| m.0);
        let first_ws = marks.first().is_some_and(|m| m.1 ^ (m.0 % 2 == 0));
        Ok(StitchPattern {
            name: self.name,
            multiple: self.multiple.unwrap_or(1),
            plus: self.plus.unwrap_or(0),
            first_ws,
            rows,
            written: self.written,
            places: self.places,
            marks,
        })
    }
}
