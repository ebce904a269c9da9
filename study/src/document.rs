//! Documents whose figures come from results of studies.
//!
//! A template is Markdown. A fenced block marked `study` holds TOML and is
//! replaced by a table, or by the facts of a study:
//!
//! ````text
//! ```study
//! from = { soft = "nano-soft", stiff = "nano-stiff" }  # name = folder
//! rows = "integrator.newton_tolerance"                 # a varied key
//! columns = "integrator.step_splitting"                # another; may be absent
//! show = ["cpu_median_s", "mean_m | mean distance, mm | 1000"]
//! ratio = "reassembled"   # adds this row's figures over each row's; not of distances
//! ```
//! ````
//!
//! An entry of `show` is a column of `study.csv`, then a heading and a factor.
//! `names` and `head` replace the texts of the first column.
//! With `columns` there is one table for each entry of `show`. So there is with
//! `turned = true`: a line for each study and a column for each row value; where
//! `ratio` is given, the ratio alone, with its median, least and greatest. A block with
//! `facts = true` and `from` alone lists scene, reference, floor and
//! recommendation; `stages = "VALUE"` shows the shares of the stages in the runs
//! with that value of `rows`, and with `turned` their medians.

mod tables;

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use serde::Deserialize;

use crate::StudyError;
use crate::markdown::digits;
use crate::results::{Clock, Results, Row};
use crate::table::Table;
use tables::tables;

/// One block of a template.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Block {
    from: BTreeMap<String, String>,
    #[serde(default)]
    rows: String,
    #[serde(default)]
    columns: Option<String>,
    #[serde(default)]
    show: Vec<String>,
    #[serde(default)]
    ratio: Option<String>,
    #[serde(default)]
    names: Vec<String>,
    #[serde(default)]
    head: Option<String>,
    #[serde(default)]
    turned: bool,
    #[serde(default)]
    facts: bool,
    #[serde(default)]
    stages: Option<String>,
}

/// A study and its table.
struct Source {
    name: String,
    results: Results,
    table: Table,
}

const OPEN: &str = "```study";
const CLOSE: &str = "```";

/// Fills in a template; `folder` is what the folders of studies refer to, and
/// `name` stands for the template in messages.
///
/// # Errors
/// [`StudyError::Template`] with the line, [`StudyError::NotAStudy`] and
/// [`StudyError::Read`].
pub fn fill(template: &str, name: &str, folder: &Path) -> Result<String, StudyError> {
    let mut out = String::with_capacity(2 * template.len());
    let mut lines = template.lines().enumerate();
    while let Some((number, line)) = lines.next() {
        if line.trim_end() != OPEN {
            out.push_str(line);
            out.push('\n');
            continue;
        }
        let fail = |reason: String| StudyError::Template {
            place: format!("{name}:{}", number + 1),
            reason,
        };
        let mut text = String::new();
        loop {
            match lines.next() {
                Some((_, line)) if line.trim_end() == CLOSE => break,
                Some((_, line)) => {
                    text.push_str(line);
                    text.push('\n');
                }
                None => return Err(fail(format!("the block is not closed by `{CLOSE}`"))),
            }
        }
        let block: Block = toml::from_str(&text).map_err(|e| fail(e.message().to_owned()))?;
        let sources = sources(&block, folder)?;
        if sources.is_empty() {
            return Err(fail("`from` names no study".to_owned()));
        }
        let html = if block.facts {
            facts(&sources)
        } else if let Some(value) = &block.stages {
            stages(&block, &sources, value).map_err(fail)?
        } else {
            tables(&block, &sources).map_err(fail)?
        };
        out.push_str(&html);
    }
    Ok(out)
}

fn sources(block: &Block, folder: &Path) -> Result<Vec<Source>, StudyError> {
    let mut sources = Vec::new();
    for (name, study) in &block.from {
        let path = folder.join(study).join("study.json");
        let fail = |reason: String| StudyError::NotAStudy {
            path: folder.join(study),
            reason,
        };
        let text = std::fs::read_to_string(&path).map_err(|e| fail(format!("study.json: {e}")))?;
        let results: Results =
            serde_json::from_str(&text).map_err(|e| fail(format!("study.json: {e}")))?;
        let rows = results.rows.len();
        let best = results.recommended.as_ref().map(|b| b.row);
        if best
            .into_iter()
            .chain(results.front.iter().copied())
            .any(|i| i >= rows)
        {
            return Err(fail("study.json contradicts itself".to_owned()));
        }
        let table = Table::of(&results);
        let name = name.clone();
        sources.push(Source {
            name,
            results,
            table,
        });
    }
    Ok(sources)
}

