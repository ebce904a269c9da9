//! Steps: how they are made, how they begin and when they end.

use super::super::spec::Kind::{Bool, Choice};
use super::super::spec::{
    FRACTION, NOT_NEGATIVE, POSITIVE, Range, Table, derived, integer, key, number, optional,
};

pub(super) static INTEGRATOR: Table = Table::new(
    "",
    &[
        derived(
            "kind",
            Choice(&[
                (
                    "backward-euler",
                    "backward Euler, solved by Newton's method in velocities",
                ),
                (
                    "linearised-euler",
                    "backward Euler, one linear system a step; the residual is reported, not \
                     controlled",
                ),
                (
                    "static",
                    "no motion: iterations of Newton's method, each with less energy, until all \
                     forces are balanced; at most `simulation.duration` / `max_step` of them, \
                     each booked as a step of `max_step`",
                ),
            ]),
            "`backward-euler`; `linearised-euler` for cloth of yarns",
            "Time stepping scheme.",
        ),
        key(
            "line_search",
            Choice(&[
                ("auto", "`work` for cloth of yarns, else `residual`"),
                ("residual", "a smaller residual"),
                (
                    "work",
                    "less of the potential of the step, by the work of the residual along the way",
                ),
            ]),
            "\"auto\"",
            "What a try of the line search has to bring.",
        ),
        key(
            "max_step",
            number("s", Range::up_to(1.0)),
            "1e-3",
            "Largest time step.",
        )
        .hint("s, not ms"),
        derived(
            "min_step",
            number("s", Range::up_to(1.0)),
            "`max_step` / 2^20",
            "Smallest time step: when a step fails below it, the run ends with an error.",
        ),
        derived(
            "newton_tolerance",
            number("m/s or N·s", POSITIVE),
            "0.01 m/s for `residual_norm = \"mass\"`, 0.001 N·s for `\"paper\"`",
            "Residual at which a step is accepted, in the unit of `residual_norm`.",
        ),
        optional(
            "point_tolerance",
            number("m/s", POSITIVE),
            "Velocity error of any single point that must be met as well: the norm alone hides \
             points of little mass beside heavy ones.",
        ),
        key(
            "newton_iterations",
            integer(1, 1000),
            "5",
            "Iterations before a step is split.",
        ),
        key(
            "line_search_halvings",
            integer(1, 60),
            "5",
            "Tries of the line search, each half as long as the one before.",
        ),
        key(
            "step_splitting",
            number("", FRACTION),
            "0.75",
            "Factor applied to the step after a failure.",
        ),
        key(
            "recovery_steps",
            integer(1, 1_000_000),
            "5",
            "Accepted steps in a row before the step grows again.",
        ),
        key(
            "recovery_iterations",
            integer(1, 1000),
            "3",
            "Newton iterations above which a step does not count for that.",
        ),
        key(
            "residual_norm",
            Choice(&[
                ("mass", "mean velocity error [m/s], the same for every mesh"),
                (
                    "paper",
                    "Euclidean norm [N·s], grows with the number of points",
                ),
            ]),
            "\"mass\"",
            "Norm of the residual.",
        ),
        key(
            "curvature",
            Choice(&[
                (
                    "auto",
                    "exact; positive semidefinite for an iteration that meets trouble",
                ),
                ("exact", "always exact; trouble is left to step splitting"),
                ("projected", "always positive semidefinite"),
                (
                    "gauss-newton",
                    "products of first derivatives only: semidefinite, no upper bound",
                ),
            ]),
            "\"auto\"",
            "Second derivatives in Newton's matrix.",
        ),
        key(
            "force_tolerance",
            number("N", POSITIVE),
            "1e-6",
            "Largest unbalanced force on any free point or arc length at which a `static` solve ends.",
        ),
        key(
            "static_friction",
            Bool,
            "false",
            "Whether friction acts in a `static` solve: it then sticks where the solve begins, and \
             the state of rest is one of many.",
        ),
    ],
);

pub(super) static RELAXATION: Table = Table::new(
    "",
    &[
        derived(
            "enabled",
            Bool,
            "true; false for cloth of yarns and with `integrator.kind` = \"static\"",
            "Whether to begin gently.",
        ),
        key(
            "duration",
            number("s", NOT_NEGATIVE),
            "0.1",
            "Length of the window.",
        ),
        key(
            "step_fraction",
            number("", Range::up_to(1.0)),
            "0.0625",
            "First step relative to `integrator.max_step`.",
        ),
        key(
            "stiffness_start",
            number("", Range::up_to(1.0)),
            "0.01",
            "Fabric stiffness at the start of the window, relative to its own.",
        ),
    ],
);

pub(super) static STOP: Table = Table::new(
    "",
    &[
        key(
            "early",
            Bool,
            "true",
            "Whether to end before `simulation.duration` when the cloth is at rest; not while \
             something moves or is still to be cut.",
        ),
        key(
            "percentile",
            number("%", Range::up_to(100.0)),
            "99",
            "Percentile of the points' kinetic energies that counts.",
        ),
        derived(
            "kinetic_energy",
            number("J", POSITIVE),
            "1e-8 J; 1e-14 J for cloth of yarns, whose points weigh some milligrams",
            "Kinetic energy of one point below which it rests.",
        ),
        key(
            "window",
            number("s", NOT_NEGATIVE),
            "0.1",
            "Time for which every step has to stay below.",
        ),
    ],
);
