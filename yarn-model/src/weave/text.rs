//! Drafts as text.

use std::fmt;
use std::str::FromStr;

use super::draft::{LIMIT, limit};
use super::{Draft, Family, WeaveError};
use crate::chart::Place;

impl FromStr for Draft {
    type Err = WeaveError;

    fn from_str(text: &str) -> Result<Self, WeaveError> {
        let parts = Parts::read(text)?;
        let end = Span {
            line: text.lines().count().max(1),
            column: text.lines().last().unwrap_or("").chars().count() + 1,
            start: text.len(),
            end: text.len(),
        };
        let loom = [
            (parts.threading.is_some(), "threading"),
            (parts.tie_up.is_some(), "tie-up"),
            (parts.treadling.is_some(), "treadling"),
        ];
        match parts.matrix {
            Some((at, _)) if loom.iter().any(|(given, _)| *given) => Err(WeaveError::Mixed.at(at)),
            Some((at, rows)) => picture(at, rows),
            None if loom.iter().all(|(given, _)| !given) => {
                Err(WeaveError::Missing { what: "a matrix" }.at(end))
            }
            None => match (parts.threading, parts.tie_up, parts.treadling) {
                (Some(threading), Some(tie_up), Some(treadling)) => {
                    woven_by(threading, tie_up, treadling)
                }
                _ => {
                    let missing = loom.into_iter().find(|(given, _)| !given);
                    let what = missing.map_or("threading", |(_, what)| what);
                    Err(WeaveError::Missing { what }.at(end))
                }
            },
        }
    }
}

impl fmt::Display for Draft {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "matrix")?;
        for j in (0..self.wefts()).rev() {
            for i in 0..self.warps() {
                f.write_str(if self.warp_over(i, j) { "X" } else { "." })?;
            }
            writeln!(f)?;
        }
        Ok(())
    }
}

/// Where symbols stand, to become a [`Place`].
#[derive(Clone, Copy)]
struct Span {
    /// Line and column in characters, from 1.
    line: usize,
    column: usize,
    /// Bytes of the text.
    start: usize,
    end: usize,
}

impl From<Span> for Place {
    fn from(at: Span) -> Self {
        Self {
            line: at.line,
            column: at.column,
            span: at.start..at.end,
        }
    }
}

/// A row of a picture: where it stands, and where its symbols do.
type Row = (Span, Vec<(Span, bool)>);
/// Where a part starts, and what it holds.
type Part<T> = Option<(Span, Vec<T>)>;
/// A number and where it stands.
type Number = (Span, usize);

#[derive(Default)]
struct Parts {
    matrix: Part<Row>,
    threading: Part<Number>,
    /// Treadles in the order of the text, with the shafts that they raise.
    tie_up: Part<(Number, Vec<Number>)>,
    /// Treadles of every weft.
    treadling: Part<Vec<Number>>,
}

#[derive(Clone, Copy)]
enum Section {
    Matrix,
    Threading,
    TieUp,
    Treadling,
}

impl Parts {
    fn read(text: &str) -> Result<Self, WeaveError> {
        let mut parts = Self::default();
        let mut section = None;
        let mut start = 0;
        for (k, whole) in text.split_inclusive('\n').enumerate() {
            let line = whole.split('#').next().unwrap_or("");
            let mut words = words(line, k + 1, start);
            start += whole.len();
            if let Some((at, word)) = words.first() {
                let at = *at;
                let (name, next) = match word.as_str() {
                    "matrix" => ("matrix", Some(Section::Matrix)),
                    "threading" => ("threading", Some(Section::Threading)),
                    "tie-up" => ("tie-up", Some(Section::TieUp)),
                    "treadling" => ("treadling", Some(Section::Treadling)),
                    _ => ("", None),
                };
                if let Some(next) = next {
                    let twice = match next {
                        Section::Matrix => parts.matrix.replace((at, Vec::new())).is_some(),
                        Section::Threading => parts.threading.replace((at, Vec::new())).is_some(),
                        Section::TieUp => parts.tie_up.replace((at, Vec::new())).is_some(),
                        Section::Treadling => parts.treadling.replace((at, Vec::new())).is_some(),
                    };
                    if twice {
                        return Err(WeaveError::Twice { what: name.into() }.at(at));
                    }
                    section = Some(next);
                    words.remove(0);
                }
            }
            if !words.is_empty() {
                parts.take(section, &words)?;
            }
        }
        Ok(parts)
    }

