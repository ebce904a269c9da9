use super::super::spec::Kind::{self, Bool, Choice, Integers, Path, Text, Vector};
use super::super::spec::{
    Key, NOT_NEGATIVE, Range, Table, derived, key, number, optional, required,
};
use super::cloth::EDGE_LENGTH;

/// A kind of yarn.
pub(super) static YARN: Table = Table::new(
    "A kind of yarn: one of the library with changes.",
    &[
        key(
            "library",
            Choice(&[
                ("sweater", "radius 0.75 mm, soft twist"),
                ("shirt", "radius 0.25 mm"),
                ("pullover", "radius 1.5 mm"),
                ("weaving", "radius 0.25 mm, for woven cloth"),
            ]),
            "\"sweater\"",
            "Yarn to start from.",
        ),
        optional("radius", number("m", Range::up_to(0.05)), "Radius R.").hint("m, not mm"),
        optional(
            "density",
            number("kg/m³", Range::up_to(2e4)),
            "Density of the yarn as a cylinder, air included.",
        ),
        optional(
            "stretch_modulus",
            number("Pa", Range::up_to(1e12)),
            "Y; the yarn's stretch stiffness is Y π R².",
        ),
        optional(
            "bending_modulus",
            number("N", Range::zero_to(1e6)),
            "B; the yarn's bending stiffness is B π R².",
        ),
        optional(
            "shear_modulus",
            number("Pa", Range::zero_to(1e12)),
            "S of woven crossings; their shear stiffness is S R².",
        ),
        optional(
            "wrapping",
            number("N", Range::zero_to(1e6)),
            "Stiffness k_w of yarns wrapped around each other in stitches.",
        ),
        optional(
            "friction",
            number("", Range::zero_to(100.0)),
            "Coulomb friction coefficient between yarns.",
        ),
        optional(
            "anchor_stiffness",
            number("N/m", Range::up_to(1e9)),
            "Stiffness k_f of the springs that stand for sticking.",
        ),
        optional(
            "mass_damping",
            number("1/s", Range::zero_to(1e6)),
            "Damping α in proportion to mass.",
        ),
        optional(
            "stiffness_damping",
            number("s", Range::zero_to(1e3)),
            "Damping β in proportion to stiffness.",
        ),
    ],
);

const SLIDING: Key = key(
    "sliding",
    Bool,
    "true",
    "Whether yarns slide through each other. Without, arc lengths are no unknowns.",
);

const YARN_NAME: Key = key(
    "yarn",
    Text,
    "\"sweater\"",
    "A yarn of this scene (`[yarn.NAME]`) or of the library.",
);

const CHART: Key = key(
    "chart",
    Text,
    "\"stockinette\"",
    "A built-in chart (stockinette, garter, rib-2x2, seed, feather-and-fan, \
     openwork-diamonds, flame-chevron) or a chart file, relative to the scene file.",
);

const COURSE_PITCH: Key = optional(
    "course_pitch",
    number("m", Range::up_to(0.2)),
    "Distance of neighbouring stitches in a row; default 5.2 radii of the yarn.",
)
.hint("m, not mm");

const WALE_PITCH: Key = optional(
    "wale_pitch",
    number("m", Range::up_to(0.2)),
    "Distance of rows; default 0.75 of the course pitch.",
)
.hint("m, not mm");

const REST_SHAPE: Key = key(
    "rest_shape",
    Choice(&[
        ("laid", "flat, from the gauge alone"),
        (
            "relaxed",
            "as in fabric at rest, without borders and gravity; the gauge is then that of these \
             loops. They are kept in the cache (`SELVEDGE_CACHE`). For charts without increases \
             and decreases",
        ),
    ]),
    "\"laid\"",
    "Shape of the loops at the start.",
);

const DRAFT: Key = key(
    "draft",
    Text,
    "\"plain\"",
    "A built-in weave (plain, twill-2-2, satin-5, basket-2-2) or a draft file, relative to \
     the scene file.",
);

const SPACING: Key = key(
    "spacing",
    number("m", Range::up_to(0.2)),
    "0.001",
    "Distance of neighbouring yarns.",
)
.hint("m, not mm");

const CRIMP: Key = key(
    "crimp",
    number("", Range::between(0.5, 2.0)),
    "1",
    "Length of a yarn at rest over the length that it spans in flat cloth.",
);

const WEFT_YARN: Key = optional(
    "weft_yarn",
    Text,
    "Yarn of the weft, where it is not that of the warp.",
);

const FILE: Key = required(
    "file",
    Path,
    "OBJ file with texture coordinates, relative to the scene file, such as the `final.obj` of \
     a draped garment. Its panels are the connected pieces of the texture; seams are where \
     points of their borders coincide in space. Every border gets a rod, a yarn into whose \
     points the ends of the panels' yarns are merged.",
);

