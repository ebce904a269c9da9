//! Validation against closed forms: every case as data, run on ladders of
//! meshes and steps.
//!
//! [`all`] lists the cases. A case runs quickly, for the tests, or on its full
//! ladders, for the page that [`markdown`] writes.

mod buckling;
mod document;
pub mod elastica;
pub mod exact;
pub mod friction;
pub mod hanging;
mod ladder;
mod lateral;
pub mod motion;
mod narrow;
mod stability;
mod vibration;

pub use document::markdown;
pub use ladder::{Finding, Judged, Ladder, Rung};

/// How much of a ladder is run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// The coarse end, in seconds.
    Quick,
    /// All of it.
    Full,
}

impl Effort {
    /// One of two.
    pub fn pick<T>(self, quick: T, full: T) -> T {
        match self {
            Self::Quick => quick,
            Self::Full => full,
        }
    }
}

/// A validation.
pub struct Case {
    /// Short name, as an anchor of the page.
    pub name: &'static str,
    /// Heading.
    pub title: &'static str,
    /// What is done and what is compared with what.
    pub text: &'static str,
    /// The closed form.
    pub formula: &'static str,
    /// Where it is from.
    pub source: &'static str,
    /// Runs it.
    pub run: fn(Effort) -> Measured,
}

/// What a case measured.
pub struct Measured {
    /// Its quantities.
    pub ladders: Vec<Ladder>,
    /// Further figures, in Markdown; may be empty.
    pub details: String,
}

impl From<Vec<Ladder>> for Measured {
    fn from(ladders: Vec<Ladder>) -> Self {
        Self {
            ladders,
            details: String::new(),
        }
    }
}

/// All cases, in the order of the page.
pub fn all() -> Vec<Case> {
    let mut cases = Vec::new();
    cases.extend(motion::cases());
    cases.extend(hanging::cases());
    cases.extend(elastica::cases());
    cases.extend(friction::cases());
    cases.extend(vibration::cases());
    cases.extend(buckling::cases());
    cases.extend(lateral::cases());
    cases
}

/// The rungs of a ladder: `measure` at every choice.
pub(crate) fn climb<T: Copy>(
    choices: &[T],
    label: impl Fn(T) -> (String, f64),
    mut measure: impl FnMut(T) -> f64,
) -> Vec<Rung> {
    choices
        .iter()
        .map(|&c| {
            let (label, size) = label(c);
            Rung {
                label,
                size,
                value: measure(c),
            }
        })
        .collect()
}

/// Label and size of a step [s].
pub(crate) fn step(h: f64) -> (String, f64) {
    (format!("{} ms", (h * 1e6).round() / 1e3), h)
}

/// Label and size of a mesh of so many cells.
pub(crate) fn cells(n: usize) -> (String, f64) {
    (n.to_string(), 1.0 / n as f64)
}
