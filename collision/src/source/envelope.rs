use selvedge_energy::EvalPoint;

use crate::CollisionError;
use crate::proximity::check_positions;
use crate::source::StepStart;

/// Where detection assumes every point to stay: within `slack` of the box
/// spanned by its start and a somewhat overshot prediction of its end.
#[derive(Clone, Debug, Default)]
pub(crate) struct Envelope {
    end: Vec<f64>,
    slack: f64,
}

impl Envelope {
    pub(crate) fn set(
        &mut self,
        points: usize,
        step: &StepStart<'_>,
        overshoot: f64,
        slack: f64,
    ) -> Result<(), CollisionError> {
        check_positions(points, step.q_start)?;
        check_positions(points, step.q_predicted)?;
        self.slack = slack;
        self.end.clear();
        let ends = step.q_start.iter().zip(step.q_predicted);
        self.end.extend(
            ends.take(3 * points)
                .map(|(a, b)| a + (1.0 + overshoot) * (b - a)),
        );
        Ok(())
    }

    /// The overshot ends.
    pub(crate) fn end(&self) -> &[f64] {
        &self.end
    }

    /// Whether some points are all inside.
    pub(crate) fn contains(&self, at: &EvalPoint<'_>, points: impl Iterator<Item = u32>) -> bool {
        let limit = self.slack * self.slack;
        for p in points {
            let mut outside = 0.0;
            for k in 3 * p as usize..3 * p as usize + 3 {
                let (a, b, q) = (at.q_start[k], self.end[k], at.q[k]);
                let d = q - q.clamp(a.min(b), a.max(b));
                outside += d * d;
            }
            // False for NaN too.
            if !(outside <= limit) {
                return false;
            }
        }
        true
    }

    pub(crate) fn heap_bytes(&self) -> usize {
        8 * self.end.capacity()
    }
}
