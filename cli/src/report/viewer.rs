//! The 3D view: data in base64, controls, and the script that draws them.

use std::fmt::Write as _;

use serde_json::{Value, json};

use super::colour::{self, ColourMap, encode};
use super::data::{Field, Point, ReportData, ReportSurface};
use super::picture::map_of;
use super::quantise::{Quantised, base64, base64_len};
use super::scalebar::table_bytes;
use super::shade::{BODY, RIGHT_SIDE, TINTS, WRONG_SIDE};
use super::stats::FieldStats;
use super::text::{escape, script_json};
use super::viewer_yarns;

const SCRIPT: &str = include_str!("viewer.js");
const CONTROLS: &str = include_str!("viewer.html");

/// The section's HTML, or why there is none.
pub(super) enum Viewer {
    /// Ready to be placed in the page.
    Html(String),
    /// A sentence for the reader.
    Absent(String),
}

/// Embeds as many frames as fit into `budget` bytes, evenly chosen; the first and
/// the last one are always among them.
pub(super) fn viewer(data: &ReportData, budget: usize) -> Viewer {
    let total = data.frames.len();
    let points = data
        .frames
        .iter()
        .map(|f| f.positions.len())
        .max()
        .unwrap_or(0);
    let tubes = data.yarns.as_ref();
    if points == 0 || data.mesh.triangles.is_empty() {
        return Viewer::Absent("There is no recorded state with triangles to show in 3D.".into());
    }
    // The view builds tubes itself, from one value a segment.
    let on_triangles = tubes.map_or(&data.triangle_fields, |y| &y.segment_fields);
    let on_points = data.point_fields.iter().filter(|_| tubes.is_none());
    let fields: Vec<(&Field, bool)> = on_triangles
        .iter()
        .map(|f| (f, true))
        .chain(on_points.map(|f| (f, false)))
        .filter(|(f, _)| f.values.iter().any(|v| v.is_finite()))
        .collect();
    let fixed = SCRIPT.len()
        + 32_768
        + tubes.map_or_else(
            || topology_len(&data.mesh.triangles, points) + base64_len(2 * data.mesh.panel.len()),
            viewer_yarns::length,
        )
        + fields
            .iter()
            .map(|(f, _)| base64_len(f.values.len()))
            .sum::<usize>();
    let bodies = embedded_bodies(&data.bodies, budget.saturating_sub(fixed) / 2);
    let fixed = fixed + bodies.iter().map(|b| body_len(b)).sum::<usize>();
    let frame = base64_len(6 * points)
        + bodies
            .iter()
            .map(|b| {
                if moves(b, total) {
                    base64_len(6 * b.points.len())
                } else {
                    0
                }
            })
            .sum::<usize>()
        + fields
            .iter()
            .map(|(f, _)| {
                if varies(f, total) {
                    base64_len(f.values.len())
                } else {
                    0
                }
            })
            .sum::<usize>()
        + 256;
    let room = budget.saturating_sub(fixed) / frame;
    if room == 0 {
        return Viewer::Absent(format!(
            "The 3D view is left out: {points} points and {} triangles do not fit into the size limit of this page. The recording contains every frame.",
            data.mesh.triangles.len()
        ));
    }
    let chosen = evenly(total, room);
    let mut blobs = Blobs(String::new());
    let meta = describe(data, points, &fields, &bodies, &chosen, &mut blobs);
    let mut remarks = Vec::new();
    if chosen.len() < total {
        remarks.push(format!(
            "{} of {total} recorded frames, evenly chosen to limit the size of this page.",
            chosen.len()
        ));
    } else if total > 1 {
        remarks.push(format!("All {total} recorded frames."));
    }
    if let Some(yarns) = tubes.filter(|y| y.stride > 1) {
        remarks.push(format!(
            "Yarns are drawn through one of {} points to limit the size of this page.",
            yarns.stride
        ));
    }
    let left_out = data.bodies.len() - bodies.len();
    if left_out > 0 {
        remarks.push(format!(
            "{left_out} bodies are too detailed to be embedded here; the pictures show them."
        ));
    }
    let controls = CONTROLS.replace("{{remarks}}", &escape(&remarks.join(" ")));
    Viewer::Html(format!(
        "{controls}\n<script type=\"application/json\" id=\"viewer-data\">{}</script>\n{}<script>\n{SCRIPT}</script>\n",
        script_json(&meta),
        blobs.0,
    ))
}

/// `room` of `total` indices, first and last included, in order.
fn evenly(total: usize, room: usize) -> Vec<usize> {
    if room >= total {
        (0..total).collect()
    } else if room == 1 {
        vec![total - 1]
    } else {
        (0..room)
            .map(|i| (i * (total - 1) + (room - 1) / 2) / (room - 1))
            .collect()
    }
}

/// Base64 texts in script elements that no browser runs.
struct Blobs(String);

impl Blobs {
    fn add(&mut self, id: &str, base64: &str) {
        let _ = writeln!(
            self.0,
            "<script type=\"text/plain\" id=\"b-{id}\">{base64}</script>"
        );
    }
}

fn moves(body: &ReportSurface, frames: usize) -> bool {
    frames > 1 && body.motion.len() == frames
}

fn varies(field: &Field, frames: usize) -> bool {
    frames > 1 && field.history.len() == frames
}

fn index_size(points: usize) -> usize {
    if points <= 65_536 { 2 } else { 4 }
}

fn topology_len(triangles: &[[u32; 3]], points: usize) -> usize {
    base64_len(3 * index_size(points) * triangles.len())
}

fn body_len(body: &ReportSurface) -> usize {
    topology_len(&body.triangles, body.points.len()) + base64_len(6 * body.points.len()) + 256
}

