//! Plots of a study: error against time, and both against a setting.

use std::fmt::Write as _;

use selvedge_study::{Results, Row, least, median};

use super::text::{duration, escape, length, number, superscript};

/// A logarithmic axis that is only as long as its values need.
struct Log {
    low: f64,
    high: f64,
    ticks: Vec<(f64, String)>,
}

impl Log {
    /// `None` without a positive value.
    fn new(values: impl Iterator<Item = f64>) -> Option<Self> {
        let logs = values.filter(|v| v.is_finite() && *v > 0.0).map(f64::log10);
        let (low, high) = logs.fold(None, |r: Option<(f64, f64)>, v| {
            Some(r.map_or((v, v), |(a, b)| (a.min(v), b.max(v))))
        })?;
        let pad = 0.06 * (high - low).max(0.5);
        let (low, high) = (low - pad, high + pad);
        let fine: &[f64] = match high - low {
            span if span < 0.6 => &[1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0],
            span if span < 1.3 => &[1.0, 2.0, 3.0, 5.0, 7.0],
            span if span < 2.5 => &[1.0, 2.0, 5.0],
            _ => &[1.0],
        };
        let stride = (((high - low) / 8.0).ceil() as i32).max(1);
        let mut ticks = Vec::new();
        for e in (low.floor() as i32..=high.ceil() as i32).filter(|e| e % stride == 0) {
            for m in fine {
                let value = m * 10f64.powi(e);
                if (low..=high).contains(&value.log10()) {
                    ticks.push((value, label(*m, e)));
                }
            }
        }
        Some(Self { low, high, ticks })
    }

    fn place(&self, value: f64) -> f64 {
        let least = 10f64.powf(self.low);
        (value.max(least).log10() - self.low) / (self.high - self.low)
    }
}

fn label(m: f64, e: i32) -> String {
    if (-3..4).contains(&e) {
        number(m * 10f64.powi(e))
    } else if m == 1.0 {
        format!("10{}", superscript(e))
    } else {
        format!("{m}·10{}", superscript(e))
    }
}

/// Rectangle of a plot in SVG units.
struct Frame {
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
}

impl Frame {
    fn x(&self, t: f64) -> f64 {
        self.left + t * (self.right - self.left)
    }

    fn y(&self, t: f64) -> f64 {
        self.bottom - t * (self.bottom - self.top)
    }

    fn axes(&self, out: &mut String, x: &[(f64, String)], y: &[(f64, String)], names: [&str; 2]) {
        let Self {
            left,
            right,
            top,
            bottom,
        } = self;
        for (at, text) in y {
            let at = self.y(*at);
            let _ = write!(
                out,
                "<path class=\"grid\" d=\"M{left} {at:.1}H{right}\"/><text class=\"y\" x=\"{}\" y=\"{:.1}\">{text}</text>",
                left - 7.0,
                at + 3.8
            );
        }
        for (at, text) in x {
            let at = self.x(*at);
            let _ = write!(
                out,
                "<path class=\"grid\" d=\"M{at:.1} {bottom}V{top}\"/><text class=\"x\" x=\"{at:.1}\" y=\"{}\">{}</text>",
                bottom + 16.0,
                escape(text)
            );
        }
        let _ = write!(
            out,
            "<path class=\"axis\" d=\"M{left} {top}V{bottom}H{right}\"/><text x=\"{}\" y=\"{}\">{}</text><text class=\"time\" x=\"{right}\" y=\"{}\">{}</text>",
            left - 50.0,
            top - 10.0,
            escape(names[0]),
            bottom + 33.0,
            escape(names[1])
        );
    }
}

fn ticks(axis: &Log) -> Vec<(f64, String)> {
    let place = |(v, text): &(f64, String)| (axis.place(*v), text.clone());
    axis.ticks.iter().map(place).collect()
}

/// Settings, error and time of a run, for the pointer.
fn hover(r: &Results, row: &Row) -> String {
    let mut text = String::new();
    for (key, value) in r.keys.iter().zip(&row.settings) {
        let _ = writeln!(text, "{key} = {value}");
    }
    let time = row.seconds(r.time).unwrap_or(f64::NAN);
    let error = row.error(r.measure).unwrap_or(f64::NAN);
    let _ = write!(text, "{}, {}", duration(time), length(error));
    if row.within_floor {
        text.push_str(" (within the floor: as good as the reference)");
    }
    escape(&text)
}

/// Error of a run as it is drawn [mm]: what is below the floor stays close.
fn drawn(r: &Results, row: &Row) -> Option<f64> {
    let error = row.error(r.measure)?;
    let least = if r.floor_m() > 0.0 {
        0.4 * r.floor_m()
    } else {
        1e-12
    };
    Some(1e3 * error.max(least))
}

/// Decades that a plot reaches down for a floor below its least value.
const REACH: f64 = 2.5;

