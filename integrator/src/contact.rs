use std::time::Instant;

use selvedge_collision::{ContactResponse, ContactSource, StepStart};
use selvedge_energy::EvalPoint;

use crate::{Ledger, StepError};

/// Detections in one step before it is given up.
const MAX_DETECTIONS: usize = 3;

/// All contact sources of a plan during one step.
#[derive(Default)]
pub(crate) struct Contacts {
    pub(crate) response: ContactResponse,
    detections: usize,
}

impl Contacts {
    pub(crate) fn begin_step(
        &mut self,
        sources: &mut [Box<dyn ContactSource>],
        start: &StepStart<'_>,
        ledger: &mut Ledger,
    ) -> Result<(), StepError> {
        self.detections = 0;
        self.detect(sources, start, ledger)
    }

    /// Finds the candidates again for points that moved beyond the margin.
    pub(crate) fn detect(
        &mut self,
        sources: &mut [Box<dyn ContactSource>],
        start: &StepStart<'_>,
        ledger: &mut Ledger,
    ) -> Result<(), StepError> {
        if self.detections == MAX_DETECTIONS {
            return Err(StepError::ContactMargin {
                tries: self.detections,
            });
        }
        self.detections += 1;
        for source in sources {
            let clock = Instant::now();
            let found = source.detect(start);
            ledger.time_term("detection", source.name(), clock.elapsed());
            found?;
        }
        Ok(())
    }

    /// Evaluates all contacts and adds `dt · force` to `impulse`; returns the
    /// contact energy [J].
    pub(crate) fn add_impulse(
        &mut self,
        sources: &mut [Box<dyn ContactSource>],
        at: &EvalPoint<'_>,
        curvature: bool,
        impulse: &mut [f64],
        ledger: &mut Ledger,
    ) -> Result<f64, StepError> {
        let r = &mut self.response;
        r.clear();
        let mut energy = 0.0;
        if sources.is_empty() {
            return Ok(energy);
        }
        for source in sources {
            let clock = Instant::now();
            let evaluated = source.evaluate(at, curvature, r);
            ledger.time_term("contact", source.name(), clock.elapsed());
            energy += evaluated?;
        }
        let clock = Instant::now();
        let (impulse, _) = impulse.as_chunks_mut::<3>();
        for ((nodes, weights), force) in r.nodes.iter().zip(&r.weights).zip(&r.force) {
            for (&n, &w) in nodes.iter().zip(weights) {
                if w != 0.0 {
                    add(&mut impulse[n as usize], w * at.dt, force);
                }
            }
        }
        for (&n, force) in r.body_nodes.iter().zip(&r.body_force) {
            add(&mut impulse[n as usize], at.dt, force);
        }
        ledger.book("contact: scatter", clock.elapsed());
        Ok(energy)
    }
}

#[inline]
fn add(to: &mut [f64; 3], factor: f64, v: &[f64; 3]) {
    for i in 0..3 {
        to[i] += factor * v[i];
    }
}
