//! Elements that may come near a body within a step.

use super::element::{Element, Overrun, Task};
use super::impact::{Answer, Arrival};
use super::limits::{DEEP, foreseen_depth};
use super::{AgainstBodies, BodyElement, BodyPair, Guard};
use crate::source::{CHUNK, StepStart, in_order};
use crate::vec3::Vec3;
use crate::{Aabb, Body, SurfaceSample};

/// A detection beside one body.
pub struct Search<'a, E: Element> {
    pub source: &'a AgainstBodies<E>,
    pub step: &'a StepStart<'a>,
    pub index: u32,
    pub body: &'a dyn Body,
    /// Box of the body and of all that may touch it.
    pub bounds: Aabb,
    /// What is known of the distances of elements, where the body is still.
    pub guards: Option<&'a [Guard]>,
}

impl<E: BodyElement> AgainstBodies<E> {
    /// Replaces the candidates and adds fast arrivals; returns the first element
    /// that a body runs over.
    pub(super) fn search(
        &mut self,
        step: &StepStart<'_>,
        impacts: &mut Vec<(BodyPair, f64)>,
    ) -> Option<Overrun> {
        let mut tasks = std::mem::take(&mut self.tasks);
        let mut candidates = std::mem::take(&mut self.candidates);
        candidates.clear();
        let (mut fresh, mut overrun) = (Vec::new(), None);
        let count = self.element.searched();
        for index in 0..self.bodies.len() {
            let body = &*self.bodies[index];
            let reach = self.potential.thickness() + self.settings.margin;
            let guards = self.guards.get(index).filter(|g| !g.is_empty());
            let look = Search {
                source: &*self,
                step,
                index: index as u32,
                body,
                bounds: body.bounds(self.time_end).inflate(reach),
                guards: guards.map(Vec::as_slice),
            };
            in_order(
                count.div_ceil(CHUNK),
                &mut tasks,
                |i, task: &mut Task<_, _>| {
                    task.begin_search();
                    E::search(&look, CHUNK * i..(CHUNK * (i + 1)).min(count), task);
                },
                |task| {
                    candidates.append(&mut task.candidates);
                    fresh.append(&mut task.guards);
                    impacts.append(&mut task.impacts);
                    overrun = overrun.or(task.overrun);
                },
            );
            for (element, guard) in fresh.drain(..) {
                self.guards[index][element as usize] = guard;
            }
        }
        self.tasks = tasks;
        self.candidates = candidates;
        self.split();
        overrun
    }

    /// Splits the candidates into tasks.
    fn split(&mut self) {
        self.ranges.clear();
        let mut from = 0;
        let together = |a: BodyPair, b: BodyPair| !E::ONE_BODY || a.body == b.body;
        for run in self.candidates.chunk_by(|a, b| together(a.of, b.of)) {
            let end = from + run.len();
            while from < end {
                let to = (from + E::CHUNK).min(end);
                self.ranges.push(from..to);
                from = to;
            }
        }
    }
}

impl<E: BodyElement> Search<'_, E> {
    pub fn pair(&self, element: u32) -> BodyPair {
        BodyPair {
            body: self.index,
            element,
        }
    }

    /// Notes whether the body runs over an element, or is met by it too fast:
    /// `s` is the sample of the point of the element that is nearest, which
    /// moves by `way` \[m\] and has the mass \[kg\]; without one it is not
    /// stopped.
    pub fn foresee(
        &self,
        of: BodyPair,
        s: &SurfaceSample,
        way: Vec3,
        mass: Option<f64>,
        task: &mut Task<E::Weights, E::Scratch>,
    ) {
        let (potential, dt) = (&self.source.potential, self.step.dt);
        let thickness = potential.thickness();
        let deep = DEEP * thickness;
        let mut too_deep = foreseen_depth(s, way, dt, deep).map(|depth| (depth, deep));
        if let Some(mass) = mass {
            let area = self.source.area(of.element);
            let capacity = potential.evaluate(-deep, area).energy;
            let arrival = Arrival::new(s, way, dt);
            match arrival.answer(mass, dt, thickness, deep, capacity) {
                Some(Answer::Refuse { depth, limit }) => {
                    too_deep = too_deep.or(Some((depth, limit)));
                }
                Some(Answer::Stop(k)) if k > potential.stiffness(area) => {
                    task.impacts.push((of, k));
                }
                _ => {}
            }
        }
        if let Some((depth, limit)) = too_deep
            && task.overrun.is_none()
        {
            task.overrun = Some(Overrun { of, depth, limit });
        }
    }
}
