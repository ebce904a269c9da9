//! The rungs of the ladder, the list of findings, and the clean stop.

use selvedge_integrator::Simulation;

use super::finding::Place;
use super::{Answer, CUT, DUMP, Dump, Event, Scope, Trouble, Watchdog};
use crate::driver::chain;
use crate::file::model::WatchdogAnswer;
use crate::result::write_whole;

impl Watchdog {
    /// One rung up, at most to `most`; what that is called.
    pub(super) fn next_rung(&mut self, simulation: &mut Simulation, most: u8) -> Answer {
        if self.settings.answer == WatchdogAnswer::Note || self.rung >= most {
            let cut = most >= CUT && self.settings.answer == WatchdogAnswer::Ladder;
            return if cut {
                Answer::SmallerStep
            } else {
                Answer::Noted
            };
        }
        let rung = self.rung + 1;
        self.climb(simulation, rung);
        match rung {
            1 => Answer::TighterTolerance,
            2 => Answer::ProjectedCurvature,
            _ => Answer::SmallerStep,
        }
    }

    /// The points or terms changed after a step: energies cannot be compared,
    /// and the settings of the rung have to be set anew.
    pub(crate) fn changed(&mut self, simulation: &mut Simulation) {
        self.meter.reset();
        self.before = None;
        self.ladder.apply(simulation, self.rung);
    }

    pub(super) fn climb(&mut self, simulation: &mut Simulation, rung: u8) {
        self.rung = rung;
        self.calm = 0;
        self.ladder.apply(simulation, rung);
    }

    pub(super) fn note(
        &mut self,
        simulation: &Simulation,
        trouble: Trouble,
        what: String,
        dt: f64,
        place: Place,
        answer: Answer,
    ) {
        if self.events.len() >= self.settings.most_events && answer != Answer::Stopped {
            self.unlisted += 1;
            return;
        }
        self.events.push(Event {
            trouble,
            what,
            stage: self.stage.to_owned(),
            time_s: simulation.state().time,
            step: simulation.counters().steps,
            dt_s: dt,
            term: place.term,
            points: place.points,
            at: place.at,
            answer,
            dump: None,
        });
    }

    /// Writes the step down; the reason for the end, in a sentence.
    pub(super) fn stop(
        &mut self,
        simulation: &Simulation,
        trouble: Trouble,
        what: String,
        dt: f64,
        place: Place,
        scope: &Scope<'_>,
    ) -> String {
        let mut reason = what.clone();
        if let (Some(at), Some(p)) = (place.at, place.points.first()) {
            let term = place.term.as_deref().unwrap_or("no term");
            reason += &format!(
                "; point {p} at ({:.4}, {:.4}, {:.4}) m, where `{term}` pulls hardest",
                at[0], at[1], at[2]
            );
        }
        self.note(simulation, trouble, what, dt, place, Answer::Stopped);
        let Some(event) = self.events.last_mut() else {
            return reason;
        };
        let path = scope.directory.join(DUMP);
        event.dump = Some(path.display().to_string());
        let dump = Dump::new(
            scope,
            &simulation.snapshot(),
            event.clone(),
            self.rung,
            self.energy_before,
        );
        let text = serde_json::to_string_pretty(&dump).unwrap_or_default();
        match write_whole(&path, text.as_bytes()) {
            Ok(()) => reason += &format!("; the step is in {}", path.display()),
            Err(e) => {
                // The results come first, and say what is missing.
                event.dump = None;
                reason += &format!("; the step could not be written: {}", chain(&e));
            }
        }
        reason
    }
}
