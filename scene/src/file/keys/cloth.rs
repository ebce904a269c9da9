use super::super::spec::Kind::{
    Choice, Integers, NamedIntegers, NamedTexts, Path, Rotation, Text, Texts, Vector,
};
use super::super::spec::{
    Key, Range, Table, Variant, derived, integer, key, number, optional, required,
};
use super::POSITION;
use super::yarn::{KNIT, KNIT_MESH, KNIT_PATTERN, WOVEN, WOVEN_MESH};

const MOST_LAYERS: i64 = 100;

pub(super) static CLOTH: Table = Table::new(
    "A piece of cloth.",
    &[
        derived(
            "name",
            Text,
            "`cloth`, `cloth-1`, …",
            "Name by which pins and attachments refer to it.",
        ),
        key(
            "fabric",
            Text,
            "\"cotton-poplin\"",
            "A fabric of this scene (`[fabric.NAME]`) or of the library (`selvedge fabric list`). \
             Cloth of yarns has none, but for `knit-pattern`, whose shells drape with it.",
        ),
        key(
            "center",
            POSITION,
            "[0, 0, 0]",
            "Where the middle of a sheet, or the origin of a file, is put.",
        )
        .hint("is it in cm?"),
        key(
            "rotation",
            Rotation,
            "[0, 0, 0]",
            "Rotation about that point. A sheet lies in the x-z plane, warp along x.",
        ),
        key(
            "stretch",
            number("", Range::between(0.01, 100.0)),
            "1",
            "Initial size relative to rest: 1.2 begins stretched by 20 %.",
        ),
        key(
            "noise",
            number("m", Range::zero_to(0.1)),
            "0",
            "Standard deviation of a random displacement of every point at the start.",
        )
        .hint("m, not mm"),
        key(
            "noise_seed",
            integer(0, i64::MAX),
            "1",
            "Seed of that displacement.",
        ),
        key(
            "layer",
            integer(0, MOST_LAYERS),
            "0",
            "Place among the layers of clothing, from 0 at the body outwards. Patterns start \
             `assemble.layer_clearance` further out for each; cloth in layers touches itself.",
        ),
    ],
)
.tagged_or(
    "kind",
    "sheet",
    &[
        Variant {
            name: "sheet",
            doc: "A rectangle.",
            keys: SHEET,
        },
        Variant {
            name: "mesh",
            doc: "A triangle mesh from an OBJ file.",
            keys: MESH,
        },
        Variant {
            name: "pattern",
            doc: "A sewing pattern from a GarmentCode file.",
            keys: PATTERN,
        },
        Variant {
            name: "knit",
            doc: "A knitted rectangle, yarn by yarn, from a stitch chart.",
            keys: KNIT,
        },
        Variant {
            name: "woven",
            doc: "A woven rectangle, yarn by yarn, from a weave draft.",
            keys: WOVEN,
        },
        Variant {
            name: "knit-mesh",
            doc: "The panels of an OBJ file, knitted and sewn yarn by yarn.",
            keys: KNIT_MESH,
        },
        Variant {
            name: "knit-pattern",
            doc: "A sewing pattern, draped as a shell and then knitted and sewn yarn by yarn.",
            keys: KNIT_PATTERN,
        },
        Variant {
            name: "woven-mesh",
            doc: "The panels of an OBJ file, woven and sewn yarn by yarn.",
            keys: WOVEN_MESH,
        },
    ],
);

pub(super) const EDGE_LENGTH: Key = optional(
    "edge_length",
    number("m", Range::up_to(10.0)),
    "Target edge length; default `mesh.edge_length`.",
)
.hint("m, not mm or cm");

static SHEET: &[Key] = &[
    key(
        "size",
        Vector {
            len: 2,
            unit: "m",
            range: Range::up_to(100.0),
        },
        "[1, 1]",
        "Extent along warp and weft.",
    )
    .hint("m, not cm or mm"),
    optional(
        "points",
        Integers {
            len: 2,
            min: 2,
            max: 20_000,
        },
        "Points along warp and weft; instead of `edge_length`.",
    ),
    EDGE_LENGTH,
    key(
        "lattice",
        Choice(&[
            (
                "equilateral",
                "rows of near-equilateral triangles, the same bending in every direction",
            ),
            (
                "alternating",
                "right triangles with diagonals of alternating direction",
            ),
        ]),
        "\"equilateral\"",
        "Arrangement of the points.",
    ),
];

static MESH: &[Key] = &[
    key(
        "rest",
        Choice(&[
            (
                "auto",
                "the texture coordinates if every edge has between 0.8 and 1.25 times its length \
                 in them and no triangle is turned over, as in `final.obj`; else the shape",
            ),
            (
                "shape",
                "the shape of the file; warp runs along the world's x axis",
            ),
            (
                "texture",
                "the texture coordinates, warp and weft in the unit of the file",
            ),
        ]),
        "\"auto\"",
        "What is at rest.",
    ),
    key(
        "rest_angles",
        Choice(&[
            ("flat", "none: the cloth is flat where nothing bends it"),
            ("shape", "those of the shape, as placed in the scene"),
        ]),
        "\"flat\"",
        "Angles between the triangles at rest.",
    ),
    required("file", Path, "OBJ file, relative to the scene file."),
    key(
        "scale",
        number("", Range::up_to(1e4)),
        "1",
        "Factor from the file's unit to metres: 0.01 for a file in cm.",
    ),
];

static PATTERN: &[Key] = &[
    required(
        "file",
        Path,
        "GarmentCode JSON file, relative to the scene file.",
    ),
    EDGE_LENGTH,
    key(
        "panel_fabric",
        NamedTexts,
        "{}",
        "Fabric of single panels, by panel name.",
    ),
    key(
        "panel_layer",
        NamedIntegers { max: MOST_LAYERS },
        "{}",
        "Layer of single panels, by panel name, instead of `layer`: an overlapping front, a pocket.",
    ),
    key(
        "hold",
        Texts,
        "[\"auto\"]",
        "Labels of edges that stay attached to where they are on the body. `auto` stands for \
         `strapless_top`, and for `lower_interface` (the waist) where nothing of the garment \
         reaches more than 10 cm above it; an empty list attaches nothing.",
    ),
];
