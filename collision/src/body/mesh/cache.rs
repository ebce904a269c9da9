//! Sampled fields on disk.
//!
//! ```text
//! magic 8 | key 32 | origin, voxel 4 f64 | cells 3 u64 | hidden, cavities 2 u64
//! | lengths 3 u64 | coarse f32.. | bricks u32.. | fine f32.. | blake3 of all before 32
//! ```
//! Little-endian.

use super::super::FieldSettings;
use super::super::field::SparseField;
use super::Sampled;
use crate::CollisionError;
use std::fmt;
use std::fs;
use std::io::{self, Write};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

/// Changes with the layout and with anything that changes the values.
const MAGIC: &[u8; 8] = b"SLVSDF02";

/// What a cache did.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum CacheNote {
    /// The field was read.
    Read,
    /// The field was built and stored.
    Stored,
    /// The entry was damaged; the field was built and stored anew.
    Replaced {
        /// What was wrong with the entry.
        damage: String,
    },
    /// The field was built but could not be stored.
    NotStored {
        /// The reason the system gave.
        reason: String,
    },
}

impl fmt::Display for CacheNote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Read => write!(f, "read from the cache"),
            Self::Stored => write!(f, "built and stored in the cache"),
            Self::Replaced { damage } => write!(f, "built anew, the cached one was {damage}"),
            Self::NotStored { reason } => write!(f, "built, not stored in the cache: {reason}"),
        }
    }
}

pub(super) fn key(
    points: &[[f64; 3]],
    triangles: &[[u32; 3]],
    settings: &FieldSettings,
) -> blake3::Hash {
    let mut h = blake3::Hasher::new();
    h.update(MAGIC);
    h.update(&settings.voxel.to_le_bytes());
    h.update(&settings.band.to_le_bytes());
    h.update(&(points.len() as u64).to_le_bytes());
    let mut bytes = Vec::with_capacity(24 * points.len().max(triangles.len()));
    bytes.extend(points.iter().flatten().flat_map(|x| x.to_le_bytes()));
    h.update(&bytes);
    bytes.clear();
    bytes.extend(triangles.iter().flatten().flat_map(|i| i.to_le_bytes()));
    h.update(&bytes);
    h.finalize()
}

pub(super) fn read_or_build(
    dir: &Path,
    key: &blake3::Hash,
    build: impl FnOnce() -> Result<Sampled, CollisionError>,
) -> Result<(Sampled, CacheNote), CollisionError> {
    let path = dir.join(format!("{}.sdf", key.to_hex()));
    let damage = match fs::read(&path) {
        Ok(bytes) => match decode(&bytes, key) {
            Ok(entry) => return Ok((entry, CacheNote::Read)),
            Err(damage) => Some(damage.to_owned()),
        },
        Err(e) if e.kind() == io::ErrorKind::NotFound => None,
        Err(e) => Some(format!("unreadable ({e})")),
    };
    let entry = build()?;
    let note = match store(dir, &path, &encode(&entry, key)) {
        Err(e) => CacheNote::NotStored {
            reason: e.to_string(),
        },
        Ok(()) => match damage {
            Some(damage) => CacheNote::Replaced { damage },
            None => CacheNote::Stored,
        },
    };
    Ok((entry, note))
}

/// Writes beside the entry and renames, so that readers see all or nothing.
fn store(dir: &Path, path: &Path, bytes: &[u8]) -> io::Result<()> {
    static NEXT: AtomicU64 = AtomicU64::new(0);
    fs::create_dir_all(dir)?;
    let n = NEXT.fetch_add(1, Ordering::Relaxed);
    let temporary = path.with_extension(format!("{}-{n}.tmp", std::process::id()));
    let written = fs::File::create(&temporary)
        .and_then(|mut file| file.write_all(bytes))
        .and_then(|()| fs::rename(&temporary, path));
    if written.is_err() {
        let _ = fs::remove_file(&temporary); // may never have been created
    }
    written
}

fn encode(sampled: &Sampled, key: &blake3::Hash) -> Vec<u8> {
    let field = &sampled.field;
    let mut out = Vec::with_capacity(field.heap_bytes() + 200);
    out.extend(MAGIC);
    out.extend(key.as_bytes());
    out.extend(
        field
            .origin
            .iter()
            .chain([&field.voxel])
            .flat_map(|x| x.to_le_bytes()),
    );
    let lengths = [field.coarse.len(), field.bricks.len(), field.fine.len()];
    let left_out = [sampled.hidden, sampled.cavities];
    let counts = field.cells.into_iter().chain(left_out).chain(lengths);
    out.extend(counts.flat_map(|n| (n as u64).to_le_bytes()));
    out.extend(field.coarse.iter().flat_map(|x| x.to_le_bytes()));
    out.extend(field.bricks.iter().flat_map(|x| x.to_le_bytes()));
    out.extend(field.fine.iter().flat_map(|x| x.to_le_bytes()));
    let sum = blake3::hash(&out);
    out.extend(sum.as_bytes());
    out
}

fn decode(bytes: &[u8], key: &blake3::Hash) -> Result<Sampled, &'static str> {
    let (content, sum) = bytes.split_last_chunk::<32>().ok_or("cut short")?;
    if blake3::hash(content) != blake3::Hash::from_bytes(*sum) {
        return Err("cut short or damaged (checksum)");
    }
    let mut rest = content;
    if take::<8>(&mut rest)? != *MAGIC {
        return Err("of another format");
    }
    if blake3::Hash::from_bytes(take::<32>(&mut rest)?) != *key {
        return Err("of another mesh");
    }
    let mut numbers = [0.0; 4];
    for x in &mut numbers {
        *x = f64::from_le_bytes(take::<8>(&mut rest)?);
    }
    let mut counts = [0_usize; 8];
    for n in &mut counts {
        let wide = u64::from_le_bytes(take::<8>(&mut rest)?);
        *n = usize::try_from(wide).map_err(|_| "of impossible size")?;
    }
    let coarse = words(&mut rest, counts[5], f32::from_le_bytes)?;
    let bricks = words(&mut rest, counts[6], u32::from_le_bytes)?;
    let fine = words(&mut rest, counts[7], f32::from_le_bytes)?;
    let field = SparseField {
        origin: [numbers[0], numbers[1], numbers[2]],
        voxel: numbers[3],
        cells: [counts[0], counts[1], counts[2]],
        coarse,
        bricks,
        fine,
    };
    if !rest.is_empty() || !field.is_consistent() {
        return Err("inconsistent");
    }
    Ok(Sampled {
        field,
        hidden: counts[3],
        cavities: counts[4],
    })
}

fn take<const N: usize>(rest: &mut &[u8]) -> Result<[u8; N], &'static str> {
    let (head, tail) = rest.split_first_chunk::<N>().ok_or("cut short")?;
    *rest = tail;
    Ok(*head)
}

fn words<T>(
    rest: &mut &[u8],
    count: usize,
    from: impl Fn([u8; 4]) -> T,
) -> Result<Vec<T>, &'static str> {
    let length = count.checked_mul(4).ok_or("of impossible size")?;
    let (head, tail) = rest.split_at_checked(length).ok_or("cut short")?;
    *rest = tail;
    Ok(head.as_chunks::<4>().0.iter().map(|b| from(*b)).collect())
}
