//! How a run tells where it stands.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use selvedge_scene::driver::{Progress, Tick};

use crate::output::{complain, say};

/// Steps between two events of `--json`, in wall time.
const JSON_INTERVAL: Duration = Duration::from_millis(500);

/// A bar on a terminal, JSON lines when asked for, silence otherwise.
pub struct Reporter {
    bar: Option<ProgressBar>,
    json: bool,
    stage: String,
    started: Instant,
    told: Option<Instant>,
}

impl Reporter {
    /// Decides by the terminal and the command line.
    pub fn new(json: bool) -> Self {
        let bar = (!json && std::io::stderr().is_terminal()).then(|| {
            let style = "{msg}\n{bar:40} {pos:>3} %  {prefix}";
            let bar = ProgressBar::new(100);
            // The template is a constant; the default style would do as well.
            if let Ok(style) = ProgressStyle::with_template(style) {
                bar.set_style(style);
            }
            bar
        });
        Self {
            bar,
            json,
            stage: String::new(),
            started: Instant::now(),
            told: None,
        }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

impl Progress for Reporter {
    fn tick(&mut self, t: &Tick<'_>) {
        if self.stage != t.stage {
            self.stage = t.stage.to_owned();
            self.started = Instant::now();
            self.told = None;
        }
        if let Some(bar) = &self.bar {
            let spent = self.started.elapsed().as_secs_f64();
            let rate = if spent > 0.0 { t.time / spent } else { 0.0 };
            let left = if rate > 0.0 {
                (t.end - t.time) / rate
            } else {
                f64::INFINITY
            };
            bar.set_position((100.0 * t.time / t.end.max(f64::MIN_POSITIVE)) as u64);
            bar.set_message(format!(
                "{}: t = {:.3} s of {:.3} s, step {:.3} ms, {} steps ({} rejected)",
                t.stage,
                t.time,
                t.end,
                1e3 * t.dt,
                t.steps,
                t.rejected
            ));
            bar.set_prefix(format!(
                "{:.3} s/s, {} left, residual {:.1e}, {} contacts, rest {:.1e} J",
                rate,
                duration(left),
                t.residual,
                t.contacts,
                t.rest_energy
            ));
        }
        if self.json && self.told.is_none_or(|at| at.elapsed() >= JSON_INTERVAL) {
            self.told = Some(Instant::now());
            let event = serde_json::json!({
                "event": "progress",
                "stage": t.stage,
                "time_s": t.time,
                "end_s": t.end,
                "dt_s": t.dt,
                "steps": t.steps,
                "rejected_steps": t.rejected,
                "residual": t.residual,
                "contacts": t.contacts,
            });
            // Nobody listens any more: the run goes on.
            let _ = say!("{event}");
        }
    }

    fn note(&mut self, text: &str) {
        match &self.bar {
            Some(bar) => bar.println(text),
            None if self.json => {
                let _ = say!("{}", serde_json::json!({ "event": "note", "text": text }));
            }
            None => complain(format_args!("{text}")),
        }
    }
}

fn duration(seconds: f64) -> String {
    if !seconds.is_finite() {
        return "?".to_owned();
    }
    let s = seconds.round() as u64;
    if s >= 3600 {
        format!("{} h {:02} min", s / 3600, s / 60 % 60)
    } else if s >= 60 {
        format!("{} min {:02} s", s / 60, s % 60)
    } else {
        format!("{s} s")
    }
}
