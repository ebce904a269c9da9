use super::super::spec::Kind::{Path, Table as Sub, Text};
use super::super::spec::{Key, Range, Table, Variant, key, number, optional};

const fn modulus(name: &'static str, doc: &'static str) -> Key {
    optional(name, number("N/m", Range::up_to(1e8)), doc)
}

const fn rigidity(name: &'static str, doc: &'static str) -> Key {
    optional(name, number("N·m", Range::up_to(1.0)), doc)
        .hint("N·m: 1 gf·cm²/cm is 9.807e-5 N·m, 1 µN·m is 1e-6 N·m")
}

const POISSON: Key = optional(
    "poisson",
    number("", Range::between(-10.0, 10.0)),
    "Poisson's ratio: weft contraction per warp extension; default 0.",
);

/// A fabric of the scene.
pub(super) static FABRIC: Table = Table::new(
    "A fabric: a base with changes, or all of its numbers. Without a base, `density`, `membrane` \
     and `bending` have to be there.",
    &[
        optional(
            "library",
            Text,
            "Library fabric to start from (`selvedge fabric list`).",
        ),
        optional(
            "file",
            Path,
            "Fabric file to start from, relative to the scene file: TOML, or measured tables \
             as JSON.",
        ),
        optional(
            "density",
            number("kg/m²", Range::up_to(5.0)),
            "Mass per area.",
        )
        .hint("kg/m², not g/m²: 150 g/m² is 0.15"),
        optional(
            "thickness",
            number("m", Range::up_to(0.05)),
            "Thickness, for contact and export.",
        )
        .hint("m, not mm"),
        optional(
            "friction",
            number("", Range::zero_to(100.0)),
            "Coulomb friction coefficient of the fabric on itself. Two fabrics, or a fabric and a \
             body, rub with the geometric mean of their coefficients.",
        ),
        optional("membrane", Sub(&MEMBRANE), "Resistance to stretching."),
        optional("bending", Sub(&BENDING), "Resistance to bending."),
        key("damping", Sub(&DAMPING), "{}", "Dissipation."),
    ],
);

static MEMBRANE: Table = Table::new("Membrane moduli.", &[]).tagged_or(
    "form",
    "direct",
    &[
        Variant {
            name: "direct",
            doc: "The entries of the stiffness matrix; what is absent comes from the base.",
            keys: &[
                modulus("warp", "`k_u`."),
                modulus("weft", "`k_v`."),
                modulus("shear", "`k_s`, against the engineering shear strain."),
                optional(
                    "coupling",
                    number("N/m", Range::within(1e8)),
                    "`k_uv`; its square has to be less than `warp` times `weft`.",
                ),
            ],
        },
        Variant {
            name: "moduli",
            doc: "Moduli of strips cut along warp, weft and bias.",
            keys: &[
                modulus("warp", "`E_u`."),
                modulus("weft", "`E_v`."),
                modulus("bias", "`E_b`, at 45°."),
                POISSON,
            ],
        },
        Variant {
            name: "isotropic",
            doc: "The same in every direction.",
            keys: &[
                modulus("stiffness", "Young's modulus times thickness."),
                POISSON,
            ],
        },
    ],
);

static BENDING: Table = Table::new("Flexural rigidity per unit width.", &[]).tagged_or(
    "form",
    "direct",
    &[
        Variant {
            name: "direct",
            doc: "Rigidity of strips; what is absent comes from the base.",
            keys: &[
                rigidity("warp", "`B_u`."),
                rigidity("weft", "`B_v`."),
                rigidity(
                    "bias",
                    "`B_b`, at 45°; default the mean of warp and weft, halved.",
                ),
            ],
        },
        Variant {
            name: "isotropic",
            doc: "The same in every direction.",
            keys: &[rigidity("rigidity", "Flexural rigidity.")],
        },
    ],
);

static DAMPING: Table = Table::new(
    "Dissipation of the fabric.",
    &[
        optional(
            "drag",
            number("1/s", Range::zero_to(1e6)),
            "Drag of still air; default 5.",
        ),
        optional(
            "membrane",
            number("s", Range::zero_to(1e3)),
            "Viscous over elastic membrane moduli; default 0.01.",
        ),
        optional(
            "bending",
            number("s", Range::zero_to(1e3)),
            "Viscous over elastic bending rigidity; default 0.1.",
        ),
    ],
);
