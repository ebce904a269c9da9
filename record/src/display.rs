//! Foxglove's well-known messages.
//!
//! Display coordinates are rounded to `f32`: the wire type of a vertex is a
//! double, and the zero bits that rounding leaves compress well.

use foxglove::bytes::Bytes;
use foxglove::messages::packed_element_field::NumericType;
use foxglove::messages::{
    Color, LinePrimitive, Log, PackedElementField, Point3, PointCloud, Pose, Quaternion,
    SceneEntity, SceneUpdate, Timestamp, TriangleListPrimitive, Vector3, line_primitive, log,
};

use crate::RunHeader;

/// Importance of a log line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LogLevel {
    /// Detail for developers.
    Debug,
    /// Normal events.
    Info,
    /// Something to look at.
    Warning,
    /// Something failed, the run goes on.
    Error,
    /// The run ends.
    Fatal,
}

impl LogLevel {
    fn wire(self) -> i32 {
        let level = match self {
            Self::Debug => log::Level::Debug,
            Self::Info => log::Level::Info,
            Self::Warning => log::Level::Warning,
            Self::Error => log::Level::Error,
            Self::Fatal => log::Level::Fatal,
        };
        level as i32
    }

    pub(crate) fn from_wire(level: u64) -> Self {
        match level {
            1 => Self::Debug,
            3 => Self::Warning,
            4 => Self::Error,
            5 => Self::Fatal,
            _ => Self::Info,
        }
    }
}

/// Okabe and Ito's palette, which most colour-blind people can tell apart.
const PALETTE: [[u8; 3]; 7] = [
    [86, 180, 233],
    [230, 159, 0],
    [0, 158, 115],
    [240, 228, 66],
    [0, 114, 178],
    [213, 94, 0],
    [204, 121, 167],
];

/// The fixed frame of every message.
const FRAME: &str = "world";

/// Triangles of one fabric and the points that they use.
struct Part {
    fabric: u16,
    points: Vec<u32>,
    indices: Vec<u32>,
}

/// Lines of the yarns of one thickness, and the points that they use.
struct Lines {
    thickness: f64,
    points: Vec<u32>,
    indices: Vec<u32>,
}

/// Lines of yarns in a message; beyond, visits are skipped evenly.
const LINE_LIMIT: usize = 400_000;

/// Builds display messages of the cloth.
pub(crate) struct ClothDisplay {
    parts: Vec<Part>,
    lines: Vec<Lines>,
}

impl ClothDisplay {
    pub fn new(header: &RunHeader) -> Self {
        let mut fabrics: Vec<u16> = header.fabrics.clone();
        fabrics.sort_unstable();
        fabrics.dedup();
        if fabrics.is_empty() {
            fabrics.push(0);
        }
        let parts = fabrics
            .into_iter()
            .map(|fabric| {
                let mut local = vec![u32::MAX; header.points];
                let (mut points, mut indices) = (Vec::new(), Vec::new());
                for (t, triangle) in header.triangles.iter().enumerate() {
                    if header.fabrics.get(t).is_some_and(|f| *f != fabric) {
                        continue;
                    }
                    for &p in triangle {
                        let slot = &mut local[p as usize];
                        if *slot == u32::MAX {
                            *slot = points.len() as u32;
                            points.push(p);
                        }
                        indices.push(*slot);
                    }
                }
                Part {
                    fabric,
                    points,
                    indices,
                }
            })
            .collect();
        Self {
            parts,
            lines: lines(header),
        }
    }

    pub fn scene(&self, nanoseconds: u64, positions: &[f64]) -> SceneUpdate {
        let triangles = self
            .parts
            .iter()
            .map(|part| {
                let points = part
                    .points
                    .iter()
                    .map(|&p| {
                        let p = 3 * p as usize;
                        point([positions[p], positions[p + 1], positions[p + 2]])
                    })
                    .collect();
                let rgb = PALETTE[part.fabric as usize % PALETTE.len()];
                primitive(points, part.indices.clone(), rgb)
            })
            .collect();
        let mut update = entity(nanoseconds, "cloth", triangles);
        let lines = self.lines.iter().enumerate().map(|(k, lines)| {
            let points = lines.points.iter().map(|&p| {
                let p = 3 * p as usize;
                point([positions[p], positions[p + 1], positions[p + 2]])
            });
            let [r, g, b] = PALETTE[k % PALETTE.len()].map(|c| f64::from(c) / 255.0);
            LinePrimitive {
                r#type: line_primitive::Type::LineList as i32,
                pose: Some(upright()),
                thickness: lines.thickness,
                scale_invariant: false,
                points: points.collect(),
                color: Some(Color { r, g, b, a: 1.0 }),
                colors: Vec::new(),
                indices: lines.indices.clone(),
            }
        });
        update.entities[0].lines = lines.collect();
        update
    }
}

