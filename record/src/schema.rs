//! Topics and schemas. The ones of Foxglove come from its own crate; ours are
//! protocol buffers, described here so that any reader can decode them.

use crate::wire::Encoder;

/// Newest format of our own part of the file.
pub(crate) const FORMAT: u32 = 1;

/// Cloth triangles, `foxglove.SceneUpdate`.
pub const TOPIC_CLOTH: &str = "/cloth";
/// Obstacles, `foxglove.SceneUpdate`, once.
pub const TOPIC_BODIES: &str = "/bodies";
/// Cloth points, `foxglove.PointCloud`; optional.
pub const TOPIC_POINTS: &str = "/points";
/// Log lines, `foxglove.Log`.
pub const TOPIC_LOG: &str = "/log";
/// Lossless unknowns and rates, `selvedge.Frame`.
pub const TOPIC_STATE: &str = "/state";
/// JSON of [`StepDiagnostics`](crate::StepDiagnostics).
pub const TOPIC_DIAGNOSTICS: &str = "/diagnostics";
/// `selvedge.Checkpoint`.
pub const TOPIC_CHECKPOINT: &str = "/checkpoint";
/// Mesh and bodies, `selvedge.Topology`, once.
pub const TOPIC_TOPOLOGY: &str = "/topology";

/// Metadata record with scene, settings and version.
pub const METADATA_RUN: &str = "selvedge.run";
/// Metadata record with the outcome; only a complete recording has it.
pub const METADATA_OUTCOME: &str = "selvedge.outcome";
/// Attachment with the scene file.
pub const ATTACHMENT_SCENE: &str = "scene.toml";

const DOUBLE: u64 = 1;
const UINT64: u64 = 4;
const FIXED32: u64 = 7;
const STRING: u64 = 9;
const MESSAGE: u64 = 11;
const BYTES: u64 = 12;

struct Field(&'static str, u64, u64, bool, &'static str);

const fn one(name: &'static str, number: u64, kind: u64) -> Field {
    Field(name, number, kind, false, "")
}

const fn many(name: &'static str, number: u64, kind: u64) -> Field {
    Field(name, number, kind, true, "")
}

fn message(e: &mut Encoder<'_>, name: &str, fields: &[Field]) {
    // FileDescriptorProto.message_type
    e.message(4, |e| {
        e.string(1, name);
        for Field(name, number, kind, repeated, type_name) in fields {
            e.message(2, |e| {
                e.string(1, name);
                e.uint(3, *number);
                e.uint(4, if *repeated { 3 } else { 1 });
                e.uint(5, *kind);
                if !type_name.is_empty() {
                    e.string(6, type_name);
                }
            });
        }
    });
}

/// `google.protobuf.FileDescriptorSet` of our messages.
pub(crate) fn descriptors() -> Vec<u8> {
    let mut bytes = Vec::new();
    Encoder(&mut bytes).message(1, |e| {
        e.string(1, "selvedge.proto");
        e.string(2, "selvedge");
        message(
            e,
            "Frame",
            &[
                one("time", 1, DOUBLE),
                one("step", 2, UINT64),
                many("positions", 3, DOUBLE),
                many("velocities", 4, DOUBLE),
                many("scalars", 5, DOUBLE),
                many("scalar_rates", 6, DOUBLE),
            ],
        );
        message(
            e,
            "Section",
            &[one("name", 1, STRING), many("values", 2, DOUBLE)],
        );
        message(
            e,
            "Checkpoint",
            &[
                one("time", 1, DOUBLE),
                one("step", 2, UINT64),
                Field("sections", 3, MESSAGE, true, ".selvedge.Section"),
                one("blake3", 4, BYTES),
            ],
        );
        message(
            e,
            "Body",
            &[
                one("name", 1, STRING),
                many("points", 2, DOUBLE),
                many("triangles", 3, FIXED32),
            ],
        );
        message(
            e,
            "Yarns",
            &[
                many("offsets", 1, FIXED32),
                many("points", 2, FIXED32),
                one("layers", 3, BYTES),
                many("arcs", 4, DOUBLE),
                many("radii", 5, DOUBLE),
                many("panels", 6, FIXED32),
                one("sides", 7, BYTES),
            ],
        );
        message(
            e,
            "Topology",
            &[
                one("points", 1, UINT64),
                one("scalars", 2, UINT64),
                many("triangles", 3, FIXED32),
                many("panels", 4, FIXED32),
                many("fabrics", 5, FIXED32),
                many("material", 6, DOUBLE),
                many("panel_names", 7, STRING),
                many("fabric_names", 8, STRING),
                Field("bodies", 9, MESSAGE, true, ".selvedge.Body"),
                Field("yarns", 10, MESSAGE, false, ".selvedge.Yarns"),
            ],
        );
        e.string(12, "proto3");
    });
    bytes
}
