use selvedge_energy::EvalPoint;

use super::pass::{Anchor, Pass};
use super::{BodyContact, BodyContactSettings, Guard, NAME, bad_sample, history, run_over};
use crate::source::{ContactSource, StepStart, check_point, check_step, in_order};
use crate::{CollisionError, ContactResponse, SurfaceSample};

impl ContactSource for BodyContact {
    fn name(&self) -> &str {
        NAME
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
            Some((c, depth, limit)) => {
                let body = &*self.bodies[c.body as usize];
                Err(run_over(body, c.point, depth, limit))
            }
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
        let before = out.body_nodes.len();
        let (mut energy, mut deepest, mut deep, mut bad) = (0.0, 0.0_f64, 0, None);
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
                deep += task.deep;
                bad = bad.or(task.bad);
            },
        );
        self.tasks = tasks;
        self.active = out.body_nodes.len() - before;
        (self.deepest, self.deep) = (deepest, deep);
        match bad {
            Some(c) => Err(bad_sample(&*self.bodies[c.body as usize], c.point)),
            None => Ok(energy),
        }
    }

    fn covers(&self, at: &EvalPoint<'_>) -> bool {
        self.envelope.contains(at, self.points.iter().copied())
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
        history::to_numbers(&self.memory)
    }

    fn restore_history(&mut self, history: &[f64]) -> Result<(), CollisionError> {
        self.memory = history::from_numbers(history, [self.bodies.len(), self.point_count])?;
        Ok(())
    }

    fn heap_bytes(&self) -> usize {
        let tasks: usize = self
            .tasks
            .iter()
            .map(|t| {
                t.response.heap_bytes()
                    + 24 * t.positions.capacity()
                    + size_of::<SurfaceSample>() * t.samples.capacity()
                    + 8 * t.candidates.capacity()
                    + size_of::<Anchor>() * t.memory.capacity()
            })
            .sum();
        4 * self.points.capacity()
            + 8 * (self.inverse_masses.capacity() + self.areas.capacity() + self.masses.capacity())
            + self.impacts.heap_bytes()
            + 8 * (self.coefficients.capacity() + self.body_coefficients.capacity())
            + 8 * self.candidates.capacity()
            + 16 * self.ranges.capacity()
            + size_of::<Anchor>() * (self.memory.capacity() + self.spare.capacity())
            + self.envelope.heap_bytes()
            + self
                .guards
                .iter()
                .map(|g| size_of::<Guard>() * g.capacity())
                .sum::<usize>()
            + tasks
    }
}
