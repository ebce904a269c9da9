//! Tables of figures.

use std::fmt::Write as _;

use super::{Block, Source};
use crate::markdown::{Cell, digits, markdown};
use crate::metrics::median;

/// A figure to show.
struct Show {
    column: String,
    heading: String,
    factor: f64,
}

/// Tables of a block.
pub(super) fn tables(block: &Block, sources: &[Source]) -> Result<String, String> {
    let first = sources.first().ok_or("no study")?;
    let shows: Vec<Show> = block
        .show
        .iter()
        .map(|s| show(s))
        .collect::<Result<_, _>>()?;
    if shows.is_empty() {
        return Err("`show` names no column".to_owned());
    }
    let rows = values(first, &block.rows)?;
    if let Some(baseline) = &block.ratio
        && !rows.contains(baseline)
    {
        return Err(format!(
            "no row `{baseline}`; there are `{}`",
            rows.join("`, `")
        ));
    }
    if !block.names.is_empty() && block.names.len() != rows.len() {
        let (names, rows) = (block.names.len(), rows.len());
        return Err(format!("`names` has {names} entries for {rows} rows"));
    }
    match &block.columns {
        _ if block.turned => turned(block, sources, &shows, &rows),
        Some(columns) => wide(block, sources, &shows, &rows, columns),
        None => long(block, sources, &shows, &rows),
    }
}

/// Values of a varied key in the order of the points.
fn values(source: &Source, key: &str) -> Result<Vec<String>, String> {
    let keys = &source.results.keys;
    let i = keys.iter().position(|k| k == key).ok_or_else(|| {
        let list = keys.join("`, `");
        format!(
            "`{}` does not vary `{key}`; it varies `{list}`",
            source.name
        )
    })?;
    let mut values: Vec<String> = Vec::new();
    for row in &source.results.rows {
        if let Some(v) = row.settings.get(i)
            && !values.contains(v)
        {
            values.push(v.clone());
        }
    }
    Ok(values)
}

fn show(text: &str) -> Result<Show, String> {
    let mut parts = text.split('|').map(str::trim);
    let column = parts.next().unwrap_or_default().to_owned();
    let heading = parts.next().unwrap_or(&column).to_owned();
    let factor = match parts.next() {
        Some(factor) => factor
            .parse()
            .map_err(|_| format!("`{factor}` is not a number"))?,
        None => 1.0,
    };
    Ok(Show {
        column,
        heading,
        factor,
    })
}

/// The figure of the point with these settings: the median, should there be
/// several. Failed runs say so.
fn figure(source: &Source, settings: &[(&str, &str)], show: &Show) -> Result<Cell, String> {
    let t = &source.table;
    if !t.columns.contains(&show.column) {
        let list = t.columns.join("`, `");
        return Err(format!("no column `{}`; there are `{list}`", show.column));
    }
    let mut found = Vec::new();
    for row in 0..t.rows.len() {
        let fits = |(k, v): &(&str, &str)| t.get(row, k) == Some(v);
        if t.get(row, "role") != Some("point") || !settings.iter().all(fits) {
            continue;
        }
        if t.get(row, "status") == Some("failed") {
            return Ok(Cell::Text("failed".to_owned()));
        }
        let text = t.get(row, &show.column).unwrap_or_default();
        match text.parse::<f64>() {
            Ok(x) => found.push(show.factor * x),
            Err(_) => return Ok(Cell::Text(text.to_owned())),
        }
    }
    Ok(median(&found).map_or(Cell::Text("–".to_owned()), Cell::Number))
}

fn short(key: &str) -> &str {
    key.rsplit('.').next().unwrap_or(key)
}

fn first_column(block: &Block, rows: &[String]) -> Vec<Vec<String>> {
    let names = if block.names.is_empty() {
        rows
    } else {
        &block.names
    };
    names.iter().map(|r| vec![r.clone()]).collect()
}

