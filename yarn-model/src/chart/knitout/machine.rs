use std::collections::BTreeMap;

use super::{Knitout, KnitoutError, KnitoutWarning};
use crate::chart::error::nearest;
use crate::chart::{Chart, ChartRow, Op, Place, Stack};

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

/// The beds of the machine and the rows made so far.
#[derive(Default)]
pub(super) struct Machine {
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
    /// The operation being read.
    pub(super) place: Option<Place>,
    pub(super) operation: String,
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

    pub(super) fn warn(&mut self, at: &Place, message: String) {
        let at = at.clone();
        self.warnings.push(KnitoutWarning { at, message });
    }

    /// Does one operation.
    pub(super) fn execute(&mut self, word: &str, rest: &[&str]) -> Result<(), KnitoutError> {
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

    /// The chart of what was made.
    pub(super) fn finish(mut self) -> Result<Knitout, KnitoutError> {
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
