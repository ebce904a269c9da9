//! Settings of the other parts.

use super::super::spec::Kind::{Bool, Choice, Path};
use super::super::spec::{NOT_NEGATIVE, Range, Table, derived, integer, key, number, optional};

pub(super) static DAMPING: Table = Table::new(
    "",
    &[
        key(
            "kind",
            Choice(&[
                ("rate", "forces proportional to the rate of strain"),
                (
                    "incremental",
                    "a potential of the strain gained in the step: variational",
                ),
                (
                    "none",
                    "no dissipation in the fabric, no drag, no damping of yarns",
                ),
            ]),
            "\"rate\"",
            "Form of the dissipation. Yarns have one, a potential of the step, under `rate` and `incremental` alike.",
        ),
        optional(
            "drag",
            number("1/s", Range::zero_to(1e6)),
            "Drag of still air, instead of every fabric's own.",
        ),
        optional(
            "membrane",
            number("s", Range::zero_to(1e3)),
            "Viscous over elastic membrane moduli, instead of every fabric's own.",
        ),
        optional(
            "bending",
            number("s", Range::zero_to(1e3)),
            "Viscous over elastic bending rigidity, instead of every fabric's own.",
        ),
    ],
);

pub(super) static MESH: Table = Table::new(
    "",
    &[key(
        "edge_length",
        number("m", Range::up_to(10.0)),
        "0.01",
        "Target edge length of cloth meshes.",
    )
    .hint("m, not mm or cm")],
);

pub(super) static OUTPUT: Table = Table::new(
    "",
    &[
        derived(
            "directory",
            Path,
            "`out/NAME`",
            "Folder of the results, relative to where the program runs.",
        ),
        key(
            "frame_rate",
            number("1/s", Range::up_to(1e5)),
            "30",
            "Recorded frames per simulated second.",
        ),
        key(
            "checkpoint_seconds",
            number("s", NOT_NEGATIVE),
            "60",
            "Seconds of computing between checkpoints; 0 writes none.",
        ),
        key("report", Bool, "true", "Whether to write `report.html`."),
        key("recording", Bool, "true", "Whether to write `run.mcap`."),
    ],
);

pub(super) static ASSEMBLE: Table = Table::new(
    "",
    &[
        key(
            "clearance",
            number("m", Range::zero_to(1.0)),
            "0.02",
            "Least distance of the panels from the body at the start.",
        )
        .hint("m, not mm or cm"),
        key(
            "layer_clearance",
            number("m", Range::zero_to(1.0)),
            "5e-3",
            "What `clearance` grows by for every `layer`.",
        )
        .hint("m, not mm or cm"),
        key(
            "pre_iterations",
            integer(0, 1_000_000),
            "1500",
            "Iterations that bend the panels around the body before sewing.",
        ),
        key(
            "seam_time",
            number("s", NOT_NEGATIVE),
            "0.5",
            "Time over which the seams are closed.",
        ),
        key(
            "seam_stiffness",
            number("N/m", Range::up_to(1e9)),
            "1000",
            "Stiffness of a seam spring.",
        ),
        key(
            "settle_time",
            number("s", NOT_NEGATIVE),
            "0.3",
            "Time to settle after sewing.",
        ),
        key(
            "max_step",
            number("s", Range::up_to(1.0)),
            "1e-3",
            "Largest time step of both. They go without velocities, so that it decides where \
             the drape begins.",
        )
        .hint("s, not ms"),
        key(
            "coarsest",
            number("m", Range::zero_to(1.0)),
            "0.04",
            "Edge length of the mesh on which garments are sewn and draped first; every mesh of \
             half its edges starts from there, down to the garment's own. 0: sewn on its own mesh.",
        )
        .hint("m, not mm or cm"),
    ],
);
