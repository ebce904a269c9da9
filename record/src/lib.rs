//! Recordings of cloth simulations: MCAP files that survive being killed,
//! checkpoints from which a run continues bit for bit, exports for other
//! programs and the comparison of results.
//!
//! A [`Recorder`] writes, a [`Recording`] reads. The crate knows nothing of
//! how a state comes about.
//!
//! ```
//! use selvedge_record::{Checkpoint, Recorder, RecorderOptions, Recording, RunHeader};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let folder = tempfile::tempdir()?;
//! let path = folder.path().join("run.mcap");
//! let header = RunHeader {
//!     scene_name: "one triangle".into(),
//!     points: 3,
//!     triangles: vec![[0, 1, 2]],
//!     ..RunHeader::default()
//! };
//! let q = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
//! let mut recorder = Recorder::create(&path, &header, RecorderOptions::default())?;
//! recorder.frame(0.0, 0, &q, &[0.0; 9])?;
//! recorder.checkpoint(&Checkpoint { sections: vec![("q".into(), q.to_vec())], ..Default::default() })?;
//! recorder.finish(&serde_json::json!({ "status": "finished" }))?;
//!
//! let recording = Recording::open(&path)?;
//! assert!(recording.is_complete() && recording.warnings().is_empty());
//! assert_eq!(recording.frame(0)?.positions, q);
//! # Ok(())
//! # }
//! ```

mod atomic;
mod checkpoint;
pub mod compare;
mod diagnostics;
mod display;
mod error;
pub mod export;
mod frame;
mod header;
mod recorder;
mod recording;
mod resume;
mod scan;
mod schema;
mod surface;
mod wire;
mod yarns;

pub use checkpoint::Checkpoint;
pub use diagnostics::{PinState, StepDiagnostics};
pub use display::LogLevel;
pub use error::RecordError;
pub use frame::Frame;
pub use header::{BodySurface, RunHeader};
pub use recorder::{Recorder, RecorderOptions};
pub use recording::{FrameInfo, LogLine, Recording};
pub use schema::{
    ATTACHMENT_SCENE, METADATA_OUTCOME, METADATA_RUN, TOPIC_BODIES, TOPIC_CHECKPOINT, TOPIC_CLOTH,
    TOPIC_DIAGNOSTICS, TOPIC_LOG, TOPIC_POINTS, TOPIC_STATE, TOPIC_TOPOLOGY,
};
pub use surface::Surface;
pub use yarns::YarnPaths;
