//! Text of the page: escaping and human-readable quantities.

use std::fmt::Write as _;

/// `text` made safe for HTML content and quoted attributes.
pub fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len() + 8);
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            // Control characters are not allowed in HTML text.
            c if c.is_control() && !matches!(c, '\n' | '\t') => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

/// JSON that can stand inside a `<script>` element: no `<` survives.
pub(super) fn script_json(value: &serde_json::Value) -> String {
    value.to_string().replace('<', "\\u003c")
}

/// `exponent` in superscript digits.
pub(super) fn superscript(exponent: i32) -> String {
    exponent
        .to_string()
        .chars()
        .map(|c| match c {
            '-' => '⁻',
            '1' => '¹',
            '2' => '²',
            '3' => '³',
            c => c
                .to_digit(10)
                .and_then(|d| char::from_u32(0x2070 + d))
                .unwrap_or(c),
        })
        .collect()
}

/// A number with about four significant digits.
pub(super) fn number(v: f64) -> String {
    if !v.is_finite() {
        return "not finite".into();
    }
    if v == 0.0 {
        return "0".into();
    }
    let magnitude = v.abs();
    if !(1e-3..1e5).contains(&magnitude) {
        let text = format!("{v:.3e}");
        let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        let exponent = superscript(exponent.parse().unwrap_or(0));
        return format!("{} × 10{exponent}", minus(trim_zeros(mantissa)));
    }
    let digits = (3 - magnitude.log10().floor() as i32).clamp(0, 7) as usize;
    let text = format!("{v:.digits$}");
    minus(if digits > 0 { trim_zeros(&text) } else { &text })
}

/// `text` without zeros after the decimal point.
pub(super) fn trim_zeros(text: &str) -> &str {
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.')
    } else {
        text
    }
}

/// `text` with a typographic minus sign.
pub(super) fn minus(text: &str) -> String {
    text.replace('-', "−")
}

/// A count, with thin spaces between groups of three.
pub(super) fn count(v: u64) -> String {
    let digits = v.to_string();
    let mut out = String::new();
    for (i, c) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) && digits.len() > 4 {
            out.push('\u{2009}');
        }
        out.push(c);
    }
    out
}

/// A duration given in seconds.
pub(super) fn duration(s: f64) -> String {
    if !s.is_finite() {
        return "not finite".into();
    }
    let magnitude = s.abs();
    if magnitude == 0.0 {
        "0 s".into()
    } else if magnitude < 1e-3 {
        format!("{} µs", number(s * 1e6))
    } else if magnitude < 0.1 {
        format!("{} ms", number(s * 1e3))
    } else if magnitude < 120.0 {
        format!("{} s", number(s))
    } else if magnitude < 7200.0 {
        let whole = s.round();
        format!("{} min {:02} s", (whole / 60.0).floor(), whole % 60.0)
    } else {
        let minutes = (s / 60.0).round();
        format!("{} h {:02} min", (minutes / 60.0).floor(), minutes % 60.0)
    }
}

/// A length given in metres.
pub(super) fn length(m: f64) -> String {
    let magnitude = m.abs();
    if !magnitude.is_finite() || magnitude == 0.0 || magnitude >= 1.0 {
        format!("{} m", number(m))
    } else if magnitude >= 1e-4 {
        format!("{} mm", number(m * 1e3))
    } else if magnitude >= 1e-7 {
        format!("{} µm", number(m * 1e6))
    } else {
        format!("{} nm", number(m * 1e9))
    }
}

/// A ratio in per cent.
pub(super) fn percent(ratio: f64) -> String {
    format!("{} %", number(ratio * 100.0))
}

/// A size in bytes.
pub(super) fn bytes(v: f64) -> String {
    let mut v = v;
    for unit in ["B", "KiB", "MiB", "GiB"] {
        if v.abs() < 1024.0 {
            let digits = usize::from(unit != "B" && v.abs() < 100.0);
            return format!("{v:.digits$} {unit}");
        }
        v /= 1024.0;
    }
    format!("{v:.1} TiB")
}

/// A quantity with its unit; dimensionless ones stand alone.
pub(super) fn quantity(v: f64, unit: &str) -> String {
    let mut out = number(v);
    if !unit.is_empty() && unit != "1" {
        let _ = write!(out, " {unit}");
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nothing a user types can open a tag, an attribute or a script.
    #[test]
    fn markup_is_escaped() {
        assert_eq!(
            escape("<a b='c' d=\"e\">&\u{0}"),
            "&lt;a b=&#39;c&#39; d=&quot;e&quot;&gt;&amp;\u{fffd}"
        );
        let json = script_json(&serde_json::json!({ "x": "</script><!--" }));
        assert!(!json.contains('<'));
        let back: serde_json::Value = serde_json::from_str(&json).unwrap();
        assert_eq!(back["x"], "</script><!--");
    }

    /// Quantities read as an engineer would write them.
    #[test]
    fn quantities_are_readable() {
        assert_eq!(number(0.0), "0");
        assert_eq!(number(-1.5), "−1.5");
        assert_eq!(number(123.456), "123.5");
        assert_eq!(number(100.0), "100");
        assert_eq!(number(2.5e-7), "2.5 × 10⁻⁷");
        assert_eq!(number(f64::NAN), "not finite");
        assert_eq!(count(1_234_567), "1\u{2009}234\u{2009}567");
        assert_eq!(count(9999), "9999");
        assert_eq!(duration(0.0123), "12.3 ms");
        assert_eq!(duration(192.0), "3 min 12 s");
        assert_eq!(duration(9000.0), "2 h 30 min");
        assert_eq!(length(0.00123), "1.23 mm");
        assert_eq!(length(0.0), "0 m");
        assert_eq!(bytes(1536.0), "1.5 KiB");
        assert_eq!(percent(0.034), "3.4 %");
    }
}
