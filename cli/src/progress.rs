//! How a run tells where it stands.

use std::io::{self, IsTerminal, Write};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use selvedge_scene::driver::{Progress, Tick};

use crate::output::{complain, say};

/// Steps between two events of `--json`, in wall time.
const JSON_INTERVAL: Duration = Duration::from_millis(500);

/// Wall time between two lines where there is no terminal.
const LINE_INTERVAL: Duration = Duration::from_secs(30);

/// A bar on a terminal, JSON lines when asked for, now and then a plain line
/// otherwise.
pub struct Reporter {
    bar: Option<ProgressBar>,
    lines: Option<Lines>,
    json: bool,
    stage: String,
    started: Instant,
    /// Simulated time at `started`: a resumed run does not begin at zero.
    from: f64,
    told: Option<Instant>,
}

/// Plain lines at an interval of wall time.
struct Lines {
    out: Box<dyn Write + Send>,
    interval: Duration,
    last: Instant,
}

impl Lines {
    fn tell(&mut self, t: &Tick<'_>, rate: f64, left: f64) {
        if self.last.elapsed() < self.interval {
            return;
        }
        self.last = Instant::now();
        // There is nowhere left to say that it failed.
        let _ = writeln!(
            self.out,
            "{}: t = {:.3} s of {:.3} s, {} steps ({} rejected), {rate:.2e} s/s, {} left",
            t.stage,
            t.time,
            t.end,
            t.steps,
            t.rejected,
            duration(left)
        );
    }
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
        let lines = (!json && bar.is_none()).then(|| Lines {
            out: Box::new(io::stderr()),
            interval: LINE_INTERVAL,
            last: Instant::now(),
        });
        Self {
            bar,
            lines,
            json,
            stage: String::new(),
            started: Instant::now(),
            from: 0.0,
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
            self.from = t.time;
            self.told = None;
        }
        let spent = self.started.elapsed().as_secs_f64();
        let done = t.time - self.from;
        let rate = if spent > 0.0 { done / spent } else { 0.0 };
        let left = if rate > 0.0 {
            (t.end - t.time) / rate
        } else {
            f64::INFINITY
        };
        if let Some(lines) = &mut self.lines {
            lines.tell(t, rate, left);
        }
        if let Some(bar) = &self.bar {
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

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use super::*;

    #[derive(Clone, Default)]
    struct Shared(Arc<Mutex<Vec<u8>>>);

    impl Write for Shared {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.lock().unwrap().write(bytes)
        }
        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    /// What two ticks of a stage leave at an interval.
    fn lines(interval: Duration) -> Vec<String> {
        let out = Shared::default();
        let mut reporter = Reporter::new(false);
        reporter.bar = None;
        reporter.lines = Some(Lines {
            out: Box::new(out.clone()),
            interval,
            last: Instant::now(),
        });
        for time in [2.0, 2.5] {
            reporter.tick(&Tick {
                stage: "drape",
                time,
                end: 3.0,
                dt: 0.5,
                steps: 7,
                rejected: 1,
                residual: 0.0,
                contacts: 0,
                rest_energy: 0.0,
            });
        }
        let text = out.0.lock().unwrap().clone();
        let text = String::from_utf8(text).unwrap();
        text.lines().map(str::to_owned).collect()
    }

    /// Lines come at the interval, with stage, time and a rate that counts
    /// from where the run began.
    #[test]
    fn plain_lines() {
        let all = lines(Duration::ZERO);
        assert_eq!(all.len(), 2, "{all:?}");
        assert!(all[0].starts_with("drape: t = 2.000 s of 3.000 s, 7 steps (1 rejected), "));
        assert!(all[0].ends_with(" 0.00e0 s/s, ? left"), "{all:?}");
        assert!(
            all[1].contains("t = 2.500 s") && !all[1].contains('?'),
            "{all:?}"
        );
        assert!(lines(LINE_INTERVAL).is_empty());
    }
}
