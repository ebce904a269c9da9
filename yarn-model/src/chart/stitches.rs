use std::ops::Range;

use super::error::nearest;
use super::expand::{Word, WrittenRow};
use super::op::{NAMES, NotAnOp};
use super::parse::Reader;
use super::rows::{MAX_STITCHES, MAX_WIDTH};
use super::{ChartError, MAX_STACK, Op};

/// Deepest nesting of groups.
const MAX_DEPTH: usize = 16;

/// Where the words of a row go.
struct Group {
    words: Vec<Word>,
    /// First word of the item that a count would repeat, if there is one.
    item: Option<usize>,
    opened: Range<usize>,
}

impl Reader<'_> {
    /// Reads what follows the colon of a row.
    pub(super) fn read_stitches(
        &mut self,
        row: usize,
        body: Range<usize>,
    ) -> Result<WrittenRow, ChartError> {
        let group = |opened| Group {
            words: Vec::new(),
            item: None,
            opened,
        };
        let (mut before, mut repeat) = (None, None);
        let mut open = vec![group(body.clone())];
        let mut stitch = 0;
        let bytes = self.text.as_bytes();
        let mut i = body.start;
        while i < body.end {
            let start = i;
            i += 1;
            // There is always the outermost group.
            let depth = open.len();
            let top = &mut open[depth - 1];
            match bytes[start] {
                b',' => top.item = None,
                b if b.is_ascii_whitespace() => {}
                b'(' => {
                    if depth > MAX_DEPTH {
                        return self.syntax(start..i, format!("more than {MAX_DEPTH} groups"));
                    }
                    open.push(group(start..i));
                }
                b')' => {
                    if depth == 1 {
                        return self.syntax(start..i, "`)` without `(`");
                    }
                    let inner = std::mem::take(&mut top.words);
                    open.pop();
                    let outer = &mut open[depth - 2];
                    outer.item = Some(outer.words.len());
                    outer.words.extend(inner);
                    self.limit(outer.words.len(), start..i)?;
                }
                b'*' => {
                    if depth > 1 {
                        return self.syntax(start..i, "`*` within a group");
                    }
                    let words = std::mem::take(&mut top.words);
                    top.item = None;
                    if before.is_none() {
                        before = Some((words, start..i));
                    } else if repeat.is_none() {
                        if words.iter().all(|w| w.op.takes() == 0) {
                            return self.syntax(start..i, "a repeat that takes no stitch");
                        }
                        repeat = Some(words);
                    } else {
                        return self.syntax(start..i, "one repeat a row");
                    }
                }
                b if b.is_ascii_alphanumeric() => {
                    while i < body.end && bytes[i].is_ascii_alphanumeric() {
                        i += 1;
                    }
                    let word = &self.text[start..i];
                    let count = word.strip_prefix(['x', 'X']).filter(|n| !n.is_empty());
                    if count.is_some_and(|n| n.bytes().all(|b| b.is_ascii_digit())) {
                        let Some(first) = top.item.take() else {
                            return self.syntax(start..i, "a count needs something to repeat");
                        };
                        let times = self.number(start + 1..i, MAX_WIDTH)?;
                        let item: Vec<Word> = top.words.drain(first..).collect();
                        let size = times.saturating_mul(item.len());
                        self.limit(top.words.len().saturating_add(size), start..i)?;
                        for _ in 0..times {
                            top.words.extend_from_slice(&item);
                        }
                    } else {
                        stitch += 1;
                        let (op, times) = self.operation(row, stitch, start..i)?;
                        let place = self.places.len() as u32;
                        self.places.push(self.place(start..i));
                        self.limit(top.words.len().saturating_add(times), start..i)?;
                        top.item = Some(top.words.len());
                        top.words.extend((0..times).map(|_| Word { op, place }));
                    }
                }
                _ => {
                    let odd = self.text[start..].chars().next().unwrap_or(' ');
                    let span = start..start + odd.len_utf8();
                    return self.syntax(span, format!("unexpected `{odd}`"));
                }
            }
        }
        if open.len() > 1 {
            let opened = open[open.len() - 1].opened.clone();
            return self.syntax(opened, "`(` is never closed");
        }
        let last = open.pop().map(|g| g.words).unwrap_or_default();
        let (before, after) = match (before, &repeat) {
            (None, _) => (last, Vec::new()),
            (Some((words, _)), Some(_)) => (words, last),
            (Some((_, star)), None) => return self.syntax(star, "the repeat is never closed"),
        };
        self.operations += before.len() + after.len() + repeat.as_ref().map_or(0, Vec::len);
        self.limit_total(body.clone())?;
        if before.is_empty() && after.is_empty() && repeat.is_none() {
            return Err(ChartError::Empty {
                at: Some(self.place(body)),
                what: "stitches in this row",
            });
        }
        Ok(WrittenRow {
            before,
            repeat,
            after,
            place: self.place(body),
        })
    }

    fn limit(&self, value: usize, span: Range<usize>) -> Result<(), ChartError> {
        self.at_most("stitches of a row", value, MAX_WIDTH, span)
    }

    fn limit_total(&self, span: Range<usize>) -> Result<(), ChartError> {
        let value = self.operations;
        self.at_most("stitches of the chart", value, MAX_STITCHES, span)
    }

    fn at_most(
        &self,
        what: &'static str,
        value: usize,
        limit: usize,
        span: Range<usize>,
    ) -> Result<(), ChartError> {
        if value <= limit {
            return Ok(());
        }
        Err(ChartError::TooLarge {
            at: Some(self.place(span)),
            what,
            value,
            limit,
        })
    }

    /// An operation and how often: `k6`, `yo`, `k2tog`.
    fn operation(
        &self,
        row: usize,
        stitch: usize,
        span: Range<usize>,
    ) -> Result<(Op, usize), ChartError> {
        let word = &self.text[span.clone()];
        let at = || self.place(span.clone());
        let failed = match Op::parse(word) {
            Ok(op) => return Ok((op, 1)),
            Err(failed) => failed,
        };
        let name = word.trim_end_matches(|c: char| c.is_ascii_digit());
        match (failed, Op::parse(name)) {
            (NotAnOp::Unknown, Ok(op)) => {
                let times = self.number(span.start + name.len()..span.end, MAX_WIDTH)?;
                Ok((op, times))
            }
            (NotAnOp::Split { parents, children }, _) => Err(ChartError::SplitStack {
                at: at(),
                row,
                stitch,
                word: word.to_owned(),
                parents,
                children,
            }),
            (NotAnOp::Count, _) => self.syntax(
                span.clone(),
                format!("row {row}, stitch {stitch}: `{word}` needs 2 to {MAX_STACK} loops"),
            ),
            _ => Err(ChartError::UnknownOperation {
                at: at(),
                row,
                stitch,
                word: word.to_owned(),
                nearest: nearest(word, &NAMES),
            }),
        }
    }
}
