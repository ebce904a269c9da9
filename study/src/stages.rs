//! Shares of the stages of a simulation.

use std::collections::BTreeMap;

use crate::markdown::markdown;
use crate::metrics::median;

/// Stages as the paper's pie has them, and the beginnings of ours that make them
/// up; whatever none of them names is the last.
const GROUPS: [(&str, &[&str]); 5] = [
    (
        "contact forces and matrix",
        &["contact: ", "assembly: contact"],
    ),
    ("collision detection", &["detection: "]),
    ("set-up of the static system", &["assembly: ", "forces"]),
    ("linear solve", &["solve"]),
    ("other", &[""]),
];

/// Percent of each group of stages.
fn shares(stages_s: &BTreeMap<String, f64>) -> [f64; GROUPS.len()] {
    let mut out = [0.0; GROUPS.len()];
    for (name, seconds) in stages_s {
        let begins = |group: &(&str, &[&str])| group.1.iter().any(|s| name.starts_with(s));
        if let Some(group) = GROUPS.iter().position(begins) {
            out[group] += seconds;
        }
    }
    let sum: f64 = out.iter().sum();
    out.map(|s| if sum > 0.0 { 100.0 * s / sum } else { 0.0 })
}

/// A line for each study, and the median where asked for, in percent.
pub(crate) fn table<'a>(
    head: &str,
    summary: bool,
    studies: impl Iterator<Item = (&'a str, &'a BTreeMap<String, f64>)>,
) -> String {
    let mut heads = vec![head.to_owned()];
    heads.extend(GROUPS.map(|g| format!("{}, %", g.0)));
    let mut lines = Vec::new();
    let mut columns = vec![Vec::new(); GROUPS.len()];
    for (name, stages_s) in studies {
        let shares = shares(stages_s);
        for (column, share) in columns.iter_mut().zip(shares) {
            column.push(share);
        }
        lines.push(line(name, shares.into_iter()));
    }
    if summary {
        let medians = columns.iter().map(|c| median(c).unwrap_or(0.0));
        lines.push(line("*median*", medians));
    }
    markdown(&heads, &lines)
}

fn line(name: &str, shares: impl Iterator<Item = f64>) -> Vec<String> {
    let cells = shares.map(|s| format!("{s:.1}"));
    std::iter::once(name.to_owned()).chain(cells).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every stage counts once, and all of them are the whole.
    #[test]
    fn stages_are_grouped_once() {
        let stages = [
            ("assembly: bending", 3.0),
            ("assembly: contact", 0.5),
            ("contact: self-contact", 0.5),
            ("detection: self-contact", 2.0),
            ("forces", 1.0),
            ("solve", 2.0),
            ("watchdog", 1.0),
        ];
        let stages = stages.map(|(name, s)| (name.to_owned(), s)).into();
        assert_eq!(shares(&stages), [10.0, 20.0, 40.0, 20.0, 10.0]);
        assert_eq!(shares(&BTreeMap::new()), [0.0; 5]);
        let text = table("garment", false, [("a", &stages)].into_iter());
        assert!(
            text.ends_with("| a | 10.0 | 20.0 | 40.0 | 20.0 | 10.0 |\n"),
            "{text}"
        );
    }
}
