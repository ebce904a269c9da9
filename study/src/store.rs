//! The folder of a study: its plan, an index of finished runs for every part,
//! and their shapes.
//!
//! ```text
//! plan.json               what is run, with the content hash of every job
//! index-0-of-1.jsonl      finished runs of a part, one a line, only appended
//! shapes/HASH.bin         the last shape of each
//! failed/HASH.json        steps at which runs failed, for `selvedge run`
//! ```
//!
//! The last member of a line, `digest`, is the BLAKE3 of the line without it:
//! an edited line is left out. Lines of older versions have none and are read
//! as they are.
//!
//! A shape is there, whole, before the line that names it, and a line counts
//! when it ends: killing the program loses the run at hand and nothing else.

use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::{SystemTime, UNIX_EPOCH};

use selvedge_scene::watchdog::Dump;

use crate::StudyError;
use crate::plan::{Plan, Point, STUDY_SCHEMA};
use crate::record::{Entry, Measured};
use crate::shape::Shape;
use crate::shard::Shard;

const PLAN: &str = "plan.json";
const SHAPES: &str = "shapes";
const SCRATCH: &str = "running";
const FAILED: &str = "failed";

/// A folder with one part of it open for writing.
pub struct Store {
    folder: PathBuf,
    index: Mutex<File>,
    index_path: PathBuf,
}

/// Finished runs by their hash.
pub type Entries = BTreeMap<String, Entry>;

impl Store {
    /// Opens a part of a study, and the study itself when it is new. Nothing is
    /// written when it is refused.
    ///
    /// # Errors
    /// [`StudyError::Exists`] for a part that was begun, unless `resume`;
    /// [`StudyError::Other`] for a part of another study.
    pub fn open(
        folder: &Path,
        plan: &Plan,
        shard: Shard,
        resume: bool,
    ) -> Result<Self, StudyError> {
        let index_path = folder.join(format!("index-{}-of-{}.jsonl", shard.index, shard.count));
        if index_path.exists() && !resume {
            return Err(StudyError::Exists {
                path: folder.to_owned(),
            });
        }
        let known = match read_plan(folder) {
            Ok(plan) => Some(plan),
            Err(_) if !folder.join(PLAN).exists() => None,
            Err(e) => return Err(e),
        };
        // A study alone in its folder may be asked for more; parts may not
        // disagree.
        if let Some(known) = &known
            && let Some(difference) = difference(known, plan)
            && (shard.count > 1 || !resume)
        {
            return Err(StudyError::Other {
                path: folder.to_owned(),
                difference,
            });
        }
        let shapes = folder.join(SHAPES);
        fs::create_dir_all(&shapes).map_err(written(&shapes))?;
        let mut index = OpenOptions::new()
            .read(true)
            .append(true)
            .create(true)
            .open(&index_path)
            .map_err(written(&index_path))?;
        // Where the file system knows no locks there is nothing to be told.
        if matches!(index.try_lock(), Err(TryLockError::WouldBlock)) {
            return Err(StudyError::InUse { path: index_path });
        }
        if known.as_ref() != Some(plan) {
            let text = serde_json::to_string_pretty(plan).unwrap_or_default() + "\n";
            whole(&folder.join(PLAN), text.as_bytes())?;
        }
        end_line(&mut index).map_err(written(&index_path))?;
        Ok(Self {
            folder: folder.to_owned(),
            index: Mutex::new(index),
            index_path,
        })
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Folder inside for what runs leave behind.
    pub fn scratch(&self) -> PathBuf {
        self.folder.join(SCRATCH)
    }

    /// Keeps a finished run.
    ///
    /// # Errors
    /// [`StudyError::Write`].
    pub fn keep(&self, hash: &str, measured: &Measured) -> Result<Entry, StudyError> {
        let mut digest = None;
        if let Some(shape) = &measured.shape {
            let bytes = shape.to_bytes();
            whole(&shape_path(&self.folder, hash), &bytes)?;
            digest = Some(blake3::hash(&bytes).to_hex().to_string());
        }
        let mut figures = measured.figures.clone();
        let dump = self.folder.join(FAILED).join(format!("{hash}.json"));
        match &measured.dump {
            Some(text) => {
                let folder = self.folder.join(FAILED);
                fs::create_dir_all(&folder).map_err(written(&folder))?;
                whole(&dump, moved(text, &dump).as_bytes())?;
                figures.reason += &format!("; the step is in {}", dump.display());
            }
            // That of an earlier try.
            None if dump.exists() => fs::remove_file(&dump).map_err(written(&dump))?,
            None => {}
        }
        let entry = Entry {
            hash: hash.to_owned(),
            shape: digest,
            figures,
        };
        let line = line_of(&entry);
        let mut index = self.index.lock().unwrap_or_else(PoisonError::into_inner);
        index
            .write_all(line.as_bytes())
            .and_then(|()| index.sync_data())
            .map_err(written(&self.index_path))?;
        Ok(entry)
    }
}

/// Closes a line that a kill cut off, so that the next one stands alone.
fn end_line(index: &mut File) -> std::io::Result<()> {
    if index.seek(SeekFrom::End(0))? == 0 {
        return Ok(());
    }
    index.seek(SeekFrom::End(-1))?;
    let mut last = [0];
    index.read_exact(&mut last)?;
    if last != *b"\n" {
        index.write_all(b"\n")?;
    }
    Ok(())
}

/// The plan of a study.
///
/// # Errors
/// [`StudyError::NotAStudy`].
pub fn read_plan(folder: &Path) -> Result<Plan, StudyError> {
    let fail = |reason: String| StudyError::NotAStudy {
        path: folder.to_owned(),
        reason,
    };
    let path = folder.join(PLAN);
    let text = fs::read_to_string(&path).map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound => fail(format!("there is no {PLAN} in it")),
        _ => fail(format!("{PLAN}: {e}")),
    })?;
    let plan: Plan = serde_json::from_str(&text).map_err(|e| fail(format!("{PLAN}: {e}")))?;
    if plan.schema != STUDY_SCHEMA {
        return Err(fail(format!(
            "its layout {} is not known here",
            plan.schema
        )));
    }
    let axes = plan.spec.axes.len();
    let fits = |p: &Point| p.job < plan.jobs.len() && p.settings.len() == axes;
    if plan.jobs.len() <= plan.spec.floor || !plan.points.iter().all(fits) {
        return Err(fail(format!("{PLAN} contradicts itself")));
    }
    Ok(plan)
}

