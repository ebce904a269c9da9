use std::ops::Range;

use selvedge_energy::EvalPoint;

use super::element::{Anchor, AnchorOf, BodyPair, NotFinite, Task, TaskOf, Touch};
use super::friction::BodyFriction;
use super::limits::DEEP;
use super::{AgainstBodies, BodyElement};
use crate::friction::{AnchorState, anchor_damping};
use crate::vec3::{Vec3, add_outer, axpy, norm, scale, sub, tangential, unit};
use crate::{Friction, FrictionAnchored, FrictionLagged, LaggedResponse, Repulsion};

/// Cloth against bodies at one point of evaluation.
pub struct Pass<'a, E: BodyElement> {
    pub source: &'a AgainstBodies<E>,
    pub at: &'a EvalPoint<'a>,
    pub curvature: bool,
}

impl<E: BodyElement> Pass<'_, E> {
    /// Repulsion at a distance below the thickness; that of fast arrivals stops
    /// them.
    #[inline]
    pub fn repel(&self, of: BodyPair, distance: f64) -> Repulsion {
        let (source, potential) = (self.source, &self.source.potential);
        match source.impacts.stiffness(of) {
            None => potential.evaluate(distance, source.area(of.element)),
            Some(k) => {
                let depth = potential.thickness() - distance;
                Repulsion {
                    energy: 0.5 * k * depth * depth,
                    force: k * depth,
                    curvature: k,
                }
            }
        }
    }

    pub(super) fn evaluate(&self, range: Range<usize>, task: &mut TaskOf<E>) {
        let Task {
            scratch,
            response,
            bad,
            ..
        } = task;
        response.clear();
        let (mut energy, mut deepest, mut active, mut deep) = (0.0, 0.0_f64, 0, 0);
        let thickness = self.source.potential.thickness();
        self.each(range, scratch, bad, |touch, anchor| {
            let mut force = scale(touch.repulsion.force, touch.slope);
            let mut k = [[0.0; 3]; 3];
            add_outer(&mut k, touch.repulsion.curvature, touch.slope);
            energy += touch.repulsion.energy;
            let mut lagged = None;
            if let Some(friction) = &self.source.friction {
                match friction.model {
                    Friction::Anchored(f) => {
                        let (f, state) = self.anchored(f, friction, touch, anchor);
                        let answer = f.respond(&state, self.at.dt);
                        force = axpy(force, 1.0, answer.force);
                        answer.add_curvature(&state, self.at.dt, &mut k);
                        energy += answer.energy;
                    }
                    Friction::Lagged(f) => {
                        lagged = anchor.map(|a| (a.weights, self.lagged(f, friction, touch, a)));
                        energy += lagged.map_or(0.0, |(_, answer)| answer.energy);
                    }
                }
            }
            let k = self.curvature.then_some(k);
            self.source.element.push(touch, force, k, lagged, response);
            if let Some((node, of_corner, pull)) = touch.corner {
                energy -= of_corner;
                response.body_nodes.push(node);
                response.body_force.push(pull);
                if self.curvature {
                    // Its second derivative is negative: left out.
                    response.body_curvature.push([[0.0; 3]; 3]);
                }
            }
            deepest = deepest.max(thickness - touch.distance);
            deep += usize::from(touch.distance < -DEEP * thickness);
            active += 1;
        });
        (task.energy, task.deepest) = (energy, deepest);
        (task.active, task.deep) = (active, deep);
    }

    pub(super) fn remember(&self, range: Range<usize>, task: &mut TaskOf<E>) {
        let Task {
            scratch,
            memory,
            bad,
            ..
        } = task;
        memory.clear();
        let source = self.source;
        let Some(friction) = &source.friction else {
            return;
        };
        self.each(range, scratch, bad, |touch, anchor| {
            let Touch { of, weights, .. } = *touch;
            let place = match friction.model {
                Friction::Lagged(_) => touch.pressing,
                Friction::Anchored(f) => {
                    let (f, state) = self.anchored(f, friction, touch, anchor);
                    let answer = f.respond(&state, self.at.dt);
                    if let Some(a) = anchor
                        && !answer.slipping
                    {
                        return memory.push(*a);
                    }
                    let x = source.element.position(of.element, &weights, self.at.q);
                    let place = sub(x, answer.displacement);
                    source.bodies[of.body as usize].to_body(place, source.time_end)
                }
            };
            memory.push(Anchor { of, weights, place });
        });
    }

    /// Walks over touching candidates with their anchors; remembers the first
    /// that has no distance.
    #[inline]
    fn each(
        &self,
        range: Range<usize>,
        scratch: &mut E::Scratch,
        bad: &mut Option<BodyPair>,
        mut visit: impl FnMut(&Touch<E::Weights>, Option<&AnchorOf<E>>),
    ) {
        let all = &self.source.candidates[range];
        let memory = &self.source.memory;
        *bad = None;
        let Some(first) = all.first() else { return };
        E::prepare(self, all, scratch);
        let mut m = memory.partition_point(|a| a.of < first.of);
        for (i, c) in all.iter().enumerate() {
            while m < memory.len() && memory[m].of < c.of {
                m += 1;
            }
            match E::touch(self, c, i, scratch) {
                Ok(Some(touch)) => visit(&touch, memory.get(m).filter(|a| a.of == c.of)),
                Ok(None) => {}
                Err(NotFinite) => *bad = bad.or(Some(c.of)),
            }
        }
    }

    /// Way of a point of an element in this step relative to the surface, across
    /// `normal`.
    fn slid(&self, touch: &Touch<E::Weights>, weights: &E::Weights, normal: Vec3) -> Vec3 {
        let place = |q| self.source.element.position(touch.of.element, weights, q);
        let moved = sub(place(self.at.q), place(self.at.q_start));
        tangential(axpy(moved, -self.at.dt, touch.velocity), normal)
    }

    fn coefficient(&self, friction: &BodyFriction, touch: &Touch<E::Weights>) -> f64 {
        let Touch { of, weights, .. } = touch;
        friction.coefficient(&self.source.bodies, of.body, |of_points| {
            self.source.element.mean(of.element, weights, of_points)
        })
    }

    /// Lagged friction, with the normal force that the anchor holds.
    fn lagged(
        &self,
        f: FrictionLagged,
        friction: &BodyFriction,
        touch: &Touch<E::Weights>,
        anchor: &AnchorOf<E>,
    ) -> LaggedResponse {
        let n = unit(anchor.place).unwrap_or(touch.normal);
        let coefficient = self.coefficient(friction, touch);
        let slid = self.slid(touch, &anchor.weights, n);
        let f = FrictionLagged { coefficient, ..f };
        f.respond(slid, n, norm(anchor.place), self.at.dt)
    }

    fn anchored(
        &self,
        f: FrictionAnchored,
        friction: &BodyFriction,
        touch: &Touch<E::Weights>,
        anchor: Option<&AnchorOf<E>>,
    ) -> (FrictionAnchored, AnchorState) {
        let source = self.source;
        let (of, element) = (touch.of, &source.element);
        let slid = self.slid(touch, &touch.weights, touch.normal);
        let displacement = match anchor {
            None => slid,
            Some(a) => {
                let place = source.bodies[of.body as usize].from_body(a.place, source.time_end);
                let x = element.position(of.element, &a.weights, self.at.q);
                tangential(sub(x, place), touch.normal)
            }
        };
        let stiffness = f.stiffness_ratio * source.potential.stiffness(source.area(of.element));
        let masses = &friction.inverse_masses;
        let inverse_mass = element.inverse_mass(of.element, &touch.weights, masses);
        let state = AnchorState {
            displacement,
            velocity: scale(1.0 / self.at.dt, slid),
            normal: touch.normal,
            normal_force: touch.normal_force,
            stiffness,
            damping: anchor_damping(f.damping_ratio, stiffness, inverse_mass),
        };
        let coefficient = self.coefficient(friction, touch);
        (FrictionAnchored { coefficient, ..f }, state)
    }
}
