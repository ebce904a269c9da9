use super::guard::Guard;
use std::ops::Range;

use selvedge_energy::EvalPoint;

use super::{BodyContact, coefficient};
use crate::friction::{AnchorState, anchor_damping};
use crate::vec3::{Vec3, add, add_outer, axpy, norm, point, scale, sub, tangential, unit};
use crate::{
    ContactResponse, Friction, FrictionAnchored, FrictionLagged, Repulsion, SurfaceSample,
};

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Candidate {
    pub body: u32,
    pub point: u32,
}

/// A friction anchor in the body's frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Anchor {
    pub of: Candidate,
    pub place: Vec3,
}

/// Scratch and results of one chunk.
#[derive(Clone, Debug, Default)]
pub(super) struct Task {
    pub positions: Vec<Vec3>,
    pub samples: Vec<SurfaceSample>,
    pub response: ContactResponse,
    pub candidates: Vec<Candidate>,
    pub guards: Vec<(u32, Guard)>,
    pub memory: Vec<Anchor>,
    pub energy: f64,
    pub deepest: f64,
    pub deep: usize,
    pub bad: Option<Candidate>,
    /// Fast arrivals and their stiffness [N/m].
    pub impacts: Vec<(Candidate, f64)>,
    /// First point that a body runs over within the step, how far, and how far
    /// it may [m].
    pub overrun: Option<(Candidate, f64, f64)>,
}

/// A touching point.
pub(super) struct Touch {
    force: Vec3,
    curvature: f64,
    energy: f64,
    /// Unit normal of the surface and size of the normal force.
    normal: Vec3,
    normal_force: f64,
    slope: Vec3,
}

pub(super) struct Pass<'a> {
    pub source: &'a BodyContact,
    pub at: &'a EvalPoint<'a>,
    pub curvature: bool,
}

