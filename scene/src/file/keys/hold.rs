use super::super::spec::Kind::{Choice, Indices, Table as Sub, Tables, Text};
use super::super::spec::{
    Key, NOT_NEGATIVE, Range, Table, Variant, derived, integer, key, number, optional, required,
};
use super::body::{INTERPOLATION, KEYFRAME};
use super::{DIRECTION, POSITION};

const CLOTH: Key = derived(
    "cloth",
    Text,
    "the only piece of cloth",
    "Name of the piece of cloth.",
);

const SELECT: Key = required(
    "select",
    Sub(&SELECTION),
    "Which of its points. Exactly one of the keys.",
);

const PIVOT: Key = optional(
    "pivot",
    POSITION,
    "Point that `motion` rotates about; default the middle of the selected points.",
);

const MOTION: Key = key(
    "motion",
    Tables(&KEYFRAME),
    "[]",
    "Keyframes that move what the points are held to.",
);

const EASE: Key = key(
    "interpolation",
    INTERPOLATION,
    "\"linear\"",
    "How the motion passes between keyframes.",
);

pub(super) static PIN: Table = Table::new(
    "Points held exactly.",
    &[CLOTH, SELECT, MOTION, PIVOT, EASE],
)
.tagged_or(
    "kind",
    "fixed",
    &[
        Variant {
            name: "fixed",
            doc: "No freedom: the points stay, or follow the motion.",
            keys: &[],
        },
        Variant {
            name: "plane",
            doc: "Free to slide in a plane.",
            keys: &[required("normal", DIRECTION, "Normal of the plane.")],
        },
        Variant {
            name: "line",
            doc: "Free to slide along a line.",
            keys: &[required("direction", DIRECTION, "Direction of the line.")],
        },
    ],
);

pub(super) static ATTACHMENT: Table = Table::new(
    "Points held by springs to where they start.",
    &[
        CLOTH,
        SELECT,
        key(
            "stiffness",
            number("N/m", Range::up_to(1e9)),
            "1e4",
            "Stiffness of each spring.",
        ),
        optional(
            "body",
            Text,
            "Body whose motion the other ends of the springs follow.",
        ),
        MOTION,
        PIVOT,
        EASE,
    ],
);

static SELECTION: Table = Table::one_of(
    "Points of a piece of cloth. Exactly one of the keys.",
    &[
        optional(
            "corner",
            Choice(&[
                ("all", "the four corners of a sheet"),
                ("top-left", "least warp, greatest weft coordinate"),
                ("top-right", "greatest warp and weft coordinate"),
                ("bottom-left", "least warp and weft coordinate"),
                ("bottom-right", "greatest warp, least weft coordinate"),
            ]),
            "Corners of a sheet.",
        ),
        optional(
            "edge",
            Choice(&[
                ("left", "least warp coordinate"),
                ("right", "greatest warp coordinate"),
                ("bottom", "least weft coordinate"),
                ("top", "greatest weft coordinate"),
                ("all", "the whole boundary"),
            ]),
            "Points of an edge of a sheet.",
        ),
        optional("box", Sub(&BOX), "Points inside a box at the start."),
        optional("points", Indices, "Points by number, from 0."),
        optional(
            "label",
            Text,
            "Points of the pattern's edges with this label.",
        ),
        optional("nearest", Sub(&NEAREST), "The points nearest to a place."),
        optional("yarn", Sub(&YARN_END), "The end of a yarn."),
    ],
);

static BOX: Table = Table::new(
    "A box along the axes.",
    &[
        required("min", POSITION, "Least corner."),
        required("max", POSITION, "Greatest corner."),
    ],
);

static YARN_END: Table = Table::new(
    "An end of a yarn.",
    &[
        key(
            "index",
            integer(-1_000_000, 1_000_000),
            "0",
            "The yarn: from 0, or from -1 for the last backwards. Knits: cast-on, rows, bind-off; \
             wovens: warps, then wefts.",
        ),
        required(
            "end",
            Choice(&[
                ("first", "where it begins"),
                ("last", "where it ends"),
                ("both", "both ends"),
            ]),
            "Which end.",
        ),
    ],
);

static NEAREST: Table = Table::new(
    "A place.",
    &[
        required("to", POSITION, "The place."),
        key(
            "within",
            number("m", NOT_NEGATIVE),
            "0",
            "All points within this distance; 0 takes the nearest alone.",
        ),
    ],
);
