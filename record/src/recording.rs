use std::collections::BTreeMap;
use std::fs::File;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use crate::atomic::read_error;
use crate::recorder::metadata_digest;
use crate::scan::{Event, Position, RawMessage, ScanError, message_at, read_chunk, scan};
use crate::schema::*;
use crate::wire::{Fields, Malformed};
use crate::{Checkpoint, Frame, LogLevel, RecordError, RunHeader, StepDiagnostics};

/// Time and step of a frame, without its arrays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameInfo {
    /// Simulated time \[s\].
    pub time: f64,
    /// Number of accepted steps.
    pub step: u64,
}

/// A line of text.
#[derive(Clone, Debug, PartialEq)]
pub struct LogLine {
    /// Simulated time \[s\].
    pub time: f64,
    /// Its importance.
    pub level: LogLevel,
    /// The text.
    pub message: String,
}

/// Reads recordings, finished, interrupted or damaged.
///
/// Opening walks once through the whole file and checks every checksum in
/// bounded memory; the arrays of frames are read when asked for. What cannot
/// be trusted is left out, and [`warnings`](Self::warnings) says so.
#[derive(Debug)]
pub struct Recording {
    path: PathBuf,
    header: RunHeader,
    frames: Vec<FrameInfo>,
    positions: Vec<Position>,
    diagnostics: Vec<StepDiagnostics>,
    logs: Vec<LogLine>,
    checkpoint: Option<Checkpoint>,
    pub(crate) checkpoint_at: Option<Position>,
    outcome: Option<serde_json::Value>,
    warnings: Vec<String>,
    reader: Mutex<Reader>,
}

/// The file and the chunk that was read last.
#[derive(Debug)]
struct Reader {
    file: File,
    chunk: Option<u64>,
    unpacked: Vec<u8>,
}

/// What accumulates while a file is opened.
#[derive(Default)]
struct Opening {
    metadata: Option<BTreeMap<String, String>>,
    scene: Option<Vec<u8>>,
    header: Option<RunHeader>,
    frames: Vec<FrameInfo>,
    positions: Vec<Position>,
    diagnostics: Vec<StepDiagnostics>,
    logs: Vec<LogLine>,
    checkpoint: Option<(Position, Checkpoint)>,
    outcome: Option<serde_json::Value>,
    warnings: Vec<String>,
}