/// Shares of the stages with one value of a varied key.
fn stages(block: &Block, sources: &[Source], value: &str) -> Result<String, String> {
    let mut found = Vec::new();
    for source in sources {
        let keys = &source.results.keys;
        let key = keys.iter().position(|k| *k == block.rows);
        let fits =
            |row: &&Row| key.is_some_and(|k| row.settings.get(k).is_some_and(|v| v == value));
        let row = source.results.rows.iter().find(fits);
        let figures = row.and_then(|row| row.figures.as_ref());
        let figures = figures
            .ok_or_else(|| format!("`{}` has no run `{} = {value}`", source.name, block.rows))?;
        found.push((source.name.as_str(), &figures.stages_s));
    }
    let head = block.head.as_deref().unwrap_or_default();
    Ok(crate::stages::table(head, block.turned, found.into_iter()))
}

fn facts(sources: &[Source]) -> String {
    let mut out = String::new();
    let list = |settings: &[(String, String)]| {
        let each = settings.iter().map(|(k, v)| format!("`{k}={v}`"));
        each.collect::<Vec<_>>().join(", ")
    };
    for s in sources {
        let r = &s.results;
        let points = r.reference.figures.as_ref().map_or(0, |f| f.points);
        let failed = r.rows.iter().filter(|row| row.status == "failed").count();
        let cpu = r.reference.seconds(Clock::Cpu).unwrap_or(0.0);
        let _ = write!(
            out,
            "- **{}**: `{}`, {points} points, {} runs, {failed} failed. Reference: {}; \
             {} processor seconds.",
            s.name,
            r.scene,
            r.rows.len(),
            list(&r.reference_settings),
            digits(cpu)
        );
        if !r.set.is_empty() {
            let _ = write!(out, " All runs: {}.", list(&r.set));
        }
        match r.floor {
            Some(f) => {
                let _ = write!(
                    out,
                    " Floor: mean {} mm, Hausdorff {} mm.",
                    digits(1e3 * f.mean_m),
                    digits(1e3 * f.hausdorff_m)
                );
            }
            None => out.push_str(" Floor: not measured."),
        }
        if let Some(best) = &r.recommended {
            let keys = r.keys.iter().cloned();
            let settings: Vec<(String, String)> = keys
                .zip(r.rows[best.row].settings.iter().cloned())
                .collect();
            let _ = write!(out, " Recommended: {}: {}.", list(&settings), best.reason);
        }
        out.push('\n');
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Text passes through; blocks that cannot be filled are named by line.
    #[test]
    fn mistakes_are_placed() {
        let fill = |t: &str| fill(t, "t.md", Path::new("/nowhere"));
        assert_eq!(
            fill("# A\n\n```sh\nx\n```\n").unwrap(),
            "# A\n\n```sh\nx\n```\n"
        );
        let message = |t: &str| fill(t).unwrap_err().to_string();
        assert!(message("a\n```study\nx").starts_with("t.md:2: "));
        assert!(message("```study\nfrom = 3\n```\n").starts_with("t.md:1: "));
        assert!(message("```study\nfrom = {}\n```\n").contains("no study"));
        assert!(message("```study\nfrom = { a = \"b\" }\n```\n").contains("/nowhere/b"));
    }

    /// Studies as lines: the baseline's ratio to itself is 1, and so is what is
    /// said of all.
    #[test]
    fn turned_tables_summarise() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/studies");
        let block = |more: &str| {
            let study = "twist-nano-soft-precision";
            format!(
                "```study\nfrom = {{ a = \"{study}\", b = \"{study}\", c = \"{study}\" }}\n\
                 rows = \"solver.precision\"\nshow = [\"cpu_median_s | time\"]\n\
                 turned = true\n{more}```\n"
            )
        };
        let table = fill(&block("ratio = \"f64\"\n"), "t.md", &folder).unwrap();
        assert!(table.starts_with("time, times less:\n\n|  | f64 | mixed |\n"));
        let ones = table.lines().filter(|l| l.contains("| 1 |")).count();
        assert_eq!(ones, 6, "{table}");
        let plain = fill(&block(""), "t.md", &folder).unwrap();
        assert!(!plain.contains("*median*") && !plain.contains("times less"));
    }
}
