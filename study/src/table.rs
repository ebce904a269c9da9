//! The results as a table of texts, and as CSV.

use std::collections::BTreeSet;

use crate::StudyError;
use crate::metrics::{least, median};
use crate::results::{Results, Row};

/// Rows of texts under named columns; "" where there is no value.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Names, with the unit as their ending.
    pub columns: Vec<String>,
    /// Cells, as many a row as there are columns.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// All runs of a study: the reference, its repetitions, the points.
    pub fn of(results: &Results) -> Self {
        let all: Vec<&Row> = [&results.reference]
            .into_iter()
            .chain(&results.floor_runs)
            .chain(&results.rows)
            .collect();
        let energies: BTreeSet<&String> = all
            .iter()
            .flat_map(|r| r.energy_differences_j.keys())
            .collect();
        let stages: BTreeSet<&String> = all
            .iter()
            .filter_map(|r| r.figures.as_ref())
            .flat_map(|f| f.stages_s.keys())
            .collect();
        let mut table = Self::default();
        for (i, row) in all.iter().enumerate() {
            let point = i.checked_sub(1 + results.floor_runs.len());
            let cells = cells(results, row, point, &energies, &stages);
            if table.columns.is_empty() {
                table.columns = cells.iter().map(|c| c.0.clone()).collect();
            }
            table.rows.push(cells.into_iter().map(|c| c.1).collect());
        }
        table
    }

    /// As CSV with a line of names.
    pub fn to_csv(&self) -> String {
        let mut writer = csv::Writer::from_writer(Vec::new());
        let lines = [&self.columns].into_iter().chain(&self.rows);
        for line in lines {
            // Writing to memory does not fail.
            let _ = writer.write_record(line);
        }
        let bytes = writer.into_inner().unwrap_or_default();
        String::from_utf8(bytes).unwrap_or_default()
    }

    /// Reads [`Self::to_csv`].
    ///
    /// # Errors
    /// [`StudyError::Read`] with the line.
    pub fn from_csv(text: &str) -> Result<Self, StudyError> {
        let fail = |e: csv::Error| StudyError::Read {
            path: "CSV".into(),
            reason: e.to_string(),
        };
        let texts = |r: &csv::StringRecord| r.iter().map(str::to_owned).collect::<Vec<_>>();
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let columns = texts(reader.headers().map_err(fail)?);
        let rows = reader.records().map(|r| r.map(|r| texts(&r)));
        let rows = rows.collect::<Result<_, _>>().map_err(fail)?;
        Ok(Self { columns, rows })
    }

    /// A cell by its column's name.
    pub fn get(&self, row: usize, column: &str) -> Option<&str> {
        let column = self.columns.iter().position(|c| c == column)?;
        self.rows.get(row)?.get(column).map(String::as_str)
    }
}