/// The floor as far as it is worth room in a plot of these values.
fn near_floor(values: impl Iterator<Item = f64>, floor: f64) -> Option<f64> {
    let least = values.fold(f64::INFINITY, f64::min);
    (floor > 0.0 && floor > least * 10f64.powf(-REACH)).then_some(0.5 * floor)
}

/// The floor as a line, with what is below it shaded.
fn floor_line(out: &mut String, f: &Frame, y: &Log, floor_mm: f64, text: bool) {
    if floor_mm <= 0.0 {
        return;
    }
    if floor_mm.log10() < y.low {
        if text {
            let _ = write!(
                out,
                "<text class=\"time\" x=\"{}\" y=\"{}\">repeatability floor, {}: below this plot ↓</text>",
                f.right - 6.0,
                f.bottom - 8.0,
                length(1e-3 * floor_mm)
            );
        }
        return;
    }
    let at = f.y(y.place(floor_mm));
    let _ = write!(
        out,
        "<rect class=\"below\" x=\"{}\" y=\"{at:.1}\" width=\"{}\" height=\"{:.1}\"/><path class=\"line c7 dash\" d=\"M{} {at:.1}H{}\"/>",
        f.left,
        f.right - f.left,
        (f.bottom - at).max(0.0),
        f.left,
        f.right
    );
    if text {
        let _ = write!(
            out,
            "<text class=\"time\" x=\"{}\" y=\"{:.1}\">repeatability floor, {}</text>",
            f.right - 6.0,
            at + 14.0,
            length(1e-3 * floor_mm)
        );
    }
}

/// Error against time in double logarithmic axes, with the front and the floor.
pub(super) fn pareto(r: &Results, clock: &str) -> String {
    let f = Frame {
        left: 66.0,
        right: 986.0,
        top: 34.0,
        bottom: 440.0,
    };
    let floor_mm = 1e3 * r.floor_m();
    let shown: Vec<(usize, f64, f64)> = (0..r.rows.len())
        .filter_map(|i| Some((i, r.place(i)?.0, drawn(r, &r.rows[i])?)))
        .collect();
    let times = |row: &Row| {
        row.figures.as_ref().map(|f| match r.time {
            selvedge_study::Clock::Wall => f.wall_s.clone(),
            selvedge_study::Clock::Cpu => f.cpu_s.clone(),
        })
    };
    let errors = || shown.iter().map(|s| s.2);
    let all_times = r.rows.iter().filter_map(times).flatten();
    let (Some(x), Some(y)) = (
        Log::new(all_times.chain(shown.iter().map(|s| s.1))),
        Log::new(errors().chain(near_floor(errors(), floor_mm))),
    ) else {
        return "<p class=\"card\">No run has both a time and a distance.</p>\n".to_owned();
    };
    let mut out = String::from(
        "<figure class=\"card plot\"><svg viewBox=\"0 0 1000 480\" role=\"img\" aria-label=\"Error against time\">",
    );
    let name = format!("{clock} [s]");
    f.axes(&mut out, &ticks(&x), &ticks(&y), ["distance [mm]", &name]);
    floor_line(&mut out, &f, &y, floor_mm, true);
    let mut path = String::new();
    for i in &r.front {
        if let Some((_, t, e)) = shown.iter().find(|s| s.0 == *i) {
            let (px, py) = (f.x(x.place(*t)), f.y(y.place(*e)));
            let _ = match path.is_empty() {
                true => write!(path, "M{px:.1} {py:.1}"),
                false => write!(path, "H{px:.1}V{py:.1}"),
            };
        }
    }
    let _ = write!(out, "<path class=\"line c0\" d=\"{path}\"/>");
    let best = r.recommended.as_ref().map(|b| b.row);
    // What lies in front is drawn last.
    let order = shown.iter().filter(|s| !r.front.contains(&s.0));
    let order = order.chain(shown.iter().filter(|s| r.front.contains(&s.0)));
    for (i, t, e) in order {
        let row = &r.rows[*i];
        let (px, py) = (f.x(x.place(*t)), f.y(y.place(*e)));
        let front = r.front.contains(i);
        if let Some(times) = times(row).filter(|t| t.len() > 1)
            && let (Some(low), Some(mid)) = (least(&times), median(&times))
        {
            let high = times.iter().copied().fold(mid, f64::max);
            let _ = write!(
                out,
                "<path class=\"whisker\" d=\"M{:.1} {py:.1}H{:.1}\"/>",
                f.x(x.place(low)),
                f.x(x.place(high))
            );
        }
        if best == Some(*i) {
            let _ = write!(
                out,
                "<circle class=\"best\" cx=\"{px:.1}\" cy=\"{py:.1}\" r=\"11\"/>"
            );
        }
        let (class, radius) = if front {
            ("c0", 5.5)
        } else {
            ("c7 behind", 4.5)
        };
        let _ = write!(
            out,
            "<circle class=\"{class}\" cx=\"{px:.1}\" cy=\"{py:.1}\" r=\"{radius}\"><title>{}</title></circle>",
            hover(r, row)
        );
    }
    out.push_str(
        "</svg><ul class=\"legend\"><li><i class=\"dot c0\"></i>front: each more accurate, by more than the floor, than those before it that are faster</li>\
         <li><i class=\"dot c7\"></i>other runs</li><li><i class=\"c7 dash\"></i>floor: what is below it is as good as the reference</li>\
         <li><i class=\"ring\"></i>recommended</li></ul></figure>\n",
    );
    out
}

