use std::ops::Range;

use selvedge_energy::EvalPoint;

use super::element::{AnchorOf, CandidateOf, Overrun, TaskOf};
use super::friction::BodyFriction;
use super::{AgainstBodies, BodyContactSettings, BodyElement, Guard, Pass, anchor};
use crate::source::{ContactSource, StepStart, check_point, check_step, in_order};
use crate::{CollisionError, ContactResponse};

impl<E: BodyElement> ContactSource for AgainstBodies<E> {
    fn name(&self) -> &str {
        E::NAME
    }

    fn detect(&mut self, step: &StepStart<'_>) -> Result<(), CollisionError> {
        check_step(step.dt)?;
        let BodyContactSettings {
            margin, overshoot, ..
        } = self.settings;
        self.envelope
            .set(self.point_count, step, overshoot, margin)?;
        self.time_end = step.time + step.dt;
        let mut impacts = Vec::new();
        let overrun = self.search(step, &mut impacts);
        self.impacts.update(step.time, step.dt, &mut impacts);
        match overrun {
            Some(Overrun { of, depth, limit }) => Err(CollisionError::Overrun {
                body: self.bodies[of.body as usize].name().into(),
                point: self.element.first_point(of.element),
                depth,
                limit,
            }),
            None => Ok(()),
        }
    }

    fn evaluate(
        &mut self,
        at: &EvalPoint<'_>,
        curvature: bool,
        out: &mut ContactResponse,
    ) -> Result<f64, CollisionError> {
        check_point(at, self.point_count)?;
        let mut tasks = std::mem::take(&mut self.tasks);
        let (mut energy, mut deepest, mut bad) = (0.0, 0.0_f64, None);
        let (mut active, mut deep) = (0, 0);
        let ranges = &self.ranges;
        let pass = Pass {
            source: self,
            at,
            curvature,
        };
        in_order(
            ranges.len(),
            &mut tasks,
            |i, task| pass.evaluate(ranges[i].clone(), task),
            |task| {
                out.extend(&task.response);
                energy += task.energy;
                deepest = deepest.max(task.deepest);
                active += task.active;
                deep += task.deep;
                bad = bad.or(task.bad);
            },
        );
        self.tasks = tasks;
        (self.active, self.deep, self.deepest) = (active, deep, deepest);
        match bad {
            Some(of) => Err(CollisionError::NotFiniteSample {
                body: self.bodies[of.body as usize].name().into(),
                point: self.element.first_point(of.element),
            }),
            None => Ok(energy),
        }
    }

    fn covers(&self, at: &EvalPoint<'_>) -> bool {
        self.envelope.contains(at, self.element.points())
    }

    fn commit(&mut self, at: &EvalPoint<'_>) {
        if self.friction.is_none() || check_point(at, self.point_count).is_err() {
            return;
        }
        let mut tasks = std::mem::take(&mut self.tasks);
        let mut memory = std::mem::take(&mut self.spare);
        memory.clear();
        let ranges = &self.ranges;
        let pass = Pass {
            source: self,
            at,
            curvature: false,
        };
        in_order(
            ranges.len(),
            &mut tasks,
            |i, task| pass.remember(ranges[i].clone(), task),
            |task| memory.append(&mut task.memory),
        );
        self.spare = std::mem::replace(&mut self.memory, memory);
        self.tasks = tasks;
    }

    fn active(&self) -> usize {
        self.active
    }

    fn max_penetration(&self) -> f64 {
        self.deepest
    }

    fn candidates(&self) -> usize {
        self.candidates.len()
    }

    fn history(&self) -> Vec<f64> {
        anchor::to_numbers(&self.memory)
    }

    fn restore_history(&mut self, history: &[f64]) -> Result<(), CollisionError> {
        let limits = [self.bodies.len(), self.element.total()];
        self.memory = anchor::from_numbers(E::NAME, history, limits)?;
        Ok(())
    }

    fn heap_bytes(&self) -> usize {
        let guards: usize = self.guards.iter().map(Vec::capacity).sum();
        let task = |t: &TaskOf<E>| E::scratch_bytes(&t.scratch) + t.heap_bytes();
        self.element.heap_bytes()
            + 8 * (self.areas.capacity() + self.masses.capacity())
            + self.friction.as_ref().map_or(0, BodyFriction::heap_bytes)
            + self.impacts.heap_bytes()
            + self.envelope.heap_bytes()
            + size_of::<Guard>() * guards
            + size_of::<CandidateOf<E>>() * self.candidates.capacity()
            + size_of::<Range<usize>>() * self.ranges.capacity()
            + size_of::<AnchorOf<E>>() * (self.memory.capacity() + self.spare.capacity())
            + self.tasks.iter().map(task).sum::<usize>()
    }
}
