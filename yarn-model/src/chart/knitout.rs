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

use std::collections::BTreeMap;

use super::error::{Suggest, nearest};
use super::{Chart, ChartError, ChartRow, Op, Place, Stack};

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

const OPERATIONS: [&str; 16] = [
    "in",
    "inhook",
    "releasehook",
    "out",
    "outhook",
    "stitch",
    "rack",
    "knit",
    "tuck",
    "split",
    "drop",
    "amiss",
    "xfer",
    "miss",
    "pause",
    "x-",
];

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

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Needle {
    index: i32,
    back: bool,
    slider: bool,
}

/// A loop on the machine.
#[derive(Clone, Debug)]
struct Held {
    /// Row that made it; 0 is the cast-on.
    row: usize,
    /// Needle on which it was made.
    index: i32,
    operation: (Place, String),
}

/// A loop of the row being made.
struct Made {
    id: usize,
    needle: Needle,
    /// Loops it was drawn through, in the order of their arrival.
    parents: Vec<usize>,
}

#[derive(Default)]
struct Machine {
    needles: BTreeMap<Needle, Vec<usize>>,
    loops: Vec<Held>,
    /// Index of a front needle minus that of the back needle opposite.
    rack: i32,
    /// Row being made, 0 during the cast-on.
    row: usize,
    made: Vec<Made>,
    right: bool,
    /// Loops of the row before, left to right.
    below: Vec<usize>,
    cast_on: usize,
    rows: Vec<ChartRow>,
    dropped: Option<(Place, String)>,
    carriers: Vec<String>,
    warnings: Vec<KnitoutWarning>,
    place: Option<Place>,
    operation: String,
}

impl Machine {
    fn at(&self) -> (Place, String) {
        let start = Place {
            line: 1,
            column: 1,
            span: 0..0,
        };
        (self.place.clone().unwrap_or(start), self.operation.clone())
    }

    fn syntax<T>(&self, message: impl Into<String>) -> Result<T, KnitoutError> {
        let (at, operation) = self.at();
        let message = message.into();
        Err(KnitoutError::Syntax {
            at,
            operation,
            message,
        })
    }

    fn warn(&mut self, at: &Place, message: String) {
        let at = at.clone();
        self.warnings.push(KnitoutWarning { at, message });
    }

    fn execute(&mut self, word: &str, rest: &[&str]) -> Result<(), KnitoutError> {
        match (word, rest) {
            ("in" | "inhook" | "releasehook" | "out" | "outhook" | "stitch" | "pause", _) => Ok(()),
            ("amiss", [_]) | ("miss", [_, _, ..]) => Ok(()),
            ("rack", [r]) => match r.parse::<f64>() {
                Ok(r) if r.abs() <= 1000.0 => {
                    if r.fract() != 0.0 {
                        let at = self.at().0;
                        self.warn(&at, format!("rack {r} is read as {}", r.floor()));
                    }
                    self.rack = r.floor() as i32;
                    Ok(())
                }
                _ => self.syntax("expected a number between -1000 and 1000"),
            },
            ("knit", [_, needle]) | ("drop", [needle]) => {
                let needle = self.needle(needle)?;
                self.needles.remove(&needle);
                let at = self.at();
                self.dropped.get_or_insert(at);
                Ok(())
            }
            ("tuck", [_, _]) => Ok(()),
            ("xfer", [from, to]) | ("split", [_, from, to]) => {
                let (from, to) = (self.needle(from)?, self.needle(to)?);
                self.transfer(from, to)
            }
            ("knit" | "tuck", [direction, needle, carriers @ ..]) => {
                let right = match *direction {
                    "+" => true,
                    "-" => false,
                    _ => return self.syntax("expected direction `+` or `-`"),
                };
                let needle = self.needle(needle)?;
                self.carried(carriers);
                self.form(word == "tuck", right, needle)
            }
            ("split", [_, _, _, _, ..]) => does_not_map(
                self.at(),
                "a loop drawn through loops that stay on the machine",
            ),
            _ if word.starts_with("x-") => {
                let at = self.at().0;
                self.warn(&at, format!("extension `{word}` is ignored"));
                Ok(())
            }
            _ if OPERATIONS.contains(&word) => self.syntax("wrong number of parameters"),
            _ => {
                let (at, _) = self.at();
                Err(KnitoutError::UnknownOperation {
                    at,
                    operation: word.to_owned(),
                    nearest: nearest(word, &OPERATIONS[..15]),
                })
            }
        }
    }

