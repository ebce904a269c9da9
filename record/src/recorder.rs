mod begin;

pub(crate) use begin::lock_existing;

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use foxglove::Encode;
use mcap::records::{MessageHeader, Metadata};
use mcap::{McapError, Writer};

use crate::atomic::{beside, create_folder, sync_folder, write_error};
use crate::display::{self, ClothDisplay, LogLevel};
use crate::schema::*;
use crate::{Checkpoint, Frame, RecordError, RunHeader, StepDiagnostics};

/// How to record.
#[derive(Clone, Debug)]
pub struct RecorderOptions {
    /// Frames after which what is there becomes safe from a kill.
    pub flush_frames: usize,
    /// The same in wall-clock time. It moves the borders of chunks and
    /// nothing else; [`Duration::MAX`] gives files equal byte for byte.
    pub flush_interval: Duration,
    /// zstd level, 1 (fast) to 22 (small).
    pub compression_level: u32,
    /// Threads that compress in the background; 0 compresses on the caller's.
    pub compression_threads: u32,
    /// Whether triangles are written for viewers.
    pub mesh_channel: bool,
    /// Every how many frames they are.
    pub mesh_stride: usize,
    /// Whether points are written for viewers that know no triangles.
    pub point_channel: bool,
    /// Whether a checkpoint is forced onto the disk, so that it survives a
    /// power failure and not only a kill.
    pub sync_checkpoints: bool,
}

impl Default for RecorderOptions {
    fn default() -> Self {
        Self {
            flush_frames: 8,
            flush_interval: Duration::from_secs(5),
            compression_level: 1,
            compression_threads: 0,
            mesh_channel: true,
            mesh_stride: 1,
            point_channel: false,
            sync_checkpoints: true,
        }
    }
}

/// One channel: its id in the file and the number of messages so far.
#[derive(Clone, Copy, Debug, Default)]
struct Channel {
    id: u16,
    sequence: u32,
}

#[derive(Debug, Default)]
struct Channels {
    topology: Channel,
    bodies: Channel,
    cloth: Channel,
    state: Channel,
    diagnostics: Channel,
    checkpoint: Channel,
    log: Channel,
    points: Option<Channel>,
}

/// Writes a run to an MCAP file.
///
/// The file grows as `NAME.part` and gets its name when the run is finished,
/// so an earlier result stays until a new one is complete. Message times are
/// simulated time, no wall clock is recorded but the ledger: equal runs give
/// equal recordings. Dropped without [`finish`](Self::finish), the `.part`
/// stays for [`resume`](Self::resume).
pub struct Recorder {
    writer: Writer<BufWriter<File>>,
    /// Second handle of the same file: the lock and the syncing.
    file: File,
    path: PathBuf,
    part: PathBuf,
    options: RecorderOptions,
    points: usize,
    scalars: usize,
    cloth: ClothDisplay,
    channels: Channels,
    buffer: Vec<u8>,
    frames: u64,
    unflushed: usize,
    flushed: Instant,
}

impl Recorder {
    /// Starts a recording that will be called `path`. An unfinished recording
    /// of an earlier run is replaced, a finished one is not touched.
    ///
    /// # Errors
    /// [`RecordError::Write`] for a folder or disk that takes nothing,
    /// [`RecordError::InUse`], [`RecordError::InvalidHeader`].
    pub fn create(
        path: &Path,
        header: &RunHeader,
        options: RecorderOptions,
    ) -> Result<Self, RecordError> {
        header.validate()?;
        create_folder(path)?;
        let part = beside(path, ".part");
        let _earlier = lock_existing(&part)?;
        let mut recorder = Self::start(path, header, options)?;
        recorder.publish()?;
        Ok(recorder)
    }

