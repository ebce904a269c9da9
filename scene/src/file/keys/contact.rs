//! Contact and friction.

use super::super::spec::Kind::{Bool, Choice, Switch};
use super::super::spec::{Range, Table, key, number, optional};

pub(super) static CONTACT: Table = Table::new(
    "",
    &[
        key(
            "self",
            Switch,
            "\"auto\"",
            "Contact of cloth with cloth; `auto` decides by the scene (`selvedge plan`). Yarns that \
             no stitch or crossing joins touch where it is `true`, not with `auto`.",
        ),
        key(
            "broad_phase",
            Choice(&[
                ("bvh", "tree of boxes"),
                ("grid", "hash grid"),
                ("brute-force", "every pair: for tests"),
            ]),
            "\"bvh\"",
            "Search for nearby pairs.",
        ),
        key(
            "potential",
            Choice(&[("quadratic", "penalty on the missing distance")]),
            "\"quadratic\"",
            "Repulsion.",
        ),
        key(
            "stiffness",
            number("N/m", Range::up_to(1e9)),
            "100",
            "Stiffness of the repulsion of one pair.",
        ),
        key(
            "body_stiffness",
            number("N/m", Range::up_to(1e9)),
            "1000",
            "Stiffness of the repulsion of one point from a body.",
        ),
        key(
            "thickness",
            number("m", Range::up_to(0.1)),
            "1e-3",
            "Distance that cloth keeps from cloth; two yarns keep the sum of their radii instead.",
        )
        .hint("m, not mm"),
        key(
            "body_thickness",
            number("m", Range::up_to(0.1)),
            "1.5e-3",
            "Distance that cloth keeps from bodies; cloth of yarns at least two radii of its \
             thickest yarn.",
        )
        .hint("m, not mm"),
        optional(
            "body_faces",
            Bool,
            "Whether bodies meet edges and insides of triangles too, at half of `body_thickness`, \
             where they come nearer than to the corners: for needles, edges and corners of convex \
             bodies between points. On unions and meshes it is slow, and cloth may not come to \
             rest. Cloth of yarns has no triangles.",
        ),
        key(
            "release",
            number("s", Range::zero_to(1e3)),
            "0.02",
            "Time in which cloth that begins closer to cloth than `thickness` parts; 0: at once.",
        ),
        optional(
            "part_crossed",
            Bool,
            "Whether sheets and meshes that cross each other where the scene puts them are moved \
             apart as they are, the one with fewer points by the shortest way along an axis or \
             a diagonal and two `thickness` more; a message says which, and how far. Garments \
             stay. Bodies and pins are not looked at.",
        ),
        optional(
            "friction",
            number("", Range::zero_to(100.0)),
            "Coulomb friction coefficient of every pair, cloth on cloth and cloth on bodies, \
             instead of the geometric mean of the two materials' own coefficients.",
        ),
        key(
            "friction_model",
            Choice(&[
                ("anchored", "springs to anchors that slip: true sticking"),
                ("lagged", "smoothed and variational: creeps slowly"),
                ("none", "no friction"),
            ]),
            "\"anchored\"",
            "Friction.",
        ),
        key(
            "anchor_stiffness",
            number("", Range::up_to(10.0)),
            "0.1",
            "Stiffness of the anchors of `friction_model = \"anchored\"`, relative to that of the \
             contact.",
        ),
    ],
);
