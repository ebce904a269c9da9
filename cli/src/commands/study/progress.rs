//! How a study tells where it stands.

use std::io::IsTerminal;
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use indicatif::ProgressBar;
use selvedge_scene::driver::Tick;
use selvedge_study::{Clock, Ending, Entry, Job, Observer, Results, Watch, median};

use crate::Failure;
use crate::output::{complain, say};

/// Wall time between two updates of the line at the bottom.
const INTERVAL: Duration = Duration::from_millis(200);

/// A line for every run, and on a terminal one at the bottom for the run at
/// hand.
pub struct Lines {
    json: bool,
    bar: Option<ProgressBar>,
    last: Mutex<Instant>,
}

impl Lines {
    pub fn new(json: bool) -> Self {
        let bar = (!json && std::io::stderr().is_terminal()).then(ProgressBar::no_length);
        if let Some(bar) = &bar
            && let Ok(style) = indicatif::ProgressStyle::with_template("{msg}")
        {
            bar.set_style(style);
        }
        let last = Mutex::new(Instant::now());
        Self { json, bar, last }
    }

    /// Takes the bottom line away.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }

    fn line(&self, text: &str) {
        match &self.bar {
            Some(bar) => bar.println(text),
            None => complain(format_args!("{text}")),
        }
    }
}

impl Observer for Lines {
    fn begins(&self, number: usize, count: usize, job: &Job) {
        if let Some(bar) = &self.bar {
            bar.set_message(format!("[{number}/{count}] {} …", job.label));
        }
    }

    fn ended(&self, number: usize, count: usize, job: &Job, entry: &Entry) {
        let f = &entry.figures;
        if self.json {
            let event = serde_json::json!({ "event": "run", "number": number, "runs": count, "label": job.label, "hash": entry.hash, "status": f.status, "reason": f.reason, "wall_s": f.wall_s, "cpu_s": f.cpu_s });
            // Nobody listens any more: the study goes on.
            let _ = say!("{event}");
            return;
        }
        let what = match f.status {
            Ending::Failed => format!("failed: {}", f.reason),
            _ => {
                let seconds = |t: &[f64]| median(t).map_or("?".to_owned(), |t| format!("{t:.2} s"));
                let (wall, cpu) = (seconds(&f.wall_s), seconds(&f.cpu_s));
                format!(
                    "{}, {wall} (processor {cpu}), {} steps",
                    f.status.name(),
                    f.steps
                )
            }
        };
        self.line(&format!("[{number}/{count}] {}: {what}", job.label));
    }

    fn note(&self, text: &str) {
        if self.json {
            let _ = say!("{}", serde_json::json!({ "event": "note", "text": text }));
        } else {
            self.line(text);
        }
    }
}

impl Watch for Lines {
    fn tick(&self, job: &Job, tick: &Tick<'_>) {
        let Some(bar) = &self.bar else { return };
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if last.elapsed() >= INTERVAL {
            *last = Instant::now();
            bar.set_message(format!(
                "{}: t = {:.3} s of {:.3} s, {} steps ({} rejected)",
                job.label, tick.time, tick.end, tick.steps, tick.rejected
            ));
        }
    }
}

/// The end of a study in a few lines.
pub fn tell(results: &Results, folder: &Path, json: bool) -> Result<(), Failure> {
    let failed = results.rows.iter().filter(|r| r.status == "failed").count();
    let missing = results.missing();
    let best = results.recommended.as_ref();
    if json {
        let settings = best.map(|b| &results.rows[b.row].settings);
        return say!(
            "{}",
            serde_json::json!({ "event": "study", "folder": folder.display().to_string(), "points": results.rows.len(), "failed": failed, "missing": missing, "floor": results.floor, "recommended": settings, "keys": results.keys })
        );
    }
    say!(
        "{}: {} points, {failed} failed, {missing} missing",
        results.name,
        results.rows.len()
    )?;
    if let Some(floor) = results.floor {
        say!(
            "  repeatability floor: mean {:.3e} mm, Hausdorff {:.3e} mm, from {} runs",
            1e3 * floor.mean_m,
            1e3 * floor.hausdorff_m,
            floor.runs
        )?;
    }
    if let Some(best) = best {
        let row = &results.rows[best.row];
        let settings = results.keys.iter().zip(&row.settings);
        let settings: Vec<String> = settings.map(|(k, v)| format!("{k}={v}")).collect();
        say!("  recommended: {}", settings.join(" "))?;
        let clock = match results.time {
            Clock::Wall => "wall",
            Clock::Cpu => "processor",
        };
        say!(
            "    {:.3e} mm from the reference in {:.2} s of {clock} time ({})",
            1e3 * row.error(results.measure).unwrap_or(f64::NAN),
            row.seconds(results.time).unwrap_or(f64::NAN),
            best.reason
        )?;
    }
    say!("  results in {}", folder.display())?;
    if missing > 0 {
        let runs = results.floor_runs.iter().chain(&results.rows);
        for row in runs.filter(|r| r.figures.is_none()).take(5) {
            complain(format_args!("missing: {}", row.command));
        }
        complain(format_args!(
            "{missing} runs are missing: run their parts again with --resume, then --collect"
        ));
    }
    Ok(())
}
