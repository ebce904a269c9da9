//! Line plots over simulated time, as inline SVG that follows the page's theme.

use std::fmt::Write as _;

use super::data::Series;
use super::envelope::envelope;
use super::text::{count, escape, quantity};
use super::ticks::{Axis, HUGE};

/// Size of a plot in SVG units.
const WIDTH: f64 = 620.0;
const HEIGHT: f64 = 250.0;
const LEFT: f64 = 58.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 26.0;
const BOTTOM: f64 = 30.0;

/// Curves that one plot shows at most; the colours repeat after [`COLOURS`].
const CURVES: usize = 16;
/// Colours of the page's palette.
const COLOURS: usize = 8;

/// One figure a group and unit, in the order of first appearance.
pub(super) fn plots(series: &[Series]) -> String {
    let mut keys: Vec<(&str, &str, bool)> = Vec::new();
    for s in series {
        let key = (s.group.as_str(), s.unit.as_str(), s.log);
        if !keys.contains(&key) {
            keys.push(key);
        }
    }
    let times = series.iter().flat_map(|s| &s.points).map(|p| p.0);
    let x = time_axis(times);
    let mut out = String::new();
    for (group, unit, log) in keys {
        let curves: Vec<&Series> = series
            .iter()
            .filter(|s| (s.group.as_str(), s.unit.as_str(), s.log) == (group, unit, log))
            .collect();
        out.push_str(&figure(group, unit, log, &curves, &x));
    }
    out
}

/// Simulated time, from the first to the last value exactly.
fn time_axis(times: impl Iterator<Item = f64>) -> Axis {
    let ends = times
        .filter(|t| t.abs() < HUGE)
        .fold(None, |r: Option<(f64, f64)>, t| {
            Some(r.map_or((t, t), |(a, b)| (a.min(t), b.max(t))))
        });
    match ends {
        Some((a, b)) if b - a > 1e-9 * a.abs().max(b.abs()) => Axis::exact(a, b, 8),
        Some((a, _)) => Axis::new([a].into_iter(), false, 4),
        None => Axis::exact(0.0, 1.0, 5),
    }
}

fn figure(group: &str, unit: &str, log: bool, curves: &[&Series], x: &Axis) -> String {
    let shown = &curves[..curves.len().min(CURVES)];
    let values = || shown.iter().flat_map(|s| &s.points).map(|p| p.1);
    let y = Axis::new(values(), log, 5);
    let title = title(group, shown);
    let mut out = format!(
        "<figure class=\"card plot\"><figcaption>{}</figcaption>\n<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{} over simulated time\">",
        escape(&title),
        escape(&title),
    );
    frame(&mut out, x, &y, unit);
    let drawn: Vec<bool> = shown
        .iter()
        .enumerate()
        .map(|(i, s)| curve(&mut out, s, i, x, &y))
        .collect();
    if !drawn.contains(&true) {
        let _ = write!(
            out,
            "<text class=\"empty\" x=\"{}\" y=\"{}\">no values to show</text>",
            LEFT + 0.5 * (WIDTH - LEFT - RIGHT),
            TOP + 0.5 * (HEIGHT - TOP - BOTTOM),
        );
    }
    out.push_str("</svg>\n");
    legend(&mut out, shown, unit);
    let lost = values().filter(|v| y.place(*v).is_none()).count();
    if lost > 0 {
        let why = if log {
            "not finite or not positive"
        } else {
            "not finite"
        };
        let _ = write!(
            out,
            "<p class=\"small\">{} of {} values left out: {why}.</p>",
            count(lost as u64),
            count(values().count() as u64)
        );
    }
    if curves.len() > shown.len() {
        let _ = write!(
            out,
            "<p class=\"small\">{} further curves are not shown.</p>",
            curves.len() - shown.len()
        );
    }
    out.push_str("</figure>\n");
    out
}

fn title(group: &str, curves: &[&Series]) -> String {
    match (group, curves) {
        ("energy", _) => "Energies".into(),
        ("residual", _) => "Residual".into(),
        ("step", _) => "Step size".into(),
        ("contacts", _) => "Contacts".into(),
        ("kinetic", _) => "Kinetic energy".into(),
        ("solver", _) => "Linear solver".into(),
        ("", [one]) => one.name.clone(),
        (other, _) => {
            let mut c = other.chars();
            c.next()
                .map_or_else(String::new, |f| f.to_uppercase().chain(c).collect())
        }
    }
}

fn to_x(t: f64) -> f64 {
    LEFT + t * (WIDTH - LEFT - RIGHT)
}

fn to_y(t: f64) -> f64 {
    HEIGHT - BOTTOM - t * (HEIGHT - TOP - BOTTOM)
}

