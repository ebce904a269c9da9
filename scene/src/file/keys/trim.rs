use super::super::spec::Kind::{Text, Vector};
use super::super::spec::{Key, Range, Table, derived, key, number, optional, required};

const CLOTH: Key = derived(
    "cloth",
    Text,
    "the only piece of cloth",
    "Name of the piece of cloth, a sheet or a pattern.",
);

const PANEL: Key = optional(
    "panel",
    Text,
    "Panel of a pattern, by name; default its only one. A sheet has none.",
);

const AT: Key = required(
    "at",
    Vector {
        len: 2,
        unit: "m",
        range: Range::within(100.0),
    },
    "Place on the flat cloth: warp and weft from a sheet's bottom-left corner, or the panel's own \
     coordinates as in the pattern file, in m.",
)
.hint("m, not cm: patterns are often drawn in cm");

pub(super) static BUTTON: Table = Table::new(
    "A button: a rigid disc sewn by four threads to the outside of the cloth. It touches nothing \
     but what its threads and holes hold.",
    &[
        derived(
            "name",
            Text,
            "`button`, `button-1`, …",
            "Name by which buttonholes refer to it.",
        ),
        CLOTH,
        PANEL,
        AT,
        key("mass", number("kg", Range::up_to(1.0)), "5e-4", "Mass.").hint("kg, not g"),
        key(
            "radius",
            number("m", Range::up_to(0.1)),
            "6e-3",
            "Radius; the threads go through at a third of it.",
        )
        .hint("m, not mm"),
        key(
            "stiffness",
            number("N/m", Range::up_to(1e9)),
            "1000",
            "Stiffness of the four threads together.",
        ),
    ],
);

pub(super) static BUTTONHOLE: Table = Table::new(
    "A hole by which cloth is fastened to a button, between the button and the cloth that it is \
     sewn to.",
    &[
        derived("button", Text, "the only button", "Name of the button."),
        CLOTH,
        PANEL,
        AT,
        key(
            "stiffness",
            number("N/m", Range::up_to(1e9)),
            "1000",
            "Stiffness of the spring between the hole and the button.",
        ),
    ],
);