    fn needle(&self, text: &str) -> Result<Needle, KnitoutError> {
        let beds = [
            ("fs", false, true),
            ("bs", true, true),
            ("f", false, false),
            ("b", true, false),
        ];
        for (prefix, back, slider) in beds {
            let Some(index) = text.strip_prefix(prefix) else {
                continue;
            };
            return match index.parse::<i32>() {
                Ok(index) if index.abs() <= 100_000 => Ok(Needle {
                    index,
                    back,
                    slider,
                }),
                _ => break,
            };
        }
        self.syntax(format!(
            "expected a needle such as `f3` or `b-2`, found `{text}`"
        ))
    }

    fn carried(&mut self, carriers: &[&str]) {
        let set = carriers.join(" ");
        if self.carriers.is_empty() {
            self.carriers.push(set);
        } else if !self.carriers.contains(&set) {
            let at = self.at().0;
            self.warn(&at, format!("carriers `{set}` are taken for the same yarn"));
            self.carriers.push(set);
        }
    }

    fn transfer(&mut self, from: Needle, to: Needle) -> Result<(), KnitoutError> {
        let across = match (from.back, to.back) {
            (false, true) => from.index - to.index,
            (true, false) => to.index - from.index,
            _ => return self.syntax("a transfer goes to the other bed"),
        };
        if across != self.rack {
            let rack = self.rack;
            return self.syntax(format!("the needles are not aligned at rack {rack}"));
        }
        if let Some(loops) = self.needles.remove(&from) {
            self.needles.entry(to).or_default().extend(loops);
        }
        Ok(())
    }

    fn form(&mut self, tuck: bool, right: bool, needle: Needle) -> Result<(), KnitoutError> {
        if let Some(dropped) = self.dropped.take() {
            return does_not_map(dropped, "loops are dropped before the last row");
        }
        if needle.slider {
            return does_not_map(self.at(), "loops are made on sliders");
        }
        let empty = !self.needles.contains_key(&needle);
        if tuck && !empty {
            return does_not_map(self.at(), "a tuck stitch: two loops left on one needle");
        }
        if self.row == 0 && empty {
            let id = self.new_loop(needle);
            self.needles.insert(needle, vec![id]);
            return Ok(());
        }
        let last = self.made.last().map(|m| m.needle);
        if let Some(last) = last.filter(|_| self.row > 0 && right == self.right)
            && last.index == needle.index
            && last.back != needle.back
        {
            return does_not_map(self.at(), "both beds make a loop at one needle");
        }
        let beyond = last.is_some_and(|last| match right {
            true => needle.index > last.index,
            false => needle.index < last.index,
        });
        if self.row == 0 || right != self.right || !beyond {
            let turned = right != self.right;
            self.close_row()?;
            if self.row > 0 && !turned {
                return does_not_map(self.at(), "a second row in the same direction");
            }
            self.row += 1;
            self.right = right;
        }
        let parents = self.needles.remove(&needle).unwrap_or_default();
        for p in &parents {
            if self.loops[*p].row + 1 != self.row {
                return does_not_map(self.at(), "a loop that is not of the row before");
            }
        }
        let id = self.new_loop(needle);
        self.needles.insert(needle, vec![id]);
        self.made.push(Made {
            id,
            needle,
            parents,
        });
        Ok(())
    }