/// A table for each figure, with the values of a second key as columns.
fn wide(
    block: &Block,
    sources: &[Source],
    shows: &[Show],
    rows: &[String],
    columns: &str,
) -> Result<String, String> {
    let mut out = String::new();
    for show in shows {
        let head = block.head.as_deref().unwrap_or(short(&block.rows));
        let mut heads = vec![format!("{head} \\ {}", short(columns))];
        let mut lines = first_column(block, rows);
        for source in sources {
            for column in values(source, columns)? {
                heads.push(format!("{} {column}", source.name));
                for (line, row) in lines.iter_mut().zip(rows) {
                    let settings = [(block.rows.as_str(), row.as_str()), (columns, &column)];
                    line.push(figure(source, &settings, show)?.text());
                }
            }
        }
        let _ = write!(out, "{}:\n\n{}\n", show.heading, markdown(&heads, &lines));
    }
    out.pop();
    Ok(out)
}

/// One table with all figures as columns.
fn long(
    block: &Block,
    sources: &[Source],
    shows: &[Show],
    rows: &[String],
) -> Result<String, String> {
    let mut heads = vec![
        block
            .head
            .as_deref()
            .unwrap_or(short(&block.rows))
            .to_owned(),
    ];
    let mut lines = first_column(block, rows);
    for source in sources {
        let prefix = match sources.len() {
            1 => String::new(),
            _ => format!("{}: ", source.name),
        };
        for show in shows {
            let of = |row: &String| figure(source, &[(block.rows.as_str(), row.as_str())], show);
            // How often a distance fits into another says nothing.
            let ratio = block
                .ratio
                .as_ref()
                .filter(|_| !show.column.ends_with("_m"));
            let baseline = ratio.map(of).transpose()?;
            heads.push(format!("{prefix}{}", show.heading));
            if ratio.is_some() {
                heads.push("ratio".to_owned());
            }
            for (line, row) in lines.iter_mut().zip(rows) {
                let cell = of(row)?;
                line.push(cell.text());
                match (&baseline, &cell) {
                    (None, _) => {}
                    (Some(Cell::Number(b)), Cell::Number(x)) if *x != 0.0 => {
                        line.push(digits(b / x));
                    }
                    _ => line.push("–".to_owned()),
                }
            }
        }
    }
    Ok(markdown(&heads, &lines))
}

/// A table for each figure with a line for each study.
fn turned(
    block: &Block,
    sources: &[Source],
    shows: &[Show],
    rows: &[String],
) -> Result<String, String> {
    let mut out = String::new();
    for show in shows {
        let ratio = block
            .ratio
            .as_ref()
            .filter(|_| !show.column.ends_with("_m"));
        let mut heads = vec![block.head.clone().unwrap_or_default()];
        heads.extend(first_column(block, rows).into_iter().flatten());
        let mut lines = Vec::new();
        let mut numbers = vec![Vec::new(); rows.len()];
        for source in sources {
            let of = |row: &String| figure(source, &[(block.rows.as_str(), row.as_str())], show);
            let baseline = ratio.map(of).transpose()?;
            let mut line = vec![source.name.clone()];
            for (row, numbers) in rows.iter().zip(&mut numbers) {
                let cell = match (&baseline, of(row)?) {
                    (Some(Cell::Number(b)), Cell::Number(x)) if x != 0.0 => Cell::Number(b / x),
                    (Some(_), Cell::Number(_)) => Cell::Text("–".to_owned()),
                    (_, cell) => cell,
                };
                if let Cell::Number(x) = cell {
                    numbers.push(x);
                }
                line.push(cell.text());
            }
            lines.push(line);
        }
        if ratio.is_some() {
            let least = |v: &[f64]| v.iter().copied().reduce(f64::min);
            let greatest = |v: &[f64]| v.iter().copied().reduce(f64::max);
            let mut add = |name: &str, of: &dyn Fn(&[f64]) -> Option<f64>| {
                let mut line = vec![format!("*{name}*")];
                let cells = numbers.iter().map(|v| of(v).map_or("–".to_owned(), digits));
                line.extend(cells);
                lines.push(line);
            };
            add("median", &median);
            add("least", &least);
            add("greatest", &greatest);
        }
        let times = if ratio.is_some() { ", times less" } else { "" };
        let _ = write!(
            out,
            "{}{times}:\n\n{}\n",
            show.heading,
            markdown(&heads, &lines)
        );
    }
    out.pop();
    Ok(out)
}
