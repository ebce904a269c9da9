//! The cases by theme.

mod bending;
mod contact;
mod extremes;
mod friction;
mod input;
mod integrator;
mod invariance;
mod linear;
mod membrane;
mod program;
mod repeat;
mod scenes;
mod starts;
mod twist;
mod yarn_events;
mod yarns;

use std::sync::OnceLock;

use crate::Case;

/// All cases by number.
pub fn all() -> &'static [&'static Case] {
    static ALL: OnceLock<Vec<&'static Case>> = OnceLock::new();
    ALL.get_or_init(|| {
        let themes: [&'static [Case]; 15] = [
            &integrator::CASES,
            &membrane::CASES,
            &bending::CASES,
            &contact::CASES,
            &friction::CASES,
            &linear::CASES,
            &input::CASES,
            &starts::CASES,
            &extremes::CASES,
            &program::CASES,
            &repeat::CASES,
            &invariance::CASES,
            &twist::CASES,
            &yarns::CASES,
            &yarn_events::CASES,
        ];
        let mut all: Vec<&'static Case> = themes.into_iter().flatten().collect();
        all.sort_by_key(|c| c.number);
        all
    })
}