/// Finished runs of all parts. Runs whose shape is missing or damaged are left
/// out and named in `remarks`.
///
/// # Errors
/// [`StudyError::Read`].
pub fn read_entries(folder: &Path, remarks: &mut Vec<String>) -> Result<Entries, StudyError> {
    let read = |path: &Path| {
        let path = path.to_owned();
        move |e: std::io::Error| StudyError::Read {
            path,
            reason: e.to_string(),
        }
    };
    let mut indices: Vec<PathBuf> = fs::read_dir(folder)
        .map_err(read(folder))?
        .filter_map(|e| e.ok().map(|e| e.path()))
        .filter(|p| {
            let name = p.file_name().unwrap_or_default().to_string_lossy();
            name.starts_with("index-") && name.ends_with(".jsonl")
        })
        .collect();
    indices.sort();
    let mut entries = Entries::new();
    for path in indices {
        let text = fs::read(&path).map_err(read(&path))?;
        for (i, line) in text.split(|b| *b == b'\n').enumerate() {
            if line.is_empty() {
                continue;
            }
            let Ok(entry) = serde_json::from_slice::<Entry>(line) else {
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                remarks.push(format!("{name}, line {}: cut off, left out", i + 1));
                continue;
            };
            if !is_whole(line) {
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                let number = i + 1;
                remarks.push(format!(
                    "{name}, line {number}: edited or damaged, it does not fit its digest, left out"
                ));
                continue;
            }
            if entry.shape.is_some() && read_shape(folder, &entry).is_none() {
                let hash = &entry.hash;
                remarks.push(format!("shapes/{hash}.bin: missing or damaged, left out"));
                entries.remove(hash);
                continue;
            }
            entries.insert(entry.hash.clone(), entry);
        }
    }
    Ok(entries)
}