impl Pass<'_> {
    fn area(&self, p: u32) -> f64 {
        self.source.areas.get(p as usize).copied().unwrap_or(1e-4)
    }

    /// Samples a chunk; remembers the first bad one.
    fn sample(&self, range: Range<usize>, task: &mut Task) {
        let all = &self.source.candidates[range];
        task.bad = None;
        task.positions.clear();
        task.positions
            .extend(all.iter().map(|c| point(self.at.q, c.point)));
        let Some(first) = all.first() else {
            return task.samples.clear();
        };
        let body = &self.source.bodies[first.body as usize];
        body.sample_many(&task.positions, self.source.time_end, &mut task.samples);
        // A body of the user's own may return too few.
        let finite = |s: &SurfaceSample| {
            s.distance.is_finite() && s.normal.iter().chain(&s.velocity).all(|c| c.is_finite())
        };
        task.bad = (0..all.len())
            .find(|i| !task.samples.get(*i).is_some_and(finite))
            .map(|i| all[i]);
    }

    fn touch(&self, c: Candidate, s: &SurfaceSample) -> Option<Touch> {
        let potential = &self.source.potential;
        if !(s.distance < potential.thickness()) {
            return None;
        }
        // A field without a slope gives no direction: no force.
        let normal = unit(s.normal)?;
        let r = match self.source.impacts.stiffness(c) {
            None => potential.evaluate(s.distance, self.area(c.point)),
            Some(k) => {
                let depth = potential.thickness() - s.distance;
                Repulsion {
                    energy: 0.5 * k * depth * depth,
                    force: k * depth,
                    curvature: k,
                }
            }
        };
        let force = scale(r.force, s.normal);
        Some(Touch {
            force,
            curvature: r.curvature,
            energy: r.energy,
            normal,
            normal_force: norm(force),
            slope: s.normal,
        })
    }

    fn coefficient(&self, c: Candidate) -> f64 {
        match self.source.coefficients.get(c.point as usize) {
            None => self.source.body_coefficients[c.body as usize],
            Some(&of_cloth) => coefficient(&*self.source.bodies[c.body as usize], of_cloth),
        }
    }

    /// Way of a point in this step relative to the surface, tangential.
    fn slid(&self, c: Candidate, s: &SurfaceSample, normal: Vec3) -> Vec3 {
        let moved = sub(point(self.at.q, c.point), point(self.at.q_start, c.point));
        tangential(axpy(moved, -self.at.dt, s.velocity), normal)
    }

    fn anchored(
        &self,
        f: &FrictionAnchored,
        c: Candidate,
        s: &SurfaceSample,
        touch: &Touch,
        anchor: Option<&Anchor>,
    ) -> (FrictionAnchored, AnchorState) {
        let source = self.source;
        let slid = self.slid(c, s, touch.normal);
        let displacement = match anchor {
            None => slid,
            Some(a) => {
                let place = source.bodies[c.body as usize].from_body(a.place, source.time_end);
                tangential(sub(point(self.at.q, c.point), place), touch.normal)
            }
        };
        let stiffness = f.stiffness_ratio * source.potential.stiffness(self.area(c.point));
        let inverse_mass = source.inverse_masses[c.point as usize];
        let state = AnchorState {
            displacement,
            velocity: scale(1.0 / self.at.dt, slid),
            normal: touch.normal,
            normal_force: touch.normal_force,
            stiffness,
            damping: anchor_damping(f.damping_ratio, stiffness, inverse_mass),
        };
        (
            FrictionAnchored {
                coefficient: self.coefficient(c),
                ..*f
            },
            state,
        )
    }

    /// Walks over a sampled chunk with the anchors of its candidates.
    fn each(
        &self,
        range: Range<usize>,
        samples: &[SurfaceSample],
        mut visit: impl FnMut(Candidate, &SurfaceSample, Option<&Anchor>),
    ) {
        let all = &self.source.candidates[range];
        let memory = &self.source.memory;
        let Some(first) = all.first() else { return };
        let mut m = memory.partition_point(|a| a.of < *first);
        for (c, s) in all.iter().zip(samples) {
            while m < memory.len() && memory[m].of < *c {
                m += 1;
            }
            visit(*c, s, memory.get(m).filter(|a| a.of == *c));
        }
    }

    pub(super) fn evaluate(&self, range: Range<usize>, task: &mut Task) {
        self.sample(range.clone(), task);
        let Task {
            samples, response, ..
        } = task;
        response.clear();
        let (mut energy, mut deepest, mut deep) = (0.0, 0.0_f64, 0);
        let thickness = self.source.potential.thickness();
        self.each(range, samples, |c, s, anchor| {
            let Some(touch) = self.touch(c, s) else {
                return;
            };
            let mut force = touch.force;
            let mut k = [[0.0; 3]; 3];
            add_outer(&mut k, touch.curvature, touch.slope);
            energy += touch.energy;
            match &self.source.friction {
                Some(Friction::Anchored(f)) => {
                    let (f, state) = self.anchored(f, c, s, &touch, anchor);
                    let answer = f.respond(&state, self.at.dt);
                    force = axpy(force, 1.0, answer.force);
                    answer.add_curvature(&state, self.at.dt, &mut k);
                    energy += answer.energy;
                }
                Some(Friction::Lagged(f)) => {
                    // The place of the anchor holds the force at the start.
                    if let Some(a) = anchor {
                        let lambda = norm(a.place);
                        let n = unit(a.place).unwrap_or(touch.normal);
                        let f = FrictionLagged {
                            coefficient: self.coefficient(c),
                            ..*f
                        };
                        let answer = f.respond(self.slid(c, s, n), n, lambda, self.at.dt);
                        force = axpy(force, 1.0, answer.force);
                        for i in 0..3 {
                            k[i] = add(k[i], answer.curvature[i]);
                        }
                        energy += answer.energy;
                    }
                }
                None => {}
            }
            response.body_nodes.push(c.point);
            response.body_force.push(force);
            if self.curvature {
                response.body_curvature.push(k);
            }
            deepest = deepest.max(thickness - s.distance);
            deep += usize::from(s.distance < -super::DEEP * thickness);
        });
        (task.energy, task.deepest, task.deep) = (energy, deepest, deep);
    }

    pub(super) fn remember(&self, range: Range<usize>, task: &mut Task) {
        self.sample(range.clone(), task);
        let Task {
            samples, memory, ..
        } = task;
        memory.clear();
        let Some(friction) = &self.source.friction else {
            return;
        };
        self.each(range, samples, |c, s, anchor| {
            let Some(touch) = self.touch(c, s) else {
                return;
            };
            let place = match friction {
                Friction::Lagged(_) => touch.force,
                Friction::Anchored(f) => {
                    let (f, state) = self.anchored(f, c, s, &touch, anchor);
                    let answer = f.respond(&state, self.at.dt);
                    match anchor {
                        Some(a) if !answer.slipping => a.place,
                        _ => {
                            let place = sub(point(self.at.q, c.point), answer.displacement);
                            let body = &self.source.bodies[c.body as usize];
                            body.to_body(place, self.source.time_end)
                        }
                    }
                }
            };
            memory.push(Anchor { of: c, place });
        });
    }
}
