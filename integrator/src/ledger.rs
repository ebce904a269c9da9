use std::time::{Duration, Instant};

/// Wall time by stage and term.
#[derive(Clone, Debug, Default)]
pub struct Ledger {
    entries: Vec<LedgerEntry>,
}

/// One row of a [`Ledger`].
#[derive(Clone, Debug)]
pub struct LedgerEntry {
    /// Stage, for example "detection", "assembly: membrane", "solve".
    pub name: String,
    /// Wall time spent.
    pub time: Duration,
    /// Number of calls.
    pub calls: u64,
}

impl Ledger {
    /// Runs `work` and books its time.
    pub fn time<R>(&mut self, name: &str, work: impl FnOnce() -> R) -> R {
        let start = Instant::now();
        let result = work();
        self.book(name, start.elapsed());
        result
    }

    /// Books time spent elsewhere.
    pub fn book(&mut self, name: &str, time: Duration) {
        match self.entries.iter_mut().find(|e| e.name == name) {
            Some(entry) => {
                entry.time += time;
                entry.calls += 1;
            }
            None => self.entries.push(LedgerEntry {
                name: name.into(),
                time,
                calls: 1,
            }),
        }
    }

    /// Books time of one term within a stage, as "stage: term".
    pub fn time_term(&mut self, stage: &str, term: &str, time: Duration) {
        let matches = |name: &str| {
            name.strip_prefix(stage)
                .and_then(|rest| rest.strip_prefix(": "))
                == Some(term)
        };
        match self.entries.iter_mut().find(|e| matches(&e.name)) {
            Some(entry) => {
                entry.time += time;
                entry.calls += 1;
            }
            None => self.book(&format!("{stage}: {term}"), time),
        }
    }

    /// All rows in the order of their first booking.
    pub fn entries(&self) -> &[LedgerEntry] {
        &self.entries
    }

    /// Seconds of one row, zero where there is none.
    pub fn seconds(&self, name: &str) -> f64 {
        self.entries
            .iter()
            .find(|e| e.name == name)
            .map_or(0.0, |e| e.time.as_secs_f64())
    }

    /// Adds the rows of another ledger.
    pub fn merge(&mut self, other: &Ledger) {
        for e in &other.entries {
            match self.entries.iter_mut().find(|mine| mine.name == e.name) {
                Some(mine) => {
                    mine.time += e.time;
                    mine.calls += e.calls;
                }
                None => self.entries.push(e.clone()),
            }
        }
    }
}