    /// Records the state, and for viewers the mesh. Both arrays hold
    /// `3 points + scalars` values.
    ///
    /// # Errors
    /// [`RecordError::Length`], [`RecordError::NotFinite`],
    /// [`RecordError::Time`] for data that cannot be a frame,
    /// [`RecordError::Write`] for a full disk.
    pub fn frame(
        &mut self,
        time: f64,
        step: u64,
        positions: &[f64],
        velocities: &[f64],
    ) -> Result<(), RecordError> {
        let ns = nanoseconds(time)?;
        let expected = 3 * self.points + self.scalars;
        for (what, values) in [("positions", positions), ("velocities", velocities)] {
            if values.len() != expected {
                return Err(RecordError::Length {
                    what,
                    found: values.len(),
                    expected,
                });
            }
            if let Some(index) = values.iter().position(|x| !x.is_finite()) {
                return Err(RecordError::NotFinite {
                    what,
                    index,
                    value: values[index],
                    time,
                });
            }
        }
        self.buffer.clear();
        Frame::encode(
            &mut self.buffer,
            self.points,
            (time, step),
            (positions, velocities),
        );
        self.send(|c| &mut c.state, ns)?;
        let shown = self
            .frames
            .is_multiple_of(self.options.mesh_stride.max(1) as u64);
        if self.options.mesh_channel && shown {
            self.fill(&self.cloth.scene(ns, positions));
            self.send(|c| &mut c.cloth, ns)?;
        }
        if shown && self.channels.points.is_some() {
            self.fill(&display::cloud(ns, &positions[..3 * self.points]));
            self.send(|c| c.points.get_or_insert_default(), ns)?;
        }
        self.frames += 1;
        self.unflushed += 1;
        if self.unflushed >= self.options.flush_frames
            || self.flushed.elapsed() >= self.options.flush_interval
        {
            self.flush()?;
        }
        Ok(())
    }

    /// Records what a step did.
    ///
    /// # Errors
    /// [`RecordError::Time`], [`RecordError::Write`].
    pub fn diagnostics(&mut self, diagnostics: &StepDiagnostics) -> Result<(), RecordError> {
        let ns = nanoseconds(diagnostics.time)?;
        self.buffer.clear();
        serde_json::to_writer(&mut self.buffer, diagnostics).map_err(|source| {
            RecordError::Json {
                what: "diagnostics",
                source,
            }
        })?;
        self.send(|c| &mut c.diagnostics, ns)
    }

    /// Records a checkpoint and makes everything up to it safe.
    ///
    /// # Errors
    /// [`RecordError::Time`], [`RecordError::Write`].
    pub fn checkpoint(&mut self, checkpoint: &Checkpoint) -> Result<(), RecordError> {
        let ns = nanoseconds(checkpoint.time)?;
        self.buffer.clear();
        checkpoint.encode(&mut self.buffer);
        self.send(|c| &mut c.checkpoint, ns)?;
        self.flush()?;
        if self.options.sync_checkpoints {
            self.file.sync_data().map_err(write_error(&self.part))?;
        }
        Ok(())
    }

    /// Records a line of text.
    ///
    /// # Errors
    /// [`RecordError::Time`], [`RecordError::Write`].
    pub fn log(&mut self, time: f64, level: LogLevel, message: &str) -> Result<(), RecordError> {
        let ns = nanoseconds(time)?;
        self.fill(&display::line(ns, level, message));
        self.send(|c| &mut c.log, ns)
    }

    /// Closes the chunk and hands it to the operating system.
    ///
    /// # Errors
    /// [`RecordError::Write`].
    pub fn flush(&mut self) -> Result<(), RecordError> {
        self.writer.flush().map_err(mcap_error(&self.part))?;
        self.unflushed = 0;
        self.flushed = Instant::now();
        Ok(())
    }

    /// Ends the recording and gives it its name, replacing an earlier one.
    ///
    /// # Errors
    /// [`RecordError::Write`]; the `.part` and the earlier recording stay.
    pub fn finish(mut self, outcome: &serde_json::Value) -> Result<PathBuf, RecordError> {
        let mut metadata = BTreeMap::from([("outcome".to_owned(), outcome.to_string())]);
        metadata.insert("blake3".into(), metadata_digest(&metadata));
        let failed = mcap_error(&self.part);
        let outcome = Metadata {
            name: METADATA_OUTCOME.into(),
            metadata,
        };
        self.writer.write_metadata(&outcome).map_err(failed)?;
        self.writer.finish().map_err(mcap_error(&self.part))?;
        let Self {
            writer,
            file,
            path,
            part,
            ..
        } = self;
        let buffered = writer.into_inner();
        buffered
            .into_inner()
            .map_err(|e| write_error(&part)(e.into_error()))?;
        file.sync_all().map_err(write_error(&part))?;
        fs::rename(&part, &path).map_err(write_error(&path))?;
        sync_folder(&path);
        Ok(path)
    }

