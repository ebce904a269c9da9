//! The effect plan: what a scene calls for, what it does not, and why.

use selvedge_integrator::{ScenePlan, Settings};

use super::{BuiltScene, StageOptions};
use crate::effects::{ESTIMATE, EffectRow};
use crate::file::model::{Cloth, DampingKind, FrictionModel};

pub(super) fn rows(
    built: &BuiltScene,
    stage: &StageOptions,
    plan: &ScenePlan,
    settings: &Settings,
    moves: bool,
) -> Vec<EffectRow> {
    let scene = built.scene();
    let fabrics = &built.geometry.fabrics;
    let mut rows = Vec::new();
    let term = |name: &str| {
        let named = plan.terms.iter().filter(|t| t.batch.name() == name);
        let sizes = named.map(|t| (t.batch.len(), t.batch.heap_bytes()));
        sizes.reduce(|a, b| (a.0 + b.0, a.1 + b.1))
    };
    let mut add = |name: &str, on: Option<(usize, usize)>, yes: String, no: &str| {
        rows.push(match on {
            Some((stencils, bytes)) => EffectRow::on(name, yes, stencils, bytes),
            None => EffectRow::off(name, no),
        });
    };

    add(
        "membrane",
        term("membrane"),
        "there is cloth".into(),
        "no triangles",
    );
    add(
        "bending",
        term("bending"),
        "triangles share edges".into(),
        "no two triangles share an edge",
    );
    let still = stage.statics.is_some();
    let damped = scene.damping.kind != DampingKind::None && !still;
    let kind = match scene.damping.kind {
        DampingKind::Rate => "strain-rate potential",
        DampingKind::Incremental => "incremental potential",
        DampingKind::None => "none",
    };
    for (name, of, times) in [
        (
            "membrane damping",
            "membrane",
            fabrics
                .iter()
                .map(|f| f.membrane_damping)
                .collect::<Vec<_>>(),
        ),
        (
            "bending damping",
            "bending",
            fabrics.iter().map(|f| f.bending_damping).collect(),
        ),
    ] {
        let most = times.into_iter().fold(0.0, f64::max);
        let on = damped && most > 0.0;
        // Part of the elastic term's own stencils: no memory of its own.
        add(
            name,
            term(of).filter(|_| on).map(|(stencils, _)| (stencils, 0)),
            format!("{kind}, {most} s"),
            if still {
                "nothing moves in a static solve"
            } else if damped {
                "zero in every fabric"
            } else {
                "`damping.kind` is \"none\""
            },
        );
    }
    let drag = stage
        .drag
        .unwrap_or(fabrics.iter().map(|f| f.drag).fold(0.0, f64::max));
    add(
        "drag",
        term("drag"),
        format!("{drag} 1/s"),
        match still {
            true => "nothing moves in a static solve",
            false => "zero in every fabric",
        },
    );
    let count = plan
        .terms
        .iter()
        .filter(|t| t.batch.name() == "attachment")
        .count();
    let attached = plan
        .terms
        .iter()
        .filter(|t| t.batch.name() == "attachment")
        .fold((0, 0), |(n, b), t| {
            (n + t.batch.len(), b + t.batch.heap_bytes())
        });
    add(
        "seams",
        term("seam"),
        "edges sewn with springs".into(),
        "no seam needs springs",
    );
    add(
        "attachments",
        (count > 0).then_some(attached),
        held_by(built),
        "nothing is held by springs",
    );
    let pinned = plan
        .pins
        .as_ref()
        .filter(|p| !p.points.is_empty())
        .map(|p| (p.points.len(), 40 * p.points.len()));
    add(
        "pins",
        pinned,
        "points are held exactly".into(),
        "nothing is pinned",
    );
    let layered = scene.cloth.iter().any(Cloth::is_layered);
    add(
        "layers",
        layered.then_some((0, 0)),
        format!(
            "outer panels start {} m further out each",
            scene.assemble.layer_clearance
        ),
        "all cloth is in layer 0",
    );
    let (buttons, holes) = built.trims.counts();
    add(
        "trims",
        term("trim"),
        format!("buttons: {buttons}, buttonholes: {holes}"),
        "no buttons",
    );

    let contact = |name: &str| {
        plan.contacts
            .iter()
            .find(|c| c.name() == name)
            .map(|c| (c.candidates(), c.heap_bytes()))
    };
    add(
        "body contact",
        contact("body-contact"),
        format!("{} bodies", built.bodies.len()),
        "no bodies",
    );
    let (_, why) = built.body_faces();
    add("faces on bodies", contact("body-faces"), why.into(), why);
    let (wanted, why) = built.self_contact();
    let why_not = if wanted { "off in this stage" } else { why };
    add("self-contact", contact("self-contact"), why.into(), why_not);
    let rubs = |mu: f64, on: bool| {
        on && stage.friction && mu > 0.0 && scene.contact.friction_model != FrictionModel::None
    };
    let model = match scene.contact.friction_model {
        FrictionModel::Anchored => "anchored",
        FrictionModel::Lagged => "lagged",
        FrictionModel::None => "none",
    };
    let range = |[low, high]: [f64; 2]| {
        let source = match scene.contact.friction {
            Some(_) => "`contact.friction`",
            None => "of the materials",
        };
        let round = |mu: f64| (1e3 * mu).round() / 1e3;
        if low == high {
            format!("{model}, coefficient {} ({source})", round(high))
        } else {
            let (low, high) = (round(low), round(high));
            format!("{model}, coefficients {low} to {high} ({source})")
        }
    };
    let coefficients = built.friction();
    add(
        "friction on bodies",
        rubs(coefficients.on_bodies[1], !built.bodies.is_empty()).then_some((0, 0)),
        range(coefficients.on_bodies),
        no_friction(stage, "no body with friction"),
    );
    add(
        "friction of cloth on cloth",
        rubs(coefficients.on_cloth[1], wanted && stage.self_contact).then_some((0, 0)),
        range(coefficients.on_cloth),
        no_friction(stage, "no self-contact, or no friction"),
    );
    let r = &settings.relaxation;
    add(
        "initial relaxation",
        (r.duration > 0.0).then_some((0, 0)),
        format!("{} s, stiffness from {}", r.duration, r.stiffness_start),
        "`relaxation.enabled` is false",
    );
    let early = if stage.statics.is_some() {
        "a static solve ends where forces are balanced"
    } else if moves {
        "something moves"
    } else {
        "`stop.early` is false"
    };
    add(
        "early stop",
        settings.stop.early.then_some((0, 0)),
        format!(
            "{}th percentile below {} J",
            settings.stop.percentile, settings.stop.kinetic_energy
        ),
        early,
    );
    let yarns = built.geometry.yarns.as_ref();
    let slides = yarns.filter(|y| y.sliding).map(|y| {
        let scalars = y.network.strands.len();
        (scalars, 2 * 8 * scalars)
    });
    let no = match yarns {
        Some(_) => "`sliding` is false",
        None => "no yarns",
    };
    add("sliding yarns", slides, "yarns cross".into(), no);
    if yarns.is_some() {
        for (name, yes, no) in OF_YARNS {
            let no = match name {
                "yarn friction" => no_friction(stage, no),
                _ => no,
            };
            add(name, term(name), yes.into(), no);
        }
        let [alpha, beta] = yarns.map_or([[0.0; 2]; 2], |y| y.damping());
        let none = scene.damping.kind == DampingKind::None;
        let some = alpha[1] > 0.0 || beta[1] > 0.0;
        // Part of the elastic terms' own stencils: no memory of its own.
        add(
            "yarn damping",
            (some && !none && stage.statics.is_none()).then_some((0, 0)),
            format!(
                "{} s of stiffness, {} 1/s of mass",
                range(beta),
                range(alpha)
            ),
            match stage.statics {
                Some(_) => "nothing moves in a static solve",
                None if none => "`damping.kind` is \"none\"",
                None => "`mass_damping` and `stiffness_damping` are zero in every yarn",
            },
        );
    }
    if let Some(yarns) = &built.geometry.yarns {
        add(
            "topology changes",
            built
                .topology_changes()
                .then_some((yarns.network.strands.len(), 0)),
            "looked for after every step".into(),
            "`topology.changes` is false",
        );
    }
    add(ESTIMATE, None, String::new(), "not asked for");
    let o = &scene.output;
    add(
        "recording",
        o.recording.then_some((0, 0)),
        format!("{} frames a second", o.frame_rate),
        "`output.recording` is false",
    );
    add(
        "report",
        o.report.then_some((0, 0)),
        "one HTML file".into(),
        "`output.report` is false",
    );
    rows
}

