//! Legends of pictures: length scale, colour scale with the values' histogram.

use std::fmt::Write as _;

use super::colour::{ColourMap, hex};
use super::data::Field;
use super::picture::{Picture, map_of};
use super::stats::{BINS, FieldStats};
use super::text::{count, escape, length, quantity};
use super::ticks::{Axis, round_step};

/// A length drawn at the picture's scale (SVG laid over the picture's lower edge).
pub(super) fn length_bar(picture: &Picture) -> String {
    let across = f64::from(picture.width) * picture.metres_per_pixel;
    // The largest of 1, 2, 5 × 10ⁿ that is at most 30 % of the width.
    let mut bar = round_step(0.06 * across);
    while round_step(1.01 * bar) <= 0.3 * across {
        bar = round_step(1.01 * bar);
    }
    let part = 100.0 * bar / across;
    let label = if (0.01..1.0).contains(&bar) {
        quantity(bar * 100.0, "cm")
    } else {
        length(bar)
    };
    format!("<span class=\"scale\" style=\"width:{part:.3}%\">{label}</span>")
}

/// The colour scale of a field: histogram, gradient, ticks, unit.
pub(super) fn colour_bar(field: &Field, stats: &FieldStats, id: usize) -> String {
    const LEFT: f64 = 18.0;
    const WIDTH: f64 = 564.0;
    let (low, high) = (f64::from(stats.scale.0), f64::from(stats.scale.1));
    let axis = Axis::exact(low, high, 6);
    let mut out = format!(
        "<svg class=\"bar\" viewBox=\"0 0 600 78\" role=\"img\" aria-label=\"colour scale of {}\"><defs><linearGradient id=\"g{id}\">",
        escape(&field.name)
    );
    let map = map_of(field);
    for i in 0..=24 {
        let t = f64::from(i) / 24.0;
        let _ = write!(
            out,
            "<stop offset=\"{t:.4}\" stop-color=\"{}\"/>",
            hex(map.srgb(t))
        );
    }
    out.push_str("</linearGradient></defs>");
    histogram(&mut out, stats, LEFT, WIDTH);
    let _ = write!(
        out,
        "<rect x=\"{LEFT}\" y=\"36\" width=\"{WIDTH}\" height=\"14\" fill=\"url(#g{id})\"/>"
    );
    // Arrowheads: there are values beyond this end.
    if f64::from(stats.min) < low {
        let _ = write!(
            out,
            "<path d=\"M{LEFT} 36L6 43L{LEFT} 50Z\" fill=\"{}\"/>",
            hex(map.srgb(0.0))
        );
    }
    if f64::from(stats.max) > high {
        let x = LEFT + WIDTH;
        let _ = write!(
            out,
            "<path d=\"M{x} 36L{} 43L{x} 50Z\" fill=\"{}\"/>",
            x + 12.0,
            hex(map.srgb(1.0))
        );
    }
    for (v, label) in &axis.ticks {
        let x = LEFT + WIDTH * axis.place(*v).unwrap_or(0.0);
        let _ = write!(
            out,
            "<path class=\"axis\" d=\"M{x:.1} 50v4\"/><text class=\"x\" x=\"{x:.1}\" y=\"67\">{label}</text>"
        );
    }
    out.push_str("</svg>");
    let unit = axis.unit(&field.unit);
    if !unit.is_empty() {
        let _ = write!(out, "<span class=\"barunit\">{}</span>", escape(&unit));
    }
    out
}

fn histogram(out: &mut String, stats: &FieldStats, left: f64, width: f64) {
    let peak = f64::from(stats.histogram.iter().copied().max().unwrap_or(0).max(1));
    let bin = width / BINS as f64;
    let mut path = String::new();
    for (i, &n) in stats.histogram.iter().enumerate() {
        if n > 0 {
            // Square root: rare extremes stay visible.
            let h = 30.0 * (f64::from(n) / peak).sqrt();
            let _ = write!(
                path,
                "M{:.1} 34v{:.1}h{:.1}v{h:.1}z",
                left + bin * i as f64,
                -h,
                bin - 1.0
            );
        }
    }
    if !path.is_empty() {
        let _ = write!(out, "<path class=\"histogram\" d=\"{path}\"/>");
    }
}

/// The figures under a map.
pub(super) fn figures(field: &Field, stats: &FieldStats) -> String {
    if stats.finite == 0 {
        return "<p class=\"small\">This field has no finite value.</p>".into();
    }
    let q = |v: f64| escape(&quantity(v, &field.unit));
    let mut out = format!(
        "<dl class=\"figures\"><div><dt>min</dt><dd>{}</dd></div><div><dt>median</dt><dd>{}</dd></div><div><dt>mean</dt><dd>{}</dd></div><div><dt>{}</dt><dd>{}</dd></div><div><dt>max</dt><dd>{}</dd></div></dl>",
        q(stats.min.into()),
        q(stats.median.into()),
        q(stats.mean),
        if field.diverging {
            "99 % within ±"
        } else {
            "99 % below"
        },
        q(stats.p99.into()),
        q(stats.max.into()),
    );
    if stats.missing > 0 {
        let _ = write!(
            out,
            "<p class=\"small\"><i class=\"missing\"></i>grey: no value ({} of {}).</p>",
            count(stats.missing as u64),
            count((stats.missing + stats.finite) as u64),
        );
    }
    out
}

/// All 256 colours of a scale, for the 3D view.
pub(super) fn table_bytes(map: ColourMap) -> Vec<u8> {
    map.table().into_iter().flatten().collect()
}