fn embedded_bodies(bodies: &[ReportSurface], mut room: usize) -> Vec<&ReportSurface> {
    bodies
        .iter()
        .filter(|b| {
            let fits = body_len(b) <= room;
            room -= if fits { body_len(b) } else { 0 };
            fits
        })
        .collect()
}

/// Invalid triangles become degenerate ones, so that fields keep their places.
fn topology(triangles: &[[u32; 3]], points: usize) -> String {
    let valid = |t: &[u32; 3]| {
        if t.iter().all(|&i| (i as usize) < points) {
            *t
        } else {
            [0; 3]
        }
    };
    let ids = triangles.iter().flat_map(valid);
    if index_size(points) == 2 {
        base64(ids.flat_map(|i| (i as u16).to_le_bytes()))
    } else {
        base64(ids.flat_map(u32::to_le_bytes))
    }
}

/// 0..=254 on the colour scale, 255 for "no value".
fn levels(values: &[f32], count: usize, (low, high): (f32, f32)) -> String {
    base64((0..count).map(|i| match values.get(i) {
        Some(v) if v.is_finite() => {
            let t = (f64::from(*v) - f64::from(low)) / (f64::from(high) - f64::from(low));
            (t.clamp(0.0, 1.0) * 254.0).round() as u8
        }
        _ => 255,
    }))
}

fn packed(blobs: &mut Blobs, id: &str, points: &[Point], count: usize) -> Value {
    let q = Quantised::new(points, count);
    blobs.add(id, &q.base64());
    json!({ "min": q.min, "step": q.step })
}

fn describe(
    data: &ReportData,
    points: usize,
    fields: &[(&Field, bool)],
    bodies: &[&ReportSurface],
    chosen: &[usize],
    blobs: &mut Blobs,
) -> Value {
    let total = data.frames.len();
    let yarns = data.yarns.as_ref();
    let triangles = yarns.map_or(data.mesh.triangles.len(), |_| points);
    if yarns.is_none() {
        blobs.add("topology", &topology(&data.mesh.triangles, points));
    }
    let panels = data
        .mesh
        .panel
        .iter()
        .max()
        .map_or(1, |&p| usize::from(p) + 1);
    if panels > 1 && yarns.is_none() {
        blobs.add(
            "panel",
            &base64(data.mesh.panel.iter().flat_map(|p| p.to_le_bytes())),
        );
    }
    let frames: Vec<Value> = chosen
        .iter()
        .enumerate()
        .map(|(k, &i)| {
            let frame = &data.frames[i];
            let mut v = packed(blobs, &format!("frame{k}"), &frame.positions, points);
            v["time"] = json!(if frame.time.is_finite() {
                frame.time
            } else {
                0.0
            });
            v
        })
        .collect();
    let bodies: Vec<Value> = bodies
        .iter()
        .enumerate()
        .map(|(b, body)| {
            let count = body.points.len();
            blobs.add(&format!("body{b}"), &topology(&body.triangles, count));
            let states: Vec<Value> = if moves(body, total) {
                let state = |(k, &i): (usize, &usize)| {
                    packed(blobs, &format!("body{b}-{k}"), &body.motion[i], count)
                };
                chosen.iter().enumerate().map(state).collect()
            } else {
                vec![packed(blobs, &format!("body{b}-0"), &body.points, count)]
            };
            json!({ "name": body.name, "points": count, "triangles": body.triangles.len(),
                "index": index_size(count), "frames": states })
        })
        .collect();
    let fields: Vec<Value> = fields
        .iter()
        .enumerate()
        .map(|(f, (field, on_triangles))| {
            let scale = FieldStats::of(field).scale;
            let count = if *on_triangles { triangles } else { points };
            let states = if varies(field, total) { chosen.len() } else { 1 };
            for k in 0..states {
                let values = if states > 1 { &field.history[chosen[k]] } else { &field.values };
                blobs.add(&format!("field{f}-{k}"), &levels(values, count, scale));
            }
            json!({ "name": field.name, "unit": field.unit, "triangles": on_triangles, "low": scale.0,
                "high": scale.1, "frames": states, "diverging": map_of(field) == ColourMap::Diverging })
        })
        .collect();
    let palette: Vec<u8> = (0..panels.min(TINTS))
        .flat_map(|p| colour::panel_colour(p).map(encode))
        .collect();
    json!({
        "yarns": yarns.map(|y| viewer_yarns::describe(y, |id, text| blobs.add(id, text))),
        "points": points, "triangles": triangles, "index": index_size(points), "frames": frames,
        "bodies": bodies, "fields": fields, "panels": panels, "panelNames": data.mesh.panel_names,
        "palette": base64(palette),
        "sequential": base64(table_bytes(ColourMap::Sequential)),
        "diverging": base64(table_bytes(ColourMap::Diverging)),
        "rightSide": RIGHT_SIDE, "wrongSide": WRONG_SIDE, "body": BODY,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The choice is increasing, even, and keeps both ends.
    #[test]
    fn frames_are_chosen_evenly() {
        for (total, room) in [(1, 1), (2, 1), (10, 10), (100, 7), (61, 60), (1000, 2)] {
            let c = evenly(total, room);
            assert_eq!(c.len(), room.min(total));
            assert_eq!(c.last(), Some(&(total - 1)));
            assert!(c.len() == 1 || c[0] == 0);
            let steps: Vec<usize> = c.windows(2).map(|w| w[1] - w[0]).collect();
            if let (Some(a), Some(b)) = (steps.iter().min(), steps.iter().max()) {
                assert!(*a > 0 && b - a <= 1, "{c:?}");
            }
        }
    }
}
