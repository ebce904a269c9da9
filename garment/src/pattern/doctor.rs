//! Finding mistakes in patterns before they cost a simulation.

use super::{Curve, EdgeId, Pairing, Panel, Pattern, Stitch, placed_stitch, polygon_crossing};
use crate::GarmentError;
use crate::math::{dist2, polygon_area};
use crate::union_find::UnionFind;

/// How bad a finding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Worth knowing; nothing to do.
    Note,
    /// Probably a mistake, but it can be meshed and simulated.
    Warning,
    /// Cannot be meshed as it is.
    Error,
}

/// Where a finding is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// Panel coordinates [m].
    Panel([f64; 2]),
    /// World coordinates [m].
    World([f64; 3]),
}

/// One thing the doctor noticed.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// How bad it is.
    pub severity: Severity,
    /// Name of the panel, where there is one.
    pub panel: Option<String>,
    /// Index of the edge in its panel, where there is one.
    pub edge: Option<usize>,
    /// Coordinates, where there are some.
    pub place: Option<Place>,
    /// What is wrong, with names and numbers.
    pub message: String,
    /// What to do about it.
    pub help: String,
}

/// Edges shorter than this have no usable length [m].
const ZERO_LENGTH: f64 = 1e-5;
/// Sewn lengths that differ by more than this factor are a mistake.
const MAX_RATIO: f64 = 3.0;
/// Plausible size of a garment [m].
const SIZE_RANGE: [f64; 2] = [0.2, 5.0];
/// Size outside of which it cannot be one [m].
const POSSIBLE_RANGE: [f64; 2] = [0.02, 50.0];

/// Checks a pattern on its own.
///
/// Looks for open and self-crossing outlines, edges without length, arcs with
/// impossible radii, stitches that name missing edges, join an edge to
/// itself, join very different lengths or run the wrong way in the placement,
/// clockwise outlines, panels sewn to nothing, and a unit that is off.
pub fn examine(pattern: &Pattern) -> Vec<Finding> {
    let mut out = Vec::new();
    if pattern.panels.is_empty() {
        out.push(finding(
            Severity::Error,
            "the pattern has no panel".into(),
            "add panels to `pattern.panels`".into(),
        ));
        return out;
    }
    check_size(pattern, &mut out);
    for panel in &pattern.panels {
        check_panel(panel, &mut out);
    }
    let mut known = Vec::new();
    for (i, s) in pattern.stitches.iter().enumerate() {
        if check_stitch_exists(pattern, i, s, &mut out) {
            known.push((i, s));
        }
    }
    for &(i, s) in &known {
        check_stitch(pattern, i, s, &mut out);
    }
    check_isolated(pattern, &known, &mut out);
    out
}

fn finding(severity: Severity, message: String, help: String) -> Finding {
    Finding {
        severity,
        panel: None,
        edge: None,
        place: None,
        message,
        help,
    }
}

fn on_panel(mut f: Finding, panel: &Panel, edge: usize, at: Option<[f64; 2]>) -> Finding {
    f.panel = Some(panel.name.clone());
    f.edge = Some(edge);
    f.place = at.map(Place::Panel);
    f
}

fn check_size(pattern: &Pattern, out: &mut Vec<Finding>) {
    let Some((low, high)) = pattern.bounds() else {
        return;
    };
    let size = (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max);
    if !(SIZE_RANGE[0]..=SIZE_RANGE[1]).contains(&size) {
        let factor = if size > SIZE_RANGE[1] { 0.01 } else { 100.0 };
        let fixed = size * factor;
        let plausible = (SIZE_RANGE[0]..=SIZE_RANGE[1]).contains(&fixed);
        let help = if plausible {
            format!(
                "it would measure {fixed:.2} m with lengths {}: check `units_in_meter`",
                if factor < 1.0 {
                    "divided by 100"
                } else {
                    "multiplied by 100"
                }
            )
        } else {
            "check `units_in_meter` and the panels' translations".to_owned()
        };
        let message = format!("the garment measures {size:.3} m in its placement");
        let possible = (POSSIBLE_RANGE[0]..=POSSIBLE_RANGE[1]).contains(&size);
        let severity = if plausible || !possible {
            Severity::Error
        } else {
            Severity::Warning
        };
        out.push(finding(severity, message, help));
    }
}

