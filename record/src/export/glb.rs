use std::io::Write;
use std::path::Path;

use serde_json::{Value as Json, json};

use super::{Shown, SplitCorners};
use crate::atomic::write_atomically;
use crate::{RecordError, Surface};

/// One morph target a frame costs frames² weights and a lot of vertex
/// buffers; viewers give up somewhere above.
const FRAME_LIMIT: usize = 256;

const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// The binary part and the tables that describe it.
#[derive(Default)]
struct Buffer {
    bytes: Vec<u8>,
    views: Vec<Json>,
    accessors: Vec<Json>,
}

impl Buffer {
    /// Appends `f32` vectors of `width` and returns their accessor.
    fn floats(&mut self, values: &[f32], width: usize, target: Option<u32>) -> usize {
        let kind = ["SCALAR", "VEC2", "VEC3"][width - 1];
        let offset = self.bytes.len();
        self.bytes
            .extend(values.iter().flat_map(|x| x.to_le_bytes()));
        // Bounds are required for positions and times, and harmless otherwise.
        let bound = |start: f32, pick: fn(f32, f32) -> f32| -> Vec<f32> {
            (0..width)
                .map(|c| {
                    values
                        .iter()
                        .skip(c)
                        .step_by(width)
                        .copied()
                        .fold(start, pick)
                })
                .collect()
        };
        let count = values.len() / width;
        let mut accessor = json!({
            "bufferView": self.view(offset, target),
            "componentType": FLOAT,
            "count": count,
            "type": kind,
        });
        if count > 0 {
            accessor["min"] = json!(bound(f32::INFINITY, f32::min));
            accessor["max"] = json!(bound(f32::NEG_INFINITY, f32::max));
        }
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn indices(&mut self, triangles: &[[u32; 3]]) -> usize {
        let offset = self.bytes.len();
        self.bytes.extend(
            triangles
                .as_flattened()
                .iter()
                .flat_map(|i| i.to_le_bytes()),
        );
        let accessor = json!({
            "bufferView": self.view(offset, Some(ELEMENT_ARRAY_BUFFER)),
            "componentType": UNSIGNED_INT,
            "count": 3 * triangles.len(),
            "type": "SCALAR",
        });
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn view(&mut self, offset: usize, target: Option<u32>) -> usize {
        let length = self.bytes.len() - offset;
        let mut view = json!({ "buffer": 0, "byteOffset": offset, "byteLength": length });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.views.push(view);
        self.views.len() - 1
    }
}

/// Writes bodies and cloth; frames after the first as morph targets that an
/// animation plays.
pub(super) fn write(
    recording: &Shown<'_>,
    indices: &[usize],
    path: &Path,
) -> Result<(), RecordError> {
    let header = recording.header();
    if indices.len() > FRAME_LIMIT {
        let reason = format!(
            "{} frames are too many for glTF, which takes up to {FRAME_LIMIT}; use a larger \
             stride, usd or pc2",
            indices.len()
        );
        return Err(RecordError::Export { reason });
    }
    let first = recording.frame(indices[0])?;
    let surface = Surface::of(header, &first.positions);
    surface.validate()?;
    let split = SplitCorners::new(&surface);
    let base: Vec<f32> = split
        .point
        .iter()
        .flat_map(|p| surface.point(*p))
        .map(|x| x as f32)
        .collect();

    let mut buffer = Buffer::default();
    let position = buffer.floats(&base, 3, Some(ARRAY_BUFFER));
    let mut attributes = json!({ "POSITION": position });
    if !header.material.is_empty() {
        // Texture space counts downwards.
        let uv: Vec<f32> = split
            .material
            .iter()
            .flat_map(|[u, v]| [*u as f32, 1.0 - *v as f32])
            .collect();
        attributes["TEXCOORD_0"] = json!(buffer.floats(&uv, 2, Some(ARRAY_BUFFER)));
    }
    let triangles = buffer.indices(&split.triangles);
    let mut targets = Vec::new();
    for &index in &indices[1..] {
        let frame = recording.frame(index)?;
        let surface = Surface::of(header, &frame.positions);
        let shift: Vec<f32> = split
            .point
            .iter()
            .flat_map(|p| surface.point(*p))
            .zip(&base)
            .map(|(x, base)| (x - f64::from(*base)) as f32)
            .collect();
        targets.push(json!({ "POSITION": buffer.floats(&shift, 3, Some(ARRAY_BUFFER)) }));
    }
    let mut primitive = json!({
        "attributes": attributes, "indices": triangles, "material": 0, "mode": 4,
    });
    let mut mesh = json!({ "name": "cloth" });
    let animation = (!targets.is_empty()).then(|| {
        mesh["weights"] = json!(vec![0.0; targets.len()]);
        primitive["targets"] = Json::from(std::mem::take(&mut targets));
        animation(recording, indices, &mut buffer)
    });
    mesh["primitives"] = json!([primitive]);

    let mut meshes = vec![mesh];
    let mut nodes = vec![json!({ "name": "cloth", "mesh": 0 })];
    for body in header.bodies.iter().filter(|b| !b.triangles.is_empty()) {
        let points: Vec<f32> = body
            .points
            .as_flattened()
            .iter()
            .map(|x| *x as f32)
            .collect();
        let position = buffer.floats(&points, 3, Some(ARRAY_BUFFER));
        let triangles = buffer.indices(&body.triangles);
        nodes.push(json!({ "name": body.name, "mesh": meshes.len() }));
        meshes.push(json!({ "name": body.name, "primitives": [
            { "attributes": { "POSITION": position }, "indices": triangles, "material": 1, "mode": 4 },
        ] }));
    }
    let mut root = json!({
        "asset": { "version": "2.0", "generator": concat!("selvedge-record ", env!("CARGO_PKG_VERSION")) },
        "scene": 0,
        "scenes": [{ "nodes": (0..nodes.len()).collect::<Vec<_>>() }],
        "nodes": nodes,
        "meshes": meshes,
        "materials": [material("cloth", [0.34, 0.71, 0.91]), material("body", [0.6, 0.6, 0.6])],
        "extras": { "scene": header.scene_name, "version": header.version },
    });
    if let Some(animation) = animation {
        root["animations"] = json!([animation]);
    }
    let Buffer {
        mut bytes,
        views,
        accessors,
    } = buffer;
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    root["bufferViews"] = Json::from(views);
    root["accessors"] = Json::from(accessors);
    root["buffers"] = json!([{ "byteLength": bytes.len() }]);
    let mut text = root.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');

    let too_large = |_| RecordError::Export {
        reason: "more than 4 GiB do not fit glTF".into(),
    };
    let total = u32::try_from(12 + 8 + text.len() + 8 + bytes.len()).map_err(too_large)?;
    write_atomically(path, |out| {
        out.write_all(b"glTF")?;
        out.write_all(&2_u32.to_le_bytes())?;
        out.write_all(&total.to_le_bytes())?;
        for (kind, chunk) in [(b"JSON", &text), (b"BIN\0", &bytes)] {
            out.write_all(&(chunk.len() as u32).to_le_bytes())?; // below `total`
            out.write_all(kind)?;
            out.write_all(chunk)?;
        }
        Ok(())
    })
}

/// Frame `k` shows target `k - 1` alone, the first frame none.
fn animation(recording: &Shown<'_>, indices: &[usize], buffer: &mut Buffer) -> Json {
    let start = recording.time(indices[0]);
    let times: Vec<f32> = indices
        .iter()
        .map(|i| (recording.time(*i) - start) as f32)
        .collect();
    let count = indices.len();
    let mut weights = vec![0.0; count * (count - 1)];
    for k in 1..count {
        weights[k * (count - 1) + k - 1] = 1.0;
    }
    let (input, output) = (
        buffer.floats(&times, 1, None),
        buffer.floats(&weights, 1, None),
    );
    json!({
        "name": "run",
        "channels": [{ "sampler": 0, "target": { "node": 0, "path": "weights" } }],
        "samplers": [{ "input": input, "output": output, "interpolation": "LINEAR" }],
    })
}

fn material(name: &str, [r, g, b]: [f64; 3]) -> Json {
    json!({
        "name": name,
        "doubleSided": true,
        "pbrMetallicRoughness": {
            "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.9,
        },
    })
}