/// Names of the columns that say which run a row is, before those of the
/// settings.
fn cells(
    results: &Results,
    row: &Row,
    point: Option<usize>,
    energies: &BTreeSet<&String>,
    stages: &BTreeSet<&String>,
) -> Vec<(String, String)> {
    let mut out: Vec<(String, String)> = Vec::new();
    let mut add = |name: &str, value: String| out.push((name.to_owned(), value));
    let number = |x: Option<f64>| x.map(show).unwrap_or_default();
    let yes = |b: bool| if b { "yes" } else { "" }.to_owned();
    add("role", row.role.clone());
    for (i, key) in results.keys.iter().enumerate() {
        add(key, row.settings.get(i).cloned().unwrap_or_default());
    }
    add("status", row.status.clone());
    add("reason", row.reason.clone());
    let f = row.figures.as_ref();
    let times =
        |pick: fn(&crate::record::Figures) -> &Vec<f64>| f.map(pick).cloned().unwrap_or_default();
    let (wall, cpu) = (times(|f| &f.wall_s), times(|f| &f.cpu_s));
    add("wall_median_s", number(median(&wall)));
    add("wall_min_s", number(least(&wall)));
    add("cpu_median_s", number(median(&cpu)));
    add("cpu_min_s", number(least(&cpu)));
    add(
        "cpu_drape_median_s",
        number(median(&times(|f| &f.drape_cpu_s))),
    );
    add(
        "wall_drape_median_s",
        number(median(&times(|f| &f.drape_wall_s))),
    );
    add("repeats", wall.len().to_string());
    let v = row.distances.and_then(|d| d.vertices);
    add("mean_m", number(v.map(|v| v.mean_m)));
    add("p95_m", number(v.map(|v| v.p95_m)));
    add("max_m", number(v.map(|v| v.max_m)));
    add(
        "surface_mean_m",
        number(row.distances.map(|d| d.surface_mean_m)),
    );
    add("hausdorff_m", number(row.distances.map(|d| d.hausdorff_m)));
    add("within_floor", yes(row.within_floor));
    add(
        "on_front",
        yes(point.is_some_and(|p| results.front.contains(&p))),
    );
    let best = results.recommended.as_ref().map(|r| r.row);
    add("recommended", yes(point.is_some() && best == point));
    add("steps", number(f.map(|f| f.steps as f64)));
    add("rejected_steps", number(f.map(|f| f.rejected_steps as f64)));
    add(
        "newton_iterations",
        number(f.map(|f| f.newton_iterations as f64)),
    );
    add(
        "linear_iterations",
        number(f.map(|f| f.linear_iterations as f64)),
    );
    add("residual", number(f.map(|f| f.residual)));
    add("simulated_s", number(f.map(|f| f.simulated_s)));
    add("points", number(f.map(|f| f.points as f64)));
    add("threads", number(f.map(|f| f.threads as f64)));
    add(
        "self_intersections",
        number(f.map(|f| f.self_intersections as f64)),
    );
    add("max_penetration_m", number(f.map(|f| f.max_penetration_m)));
    add("stretch_p1", number(f.map(|f| f.stretch.p1)));
    add("stretch_p50", number(f.map(|f| f.stretch.p50)));
    add("stretch_p99", number(f.map(|f| f.stretch.p99)));
    add("stretch_max", number(f.map(|f| f.stretch.max)));
    add(
        "simulation_bytes",
        number(f.map(|f| f.simulation_bytes as f64)),
    );
    add(
        "peak_memory_bytes",
        number(f.and_then(|f| f.peak_memory_bytes).map(|b| b as f64)),
    );
    for name in energies {
        let value = row.energy_differences_j.get(*name).copied();
        add(&format!("energy difference: {name}_j"), number(value));
    }
    for name in stages {
        let value = f.and_then(|f| f.stages_s.get(*name).copied());
        add(&format!("stage: {name}_s"), number(value));
    }
    add(
        "final_state_hash",
        f.map(|f| f.final_state_hash.clone()).unwrap_or_default(),
    );
    add("hash", row.hash.clone());
    add("command", row.command.clone());
    out
}

/// The shortest text that reads back as the same number.
fn show(x: f64) -> String {
    if x == x.trunc() && x.abs() < 1e15 {
        format!("{x}")
    } else {
        format!("{x:?}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Commas, quotes, line ends and empty cells come back.
    #[test]
    fn round_trip() {
        let text = |s: &str| s.to_owned();
        let table = Table {
            columns: vec![text("a"), text("b, c"), text("d\"e")],
            rows: vec![
                vec![text(""), text("[0, -9.81, 0]"), text("line\nline")],
                vec![text("1e-7"), text("'x'"), text("")],
            ],
        };
        assert_eq!(Table::from_csv(&table.to_csv()).unwrap(), table);
        assert_eq!(table.get(1, "a"), Some("1e-7"));
        assert!(Table::from_csv("a,b\n1\n").is_err());
        let x = 0.1 + 0.2;
        assert_eq!(show(x).parse::<f64>(), Ok(x));
        assert_eq!(show(3000.0), "3000");
    }
}