/// Why friction is off.
fn no_friction(stage: &StageOptions, otherwise: &'static str) -> &'static str {
    match stage.statics {
        Some(_) if !stage.friction => "off in a static solve: `integrator.static_friction`",
        _ => otherwise,
    }
}

/// Terms of yarns, why they are on and why they are off.
const OF_YARNS: [(&str, &str, &str); 8] = [
    ("yarn stretch", "there are yarns", "no yarns"),
    (
        "yarn bending",
        "yarns bend",
        "`bending_modulus` is zero in every yarn",
    ),
    (
        "stitch wrapping",
        "there are stitches",
        "no stitches, or `wrapping` is zero",
    ),
    (
        "yarn shear",
        "warp and weft cross",
        "no woven crossings, or `shear_modulus` is zero",
    ),
    ("parallel yarns", "yarns slide", "no yarns slide"),
    (
        "stitch length",
        "yarns slide in stitches",
        "no yarns slide in stitches",
    ),
    (
        "yarn friction",
        "yarns slide and rub",
        "no yarns slide, or `friction` is zero in every yarn",
    ),
    ("yarn gravity", "there is gravity", "no gravity"),
];

/// What springs hold, for the planner.
fn held_by(built: &BuiltScene) -> String {
    let labels = built.geometry.parts.iter().flat_map(|part| {
        let name = &part.name;
        part.hold
            .iter()
            .map(move |label| format!("`{label}` of `{name}`"))
    });
    let attachments = built.scene().attachment.iter();
    let all: Vec<String> = attachments
        .map(|a| format!("points of `{}`", a.cloth))
        .chain(labels)
        .collect();
    format!("springs hold {}", all.join(", "))
}
