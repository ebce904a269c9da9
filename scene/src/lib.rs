//! Scene files, their validation, and running them.
//!
//! [`file`](mod@file) reads a scene and finds its mistakes; [`build`] turns it
//! into a simulation that holds only what the scene calls for; [`driver`] runs
//! it and writes its results.

mod assembly;
pub mod build;
mod cascade;
pub mod diagnostic;
pub mod driver;
pub mod effects;
pub mod file;
mod motion;
mod process;
pub mod random;
mod result;
pub mod summary;
pub mod watchdog;
mod yarn_skin;

pub use result::{check_results, write_summary, write_whole};
pub use yarn_skin::{YarnSkin, still_skin, whole_skin};
