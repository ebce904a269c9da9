//! Accuracy against time: many runs of a scene beside a reference.
//!
//! A [`Plan`] lists the simulations of a study with the content hash of each,
//! an [`Executor`] runs them, a [`Store`] keeps what is finished so that it
//! survives being killed, and [`Results`] compares: distances to the
//! reference, the repeatability floor, the Pareto front and its knee.
//!
//! ```no_run
//! use std::sync::atomic::AtomicBool;
//! use selvedge_study::*;
//!
//! # fn main() -> Result<(), StudyError> {
//! # struct Quiet;
//! # impl Observer for Quiet {
//! #     fn begins(&self, _: usize, _: usize, _: &Job) {}
//! #     fn ended(&self, _: usize, _: usize, _: &Job, _: &Entry) {}
//! #     fn note(&self, _: &str) {}
//! # }
//! let spec = StudySpec {
//!     axes: vec![Axis::parse("solver.tolerance=1e-3,1e-2,1e-1")?],
//!     ..StudySpec::new("scene.toml", "1.0")
//! };
//! let plan = Plan::new(spec)?;
//! let store = Store::open("out/study".as_ref(), &plan, Shard::WHOLE, true)?;
//! let executor = InProcess::new(store.scratch(), "1.0");
//! let go_on = AtomicBool::new(false);
//! run(&plan, &store, Shard::WHOLE, &executor, 1, &Quiet, &go_on)?;
//! let results = Results::of_folder(store.folder(), &plan, Clock::Cpu)?;
//! println!("{}", Table::of(&results).to_csv());
//! # Ok(())
//! # }
//! ```

mod axes;
mod document;
mod error;
mod executor;
mod hash;
mod markdown;
mod metrics;
mod pareto;
mod plan;
mod process;
mod record;
mod results;
mod run;
mod sampling;
mod shape;
mod shard;
mod stages;
mod store;
mod table;

pub use axes::{Axis, Range, Values};
pub use document::fill;
pub use error::StudyError;
pub use executor::{Executor, Halt, InProcess, Watch};
pub use hash::content_hash;
pub use metrics::{Distances, Floor, VertexDistances, distances, least, median};
pub use pareto::{front, knee};
pub use plan::{
    Job, Overrides, PERTURBATION_M, Perturbation, Plan, Point, STUDY_SCHEMA, Sample, StudySpec,
    reference_defaults,
};
pub use process::{Subprocess, serve};
pub use record::{Ending, Entry, Figures, Measured, Stretch};
pub use results::{Clock, Measure, Recommended, Results, Row};
pub use run::{Observer, Tally, run};
pub use sampling::{MOST_RUNS, grid, latin_hypercube};
pub use shape::Shape;
pub use shard::Shard;
pub use store::{Entries, Store, read_entries, read_plan, read_shape, whole};
pub use table::Table;
