use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

use serde::Serialize;

use crate::{Bench, Case, Expected, HardError};

/// How a case ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    /// All bounds hold.
    Pass,
    /// One does not.
    Fail,
    /// Not run.
    Skipped,
}

/// One measured figure and what it should be.
#[derive(Clone, Debug, Serialize)]
pub struct Figure {
    /// Its name.
    pub name: &'static str,
    /// Its value; `null` when it was not measured or is not finite.
    pub value: Option<f64>,
    /// Its unit.
    pub unit: &'static str,
    /// The requirement in signs.
    pub bound: String,
    /// Whether it holds.
    pub holds: bool,
}

/// What came of a case.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Its name.
    pub case: &'static str,
    /// Its number.
    pub number: u16,
    /// How it ended.
    pub status: Status,
    /// Its figures.
    pub figures: Vec<Figure>,
    /// Wall time [s].
    pub seconds: f64,
    /// Why it was skipped, or what went wrong.
    pub note: Option<String>,
}

impl Report {
    /// A case that is not run.
    pub fn skipped(case: &Case, why: impl Into<String>) -> Self {
        Self {
            case: case.name,
            number: case.number,
            status: Status::Skipped,
            figures: Vec::new(),
            seconds: 0.0,
            note: Some(why.into()),
        }
    }
}

/// Runs a case with some keys of its scenes changed; whatever goes wrong in it
/// is a failed case.
pub fn run(case: &Case, overrides: &[(String, String)], budget: f64) -> Report {
    if let Expected::NotYet(needs) = case.expected {
        return Report::skipped(case, format!("not applicable yet: needs {needs}"));
    }
    let clock = Instant::now();
    let caught = catch_unwind(AssertUnwindSafe(|| {
        let bench = Bench::new(overrides, budget)?;
        (case.run)(&bench)
    }));
    let measured = caught.unwrap_or_else(|panic| {
        let text = panic.downcast_ref::<&str>().map(|t| (*t).to_owned());
        let text = text.or_else(|| panic.downcast_ref::<String>().cloned());
        Err(HardError::Panicked(text.unwrap_or_default()))
    });
    let (values, note) = match measured {
        Ok(values) => (values, None),
        Err(e) => (Vec::new(), Some(e.to_string())),
    };
    let figures: Vec<Figure> = case
        .bounds
        .iter()
        .map(|b| {
            let value = values.iter().find(|(name, _)| *name == b.figure);
            let value = value.map_or(f64::NAN, |(_, v)| *v);
            Figure {
                name: b.figure,
                value: value.is_finite().then_some(value),
                unit: b.unit,
                bound: b.text(),
                holds: b.holds(value),
            }
        })
        .collect();
    let good = note.is_none() && figures.iter().all(|f| f.holds);
    Report {
        case: case.name,
        number: case.number,
        status: if good { Status::Pass } else { Status::Fail },
        figures,
        seconds: clock.elapsed().as_secs_f64(),
        note,
    }
}
