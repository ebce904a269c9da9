use selvedge_scene::driver::RunError;

/// Why there is no estimate.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EstimateError {
    /// A companion could not be run.
    #[error("the run `{name}`: {source}")]
    Run {
        /// Name of the companion, and of its folder.
        name: String,
        /// Why.
        source: Box<RunError>,
    },
    /// A companion ended with an error of its own.
    #[error("the run `{name}` failed: {reason}")]
    Failed {
        /// Name of the companion, and of its folder.
        name: String,
        /// Why.
        reason: String,
    },
    /// The user stopped it.
    #[error("interrupted while running `{name}`")]
    Interrupted {
        /// Name of the companion.
        name: String,
    },
    /// The results could not be put in their place.
    #[error("cannot move `{from}` to `{to}`: {source}")]
    Move {
        /// Where it is.
        from: std::path::PathBuf,
        /// Where it should be.
        to: std::path::PathBuf,
        /// The reason that the system gives.
        source: std::io::Error,
    },
    /// A piece of cloth has no place in the plane to compare by.
    #[error("the cloth has no triangles to compare")]
    Empty,
}
