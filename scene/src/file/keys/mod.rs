//! Every key of a scene file: name, type, unit, default, meaning.

mod body;
mod cloth;
mod contact;
mod fabric;
mod hold;
mod settings;
mod stepping;
mod system;
mod trim;
mod watchdog;
mod yarn;

use super::spec::Kind::{Named, Table as Sub, Tables, Text, Vector};
use super::spec::{ANY, Range, Table, derived, key, number};

/// The whole file.
pub(crate) static SCENE: Table = Table::new(
    "What to simulate and how. Lengths in metres, `y` points up.",
    &[
        derived(
            "name",
            Text,
            "the file's name without its ending",
            "Name of the scene; also names the output folder.",
        ),
        key("description", Text, "\"\"", "One sentence for reports."),
        key("simulation", Sub(&SIMULATION), "{}", "Time and gravity."),
        key("cloth", Tables(&cloth::CLOTH), "[]", "Pieces of cloth."),
        key("body", Tables(&body::BODY), "[]", "Obstacles."),
        key(
            "pin",
            Tables(&hold::PIN),
            "[]",
            "Points held exactly, at rest or along a motion.",
        ),
        key(
            "attachment",
            Tables(&hold::ATTACHMENT),
            "[]",
            "Points held by springs.",
        ),
        key("button", Tables(&trim::BUTTON), "[]", "Buttons."),
        key(
            "buttonhole",
            Tables(&trim::BUTTONHOLE),
            "[]",
            "Holes by which cloth is fastened to buttons.",
        ),
        key(
            "fabric",
            Named(&fabric::FABRIC),
            "{}",
            "Fabrics of this scene, by name; they hide library fabrics of the same name.",
        ),
        key(
            "yarn",
            Named(&yarn::YARN),
            "{}",
            "Yarns of this scene, by name; they hide library yarns of the same name.",
        ),
        key(
            "topology",
            Sub(&yarn::TOPOLOGY),
            "{}",
            "Yarns that leave their contacts.",
        ),
        key(
            "cut",
            Tables(&yarn::CUT),
            "[]",
            "Straight cuts through cloth of yarns.",
        ),
        key("mesh", Sub(&settings::MESH), "{}", "Triangulation."),
        key(
            "contact",
            Sub(&contact::CONTACT),
            "{}",
            "Contact and friction.",
        ),
        key("damping", Sub(&settings::DAMPING), "{}", "Dissipation."),
        key(
            "integrator",
            Sub(&stepping::INTEGRATOR),
            "{}",
            "Time stepping and Newton's method.",
        ),
        key(
            "relaxation",
            Sub(&stepping::RELAXATION),
            "{}",
            "Gentle start: small steps without velocity while the fabric gains its stiffness.",
        ),
        key("stop", Sub(&stepping::STOP), "{}", "When to end early."),
        key(
            "solver",
            Sub(&system::SOLVER),
            "{}",
            "Linear systems of Newton's method.",
        ),
        key(
            "assembly",
            Sub(&system::ASSEMBLY),
            "{}",
            "How forces and matrices are summed.",
        ),
        key(
            "assemble",
            Sub(&settings::ASSEMBLE),
            "{}",
            "Sewing a garment together on its body, before `simulation` begins.",
        ),
        key(
            "watchdog",
            Sub(&watchdog::WATCHDOG),
            "{}",
            "Guard over the steps of the simulation: what it calls trouble, and how far it goes.",
        ),
        key("output", Sub(&settings::OUTPUT), "{}", "Results."),
    ],
);

static SIMULATION: Table = Table::new(
    "",
    &[
        key(
            "duration",
            number("s", Range::zero_to(1e5)),
            "2",
            "Simulated time.",
        )
        .hint("s, not ms"),
        key(
            "gravity",
            Vector {
                len: 3,
                unit: "m/s²",
                range: Range::within(1e4),
            },
            "[0, -9.81, 0]",
            "Acceleration of gravity.",
        ),
    ],
);

pub(crate) const POSITION: super::spec::Kind = super::spec::vec3("m", Range::within(1e3));
pub(crate) const DIRECTION: super::spec::Kind = super::spec::vec3("", ANY);