    /// Words of one line that belong to a section.
    fn take(&mut self, section: Option<Section>, words: &[Word]) -> Result<(), WeaveError> {
        match section {
            None => {
                Err(unexpected(&words[0], "matrix, threading, tie-up or treadling").at(words[0].0))
            }
            Some(Section::Matrix) => {
                let row = row(words)?;
                self.matrix.iter_mut().for_each(|m| m.1.push(row.clone()));
                Ok(())
            }
            Some(Section::Threading) => {
                for word in words {
                    let number = number(word, "the number of a shaft")?;
                    self.threading.iter_mut().for_each(|t| t.1.push(number));
                }
                Ok(())
            }
            Some(Section::TieUp) => match &mut self.tie_up {
                Some((_, tie_up)) => take_tie_up(tie_up, words),
                None => Ok(()),
            },
            Some(Section::Treadling) => match &mut self.treadling {
                Some((_, treadling)) => take_treadling(treadling, words),
                None => Ok(()),
            },
        }
    }
}

fn take_tie_up(tie_up: &mut Vec<(Number, Vec<Number>)>, words: &[Word]) -> Result<(), WeaveError> {
    let mut k = 0;
    while k < words.len() {
        if words.get(k + 1).is_some_and(|(_, word)| word == ":") {
            let treadle = number(&words[k], "the number of a treadle")?;
            if tie_up.iter().any(|((_, n), _)| *n == treadle.1) {
                let what = format!("treadle {}", treadle.1);
                return Err(WeaveError::Twice { what }.at(treadle.0));
            }
            tie_up.push((treadle, Vec::new()));
            k += 2;
            continue;
        }
        match tie_up.last_mut() {
            Some((_, shafts)) => shafts.push(number(&words[k], "the number of a shaft")?),
            None => {
                let expected = "the number of a treadle and a colon";
                return Err(unexpected(&words[k], expected).at(words[k].0));
            }
        }
        k += 1;
    }
    Ok(())
}

fn take_treadling(treadling: &mut Vec<Vec<Number>>, words: &[Word]) -> Result<(), WeaveError> {
    let mut joined = false;
    for word in words {
        if word.1 == "+" && !joined && !treadling.is_empty() {
            joined = true;
            continue;
        }
        let number = number(word, "the number of a treadle")?;
        match treadling.last_mut() {
            Some(last) if joined => last.push(number),
            _ => treadling.push(vec![number]),
        }
        joined = false;
    }
    match words.last() {
        Some((at, word)) if joined => Err(WeaveError::Expected {
            found: word.clone(),
            expected: "a treadle after +",
        }
        .at(*at)),
        _ => Ok(()),
    }
}

type Word = (Span, String);

/// Words of a line; `:` and `+` are words of their own.
fn words(line: &str, number: usize, start: usize) -> Vec<Word> {
    let mut words: Vec<Word> = Vec::new();
    let mut open = false;
    for (k, (byte, symbol)) in line.char_indices().enumerate() {
        let end = start + byte + symbol.len_utf8();
        let alone = symbol == ':' || symbol == '+';
        if symbol.is_whitespace() {
            open = false;
            continue;
        }
        match words.last_mut() {
            Some((at, word)) if open && !alone => {
                at.end = end;
                word.push(symbol);
            }
            _ => {
                let at = Span {
                    line: number,
                    column: k + 1,
                    start: start + byte,
                    end,
                };
                words.push((at, symbol.into()));
            }
        }
        open = !alone;
    }
    words
}

fn unexpected((_, word): &Word, expected: &'static str) -> WeaveError {
    WeaveError::Expected {
        found: word.clone(),
        expected,
    }
}

