//! Library side of the `selvedge` program.

pub mod report;

pub mod args;
pub mod commands;
mod failure;
mod output;
mod progress;
mod report_data;
mod signals;

pub use failure::Failure;
