//! Points that may come near a body within a step.

use super::pass::{Candidate, Task};
use super::{Answer, Arrival, BodyContact, BodyContactSettings, DEEP, Guard, foreseen_depth};
use crate::Aabb;
use crate::source::{CHUNK, StepStart, in_order};
use crate::vec3::{norm, point, sub};

/// A point that a body runs over, how far, and how far it may \[m\].
type Overrun = (Candidate, f64, f64);

impl BodyContact {
    /// Replaces the candidates and adds fast arrivals; returns the first point
    /// that a body runs over.
    pub(super) fn search(
        &mut self,
        step: &StepStart<'_>,
        impacts: &mut Vec<(Candidate, f64)>,
    ) -> Option<Overrun> {
        let BodyContactSettings {
            margin, steepness, ..
        } = self.settings;
        let reach = self.potential.thickness() + margin;
        let mut tasks = std::mem::take(&mut self.tasks);
        let mut candidates = std::mem::take(&mut self.candidates);
        let mut guards = std::mem::take(&mut self.guards);
        candidates.clear();
        let mut fresh = Vec::new();
        let limit = DEEP * self.potential.thickness();
        let mut overrun = None;
        for (body, b) in self.bodies.iter().enumerate() {
            let bounds = b.bounds(self.time_end).inflate(reach);
            let body = body as u32;
            let end = self.envelope.end();
            let predicted = step.q_predicted;
            let points = &self.points;
            let time = self.time_end;
            let near = self.potential.thickness();
            let (masses, areas, potential) = (&self.masses, &self.areas, &self.potential);
            let known = guards
                .get(body as usize)
                .filter(|g| g.len() == self.point_count)
                .map(Vec::as_slice);
            in_order(
                points.len().div_ceil(CHUNK),
                &mut tasks,
                |i, task: &mut Task| {
                    task.candidates.clear();
                    task.positions.clear();
                    task.guards.clear();
                    task.impacts.clear();
                    task.overrun = None;
                    for &point_ in &points[i * CHUNK..((i + 1) * CHUNK).min(points.len())] {
                        let (x, y) = (point(step.q_start, point_), point(end, point_));
                        let way = norm(sub(y, x)) + margin;
                        if known.is_some_and(|g| {
                            g[point_ as usize].distance(x, steepness) > near + steepness * way
                        }) {
                            continue;
                        }
                        if bounds.overlaps(&Aabb::of_points(&[x, y])) {
                            task.candidates.push(Candidate {
                                body,
                                point: point_,
                            });
                            task.positions.push(x);
                        }
                    }
                    b.sample_many(&task.positions, time, &mut task.samples);
                    for (c, s) in task.candidates.iter().zip(&task.samples) {
                        let (x, y) = (point(step.q_start, c.point), point(predicted, c.point));
                        let way = sub(y, x);
                        let mut too_deep =
                            foreseen_depth(s, way, step.dt, limit).map(|depth| (depth, limit));
                        if let Some(&mass) = masses.get(c.point as usize) {
                            let area = areas.get(c.point as usize).copied().unwrap_or(1e-4);
                            let capacity = potential.evaluate(-limit, area).energy;
                            let arrival = Arrival::new(s, way, step.dt);
                            match arrival.answer(mass, step.dt, near, limit, capacity) {
                                Some(Answer::Refuse { depth, limit }) => {
                                    too_deep = too_deep.or(Some((depth, limit)));
                                }
                                Some(Answer::Stop(k)) if k > potential.stiffness(area) => {
                                    task.impacts.push((*c, k));
                                }
                                _ => {}
                            }
                        }
                        if let Some((depth, limit)) = too_deep
                            && task.overrun.is_none()
                        {
                            task.overrun = Some((*c, depth, limit));
                        }
                    }
                    // Keep what the field cannot rule out, and what it cannot tell.
                    let mut k = 0;
                    let samples = &task.samples;
                    if known.is_some() {
                        let all = task.candidates.iter().zip(&task.positions).zip(samples);
                        task.guards
                            .extend(all.map(|((c, x), s)| (c.point, Guard::new(*x, s))));
                    }
                    task.candidates.retain(|c| {
                        let (x, y) = (point(step.q_start, c.point), point(end, c.point));
                        let way = norm(sub(y, x)) + margin;
                        let far = samples
                            .get(k)
                            .is_some_and(|s| s.distance > near + steepness * way);
                        k += 1;
                        !far
                    });
                },
                |task| {
                    candidates.append(&mut task.candidates);
                    fresh.append(&mut task.guards);
                    impacts.append(&mut task.impacts);
                    overrun = overrun.or(task.overrun);
                },
            );
            for (point, g) in fresh.drain(..) {
                guards[body as usize][point as usize] = g;
            }
        }
        self.guards = guards;
        self.candidates = candidates;
        self.tasks = tasks;
        self.split();
        overrun
    }

    /// Splits the candidates into tasks of one body each.
    fn split(&mut self) {
        self.ranges.clear();
        let mut from = 0;
        for run in self.candidates.chunk_by(|a, b| a.body == b.body) {
            let end = from + run.len();
            while from < end {
                let to = (from + CHUNK).min(end);
                self.ranges.push(from..to);
                from = to;
            }
        }
    }
}