/// The outline with `per_edge` points on each edge, and the edge of each
/// point; `None` when it is open.
pub(super) fn sampled(panel: &Panel, per_edge: usize) -> Option<(Vec<[f64; 2]>, Vec<usize>)> {
    let mut points = Vec::new();
    let mut edges = Vec::new();
    for l in panel.outline().ok()? {
        let table = panel.edge_table(l.edge)?;
        let n = if matches!(panel.edges[l.edge].curve, Curve::Line) {
            1
        } else {
            per_edge
        };
        for i in 0..n {
            let t = i as f64 / n as f64;
            points.push(table.at(if l.reversed { 1.0 - t } else { t }));
            edges.push(l.edge);
        }
    }
    Some((points, edges))
}

fn check_panel(panel: &Panel, out: &mut Vec<Finding>) {
    let mut short = false;
    for (i, e) in panel.edges.iter().enumerate() {
        let Some(table) = panel.edge_table(i) else {
            continue; // the outline check names the missing corner
        };
        let at = Some(table.at(0.0));
        let length = table.length();
        if length.is_nan() || length < ZERO_LENGTH {
            short = true;
            let message = format!("panel `{}`: edge {i} is {length:.1e} m long", panel.name);
            let f = finding(Severity::Error, message, "merge its two corners".into());
            out.push(on_panel(f, panel, i, at));
        }
        if let Curve::Circle { radius, .. } = e.curve
            && let Some([a, b]) = panel.edge_ends(i)
            && radius < 0.5 * dist2(a, b) * (1.0 - 1e-6)
        {
            let half = 0.5 * dist2(a, b);
            let message = format!(
                "panel `{}`: edge {i} is an arc of radius {radius:.4} m over a chord that \
                 needs at least {half:.4} m",
                panel.name
            );
            let help = "a half circle is used; enlarge the radius".into();
            out.push(on_panel(
                finding(Severity::Warning, message, help),
                panel,
                i,
                at,
            ));
        }
    }
    match panel.outline() {
        Err(GarmentError::OpenOutline { edge, at, .. }) => {
            let message = format!(
                "panel `{}`: the outline is open after edge {edge}, at ({:.4}, {:.4}) m",
                panel.name, at[0], at[1]
            );
            let help = "every corner must end one edge and start another, in one loop".into();
            let f = finding(Severity::Error, message, help);
            out.push(on_panel(f, panel, edge, Some(at)));
            return;
        }
        Err(_) => return,
        Ok(_) => {}
    }
    let Some((points, edges)) = sampled(panel, 32) else {
        return;
    };
    if !short && let Some((i, j, at)) = polygon_crossing(&points) {
        let message = format!(
            "panel `{}`: edge {} meets edge {} at ({:.4}, {:.4}) m",
            panel.name, edges[i], edges[j], at[0], at[1]
        );
        let help = "an outline must not cross or touch itself".into();
        let f = finding(Severity::Error, message, help);
        out.push(on_panel(f, panel, edges[i], Some(at)));
    } else if polygon_area(&points) < 0.0 {
        let message = format!("panel `{}` is drawn clockwise", panel.name);
        let help = "its outside is taken to be the side from which it runs \
                    counter-clockwise; nothing to do when that faces away from the body";
        let mut f = finding(Severity::Note, message, help.into());
        f.panel = Some(panel.name.clone());
        out.push(f);
    }
}

fn edge_name(pattern: &Pattern, id: EdgeId) -> String {
    format!(
        "`{}` edge {}",
        pattern.panels[id.panel as usize].name, id.edge
    )
}

