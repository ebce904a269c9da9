use std::path::PathBuf;

/// What can go wrong while recording, reading, exporting or comparing.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordError {
    /// The operating system refused to write.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// Its reason: disk full, read-only, no permission ...
        source: std::io::Error,
    },
    /// The operating system refused to read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file or folder.
        path: PathBuf,
        /// Its reason.
        source: std::io::Error,
    },
    /// The MCAP library refused a record.
    #[error("cannot record to {}: {source}", path.display())]
    Mcap {
        /// The recording.
        path: PathBuf,
        /// Its reason.
        source: mcap::McapError,
    },
    /// Another process is writing this recording.
    #[error("{} is being written by another process", path.display())]
    InUse {
        /// The unfinished recording.
        path: PathBuf,
    },
    /// The file is not an MCAP file at all.
    #[error("{} is not an MCAP file", path.display())]
    NotMcap {
        /// The file.
        path: PathBuf,
    },
    /// An MCAP file without our header, or one whose header is damaged.
    #[error("{} holds no readable run header: {reason}", path.display())]
    NoHeader {
        /// The file.
        path: PathBuf,
        /// What is missing or damaged.
        reason: String,
    },
    /// Written by a newer program.
    #[error("{} has recording format {found}, this program reads up to {known}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// Its format.
        found: u32,
        /// The newest format known.
        known: u32,
    },
    /// Neither a finished nor an unfinished recording is there.
    #[error("nothing to resume: neither {} nor {} exists", part.display(), path.display())]
    NothingToResume {
        /// The finished recording.
        path: PathBuf,
        /// The unfinished recording.
        part: PathBuf,
    },
    /// The run has already come to its end.
    #[error("nothing to resume: {} is complete", path.display())]
    AlreadyComplete {
        /// The finished recording.
        path: PathBuf,
    },
    /// The unfinished recording holds no checkpoint.
    #[error("cannot resume {}: no checkpoint is readable{}", path.display(), list(warnings))]
    NoCheckpoint {
        /// The unfinished recording.
        path: PathBuf,
        /// What was met while reading it.
        warnings: Vec<String>,
    },
    /// The unfinished recording belongs to another scene or other settings.
    #[error("cannot resume {}: {difference}", path.display())]
    HeaderMismatch {
        /// The unfinished recording.
        path: PathBuf,
        /// The first difference, with both values.
        difference: String,
    },
    /// The header contradicts itself.
    #[error("invalid run header: {reason}")]
    InvalidHeader {
        /// What is wrong.
        reason: String,
    },
    /// An array has another length than the header says.
    #[error("{what}: {found} values, the header says {expected}")]
    Length {
        /// The array.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The length that follows from the header.
        expected: usize,
    },
    /// NaN or infinity in a frame.
    #[error("{what}[{index}] is {value} at t = {time} s")]
    NotFinite {
        /// The array.
        what: &'static str,
        /// Index of the first such value.
        index: usize,
        /// The value.
        value: f64,
        /// Simulated time \[s\].
        time: f64,
    },
    /// A time that a recording cannot hold.
    #[error("time {time} s cannot be recorded: it must lie between 0 and 4.29e9 s")]
    Time {
        /// The time \[s\].
        time: f64,
    },
    /// A frame that does not exist.
    #[error("frame {index} of {count} does not exist in {}", path.display())]
    NoFrame {
        /// The recording.
        path: PathBuf,
        /// The index asked for.
        index: usize,
        /// Number of frames.
        count: usize,
    },
    /// A record changed on disk after the recording was opened.
    #[error("{} changed while it was read, at byte {offset}: {reason}", path.display())]
    Changed {
        /// The recording.
        path: PathBuf,
        /// Where.
        offset: u64,
        /// What does not fit any more.
        reason: String,
    },
    /// A checkpoint lacks something that the caller needs.
    #[error("the checkpoint at t = {time} s has no section {name:?} of {expected} values")]
    Section {
        /// Simulated time \[s\].
        time: f64,
        /// The section.
        name: String,
        /// Its length.
        expected: usize,
    },
    /// JSON that cannot be written.
    #[error("cannot write {what} as JSON: {source}")]
    Json {
        /// The value.
        what: &'static str,
        /// The reason.
        source: serde_json::Error,
    },
    /// A surface that a format or a comparison cannot take.
    #[error("invalid surface: {reason}")]
    Surface {
        /// What is wrong.
        reason: String,
    },
    /// A selection of frames that a format cannot take.
    #[error("cannot export: {reason}")]
    Export {
        /// What is wrong.
        reason: String,
    },
}

fn list(warnings: &[String]) -> String {
    let mut text = String::new();
    for warning in warnings {
        text.push_str("; ");
        text.push_str(warning);
    }
    text
}