const SCALE: Key = key(
    "scale",
    number("", Range::up_to(1e4)),
    "1",
    "Factor from the file's unit to metres, for positions and texture coordinates.",
);

const GRAIN: Key = key(
    "grain",
    Choice(&[
        ("u", "the first, which is the warp of `final.obj`"),
        ("v", "the second"),
    ]),
    "\"u\"",
    "Texture coordinate along which warps and wales run.",
);

const SEAM_YARN: Key = optional(
    "seam_yarn",
    Text,
    "Yarn of the rods along seams and borders; default `yarn`.",
);

const SEAM_SLACK: Key = key(
    "seam_slack",
    number("", Range::between(0.5, 4.0)),
    "1",
    "Rest length of those rods over that of the border: more than 1 lets a seam stretch.",
);

/// A mesh, knitted.
pub(super) static KNIT_MESH: &[Key] = &[
    FILE,
    SCALE,
    GRAIN,
    CHART,
    YARN_NAME,
    SEAM_YARN,
    SEAM_SLACK,
    COURSE_PITCH,
    WALE_PITCH,
    REST_SHAPE,
    SLIDING,
];

/// A sewing pattern, knitted.
pub(super) static KNIT_PATTERN: &[Key] = &[
    required(
        "file",
        Path,
        "GarmentCode JSON file, relative to the scene file. Its shells are sewn and draped on \
         the scene's bodies with `fabric` and the scene's `assemble`, and kept in the cache \
         (`SELVEDGE_CACHE`); then their panels are knitted with wales along the panels' y axis, \
         and sewn.",
    ),
    EDGE_LENGTH,
    key(
        "drape_time",
        number("s", Range::up_to(60.0)),
        "1",
        "Longest time for which the shells drape; they end earlier at rest.",
    ),
    CHART,
    YARN_NAME,
    SEAM_YARN,
    SEAM_SLACK,
    COURSE_PITCH,
    WALE_PITCH,
    REST_SHAPE,
    SLIDING,
];

/// A mesh, woven.
pub(super) static WOVEN_MESH: &[Key] = &[
    FILE, SCALE, GRAIN, DRAFT, SPACING, CRIMP, YARN_NAME, WEFT_YARN, SEAM_YARN, SEAM_SLACK, SLIDING,
];

pub(super) static KNIT: &[Key] = &[
    CHART,
    key(
        "stitches",
        Integers {
            len: 2,
            min: 1,
            max: 4096,
        },
        "[20, 20]",
        "Stitches in a row, and rows.",
    ),
    YARN_NAME,
    COURSE_PITCH,
    WALE_PITCH,
    REST_SHAPE,
    SLIDING,
    key(
        "bind_off",
        Bool,
        "true",
        "Whether a yarn of its own secures the loops of the last row; without it they are open.",
    ),
];

/// Contacts that come and go.
pub(super) static TOPOLOGY: Table = Table::new(
    "",
    &[
        derived(
            "changes",
            Bool,
            "true where something is cut, else false",
            "Whether yarns leave their contacts: when their end slides past, when a loop that \
             holds nothing is drawn out. They need `sliding`.",
        ),
        key(
            "tail",
            number("m", Range::zero_to(1.0)),
            "0.003",
            "With `changes`: length of the free end beyond the contact in which a yarn ends; \
             0 ties ends to their contacts.",
        ),
    ],
);

const FLAT_PLACE: Kind = Vector {
    len: 2,
    unit: "m",
    range: Range::within(100.0),
};

pub(super) static CUT: Table = Table::new(
    "A straight cut. Every yarn that crosses it on the flat cloth is cut half-way between the two \
     contacts on either side, at the end of the step that reaches the time; the new ends are free, \
     and slide out of their contacts where they are drawn.",
    &[
        required(
            "time",
            number("s", NOT_NEGATIVE),
            "Time at which it happens; a run does not end at rest before.",
        ),
        derived(
            "cloth",
            Text,
            "the only piece of cloth",
            "Name of the piece of cloth, of yarns.",
        ),
        required(
            "from",
            FLAT_PLACE,
            "Where it begins on the flat cloth: along courses or wefts, then along wales or \
             warps, from the bottom-left corner (with `topology.tail` that of the free ends); \
             texture coordinates times `scale` for cloth of a mesh.",
        )
        .hint("m, not mm"),
        required("to", FLAT_PLACE, "Where it ends, likewise.").hint("m, not mm"),
    ],
);

pub(super) static WOVEN: &[Key] = &[
    DRAFT,
    key(
        "yarns",
        Integers {
            len: 2,
            min: 1,
            max: 20_000,
        },
        "[50, 50]",
        "Warps and wefts.",
    ),
    SPACING,
    CRIMP,
    YARN_NAME,
    WEFT_YARN,
    SLIDING,
];