fn lines(header: &RunHeader) -> Vec<Lines> {
    let yarns = &header.yarns;
    let stride = yarns.points.len().div_ceil(LINE_LIMIT).max(1);
    let mut all: Vec<Lines> = Vec::new();
    let mut local: Vec<Vec<u32>> = Vec::new();
    for (y, radius) in yarns.radii.iter().enumerate() {
        let thickness = 2.0 * radius;
        let place = all.iter().position(|l| l.thickness == thickness);
        let place = place.unwrap_or_else(|| {
            all.push(Lines {
                thickness,
                points: Vec::new(),
                indices: Vec::new(),
            });
            local.push(vec![u32::MAX; header.points]);
            all.len() - 1
        });
        let (lines, local) = (&mut all[place], &mut local[place]);
        let way = &yarns.points[yarns.visits(y)];
        let (last, but_last) = (way[way.len() - 1], way[..way.len() - 1].iter());
        let mut before = None;
        for p in but_last.step_by(stride).copied().chain([last]) {
            let slot = &mut local[p as usize];
            if *slot == u32::MAX {
                *slot = lines.points.len() as u32;
                lines.points.push(p);
            }
            lines
                .indices
                .extend(before.into_iter().flat_map(|b| [b, *slot]));
            before = Some(*slot);
        }
    }
    all
}

/// The obstacles, all in one message.
pub(crate) fn bodies(header: &RunHeader) -> SceneUpdate {
    let entities = header
        .bodies
        .iter()
        .enumerate()
        .flat_map(|(i, body)| {
            let points = body.points.iter().map(|p| point(*p)).collect();
            let indices = body.triangles.as_flattened().to_vec();
            // The index keeps bodies of equal names apart.
            let id = format!("{i} {}", body.name);
            entity(0, &id, vec![primitive(points, indices, [170, 170, 170])]).entities
        })
        .collect();
    SceneUpdate {
        deletions: Vec::new(),
        entities,
    }
}

/// The points as `f32` triples.
pub(crate) fn cloud(nanoseconds: u64, positions: &[f64]) -> PointCloud {
    let data: Vec<u8> = positions
        .iter()
        .flat_map(|x| (*x as f32).to_le_bytes())
        .collect();
    let field = |name: &str, offset| PackedElementField {
        name: name.into(),
        offset,
        r#type: NumericType::Float32 as i32,
    };
    PointCloud {
        timestamp: Some(timestamp(nanoseconds)),
        frame_id: FRAME.into(),
        pose: Some(upright()),
        point_stride: 12,
        fields: vec![field("x", 0), field("y", 4), field("z", 8)],
        data: Bytes::from(data),
    }
}

pub(crate) fn line(nanoseconds: u64, level: LogLevel, message: &str) -> Log {
    Log {
        timestamp: Some(timestamp(nanoseconds)),
        level: level.wire(),
        message: message.into(),
        name: "selvedge".into(),
        ..Log::default()
    }
}

fn entity(nanoseconds: u64, id: &str, triangles: Vec<TriangleListPrimitive>) -> SceneUpdate {
    let entity = SceneEntity {
        timestamp: Some(timestamp(nanoseconds)),
        frame_id: FRAME.into(),
        id: id.into(),
        triangles,
        ..SceneEntity::default()
    };
    SceneUpdate {
        deletions: Vec::new(),
        entities: vec![entity],
    }
}

fn primitive(points: Vec<Point3>, indices: Vec<u32>, rgb: [u8; 3]) -> TriangleListPrimitive {
    let [r, g, b] = rgb.map(|c| f64::from(c) / 255.0);
    TriangleListPrimitive {
        pose: Some(upright()),
        points,
        color: Some(Color { r, g, b, a: 1.0 }),
        colors: Vec::new(),
        indices,
    }
}

fn point(p: [f64; 3]) -> Point3 {
    let [x, y, z] = p.map(|x| f64::from(x as f32));
    Point3 { x, y, z }
}

/// Our y axis points up, the viewer's z axis: a quarter turn about x. Being
/// in the pose it leaves the coordinates as they are.
fn upright() -> Pose {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    Pose {
        position: Some(Vector3 {
            x: 0.0,
            y: 0.0,
            z: 0.0,
        }),
        orientation: Some(Quaternion {
            x: half,
            y: 0.0,
            z: 0.0,
            w: half,
        }),
    }
}

fn timestamp(nanoseconds: u64) -> Timestamp {
    let seconds = (nanoseconds / 1_000_000_000) as u32; // below u64::MAX / 1e9
    Timestamp::new(seconds, (nanoseconds % 1_000_000_000) as u32)
}