/// A stopped step that names its new place.
fn moved(text: &str, place: &Path) -> String {
    let Ok(mut dump) = serde_json::from_str::<Dump>(text) else {
        return text.to_owned();
    };
    dump.event.dump = Some(place.display().to_string());
    serde_json::to_string_pretty(&dump).unwrap_or_else(|_| text.to_owned())
}

/// What stands between the content of a line and its digest.
const DIGEST: &str = ",\"digest\":\"";

/// The line of an index: the entry with the digest of its text.
fn line_of(entry: &Entry) -> String {
    let text = serde_json::to_string(entry).unwrap_or_default();
    let digest = blake3::hash(text.as_bytes()).to_hex();
    let open = text.strip_suffix('}').unwrap_or(&text);
    format!("{open}{DIGEST}{digest}\"}}\n")
}

/// Whether a line fits its digest, or has none.
fn is_whole(line: &[u8]) -> bool {
    #[derive(serde::Deserialize)]
    struct Tail {
        digest: Option<serde_json::Value>,
    }
    let Ok(Tail { digest }) = serde_json::from_slice(line) else {
        return false;
    };
    let Some(digest) = digest else { return true };
    let tail = format!("{DIGEST}{}\"}}", digest.as_str().unwrap_or_default());
    line.strip_suffix(tail.as_bytes()).is_some_and(|open| {
        let text = [open, b"}"].concat();
        Some(blake3::hash(&text).to_hex().as_str()) == digest.as_str()
    })
}

/// The shape of a finished run; `None` when there is none or it is damaged.
pub fn read_shape(folder: &Path, entry: &Entry) -> Option<Shape> {
    let bytes = fs::read(shape_path(folder, &entry.hash)).ok()?;
    let digest = blake3::hash(&bytes).to_hex().to_string();
    (Some(digest) == entry.shape).then(|| Shape::from_bytes(&bytes))?
}

fn shape_path(folder: &Path, hash: &str) -> PathBuf {
    folder.join(SHAPES).join(format!("{hash}.bin"))
}

/// What two plans do not agree in.
fn difference(known: &Plan, plan: &Plan) -> Option<String> {
    if known == plan {
        return None;
    }
    let (a, b) = (&known.spec, &plan.spec);
    let keys = |p: &Plan| {
        let keys: Vec<&str> = p.spec.axes.iter().map(|a| a.key.as_str()).collect();
        keys.join(", ")
    };
    Some(if a.scene != b.scene {
        format!("of {}", a.scene.display())
    } else if keys(known) != keys(plan) {
        format!("it varies {}", keys(known))
    } else if a.version != b.version {
        format!("made by version {}", a.version)
    } else if a.axes != b.axes || a.sample != b.sample {
        "with other values".to_owned()
    } else if known.reference != plan.reference {
        "with another reference".to_owned()
    } else {
        "its scene, its files or its number of repetitions differ".to_owned()
    })
}

/// Replaces a file at once: readers see the old or the new contents, whoever
/// else is writing it.
///
/// # Errors
/// [`StudyError::Write`].
pub fn whole(path: &Path, contents: &[u8]) -> Result<(), StudyError> {
    let clock = SystemTime::now().duration_since(UNIX_EPOCH);
    let unique = clock.map_or(0, |d| d.as_nanos());
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{}-{unique}.new", std::process::id()));
    let temporary = path.with_file_name(name);
    let result = fs::write(&temporary, contents).and_then(|()| fs::rename(&temporary, path));
    if result.is_err() {
        // Nothing half-written stays behind; the first error is the one to tell.
        let _ = fs::remove_file(&temporary);
    }
    result.map_err(written(path))
}

fn written(path: &Path) -> impl FnOnce(std::io::Error) -> StudyError {
    let path = path.to_owned();
    move |source| StudyError::Write { path, source }
}