/// Error and time against every varied key.
pub(super) fn by_setting(r: &Results, clock: &str) -> String {
    let mut out = String::new();
    for (k, key) in r.keys.iter().enumerate() {
        let error = |i: usize| drawn(r, &r.rows[i]);
        let time = |i: usize| r.place(i).map(|p| p.0);
        let _ = write!(
            out,
            "<figure class=\"card plot\"><figcaption>{}</figcaption>",
            escape(key)
        );
        panel(
            &mut out,
            r,
            k,
            &error,
            "distance [mm]",
            "c0",
            1e3 * r.floor_m(),
        );
        panel(&mut out, r, k, &time, &format!("{clock} [s]"), "c1", 0.0);
        out.push_str("</figure>\n");
    }
    out
}

/// Values that get a place each; more are spread by their size.
const PLACES: usize = 12;

fn panel(
    out: &mut String,
    r: &Results,
    key: usize,
    value: &dyn Fn(usize) -> Option<f64>,
    name: &str,
    class: &str,
    floor: f64,
) {
    let f = Frame {
        left: 66.0,
        right: 606.0,
        top: 24.0,
        bottom: 178.0,
    };
    let setting = |i: usize| r.rows[i].settings.get(key).map_or("", String::as_str);
    let mut values: Vec<&str> = Vec::new();
    for i in 0..r.rows.len() {
        if !values.contains(&setting(i)) {
            values.push(setting(i));
        }
    }
    if values.iter().all(|v| v.parse::<f64>().is_ok()) {
        let number = |v: &str| v.parse().unwrap_or(f64::NAN);
        values.sort_by(|a, b| f64::total_cmp(&number(a), &number(b)));
    }
    let shown: Vec<(usize, f64)> = (0..r.rows.len())
        .filter_map(|i| Some((i, value(i)?)))
        .collect();
    let each = || shown.iter().map(|s| s.1);
    let Some(y) = Log::new(each().chain(near_floor(each(), floor))) else {
        return;
    };
    let parsed = |t: &str| t.parse::<f64>().ok().filter(|x| *x > 0.0);
    let spread = match values.len() > PLACES && values.iter().all(|v| parsed(v).is_some()) {
        true => Log::new(values.iter().filter_map(|v| parsed(v))),
        false => None,
    };
    let place = |text: &str| match (&spread, parsed(text)) {
        (Some(axis), Some(x)) => axis.place(x),
        _ => {
            let i = values.iter().position(|v| *v == text).unwrap_or(0);
            (i as f64 + 0.5) / values.len() as f64
        }
    };
    let labels: Vec<(f64, String)> = match &spread {
        Some(axis) => ticks(axis),
        None => values
            .iter()
            .step_by(values.len().div_ceil(PLACES))
            .map(|v| (place(v), v.chars().take(18).collect()))
            .collect(),
    };
    let _ = write!(
        out,
        "<svg viewBox=\"0 0 620 216\" role=\"img\" aria-label=\"{}\">",
        escape(name)
    );
    f.axes(out, &labels, &ticks(&y), [name, ""]);
    floor_line(out, &f, &y, floor, false);
    if spread.is_none() {
        let mut path = String::new();
        for v in &values {
            let same = shown.iter().filter(|s| setting(s.0) == *v).map(|s| s.1);
            if let Some(m) = median(&same.collect::<Vec<_>>()) {
                let c = if path.is_empty() { 'M' } else { 'L' };
                let _ = write!(path, "{c}{:.1} {:.1}", f.x(place(v)), f.y(y.place(m)));
            }
        }
        let _ = write!(out, "<path class=\"line {class}\" d=\"{path}\"/>");
    }
    for (i, v) in &shown {
        let _ = write!(
            out,
            "<circle class=\"{class}\" cx=\"{:.1}\" cy=\"{:.1}\" r=\"3.4\" fill-opacity=\"0.6\"><title>{}</title></circle>",
            f.x(place(setting(*i))),
            f.y(y.place(*v)),
            hover(r, &r.rows[*i])
        );
    }
    out.push_str("</svg>");
}