fn check_stitch_exists(
    pattern: &Pattern,
    index: usize,
    stitch: &Stitch,
    out: &mut Vec<Finding>,
) -> bool {
    let mut good = true;
    for id in [stitch.a, stitch.b] {
        if pattern.edge(id).is_some() {
            continue;
        }
        good = false;
        let (name, help) = match pattern.panels.get(id.panel as usize) {
            Some(p) => (
                format!("edge {} of panel `{}`", id.edge, p.name),
                format!("the panel has {} edges, counted from 0", p.edges.len()),
            ),
            None => (
                format!("panel number {}", id.panel),
                format!("there are {} panels", pattern.panels.len()),
            ),
        };
        let message = format!("stitch {index} names {name}, which does not exist");
        out.push(finding(Severity::Error, message, help));
    }
    good
}

fn check_stitch(pattern: &Pattern, index: usize, stitch: &Stitch, out: &mut Vec<Finding>) {
    let (a, b) = (edge_name(pattern, stitch.a), edge_name(pattern, stitch.b));
    let locate = |mut f: Finding| {
        f.panel = Some(pattern.panels[stitch.a.panel as usize].name.clone());
        f.edge = Some(stitch.a.edge as usize);
        f
    };
    if stitch.a == stitch.b {
        let message = format!("stitch {index} joins {a} to itself");
        let help = "name the other edge, or remove the stitch".into();
        out.push(locate(finding(Severity::Warning, message, help)));
        return;
    }
    let Some(placed) = placed_stitch(pattern, stitch) else {
        return;
    };
    let [la, lb] = placed.lengths;
    let (low, high) = (la.min(lb), la.max(lb));
    if high > MAX_RATIO * low {
        let message = format!(
            "stitch {index} joins {a} ({:.1} cm) to {b} ({:.1} cm): ratio {:.2}",
            100.0 * la,
            100.0 * lb,
            high / low
        );
        let help = "check that the stitch names the right edges, or split the longer one".into();
        out.push(locate(finding(Severity::Error, message, help)));
    }
    if let Some(seen) = placed.clear_pairing()
        && seen != stitch.pairing()
    {
        let message = format!(
            "stitch {index} ({a} to {b}) runs the other way in the placement: its ends are \
             {:.1} cm apart in total, {:.1} cm if it ran the other way",
            100.0 * placed.opposed.max(placed.parallel),
            100.0 * placed.opposed.min(placed.parallel),
        );
        let help = match seen {
            Pairing::Parallel => {
                "add \"right_wrong\" to the stitch, or check the panels' placement and the \
                 direction in which their outlines are drawn"
            }
            Pairing::Opposed => {
                "remove \"right_wrong\" from the stitch, or check the panels' placement"
            }
        };
        out.push(locate(finding(Severity::Warning, message, help.into())));
    }
}

/// Panels sewn to nothing, and groups of panels not connected to the rest.
fn check_isolated(pattern: &Pattern, stitches: &[(usize, &Stitch)], out: &mut Vec<Finding>) {
    let count = pattern.panels.len();
    if count < 2 {
        return;
    }
    let mut sets = UnionFind::new(count);
    for (_, s) in stitches {
        sets.join(s.a.panel, s.b.panel);
    }
    let roots: Vec<u32> = (0..count as u32).map(|i| sets.find(i)).collect();
    for (i, panel) in pattern.panels.iter().enumerate() {
        let alone = roots.iter().filter(|&&r| r == roots[i]).count() == 1;
        if alone {
            let mut f = finding(
                Severity::Warning,
                format!("panel `{}` is not sewn to any other panel", panel.name),
                "add its stitches, or remove the panel".into(),
            );
            f.panel = Some(panel.name.clone());
            out.push(f);
        }
    }
    let groups = roots
        .iter()
        .enumerate()
        .filter(|&(i, &r)| r as usize == i && roots.iter().filter(|&&q| q == r).count() > 1)
        .count();
    if groups > 1 {
        let message = format!("the garment falls into {groups} parts that are not sewn together");
        let help = "fine for separate garments (a shirt and trousers)".into();
        out.push(finding(Severity::Note, message, help));
    }
}