impl Recording {
    /// Opens a recording.
    ///
    /// # Errors
    /// [`RecordError::Read`], [`RecordError::NotMcap`],
    /// [`RecordError::NoHeader`] and [`RecordError::Format`]. Damage behind
    /// the header is no error but a warning.
    pub fn open(path: &Path) -> Result<Self, RecordError> {
        let file = File::open(path).map_err(read_error(path))?;
        let mut opening = Opening::default();
        scan(&file, |event| {
            opening.take(event);
            Ok::<_, std::convert::Infallible>(ControlFlow::Continue(()))
        })
        .map_err(|e| match e {
            ScanError::Io(source) => read_error(path)(source),
            ScanError::NotMcap => RecordError::NotMcap {
                path: path.to_owned(),
            },
            ScanError::Visit(never) => match never {},
        })?;
        let header = opening.finish_header(path)?;
        let (checkpoint_at, checkpoint) = opening.checkpoint.unzip();
        Ok(Self {
            path: path.to_owned(),
            header,
            frames: opening.frames,
            positions: opening.positions,
            diagnostics: opening.diagnostics,
            logs: opening.logs,
            checkpoint,
            checkpoint_at,
            outcome: opening.outcome,
            warnings: opening.warnings,
            reader: Mutex::new(Reader {
                file,
                chunk: None,
                unpacked: Vec::new(),
            }),
        })
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What does not change with time.
    pub fn header(&self) -> &RunHeader {
        &self.header
    }

    /// All readable frames in order.
    pub fn frames(&self) -> &[FrameInfo] {
        &self.frames
    }

    /// Reads the arrays of a frame, every bit as recorded.
    ///
    /// # Errors
    /// [`RecordError::NoFrame`]; [`RecordError::Changed`] when the file is
    /// not the one that was opened any more.
    pub fn frame(&self, index: usize) -> Result<Frame, RecordError> {
        let (Some(info), Some(at)) = (self.frames.get(index), self.positions.get(index)) else {
            let (path, count) = (self.path.clone(), self.frames.len());
            return Err(RecordError::NoFrame { path, index, count });
        };
        let changed = |reason: String| RecordError::Changed {
            path: self.path.clone(),
            offset: at.chunk,
            reason,
        };
        let mut reader = self.reader.lock().unwrap_or_else(PoisonError::into_inner);
        let Reader {
            file,
            chunk,
            unpacked,
        } = &mut *reader;
        if *chunk != Some(at.chunk) {
            *chunk = None;
            read_chunk(file, at.chunk, unpacked).map_err(changed)?;
            *chunk = Some(at.chunk);
        }
        let frame = message_at(unpacked, at.inner)
            .and_then(|(_, data)| Frame::decode(data, self.header.points, self.header.scalars).ok())
            .ok_or_else(|| changed("there is no frame".into()))?;
        if frame.time.to_bits() != info.time.to_bits() || frame.step != info.step {
            return Err(changed("another frame is there".into()));
        }
        Ok(frame)
    }

    /// The frame closest to a time; `None` when there is none.
    pub fn frame_near(&self, time: f64) -> Option<usize> {
        let distance = |i: &usize| (self.frames[*i].time - time).abs();
        (0..self.frames.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }

    /// What the steps did, rejected ones included.
    pub fn diagnostics(&self) -> &[StepDiagnostics] {
        &self.diagnostics
    }

    /// Log lines in order.
    pub fn logs(&self) -> &[LogLine] {
        &self.logs
    }

    /// The last checkpoint before the first damage, from which the run can go
    /// on.
    pub fn last_checkpoint(&self) -> Option<&Checkpoint> {
        self.checkpoint.as_ref()
    }

    /// What the run said at its end.
    pub fn outcome(&self) -> Option<&serde_json::Value> {
        self.outcome.as_ref()
    }

    /// Whether the run came to its end.
    pub fn is_complete(&self) -> bool {
        self.outcome.is_some()
    }

    /// Everything that is missing or could not be trusted. Empty for a
    /// finished recording in which no byte has changed.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }
}

impl Opening {
    fn take(&mut self, event: Event<'_>) {
        match event {
            Event::Metadata(METADATA_RUN, map) => self.metadata = Some(map.clone()),
            Event::Metadata(METADATA_OUTCOME, map) => {
                let text = map.get("outcome");
                let intact = map.get("blake3") == Some(&metadata_digest(map));
                match text
                    .filter(|_| intact)
                    .map(|text| serde_json::from_str(text))
                {
                    Some(Ok(outcome)) => self.outcome = Some(outcome),
                    _ => self
                        .warnings
                        .push("the outcome of the run is damaged".into()),
                }
            }
            Event::Attachment(ATTACHMENT_SCENE, data) => self.scene = Some(data.to_vec()),
            Event::Metadata(..) | Event::Attachment(..) | Event::ChunkEnd => {}
            Event::Damage(reason) => self.warnings.push(reason),
            Event::Message(message) => {
                if self.message(&message).is_err() {
                    let RawMessage { topic, at, .. } = message;
                    self.warnings
                        .push(format!("message on {topic} at byte {} lost", at.chunk));
                }
            }
        }
    }

    fn message(&mut self, message: &RawMessage<'_>) -> Result<(), Malformed> {
        match message.topic {
            TOPIC_TOPOLOGY => {
                let mut header = RunHeader::default();
                header.decode_topology(message.data)?;
                self.header = Some(header);
            }
            TOPIC_STATE => {
                let header = self.header.as_ref().ok_or(Malformed)?;
                let (time, step) = Frame::check(message.data, header.points, header.scalars)?;
                self.frames.push(FrameInfo { time, step });
                self.positions.push(message.at);
            }
            TOPIC_DIAGNOSTICS => {
                let parsed = serde_json::from_slice(message.data).map_err(|_| Malformed)?;
                self.diagnostics.push(parsed);
            }
            TOPIC_CHECKPOINT => {
                let checkpoint = Checkpoint::decode(message.data)?;
                // Behind a gap the frames before it would be missing.
                if self.warnings.is_empty() {
                    self.checkpoint = Some((message.at, checkpoint));
                }
            }
            TOPIC_LOG => self.logs.push(decode_log(message.data, message.ns)?),
            _ => {}
        }
        Ok(())
    }

    fn finish_header(&mut self, path: &Path) -> Result<RunHeader, RecordError> {
        let lost = |reason: &str| RecordError::NoHeader {
            path: path.to_owned(),
            reason: [reason]
                .into_iter()
                .chain(self.warnings.iter().map(String::as_str))
                .fold(String::new(), |all, one| {
                    if all.is_empty() {
                        one.to_owned()
                    } else {
                        all + "; " + one
                    }
                }),
        };
        let map = self
            .metadata
            .as_ref()
            .ok_or_else(|| lost("no record of the run"))?;
        let get = |key: &str| map.get(key).map_or("", String::as_str);
        let format = get("format")
            .parse()
            .map_err(|_| lost("no format number"))?;
        if format > FORMAT {
            let path = path.to_owned();
            return Err(RecordError::Format {
                path,
                found: format,
                known: FORMAT,
            });
        }
        if get("blake3") != metadata_digest(map) {
            return Err(lost("the record of the run is damaged"));
        }
        let mut header = self
            .header
            .clone()
            .ok_or_else(|| lost("the mesh is missing"))?;
        header.scene_name = get("scene").into();
        header.version = get("version").into();
        let json =
            |key| serde_json::from_str(get(key)).map_err(|_| lost("the settings are damaged"));
        header.effective = json("effective")?;
        header.notes = json("notes")?;
        header.validate()?;
        if header.digest() != get("digest") {
            return Err(lost("mesh and settings do not belong together"));
        }
        let text = self.scene.take().and_then(|s| String::from_utf8(s).ok());
        match text {
            Some(text)
                if blake3::hash(text.as_bytes()).to_hex().as_str() == get("scene_blake3") =>
            {
                header.scene_text = text;
            }
            _ => self
                .warnings
                .push("the scene file in the recording is lost".into()),
        }
        Ok(header)
    }
}

fn decode_log(bytes: &[u8], ns: u64) -> Result<LogLine, Malformed> {
    let mut line = LogLine {
        time: ns as f64 * 1e-9,
        level: LogLevel::Info,
        message: String::new(),
    };
    for field in Fields(bytes) {
        match field? {
            (2, value) => line.level = LogLevel::from_wire(value.uint()?),
            (3, value) => line.message = value.string()?.into(),
            _ => {}
        }
    }
    Ok(line)
}
