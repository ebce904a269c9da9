//! How a recording begins: its file, its preamble, its channels.

use std::collections::BTreeMap;
use std::fs::{self, File, TryLockError};
use std::io::{self, BufWriter};
use std::path::Path;
use std::time::Instant;

use foxglove::Encode;
use foxglove::messages::{Log, PointCloud, SceneUpdate};
use mcap::records::Metadata;
use mcap::{Attachment, Compression, McapError, WriteOptions};

use super::{Channel, Channels, Recorder, RecorderOptions, mcap_error, metadata_digest};
use crate::atomic::{beside, sync_folder, write_error};
use crate::display::{self, ClothDisplay};
use crate::schema::{self, *};
use crate::wire::Encoder;
use crate::{RecordError, RunHeader, StepDiagnostics};

/// Chunks are closed beyond this size even between flushes, which bounds the
/// memory of writer and readers.
const CHUNK_BYTES: u64 = 4 << 20;

impl Recorder {
    /// Writes the preamble to a file that is not yet called `.part`, so that
    /// there is never a `.part` without a header.
    pub(crate) fn start(
        path: &Path,
        header: &RunHeader,
        options: RecorderOptions,
    ) -> Result<Self, RecordError> {
        let part = beside(path, ".part");
        let new = beside(path, ".part.new");
        let file = File::create(&new).map_err(write_error(&new))?;
        // Advisory: a file system without locks is no reason not to record.
        let _ = file.try_lock();
        let handle = file.try_clone().map_err(write_error(&new))?;
        let writer = WriteOptions::new()
            .library(concat!("selvedge-record ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Zstd))
            .compression_level(options.compression_level)
            .compression_threads(options.compression_threads)
            .chunk_size(Some(CHUNK_BYTES))
            // Chunks are appended whole: a kill never leaves a chunk header
            // that speaks of bytes still to come.
            .disable_seeking(true)
            .create(BufWriter::with_capacity(1 << 16, file))
            .map_err(mcap_error(&new))?;
        let mut recorder = Self {
            writer,
            file: handle,
            path: path.to_owned(),
            part: new,
            points: header.points,
            scalars: header.scalars,
            cloth: ClothDisplay::new(header),
            channels: Channels::default(),
            buffer: Vec::new(),
            frames: 0,
            unflushed: 0,
            flushed: Instant::now(),
            options,
        };
        let written = recorder.preamble(header);
        if written.is_err() {
            let _ = fs::remove_file(&recorder.part);
        }
        recorder.part = part;
        written?;
        Ok(recorder)
    }

    /// Gives the new file its working name, once its content is safe.
    pub(crate) fn publish(&mut self) -> Result<(), RecordError> {
        let new = beside(&self.path, ".part.new");
        let published = self.flush().and_then(|()| {
            self.file.sync_data().map_err(write_error(&self.part))?;
            fs::rename(&new, &self.part).map_err(write_error(&self.part))
        });
        if published.is_err() {
            let _ = fs::remove_file(&new);
        }
        published?;
        sync_folder(&self.part);
        Ok(())
    }

    fn preamble(&mut self, header: &RunHeader) -> Result<(), RecordError> {
        let json = |what, value: &serde_json::Value| {
            serde_json::to_string(value).map_err(|source| RecordError::Json { what, source })
        };
        let scene = header.scene_text.as_bytes();
        let mut metadata = BTreeMap::from(
            [
                ("format", FORMAT.to_string()),
                ("scene", header.scene_name.clone()),
                ("version", header.version.clone()),
                ("effective", json("the settings", &header.effective)?),
                ("notes", json("the notes", &header.notes)?),
                ("digest", header.digest()),
                ("scene_blake3", blake3::hash(scene).to_hex().to_string()),
            ]
            .map(|(key, value)| (key.to_owned(), value)),
        );
        metadata.insert("blake3".into(), metadata_digest(&metadata));
        let part = self.part.clone();
        self.writer
            .write_metadata(&Metadata {
                name: METADATA_RUN.into(),
                metadata,
            })
            .map_err(mcap_error(&part))?;
        self.writer
            .attach(&Attachment {
                log_time: 0,
                create_time: 0,
                name: ATTACHMENT_SCENE.into(),
                media_type: "application/toml".into(),
                data: scene.into(),
            })
            .map_err(mcap_error(&part))?;
        self.add_channels().map_err(mcap_error(&part))?;

        self.buffer.clear();
        header.encode_topology(&mut Encoder(&mut self.buffer));
        self.send(|c| &mut c.topology, 0)?;
        if !header.bodies.is_empty() {
            self.fill(&display::bodies(header));
            self.send(|c| &mut c.bodies, 0)?;
        }
        Ok(())
    }

    /// Always in the same order, so that equal runs have equal ids.
    fn add_channels(&mut self) -> Result<(), McapError> {
        let ours = schema::descriptors();
        let json = StepDiagnostics::schema().to_string();
        let own = |topic, name| (topic, name, "protobuf", &ours[..], "protobuf");
        let w = &mut self.writer;
        let mut add = |(topic, name, encoding, data, message): (&str, &str, &str, &[u8], &str)| {
            let schema = w.add_schema(name, encoding, data)?;
            let id = w.add_channel(schema, topic, message, &BTreeMap::new())?;
            Ok::<_, McapError>(Channel { id, sequence: 0 })
        };
        self.channels.topology = add(own(TOPIC_TOPOLOGY, "selvedge.Topology"))?;
        self.channels.state = add(own(TOPIC_STATE, "selvedge.Frame"))?;
        self.channels.checkpoint = add(own(TOPIC_CHECKPOINT, "selvedge.Checkpoint"))?;
        let diagnostics = "selvedge.StepDiagnostics";
        self.channels.diagnostics = add((
            TOPIC_DIAGNOSTICS,
            diagnostics,
            "jsonschema",
            json.as_bytes(),
            "json",
        ))?;
        let mut known = |topic, schema: Option<foxglove::Schema>| {
            // A missing schema would show in the tests; an empty one is legal.
            let (name, encoding, data) = schema
                .map(|s| (s.name, s.encoding, s.data.into_owned()))
                .unwrap_or_default();
            add((topic, &name, &encoding, &data, "protobuf"))
        };
        self.channels.cloth = known(TOPIC_CLOTH, SceneUpdate::get_schema())?;
        self.channels.bodies = known(TOPIC_BODIES, SceneUpdate::get_schema())?;
        self.channels.log = known(TOPIC_LOG, Log::get_schema())?;
        if self.options.point_channel {
            self.channels.points = Some(known(TOPIC_POINTS, PointCloud::get_schema())?);
        }
        Ok(())
    }
}

/// Locks an unfinished recording against a second writer, if there is one.
pub(crate) fn lock_existing(part: &Path) -> Result<Option<File>, RecordError> {
    let file = match File::open(part) {
        Ok(file) => file,
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(e) => return Err(write_error(part)(e)),
    };
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => Err(RecordError::InUse {
            path: part.to_owned(),
        }),
        // Some network file systems know no locks.
        Ok(()) | Err(TryLockError::Error(_)) => Ok(Some(file)),
    }
}
