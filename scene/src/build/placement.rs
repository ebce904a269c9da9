//! Where cloth starts relative to the bodies.

use selvedge_garment::pattern::{self, examine_on_body};

use super::Sewn;
use super::bodies::{BuiltBody, nearest_surface};
use super::geometry::{Geometry, Part};
use crate::diagnostic::{Diagnostics, Finding};
use crate::file::Parsed;
use crate::file::model::BodyShape;

/// Share of a panel inside the body above which it cannot be meant [1].
const MOST_INSIDE: f64 = 0.5;
/// Ratio of sizes of a garment and a mesh body above which a unit is wrong [1].
const MOST_RATIO: f64 = 20.0;
/// Depth below which cloth in a body is left to the contact [m].
const DEEP: f64 = 0.01;

/// Findings about pieces that start inside of bodies, or do not fit them.
pub(super) fn examine(parsed: &Parsed, geometry: &Geometry, bodies: &[BuiltBody]) -> Diagnostics {
    let mut out = Diagnostics::new();
    if bodies.is_empty() {
        return out;
    }
    let positions = geometry.to_scene(&geometry.positions);
    for (i, part) in geometry.parts.iter().enumerate() {
        let here = &positions[part.points.start as usize..part.points.end as usize];
        match &part.garment {
            Some(sewn) => {
                sizes(parsed, i, here, bodies, &mut out);
                panels(parsed, i, sewn, bodies, &mut out);
            }
            None => inside(parsed, i, part, here, bodies, &mut out),
        }
    }
    out
}

fn panels(parsed: &Parsed, i: usize, sewn: &Sewn, bodies: &[BuiltBody], out: &mut Diagnostics) {
    let placed = sewn.field(bodies);
    // The finding says what; how much decides its weight.
    let path = format!("cloth.{i}.file");
    for f in examine_on_body(&sewn.mesh.pattern, &placed) {
        let share = panel_share(sewn, f.panel.as_deref(), &placed);
        let message = match f.place {
            Some(pattern::Place::World(at)) => format!(
                "{}, deepest at ({:.3}, {:.3}, {:.3}) m of the pattern",
                f.message, at[0], at[1], at[2]
            ),
            _ => f.message,
        };
        let finding = if share > MOST_INSIDE {
            parsed.locations.error("pattern::inside", &path, message)
        } else {
            parsed.locations.warning("pattern::inside", &path, message)
        };
        out.push(finding.help(f.help));
    }
}

/// Share of a panel's triangles whose middle is inside a body [1].
fn panel_share(
    sewn: &Sewn,
    panel: Option<&str>,
    placed: &dyn Fn([f64; 3]) -> (f64, [f64; 3]),
) -> f64 {
    let mesh = &sewn.mesh;
    let Some(index) = mesh
        .panels
        .iter()
        .position(|p| Some(p.name.as_str()) == panel)
    else {
        return 0.0;
    };
    let (mut all, mut inside) = (0.0, 0.0);
    for (t, _) in mesh
        .triangles
        .iter()
        .zip(&mesh.panel_of_triangle)
        .filter(|(_, p)| **p as usize == index)
    {
        let middle = std::array::from_fn(|k| {
            t.iter()
                .map(|&p| mesh.points_initial[p as usize][k])
                .sum::<f64>()
                / 3.0
        });
        all += 1.0;
        inside += f64::from(placed(middle).0 < 0.0);
    }
    if all > 0.0 { inside / all } else { 0.0 }
}

/// A garment and a body whose sizes do not go together: a unit is wrong.
fn sizes(
    parsed: &Parsed,
    i: usize,
    garment: &[[f64; 3]],
    bodies: &[BuiltBody],
    out: &mut Diagnostics,
) {
    let cloth = extent(garment);
    for (j, (body, spec)) in bodies.iter().zip(&parsed.scene.body).enumerate() {
        if !matches!(spec.shape, BodyShape::Mesh { .. }) {
            continue;
        }
        let size = extent(&body.surface.0);
        if size > MOST_RATIO * cloth || cloth > MOST_RATIO * size {
            let message = format!(
                "body `{}` is {size:.3} m large and the garment `{}` {cloth:.3} m",
                body.name, parsed.scene.cloth[i].name
            );
            let path = format!("body.{j}.file");
            let finding: Finding = parsed.locations.error("mesh::scale", &path, message);
            out.push(finding.help("is one of them in another unit? `scale = 0.01` for cm"));
        }
    }
}

/// Longest side of the bounding box [m].
fn extent(points: &[[f64; 3]]) -> f64 {
    (0..3)
        .map(|k| {
            let (low, high) = points
                .iter()
                .fold((f64::MAX, f64::MIN), |(l, h), p| (l.min(p[k]), h.max(p[k])));
            high - low
        })
        .fold(0.0, f64::max)
}

fn inside(
    parsed: &Parsed,
    i: usize,
    part: &Part,
    points: &[[f64; 3]],
    bodies: &[BuiltBody],
    out: &mut Diagnostics,
) {
    let (mut count, mut deepest) = (0, (0.0, [0.0; 3]));
    for &p in points {
        let (distance, _) = nearest_surface(bodies, p);
        count += usize::from(distance < 0.0);
        if distance < deepest.0 {
            deepest = (distance, p);
        }
    }
    if deepest.0 < -DEEP {
        let (depth, at) = (-deepest.0, deepest.1);
        let message = format!(
            "{count} of {} points of cloth `{}` start inside a body, up to {depth:.3} m deep at \
             ({:.3}, {:.3}, {:.3}) m",
            points.len(),
            part.name,
            at[0],
            at[1],
            at[2]
        );
        let path = format!("cloth.{i}.center");
        let finding = parsed.locations.warning("scene::inside", &path, message);
        out.push(finding.help("move the cloth out of the body with its `center`"));
    }
}