fn frame(out: &mut String, x: &Axis, y: &Axis, unit: &str) {
    let (x0, x1, y0, y1) = (to_x(0.0), to_x(1.0), to_y(0.0), to_y(1.0));
    for (v, label) in &y.ticks {
        let at = to_y(y.place(*v).unwrap_or(0.0));
        let _ = write!(
            out,
            "<path class=\"grid\" d=\"M{x0} {at:.1}H{x1}\"/><text class=\"y\" x=\"{}\" y=\"{:.1}\">{label}</text>",
            x0 - 7.0,
            at + 3.8,
        );
    }
    for (v, label) in &x.ticks {
        let at = to_x(x.place(*v).unwrap_or(0.0));
        let _ = write!(
            out,
            "<path class=\"grid\" d=\"M{at:.1} {y0}V{y1}\"/><text class=\"x\" x=\"{at:.1}\" y=\"{}\">{label}</text>",
            y0 + 15.0,
        );
    }
    let _ = write!(
        out,
        "<path class=\"axis\" d=\"M{x0} {y1}V{y0}H{x1}\"/><text class=\"unit\" x=\"{}\" y=\"{}\">{}</text><text class=\"time\" x=\"{x1}\" y=\"{}\">time [{}]</text>",
        x0 - 50.0,
        y1 - 11.0,
        escape(&bracketed(&y.unit(unit))),
        y0 + 27.5,
        escape(&x.unit("s")),
    );
}

fn bracketed(unit: &str) -> String {
    if unit.is_empty() {
        String::new()
    } else {
        format!("[{unit}]")
    }
}

/// Draws one curve; false when it has no value with a place in the plot.
fn curve(out: &mut String, series: &Series, index: usize, x: &Axis, y: &Axis) -> bool {
    let mut points: Vec<(f64, Option<f64>)> = series
        .points
        .iter()
        .filter_map(|&(t, v)| x.place(t).map(|t| (t, y.place(v))))
        .collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let runs = envelope(&points, (WIDTH - LEFT - RIGHT) as usize);
    let class = format!(
        "c{}{}",
        index % COLOURS,
        if index >= COLOURS { " dash" } else { "" }
    );
    let mut path = String::new();
    for run in &runs {
        if let [(t, v)] = run.as_slice() {
            let _ = write!(
                out,
                "<circle class=\"{class}\" cx=\"{:.1}\" cy=\"{:.1}\" r=\"2.6\"/>",
                to_x(*t),
                to_y(*v)
            );
            continue;
        }
        for (i, (t, v)) in run.iter().enumerate() {
            let _ = write!(
                path,
                "{}{:.1} {:.1}",
                if i == 0 { 'M' } else { 'L' },
                to_x(*t),
                to_y(*v)
            );
        }
    }
    if !path.is_empty() {
        let _ = write!(out, "<path class=\"line {class}\" d=\"{path}\"/>");
    }
    !runs.is_empty()
}

fn legend(out: &mut String, curves: &[&Series], unit: &str) {
    out.push_str("<ul class=\"legend\">");
    for (i, s) in curves.iter().enumerate() {
        let dash = if i >= COLOURS { " dash" } else { "" };
        let last = s.points.iter().rev().find(|p| p.1.is_finite());
        let last = last.map_or_else(|| "no values".into(), |p| quantity(p.1, unit));
        let _ = write!(
            out,
            "<li><i class=\"c{}{dash}\"></i>{} <b>{}</b></li>",
            i % COLOURS,
            escape(&s.name),
            escape(&last),
        );
    }
    out.push_str("</ul>\n");
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(log: bool, points: Vec<(f64, f64)>) -> Series {
        Series {
            group: "energy".into(),
            name: "<membrane>".into(),
            unit: "J".into(),
            log,
            points,
        }
    }

    /// Whatever the data, the SVG is finite, escaped and of bounded size.
    #[test]
    fn plots_are_robust() {
        let many = (0..400_000)
            .map(|i| (f64::from(i), f64::from(i).sin()))
            .collect();
        let cases: Vec<Vec<(f64, f64)>> = vec![
            vec![],
            vec![(0.0, 1.0)],
            vec![(0.0, 2.0), (1.0, 2.0)],
            vec![(0.0, f64::NAN), (f64::NAN, 1.0), (1.0, f64::INFINITY)],
            vec![
                (0.0, 1.0),
                (0.5, f64::NAN),
                (1.0, 3.0),
                (2.0, 1e308),
                (3.0, -1e308),
            ],
            vec![(1.0, -5.0), (0.0, 0.0)],
            vec![(1e300, 1e-320), (-1e300, 0.0)],
            many,
        ];
        for points in cases {
            for log in [false, true] {
                let html = plots(&[series(log, points.clone())]);
                let svg = html.split("<ul").next().unwrap();
                assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
                assert!(!html.contains("<membrane>"));
                assert!(html.len() < 90_000, "{}", html.len());
            }
        }
        assert!(plots(&[]).is_empty());
    }

    /// A gap in the data is a gap in the curve; values left out are counted.
    #[test]
    fn gaps_and_losses_are_visible() {
        let points = vec![(0.0, 1.0), (1.0, 2.0), (2.0, 0.0), (3.0, 4.0), (4.0, 5.0)];
        let html = plots(&[series(true, points)]);
        let path = html.split("class=\"line c0\" d=\"").nth(1).unwrap();
        assert_eq!(path.split('"').next().unwrap().matches('M').count(), 2);
        assert!(html.contains("1 of 5 values left out"));
    }

    /// Different units never share an axis.
    #[test]
    fn one_unit_a_plot() {
        let mut other = series(false, vec![(0.0, 1.0)]);
        other.unit = "m".into();
        let html = plots(&[series(false, vec![(0.0, 1.0)]), other]);
        assert_eq!(html.matches("<figure").count(), 2);
    }
}
