//! Triangles that may come near a body within a step.

use super::deepest::{Face, blend};
use super::pass::Task;
use super::{BodyFaces, CHUNK, Candidate, DEEP};
use crate::Aabb;
use crate::source::StepStart;
use crate::source::body_contact::{Answer, Arrival, Guard, foreseen_depth};
use crate::source::in_order;
use crate::vec3::{norm, point, sub};

/// A triangle that a body runs over, how far, and how far it may \[m\].
type Overrun = ([u32; 2], f64, f64);

impl BodyFaces {
    /// Adds the candidates of one body and its fast arrivals; returns the first
    /// triangle that it runs over.
    pub(super) fn search(
        &mut self,
        body: usize,
        step: &StepStart<'_>,
        impacts: &mut Vec<([u32; 2], f64)>,
    ) -> Option<Overrun> {
        let mut tasks = std::mem::take(&mut self.tasks);
        let mut candidates = std::mem::take(&mut self.candidates);
        let mut fresh = Vec::new();
        let mut overrun = None;
        let (count, source) = (self.triangles.len(), &*self);
        in_order(
            count.div_ceil(8 * CHUNK),
            &mut tasks,
            |i, task: &mut Task| {
                task.begin_search();
                for t in 8 * CHUNK * i..(8 * CHUNK * (i + 1)).min(count) {
                    source.look_at(body, t, step, task);
                }
            },
            |task| {
                candidates.append(&mut task.candidates);
                fresh.append(&mut task.guards);
                impacts.append(&mut task.impacts);
                overrun = overrun.or(task.overrun);
            },
        );
        for (triangle, guard) in fresh {
            self.guards[body][triangle as usize] = guard;
        }
        self.tasks = tasks;
        self.candidates = candidates;
        overrun
    }

    fn look_at(&self, index: usize, triangle: usize, step: &StepStart<'_>, task: &mut Task) {
        let steepness = self.settings.steepness;
        let thickness = self.potential.thickness();
        let (body, end) = (&*self.bodies[index], self.envelope.end());
        let nodes = self.triangles[triangle];
        let x = nodes.map(|n| point(step.q_start, n));
        let y = nodes.map(|n| point(end, n));
        let way = (0..3).map(|i| norm(sub(y[i], x[i]))).fold(0.0, f64::max);
        let way = steepness * (way + self.settings.margin);
        let middle = blend([1.0 / 3.0; 3], &x);
        let radius = x.iter().map(|x| norm(sub(*x, middle))).fold(0.0, f64::max);
        let far = thickness + way + steepness * radius;
        let guards = self.guards.get(index).filter(|g| !g.is_empty());
        if guards.is_some_and(|g| g[triangle].distance(middle, steepness) > far) {
            return;
        }
        let bounds = body.bounds(self.time_end);
        let bounds = bounds.inflate(thickness + self.settings.margin);
        if !bounds.overlaps(&Aabb::of_points(x.iter().chain(&y))) {
            return;
        }
        let face = Face {
            body,
            time: self.time_end,
            x,
        };
        if guards.is_some() {
            let sample = face.at([1.0 / 3.0; 3]).sample;
            task.guards
                .push((triangle as u32, Guard::new(middle, &sample)));
            if sample.distance > far {
                return;
            }
        }
        let limit = thickness + way;
        let Some(weights) = face.search(limit, steepness, 2.0 * thickness) else {
            return;
        };
        let place = face.descend(weights);
        // The lowest place of all, where there is but one.
        if body.is_convex() && place.sample.distance > limit {
            return;
        }
        let of = [index as u32, triangle as u32];
        task.candidates.push(Candidate {
            of,
            weights: place.weights,
        });
        // A corner's arrival is the point's own.
        if place.is_corner() {
            return;
        }
        let predicted = nodes.map(|n| point(step.q_predicted, n));
        let moved = sub(blend(place.weights, &predicted), blend(place.weights, &x));
        let deep = DEEP * thickness;
        let mut too_deep = foreseen_depth(&place.sample, moved, step.dt, deep).map(|d| (d, deep));
        if !self.masses.is_empty() {
            let area = self.areas.get(triangle).copied().unwrap_or(1e-4);
            let capacity = self.potential.evaluate(-deep, area).energy;
            let inverse = |i: usize| place.weights[i].powi(2) / self.masses[nodes[i] as usize];
            let mass = 1.0 / (0..3).map(inverse).sum::<f64>();
            let arrival = Arrival::new(&place.sample, moved, step.dt);
            match arrival.answer(mass, step.dt, thickness, deep, capacity) {
                Some(Answer::Refuse { depth, limit }) => {
                    too_deep = too_deep.or(Some((depth, limit)));
                }
                Some(Answer::Stop(k)) if k > self.potential.stiffness(area) => {
                    task.impacts.push((of, k));
                }
                _ => {}
            }
        }
        task.overrun = task
            .overrun
            .or(too_deep.map(|(depth, limit)| (of, depth, limit)));
    }
}
