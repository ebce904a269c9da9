use super::super::spec::Kind::{Choice, Path, Rotation, Tables, Text};
use super::super::spec::{
    Key, NOT_NEGATIVE, Range, Table, Variant, derived, key, number, optional, required, vec3,
};
use super::{DIRECTION, POSITION};

pub(super) static BODY: Table = Table::new(
    "An obstacle.",
    &[
        derived(
            "name",
            Text,
            "`body`, `body-1`, …",
            "Name by which attachments refer to it.",
        ),
        key(
            "friction",
            number("", Range::zero_to(100.0)),
            "0.3",
            "Coulomb friction coefficient of the body's material; cloth rubs on it with the \
             geometric mean of this and the fabric's.",
        ),
        key(
            "motion",
            Tables(&KEYFRAME),
            "[]",
            "Keyframes; at rest before the first and after the last.",
        ),
        optional(
            "pivot",
            POSITION,
            "Point that `motion` rotates about; default the origin.",
        ),
        key(
            "interpolation",
            INTERPOLATION,
            "\"linear\"",
            "How the motion passes between keyframes.",
        ),
    ],
)
.tagged("kind", SHAPES);

pub(super) const INTERPOLATION: super::super::spec::Kind = Choice(&[
    ("linear", "constant velocity between keyframes"),
    ("eased", "coming to rest at every keyframe"),
]);

/// One keyframe of a rigid motion.
pub(super) static KEYFRAME: Table = Table::new(
    "One keyframe.",
    &[
        required("time", number("s", NOT_NEGATIVE), "When."),
        key(
            "translation",
            POSITION,
            "[0, 0, 0]",
            "Displacement from the start.",
        ),
        key(
            "rotation",
            Rotation,
            "[0, 0, 0]",
            "Rotation from the start; axis and angle may exceed a full turn.",
        ),
    ],
);

const RADIUS: Key =
    required("radius", number("m", Range::up_to(100.0)), "Radius.").hint("m, not cm or mm");
const CENTER: Key = key("center", POSITION, "[0, 0, 0]", "Centre.");
const ROTATION: Key = key(
    "rotation",
    Rotation,
    "[0, 0, 0]",
    "Rotation about the centre.",
);

static SPHERE: &[Key] = &[CENTER, RADIUS];
static CAPSULE: &[Key] = &[
    required("from", POSITION, "Centre of the first end."),
    required("to", POSITION, "Centre of the second end."),
    RADIUS,
    optional(
        "radius_to",
        number("m", Range::up_to(100.0)),
        "Radius of the second end; default `radius`.",
    ),
];
static ELLIPSOID: &[Key] = &[
    CENTER,
    required(
        "radii",
        vec3("m", Range::up_to(100.0)),
        "Half lengths of the axes.",
    ),
    ROTATION,
];
static BOX: &[Key] = &[
    CENTER,
    required("size", vec3("m", Range::up_to(100.0)), "Side lengths.").hint("m, not cm or mm"),
    ROTATION,
    key(
        "rounding",
        number("m", NOT_NEGATIVE),
        "0",
        "Radius of the edges, inside `size`.",
    ),
];
static PLANE: &[Key] = &[
    key("point", POSITION, "[0, 0, 0]", "A point of the plane."),
    key(
        "normal",
        DIRECTION,
        "[0, 1, 0]",
        "Direction out of the solid side.",
    ),
];

const SPHERE_FORM: Variant = Variant {
    name: "sphere",
    doc: "A ball.",
    keys: SPHERE,
};
const CAPSULE_FORM: Variant = Variant {
    name: "capsule",
    doc: "The hull of two balls.",
    keys: CAPSULE,
};
const ELLIPSOID_FORM: Variant = Variant {
    name: "ellipsoid",
    doc: "An ellipsoid.",
    keys: ELLIPSOID,
};
const BOX_FORM: Variant = Variant {
    name: "box",
    doc: "A box, with rounded edges if asked.",
    keys: BOX,
};
const PLANE_FORM: Variant = Variant {
    name: "plane",
    doc: "A half space.",
    keys: PLANE,
};

static SHAPES: &[Variant] = &[
    SPHERE_FORM,
    CAPSULE_FORM,
    ELLIPSOID_FORM,
    BOX_FORM,
    PLANE_FORM,
    Variant {
        name: "union",
        doc: "Several shapes as one.",
        keys: &[
            required("shapes", Tables(&PART), "The shapes."),
            key(
                "smooth",
                number("m", Range::zero_to(10.0)),
                "0",
                "Radius over which the shapes blend; 0 keeps the creases.",
            ),
        ],
    },
    Variant {
        name: "mesh",
        doc: "A closed triangle mesh from an OBJ file, as a distance field.",
        keys: &[
            required("file", Path, "OBJ file, relative to the scene file."),
            key(
                "scale",
                number("", Range::up_to(1e4)),
                "1",
                "Factor from the file's unit to metres: 0.01 for a file in cm.",
            ),
            key(
                "voxel",
                number("m", Range::up_to(1.0)),
                "0.005",
                "Grid spacing of the distance field.",
            )
            .hint("m, not mm"),
            CENTER,
            ROTATION,
        ],
    },
    Variant {
        name: "mannequin",
        doc: "A standing figure of 1.70 m made of analytic shapes, feet at the origin, facing \
              +z, arms 40° below the horizontal.",
        keys: &[],
    },
];

/// A shape of a union.
static PART: Table = Table::new("A shape of a union.", &[]).tagged(
    "kind",
    &[
        SPHERE_FORM,
        CAPSULE_FORM,
        ELLIPSOID_FORM,
        BOX_FORM,
        PLANE_FORM,
    ],
);
