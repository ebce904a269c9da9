//! Numbers and tables in Markdown.

/// What stands in a table.
pub(crate) enum Cell {
    Number(f64),
    Text(String),
}

impl Cell {
    /// As it is printed.
    pub fn text(&self) -> String {
        match self {
            Self::Text(text) => text.clone(),
            Self::Number(x) => digits(*x),
        }
    }
}

/// Three significant digits; all of a count.
pub(crate) fn digits(x: f64) -> String {
    if x == x.trunc() && x.abs() < 1e6 {
        return format!("{x}");
    }
    let magnitude = x.abs().log10().floor() as i32;
    if (-3..6).contains(&magnitude) {
        format!("{x:.*}", (2 - magnitude).max(0) as usize)
    } else {
        format!("{x:.2e}")
    }
}

/// A table.
pub(crate) fn markdown(heads: &[String], lines: &[Vec<String>]) -> String {
    let row = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    let mut out = row(heads);
    out += &format!("|{}\n", "---|".repeat(heads.len()));
    for line in lines {
        out += &row(line);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three digits, whatever the size.
    #[test]
    fn three_digits() {
        for (x, text) in [
            (0.0, "0"),
            (1234.5, "1234"),
            (0.012345, "0.0123"),
            (1e-9, "1.00e-9"),
            (9.0, "9"),
        ] {
            assert_eq!(digits(x), text);
        }
    }
}
