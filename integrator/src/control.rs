use crate::{ControlSettings, StopSettings};

/// Step size: cut by the splitting factor on a rejection, grown by its inverse
/// after a run of accepted steps [Pizana2025, § 3.1.3].
///
/// Deviation: a step that took many iterations does not count, since a larger
/// one would be rejected, and that costs all the iterations of a step. (With a
/// folding sheet on a floor one step in seven was.)
#[derive(Clone, Debug, PartialEq)]
pub struct StepControl {
    settings: ControlSettings,
    dt: f64,
    accepted_run: usize,
    rejected_run: usize,
}

impl StepControl {
    /// Starts at `fraction` of the largest step.
    pub fn new(settings: ControlSettings, fraction: f64) -> Self {
        Self {
            settings,
            dt: settings.max_step * fraction.min(1.0),
            accepted_run: 0,
            rejected_run: 0,
        }
    }

    /// The next step to try [s].
    pub fn dt(&self) -> f64 {
        self.dt
    }

    /// Replaces the next step to try [s], within the largest step.
    pub fn set_dt(&mut self, dt: f64) {
        self.dt = dt.min(self.settings.max_step);
        self.accepted_run = 0;
    }

    /// Rejections since the last accepted step.
    pub fn rejected_run(&self) -> usize {
        self.rejected_run
    }

    /// Books an accepted step and the Newton iterations that it took.
    pub fn accept(&mut self, iterations: usize) {
        self.rejected_run = 0;
        if iterations > self.settings.recovery_iterations {
            self.accepted_run = 0;
            return;
        }
        self.accepted_run += 1;
        if self.accepted_run >= self.settings.recovery_steps {
            self.accepted_run = 0;
            self.dt = (self.dt / self.settings.splitting).min(self.settings.max_step);
        }
    }

    /// Books a rejected step; `false` when the step would fall below the
    /// smallest one.
    pub fn reject(&mut self) -> bool {
        self.accepted_run = 0;
        self.rejected_run += 1;
        self.dt *= self.settings.splitting;
        self.dt >= self.settings.min_step_fraction * self.settings.max_step
    }

    pub(crate) fn save(&self) -> Vec<f64> {
        vec![self.dt, self.accepted_run as f64, self.rejected_run as f64]
    }

    pub(crate) fn restore(&mut self, values: &[f64]) -> bool {
        let [dt, accepted, rejected] = values else {
            return false;
        };
        self.dt = *dt;
        self.accepted_run = *accepted as usize;
        self.rejected_run = *rejected as usize;
        true
    }
}

/// Detects rest: a percentile of the per-point kinetic energies stays below a
/// bound for a window of time [Pizana2025, § 5.3].
#[derive(Clone, Debug, PartialEq)]
pub struct RestDetector {
    settings: StopSettings,
    since: Option<f64>,
    last: f64,
}

impl RestDetector {
    /// Nothing seen yet.
    pub fn new(settings: StopSettings) -> Self {
        Self {
            settings,
            since: None,
            last: f64::INFINITY,
        }
    }

    /// Looks at an accepted step that ended at `time`; `free` lists the
    /// kinetic energies [J] of the points that may move. Returns whether the
    /// whole window was at rest. Nearest-rank percentile.
    pub fn observe(&mut self, time: f64, free: &mut [f64]) -> bool {
        if free.is_empty() {
            self.last = 0.0;
        } else {
            let rank = (self.settings.percentile / 100.0 * free.len() as f64).ceil() as usize;
            let index = rank.clamp(1, free.len()) - 1;
            let (_, value, _) = free.select_nth_unstable_by(index, f64::total_cmp);
            self.last = *value;
        }
        if self.last < self.settings.kinetic_energy && time >= self.settings.not_before {
            let since = *self.since.get_or_insert(time);
            self.settings.early && time - since >= self.settings.window
        } else {
            self.since = None;
            false
        }
    }

    /// Forgets the window, after a rejected step.
    pub fn reset(&mut self) {
        self.since = None;
    }

    /// The percentile at the last step seen [J].
    pub fn last(&self) -> f64 {
        self.last
    }

    pub(crate) fn save(&self) -> Vec<f64> {
        vec![self.since.unwrap_or(-1.0), self.last]
    }

    pub(crate) fn restore(&mut self, values: &[f64]) -> bool {
        let [since, last] = values else { return false };
        self.since = (*since >= 0.0).then_some(*since);
        self.last = *last;
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Splitting and recovery follow the printed rule.
    #[test]
    fn splits_and_recovers() {
        let mut c = StepControl::new(ControlSettings::default(), 1.0);
        assert!(c.reject());
        assert_eq!(c.dt(), 0.75e-3);
        for _ in 0..4 {
            c.accept(3);
            assert_eq!(c.dt(), 0.75e-3);
        }
        c.accept(1);
        assert_eq!(c.dt(), 1e-3);
    }

    /// A laborious step does not lead to a larger one.
    #[test]
    fn laborious_steps_do_not_count() {
        let mut c = StepControl::new(ControlSettings::default(), 1.0);
        c.reject();
        (0..50).for_each(|i| c.accept(if i % 5 == 4 { 4 } else { 1 }));
        assert_eq!(c.dt(), 0.75e-3);
    }

    /// Rejections end in `false` after ln(2^20) / ln(4/3) = 48.2 of them.
    #[test]
    fn underflow_is_bounded() {
        let mut c = StepControl::new(ControlSettings::default(), 1.0);
        let count = (1..).find(|_| !c.reject());
        assert_eq!(count, Some(49));
    }

    /// The nearest-rank percentile ignores the fastest hundredth.
    #[test]
    fn rest_needs_a_whole_window() {
        let mut rest = RestDetector::new(StopSettings::default());
        let still = |one: f64| {
            let mut e = vec![1e-9; 200];
            e[0] = one;
            e
        };
        assert!(!rest.observe(0.0, &mut still(1.0)));
        assert!(!rest.observe(0.05, &mut vec![1e-7; 200]));
        assert!(!rest.observe(0.06, &mut still(1.0)));
        assert!(!rest.observe(0.15, &mut still(1.0)));
        assert!(rest.observe(0.161, &mut still(1.0)));
    }
}
