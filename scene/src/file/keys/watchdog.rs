use super::super::spec::Kind::{Bool, Choice};
use super::super::spec::{FRACTION, NOT_NEGATIVE, POSITIVE, Table, integer, key, number};

pub(super) static WATCHDOG: Table = Table::new(
    "",
    &[
        key("enabled", Bool, "true", "Whether to watch."),
        key(
            "answer",
            Choice(&[
                (
                    "ladder",
                    "tighter linear tolerance, then projected curvature, then smaller steps, \
                     then a clean stop",
                ),
                ("note", "list it in the results and go on"),
            ]),
            "\"ladder\"",
            "What to do about a finding.",
        ),
        key(
            "rejections",
            integer(1, 1_000_000),
            "16",
            "Rejected steps in a row that are a stall.",
        ),
        key(
            "slow_steps",
            integer(1, 1_000_000),
            "500",
            "Accepted steps in a row at a small step size that are a stall.",
        ),
        key(
            "slow_fraction",
            number("", FRACTION),
            "0.015625",
            "Step size, relative to `integrator.max_step`, below which a step is small.",
        ),
        key(
            "energy_gain",
            number("", POSITIVE),
            "0.05",
            "Mechanical energy gained in one step without work, relative to the largest sum of \
             kinetic and stored energy so far, that is an injection.",
        ),
        key(
            "energy_floor",
            number("J", NOT_NEGATIVE),
            "1e-5",
            "Gain below which nothing is an injection.",
        ),
        key(
            "recovery_steps",
            integer(1, 1_000_000),
            "20",
            "Accepted steps after which the scene's own settings come back.",
        ),
        key(
            "most_events",
            integer(1, 1_000_000),
            "100",
            "Findings that are kept; further ones are counted.",
        ),
    ],
);
