use std::fs::{self, File};
use std::io;
use std::ops::ControlFlow;
use std::path::Path;

use crate::atomic::{beside, read_error, sync_folder, write_error};
use crate::recorder::lock_existing;
use crate::scan::{Event, ScanError, scan};
use crate::{Checkpoint, RecordError, Recorder, RecorderOptions, Recording, RunHeader};

impl Recorder {
    /// Takes up the interrupted recording of `path` at its last checkpoint.
    ///
    /// Everything up to the checkpoint goes into a new file, which replaces
    /// the interrupted one when it is complete; what was recorded after the
    /// checkpoint is dropped, since the run will produce it again. A run
    /// continued from the checkpoint gives the recording that an uninterrupted
    /// one gives. Damaged parts end the usable range: only checkpoints before
    /// them count.
    ///
    /// # Errors
    /// [`RecordError::NothingToResume`], [`RecordError::AlreadyComplete`],
    /// [`RecordError::NoCheckpoint`], [`RecordError::HeaderMismatch`],
    /// [`RecordError::InUse`], and whatever keeps files from being read or
    /// written. The interrupted recording is left as it was by all of them.
    pub fn resume(
        path: &Path,
        header: &RunHeader,
        options: RecorderOptions,
    ) -> Result<(Self, Checkpoint), RecordError> {
        header.validate()?;
        let part = beside(path, ".part");
        let Some(_lock) = lock_existing(&part)? else {
            return Err(nothing(path, &part));
        };
        let recording = Recording::open(&part)?;
        if recording.is_complete() {
            // Killed between the last byte and the renaming.
            fs::rename(&part, path).map_err(write_error(path))?;
            sync_folder(path);
            return Err(RecordError::AlreadyComplete {
                path: path.to_owned(),
            });
        }
        if let Some(difference) = header.difference(recording.header()) {
            return Err(RecordError::HeaderMismatch {
                path: part,
                difference,
            });
        }
        let (Some(checkpoint), Some(last)) = (
            recording.last_checkpoint().cloned(),
            recording.checkpoint_at,
        ) else {
            let warnings = recording.warnings().to_vec();
            return Err(RecordError::NoCheckpoint {
                path: part,
                warnings,
            });
        };

        let source = File::open(&part).map_err(read_error(&part))?;
        let mut recorder = Self::start(path, header, options)?;
        let mut reached = false;
        let copied = scan(&source, |event| {
            match event {
                Event::Message(m) => {
                    recorder.copy(m.topic, m.sequence, m.ns, m.data)?;
                    if m.at == last {
                        reached = true;
                        return Ok(ControlFlow::Break(()));
                    }
                }
                // The same chunks as before: equal runs, equal files.
                Event::ChunkEnd => recorder.flush()?,
                _ => {}
            }
            Ok(ControlFlow::Continue(()))
        });
        let copied = match copied {
            Ok(()) if reached => recorder.publish(),
            Ok(()) => {
                let reason = "the checkpoint is not there any more".into();
                Err(RecordError::Changed {
                    path: part,
                    offset: last.chunk,
                    reason,
                })
            }
            Err(ScanError::Visit(error)) => Err(error),
            Err(ScanError::Io(source)) => Err(read_error(&part)(source)),
            Err(ScanError::NotMcap) => Err(RecordError::NotMcap { path: part }),
        };
        if copied.is_err() {
            let _ = fs::remove_file(beside(path, ".part.new"));
        }
        copied?;
        Ok((recorder, checkpoint))
    }
}

/// There is no interrupted recording; says whether there is a finished one.
fn nothing(path: &Path, part: &Path) -> RecordError {
    match fs::metadata(path) {
        Ok(_) => RecordError::AlreadyComplete {
            path: path.to_owned(),
        },
        Err(e) if e.kind() == io::ErrorKind::NotFound => RecordError::NothingToResume {
            path: path.to_owned(),
            part: part.to_owned(),
        },
        Err(source) => RecordError::Read {
            path: path.to_owned(),
            source,
        },
    }
}