    /// The growing file.
    pub fn part_path(&self) -> &Path {
        &self.part
    }

    /// Frames so far, those before a resume included.
    pub fn frame_count(&self) -> u64 {
        self.frames
    }

    /// Takes over a message of an earlier part of the run.
    pub(crate) fn copy(
        &mut self,
        topic: &str,
        sequence: u32,
        ns: u64,
        data: &[u8],
    ) -> Result<(), RecordError> {
        let channel = match topic {
            TOPIC_STATE => &mut self.channels.state,
            TOPIC_CLOTH => &mut self.channels.cloth,
            TOPIC_DIAGNOSTICS => &mut self.channels.diagnostics,
            TOPIC_CHECKPOINT => &mut self.channels.checkpoint,
            TOPIC_LOG => &mut self.channels.log,
            TOPIC_POINTS => match &mut self.channels.points {
                Some(points) => points,
                None => return Ok(()),
            },
            _ => return Ok(()), // the preamble is there already
        };
        channel.sequence = sequence.wrapping_add(1);
        self.frames += u64::from(topic == TOPIC_STATE);
        let header = MessageHeader {
            channel_id: channel.id,
            sequence,
            log_time: ns,
            publish_time: ns,
        };
        self.writer
            .write_to_known_channel(&header, data)
            .map_err(mcap_error(&self.part))
    }

    fn fill(&mut self, message: &impl Encode) {
        self.buffer.clear();
        self.buffer.reserve(message.encoded_len().unwrap_or(0));
        // The only error is lack of room, and a vector grows.
        let _ = message.encode(&mut self.buffer);
    }

    fn send(
        &mut self,
        channel: impl FnOnce(&mut Channels) -> &mut Channel,
        ns: u64,
    ) -> Result<(), RecordError> {
        let channel = channel(&mut self.channels);
        let header = MessageHeader {
            channel_id: channel.id,
            sequence: channel.sequence,
            log_time: ns,
            publish_time: ns,
        };
        channel.sequence = channel.sequence.wrapping_add(1);
        self.writer
            .write_to_known_channel(&header, &self.buffer)
            .map_err(mcap_error(&self.part))
    }
}

impl std::fmt::Debug for Recorder {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Recorder")
            .field("part", &self.part)
            .field("frames", &self.frames)
            .finish_non_exhaustive()
    }
}

/// Simulated time as the time of a message.
fn nanoseconds(time: f64) -> Result<u64, RecordError> {
    // The seconds of the well-known messages are u32.
    let limit = f64::from(u32::MAX);
    if (0.0..limit).contains(&time) {
        Ok((time * 1e9).round() as u64)
    } else {
        Err(RecordError::Time { time })
    }
}

/// Metadata records have no checksum of their own.
pub(crate) fn metadata_digest(metadata: &BTreeMap<String, String>) -> String {
    let mut hasher = blake3::Hasher::new();
    for (key, value) in metadata.iter().filter(|(key, _)| *key != "blake3") {
        for text in [key, value] {
            hasher.update(&(text.len() as u64).to_le_bytes());
            hasher.update(text.as_bytes());
        }
    }
    hasher.finalize().to_hex().to_string()
}

/// The library wraps the operating system's reason at varying depth.
fn mcap_error(path: &Path) -> impl FnOnce(McapError) -> RecordError {
    let path = path.to_owned();
    move |error| match error {
        McapError::Io(source) => RecordError::Write { path, source },
        McapError::AttemptedWriteAfterFailure => RecordError::Write {
            path,
            source: io::Error::other("an earlier write failed"),
        },
        error => {
            let mut source = std::error::Error::source(&error);
            while let Some(inner) = source {
                if let Some(io) = inner.downcast_ref::<io::Error>() {
                    let source = match io.raw_os_error() {
                        Some(code) => io::Error::from_raw_os_error(code),
                        None => io::Error::new(io.kind(), io.to_string()),
                    };
                    return RecordError::Write { path, source };
                }
                source = inner.source();
            }
            RecordError::Mcap {
                path,
                source: error,
            }
        }
    }
}