    fn new_loop(&mut self, needle: Needle) -> usize {
        self.loops.push(Held {
            row: self.row,
            index: needle.index,
            operation: self.at(),
        });
        self.loops.len() - 1
    }

    /// Turns the loops made since the last row into a row of the chart.
    fn close_row(&mut self) -> Result<(), KnitoutError> {
        if self.row == 0 {
            let mut cast_on: Vec<usize> = (0..self.loops.len()).collect();
            cast_on.sort_by_key(|l| self.loops[*l].index);
            for pair in cast_on.windows(2) {
                if self.loops[pair[0]].index == self.loops[pair[1]].index {
                    let at = self.loops[pair[1]].operation.clone();
                    return does_not_map(at, "both beds hold a loop at one needle");
                }
            }
            self.below = cast_on;
            self.cast_on = self.below.len();
            return Ok(());
        }
        let mut made = std::mem::take(&mut self.made);
        made.sort_by_key(|m| m.needle.index);
        self.leave_out(&made)?;
        let column: BTreeMap<usize, usize> = self
            .below
            .iter()
            .enumerate()
            .map(|(k, l)| (*l, k))
            .collect();
        let mut next = 0;
        let mut stitches = Vec::with_capacity(made.len());
        for m in &made {
            let columns: Vec<usize> = m.parents.iter().map(|p| column[p]).collect();
            let mut sorted = columns.clone();
            sorted.sort_unstable();
            let at = || self.loops[m.id].operation.clone();
            if sorted.iter().copied().ne(next..next + sorted.len()) {
                return does_not_map(at(), "its loops have crossed others (a cable)");
            }
            next += sorted.len();
            let purl = m.needle.back;
            stitches.push(match columns.len() {
                0 => Op::YarnOver,
                1 => Op::Plain { purl },
                _ => {
                    let places = columns.iter().map(|c| (next - 1 - c) as u8);
                    let order: Vec<u8> = match purl {
                        true => places.rev().collect(),
                        false => places.collect(),
                    };
                    match Stack::new(&order) {
                        Some(stack) => Op::Together { stack, purl },
                        None => return does_not_map(at(), "more loops on a needle than a stack"),
                    }
                }
            });
        }
        self.below = made.iter().map(|m| m.id).collect();
        let ws = self.right;
        self.rows.push(ChartRow { ws, stitches });
        Ok(())
    }

    /// Loops of the row below that the row did not work: of the cast-on they
    /// are left out, others are stitches that skip a row.
    fn leave_out(&mut self, made: &[Made]) -> Result<(), KnitoutError> {
        let mut worked = vec![false; self.loops.len()];
        for p in made.iter().flat_map(|m| &m.parents) {
            worked[*p] = true;
        }
        for l in std::mem::take(&mut self.below) {
            let held = &self.loops[l];
            if worked[l] {
                self.below.push(l);
            } else if held.row == 0 {
                let at = held.operation.0.clone();
                self.cast_on -= 1;
                self.warn(&at, "the next row does not work this loop; left out".into());
            } else {
                let why = "the next row does not work this loop (slipped or held)";
                return does_not_map(held.operation.clone(), why);
            }
        }
        Ok(())
    }

    fn finish(mut self) -> Result<Knitout, KnitoutError> {
        self.close_row()?;
        if let Some((at, _)) = self.dropped.take() {
            self.warn(&at, "dropped loops are bound off".into());
        }
        let chart = Chart::new("knitout", self.cast_on, self.rows)?;
        let mut warnings = self.warnings;
        warnings.sort_by_key(|w| w.at.line);
        Ok(Knitout { chart, warnings })
    }
}

fn does_not_map<T>(
    (at, operation): (Place, String),
    why: impl Into<String>,
) -> Result<T, KnitoutError> {
    let why = why.into();
    Err(KnitoutError::DoesNotMap { at, operation, why })
}
