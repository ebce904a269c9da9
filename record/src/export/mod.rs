//! Files for other programs, written whole or not at all.

mod csv;
mod glb;
mod obj;
mod pc2;
mod ply;
mod skin;
mod usda;

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use crate::{RecordError, Recording, Surface};

pub use csv::write_steps_csv;
pub use obj::{write_obj, write_obj_lines};
pub use ply::write_ply;
pub use skin::Skin;

use skin::Shown;

/// A file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Wavefront OBJ: one file a frame, every bit of the coordinates kept,
    /// material coordinates as texture coordinates, panels as groups.
    Obj,
    /// Binary PLY in double precision: one file a frame.
    Ply,
    /// glTF 2.0 binary: one file, frames as morph targets.
    Glb,
    /// USD as text: one file with time samples.
    Usda,
    /// Point cache: one file with all frames, without topology.
    Pc2,
}

impl Format {
    /// All formats.
    pub const ALL: [Self; 5] = [Self::Obj, Self::Ply, Self::Glb, Self::Usda, Self::Pc2];

    /// Extension of its files.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Obj => "obj",
            Self::Ply => "ply",
            Self::Glb => "glb",
            Self::Usda => "usda",
            Self::Pc2 => "pc2",
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.extension())
    }
}

impl FromStr for Format {
    type Err = RecordError;

    /// Extensions, and the names `gltf` and `usd`.
    fn from_str(name: &str) -> Result<Self, RecordError> {
        match name {
            "gltf" => Ok(Self::Glb),
            "usd" => Ok(Self::Usda),
            _ => Self::ALL
                .into_iter()
                .find(|f| f.extension() == name)
                .ok_or_else(|| {
                    let known = Self::ALL.map(Self::extension).join(", ");
                    RecordError::Export {
                        reason: format!("unknown format {name:?}; known: {known}"),
                    }
                }),
        }
    }
}

/// Which frames of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameRange {
    /// First frame.
    pub first: usize,
    /// Last frame, itself included; the last one of the recording when it is
    /// beyond.
    pub last: usize,
    /// Every how many frames.
    pub stride: usize,
}

impl FrameRange {
    /// All frames.
    pub const ALL: Self = Self {
        first: 0,
        last: usize::MAX,
        stride: 1,
    };

    /// The last frame alone.
    pub fn last(recording: &Recording) -> Self {
        let last = recording.frames().len().saturating_sub(1);
        Self {
            first: last,
            last,
            stride: 1,
        }
    }

    /// Number of frames chosen.
    pub fn count(self, recording: &Recording) -> usize {
        self.indices(recording).map_or(0, |all| all.len())
    }

    fn indices(self, recording: &Recording) -> Result<Vec<usize>, RecordError> {
        let count = recording.frames().len();
        if self.first >= count || self.last < self.first || self.stride == 0 {
            let Self {
                first,
                last,
                stride,
            } = self;
            let reason = format!(
                "frames {first} to {last} by {stride} are none of the {count} frames of {}",
                recording.path().display()
            );
            return Err(RecordError::Export { reason });
        }
        Ok((self.first..=self.last.min(count - 1))
            .step_by(self.stride)
            .collect())
    }
}

/// Writes frames of a recording and returns the files. Formats of one frame a
/// file write `path` itself for one frame and `name.0007.obj` (the index of
/// the frame) for several.
///
/// # Errors
/// [`RecordError::Export`] when the format cannot take the selection,
/// [`RecordError::Write`], and what reading frames gives. No file is left half
/// written.
pub fn export(
    recording: &Recording,
    format: Format,
    frames: FrameRange,
    path: &Path,
) -> Result<Vec<PathBuf>, RecordError> {
    export_skinned(recording, format, frames, path, None)
}

/// [`export`] with the triangles of a skin instead of the recorded ones. A point
/// cache has no triangles and takes the recorded points.
///
/// # Errors
/// As [`export`].
pub fn export_skinned(
    recording: &Recording,
    format: Format,
    frames: FrameRange,
    path: &Path,
    skin: Option<&dyn Skin>,
) -> Result<Vec<PathBuf>, RecordError> {
    let indices = frames.indices(recording)?;
    if matches!(format, Format::Glb | Format::Usda | Format::Pc2) {
        increasing(recording, &indices)?;
    }
    let shown = Shown::new(recording, skin);
    if format != Format::Pc2 && shown.header().triangles.is_empty() {
        let reason = format!("there are no triangles for {format}; pc2 takes the points alone");
        return Err(RecordError::Export { reason });
    }
    let single = match format {
        Format::Obj => write_obj,
        Format::Ply => write_ply,
        Format::Glb => return glb::write(&shown, &indices, path).map(|()| vec![path.into()]),
        Format::Usda => return usda::write(&shown, &indices, path).map(|()| vec![path.into()]),
        Format::Pc2 => return pc2::write(recording, &indices, path).map(|()| vec![path.into()]),
    };
    let mut written = Vec::with_capacity(indices.len());
    for &index in &indices {
        let frame = shown.frame(index)?;
        let file = if indices.len() == 1 {
            path.to_owned()
        } else {
            numbered(path, index)
        };
        single(&file, &Surface::of(shown.header(), &frame.positions))?;
        written.push(file);
    }
    Ok(written)
}

/// Animations need times that increase, also after rounding to `f32`.
fn increasing(recording: &Recording, indices: &[usize]) -> Result<(), RecordError> {
    let times = indices.iter().map(|i| recording.frames()[*i].time);
    for ((a, b), index) in times.clone().zip(times.skip(1)).zip(&indices[1..]) {
        if (a as f32) >= b as f32 {
            let reason = format!("frame {index} at {b} s is not after the one before, at {a} s");
            return Err(RecordError::Export { reason });
        }
    }
    Ok(())
}

fn numbered(path: &Path, index: usize) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let extension = path
        .extension()
        .map(|e| format!(".{}", e.to_string_lossy()));
    path.with_file_name(format!(
        "{stem}.{index:04}{}",
        extension.unwrap_or_default()
    ))
}

/// Corners of a surface split where material coordinates differ: seams.
pub(crate) struct SplitCorners {
    /// Point of each split vertex.
    pub point: Vec<u32>,
    /// Its material coordinates; zeros when there are none.
    pub material: Vec<[f64; 2]>,
    /// Triangles of split vertices.
    pub triangles: Vec<[u32; 3]>,
}

impl SplitCorners {
    pub fn new(surface: &Surface<'_>) -> Self {
        let mut split = Self {
            point: Vec::new(),
            material: Vec::new(),
            triangles: Vec::new(),
        };
        // First split vertex of each point, and the next one of the same.
        let mut first = vec![u32::MAX; surface.points];
        let mut next: Vec<u32> = Vec::new();
        for (t, triangle) in surface.triangles.iter().enumerate() {
            let material = surface.material.get(t).copied().unwrap_or_default();
            split.triangles.push(std::array::from_fn(|c| {
                let point = triangle[c];
                let mut at = first[point as usize];
                while at != u32::MAX && split.material[at as usize] != material[c] {
                    at = next[at as usize];
                }
                if at == u32::MAX {
                    at = split.point.len() as u32;
                    split.point.push(point);
                    split.material.push(material[c]);
                    next.push(std::mem::replace(&mut first[point as usize], at));
                }
                at
            }));
        }
        split
    }
}
