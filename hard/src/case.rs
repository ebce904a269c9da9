use crate::{Bench, HardError};

/// How a figure has to lie to its bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Is {
    /// Less than the bound.
    Below,
    /// Not more than the bound.
    AtMost,
    /// Not less than the bound.
    AtLeast,
    /// The bound itself.
    Equal,
    /// Reported, whatever it is.
    Told,
}

/// One requirement on one figure.
#[derive(Clone, Copy, Debug)]
pub struct Bound {
    /// Name of the figure.
    pub figure: &'static str,
    /// Its unit; `1` for counts and ratios.
    pub unit: &'static str,
    /// Comparison.
    pub is: Is,
    /// What it is compared with.
    pub bound: f64,
}

impl Bound {
    /// Whether a value meets the bound. What is not finite was not measured, and
    /// never does.
    pub fn holds(&self, value: f64) -> bool {
        if !value.is_finite() {
            return false;
        }
        match self.is {
            Is::Below => value < self.bound,
            Is::AtMost => value <= self.bound,
            Is::AtLeast => value >= self.bound,
            Is::Equal => value == self.bound,
            Is::Told => true,
        }
    }

    /// The requirement in signs.
    pub fn text(&self) -> String {
        let sign = match self.is {
            Is::Below => "<",
            Is::AtMost => "≤",
            Is::AtLeast => "≥",
            Is::Equal => "=",
            Is::Told => return "told".to_owned(),
        };
        format!("{sign} {:e}", self.bound)
    }
}

pub(crate) const fn below(figure: &'static str, unit: &'static str, bound: f64) -> Bound {
    Bound {
        figure,
        unit,
        is: Is::Below,
        bound,
    }
}

pub(crate) const fn at_most(figure: &'static str, unit: &'static str, bound: f64) -> Bound {
    Bound {
        is: Is::AtMost,
        ..below(figure, unit, bound)
    }
}

pub(crate) const fn at_least(figure: &'static str, unit: &'static str, bound: f64) -> Bound {
    Bound {
        is: Is::AtLeast,
        ..below(figure, unit, bound)
    }
}

pub(crate) const fn equal(figure: &'static str, unit: &'static str, bound: f64) -> Bound {
    Bound {
        is: Is::Equal,
        ..below(figure, unit, bound)
    }
}

pub(crate) const fn told(figure: &'static str, unit: &'static str) -> Bound {
    Bound {
        is: Is::Told,
        ..below(figure, unit, 0.0)
    }
}

/// How long a case takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// A few seconds at most.
    Quick,
    /// Longer: runs when asked for by name or with the slow ones.
    Slow,
}

/// What a case is expected to do with the scene's default components.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Expected {
    /// It passes.
    Passes,
    /// It fails, for this reason.
    Fails(&'static str),
    /// It needs something that does not exist yet.
    NotYet(&'static str),
}

/// Which choices of components a case depends on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Axes {
    /// Linear solver, preconditioner, precision, storage.
    pub linear: bool,
    /// Broad phase.
    pub contact: bool,
    /// Arc lengths are unknowns, which components for points alone cannot take.
    pub scalars: bool,
}

/// Figures by name.
pub type Figures = Vec<(&'static str, f64)>;

/// One hard case.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// Number in the catalogue; those from 49 on are our own.
    pub number: u16,
    /// Name in kebab case.
    pub name: &'static str,
    /// What is set up.
    pub setup: &'static str,
    /// How naive code fails.
    pub naive: &'static str,
    /// What has to hold.
    pub bounds: &'static [Bound],
    /// How long it takes.
    pub pace: Pace,
    /// What it depends on.
    pub axes: Axes,
    /// What it does by default.
    pub expected: Expected,
    /// Measures the figures.
    pub run: fn(&Bench) -> Result<Figures, HardError>,
}

/// Neither solver nor contact.
pub(crate) const ALONE: Axes = Axes {
    linear: false,
    contact: false,
    scalars: false,
};
/// A linear solve in every step.
pub(crate) const SOLVES: Axes = Axes {
    linear: true,
    ..ALONE
};
/// A linear solve of points and arc lengths in every step.
pub(crate) const SLIDES: Axes = Axes {
    linear: true,
    scalars: true,
    ..ALONE
};
/// Linear solves and contact of cloth with cloth.
pub(crate) const TOUCHES: Axes = Axes {
    linear: true,
    contact: true,
    ..ALONE
};

/// A case that is listed and cannot be run.
pub(crate) fn nothing(_: &Bench) -> Result<Figures, HardError> {
    Ok(Vec::new())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What was not measured holds nowhere, whatever the bound.
    #[test]
    fn not_measured_is_not_passed() {
        let all = [
            below("x", "1", 1.0),
            at_most("x", "1", 1.0),
            at_least("x", "1", 1.0),
            equal("x", "1", 1.0),
            told("x", "1"),
        ];
        for bound in all {
            for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                assert!(!bound.holds(value), "{bound:?}: {value}");
            }
        }
        let held: Vec<bool> = all.iter().map(|b| b.holds(1.0)).collect();
        assert_eq!(held, [false, true, true, true, true]);
    }
}
