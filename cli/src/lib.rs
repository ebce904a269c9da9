//! Library side of the `selvedge` program.

pub mod report;