fn number(word: &Word, expected: &'static str) -> Result<Number, WeaveError> {
    match word.1.parse::<usize>() {
        Ok(n) if n > 0 => Ok((word.0, n)),
        _ => Err(unexpected(word, expected).at(word.0)),
    }
}

fn row(words: &[Word]) -> Result<Row, WeaveError> {
    let at = Span {
        end: words[words.len() - 1].0.end,
        ..words[0].0
    };
    let mut symbols = Vec::new();
    for (word_at, word) in words {
        for (k, (byte, symbol)) in word.char_indices().enumerate() {
            let at = Span {
                column: word_at.column + k,
                start: word_at.start + byte,
                end: word_at.start + byte + symbol.len_utf8(),
                ..*word_at
            };
            let over = match symbol {
                'X' | 'x' | '|' | '1' => true,
                '.' | '-' | '0' => false,
                _ => return Err(WeaveError::Symbol { symbol }.at(at)),
            };
            symbols.push((at, over));
        }
    }
    Ok((at, symbols))
}

fn picture(at: Span, rows: Vec<Row>) -> Result<Draft, WeaveError> {
    let Some((_, first)) = rows.first() else {
        return Err(WeaveError::Empty { what: "weft" }.at(at));
    };
    for (k, (at, row)) in rows.iter().enumerate() {
        if row.len() != first.len() {
            return Err(WeaveError::RowLength {
                row: k + 1,
                length: row.len(),
                expected: first.len(),
            }
            .at(*at));
        }
    }
    let bare = |row: &Row| row.1.iter().map(|(_, over)| *over).collect::<Vec<_>>();
    let matrix: Vec<Vec<bool>> = rows.iter().rev().map(bare).collect();
    Draft::from_rows(&matrix).map_err(|error| {
        let at = match error {
            WeaveError::Float {
                family: Family::Warp,
                index,
                ..
            } => first[index - 1].0,
            WeaveError::Float { index, .. } => rows[rows.len() - index].0,
            _ => at,
        };
        error.at(at)
    })
}

fn woven_by(
    threading: (Span, Vec<Number>),
    tie_up: (Span, Vec<(Number, Vec<Number>)>),
    treadling: (Span, Vec<Vec<Number>>),
) -> Result<Draft, WeaveError> {
    if threading.1.is_empty() {
        return Err(WeaveError::Empty { what: "warp" }.at(threading.0));
    }
    if treadling.1.is_empty() {
        return Err(WeaveError::Empty { what: "weft" }.at(treadling.0));
    }
    let threaded = threading.1.iter().map(|(_, n)| *n).collect::<Vec<_>>();
    let shafts = threaded.iter().copied().max().unwrap_or(0);
    for (at, shaft) in &threading.1 {
        limit("shafts", *shaft, LIMIT).map_err(|e| e.at(*at))?;
    }
    // No number twice and none above the count: treadles are 1 to the count.
    let treadles = tie_up.1.len();
    let mut raises = vec![Vec::new(); treadles];
    for ((at, treadle), lifted) in &tie_up.1 {
        range("treadle", *treadle, treadles).map_err(|e| e.at(*at))?;
        for (at, shaft) in lifted {
            range("shaft", *shaft, shafts).map_err(|e| e.at(*at))?;
            raises[treadle - 1].push(*shaft);
        }
    }
    let mut wefts = Vec::with_capacity(treadling.1.len());
    for pressed in &treadling.1 {
        for (at, treadle) in pressed {
            range("treadle", *treadle, treadles).map_err(|e| e.at(*at))?;
        }
        wefts.push(pressed.iter().map(|(_, n)| *n).collect::<Vec<_>>());
    }
    Draft::from_loom(&threaded, &raises, &wefts).map_err(|error| {
        let at = match error {
            WeaveError::Float {
                family: Family::Warp,
                index,
                ..
            } => threading.1[index - 1].0,
            WeaveError::Float { index, .. } => treadling.1[index - 1][0].0,
            _ => threading.0,
        };
        error.at(at)
    })
}

fn range(what: &'static str, index: usize, count: usize) -> Result<(), WeaveError> {
    match index > count {
        true => Err(WeaveError::OutOfRange { what, index, count }),
        false => Ok(()),
    }
}
