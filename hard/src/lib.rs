//! The catalogue of hard cases: set-ups that break cloth simulators, each with
//! what a naive code does and an acceptance that can be measured.
#![doc = ""]
#![doc = include_str!("../README.md")]

mod bench;
mod case;
pub mod cases;
mod document;
mod error;
mod matrix;
mod run;
mod sim;

pub use bench::Bench;
pub use case::{Axes, Bound, Case, Expected, Is, Pace};
pub use document::markdown;
pub use error::HardError;
pub use matrix::{Mode, modes};
pub use run::{Figure, Report, Status, run};
pub use sim::{Log, Sim};

/// The case with this name or number.
///
/// # Errors
/// [`HardError::Unknown`] with the name that comes nearest.
pub fn find(name: &str) -> Result<&'static Case, HardError> {
    let all = cases::all();
    let found = all
        .iter()
        .find(|c| c.name == name || c.number.to_string() == name);
    found.copied().ok_or_else(|| HardError::Unknown {
        name: name.to_owned(),
        nearest: nearest(name),
    })
}

fn nearest(name: &str) -> &'static str {
    let all = cases::all();
    let best = all
        .iter()
        .max_by(|a, b| likeness(name, a.name).total_cmp(&likeness(name, b.name)));
    best.map_or("", |c| c.name)
}

fn likeness(a: &str, b: &str) -> f64 {
    strsim::jaro_winkler(a, b)
}
