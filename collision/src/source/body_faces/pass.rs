use std::ops::Range;

use selvedge_energy::EvalPoint;

use super::deepest::{Face, Place, blend};
use super::{BodyFaces, Candidate};
use crate::friction::{AnchorState, anchor_damping};
use crate::source::body_contact::{Guard, coefficient};
use crate::vec3::{Vec3, add_outer, axpy, norm, point, scale, sub, tangential, unit};
use crate::{
    ContactResponse, Friction, FrictionAnchored, FrictionLagged, Repulsion, SurfaceSample,
};

/// Thicknesses below which a deepest point and a corner are equally deep: more
/// than the round-off of distances.
const SAME: f64 = 1e-6;

/// What friction remembers of a touching triangle: a point of it, and a place in
/// the body's frame (anchored) or the force in the last step (lagged) \[N\].
#[derive(Clone, Copy, Debug)]
pub(super) struct Anchor {
    pub of: [u32; 2],
    pub weights: Vec3,
    pub place: Vec3,
}

/// Results of one chunk.
#[derive(Clone, Debug, Default)]
pub(super) struct Task {
    pub response: ContactResponse,
    pub memory: Vec<Anchor>,
    pub candidates: Vec<Candidate>,
    pub guards: Vec<(u32, Guard)>,
    pub energy: f64,
    pub deepest: f64,
    pub active: usize,
    pub bad: Option<[u32; 2]>,
    /// Fast arrivals and their stiffness [N/m].
    pub impacts: Vec<([u32; 2], f64)>,
    /// First triangle that a body runs over within the step, how far, and how
    /// far it may \[m\].
    pub overrun: Option<([u32; 2], f64, f64)>,
}

impl Task {
    /// Forgets what a search found.
    pub(super) fn begin_search(&mut self) {
        self.candidates.clear();
        self.guards.clear();
        self.impacts.clear();
        self.overrun = None;
    }

    pub(super) fn heap_bytes(&self) -> usize {
        self.response.heap_bytes()
            + size_of::<Anchor>() * self.memory.capacity()
            + size_of::<Candidate>() * self.candidates.capacity()
            + size_of::<(u32, Guard)>() * self.guards.capacity()
            + size_of::<([u32; 2], f64)>() * self.impacts.capacity()
    }
}

/// A triangle whose deepest point is not a corner.
struct Touch {
    place: Place,
    nodes: [u32; 3],
    slope: Vec3,
    /// Unit normal, and the normal force less what the lowest corner has \[N\].
    normal: Vec3,
    normal_force: f64,
    repulsion: Repulsion,
    /// The lowest corner where it is near enough, its energy and its force.
    corner: Option<(u32, f64, Vec3)>,
}

pub(super) struct Pass<'a> {
    pub source: &'a BodyFaces,
    pub at: &'a EvalPoint<'a>,
    pub curvature: bool,
}

impl Pass<'_> {
    fn area(&self, triangle: u32) -> f64 {
        let areas = &self.source.areas;
        areas.get(triangle as usize).copied().unwrap_or(1e-4)
    }

    /// How a candidate touches; a triangle whose distance is not finite is an
    /// error.
    fn touch(&self, c: &Candidate) -> Result<Option<Touch>, ()> {
        let source = self.source;
        let nodes = source.triangles[c.of[1] as usize];
        let face = Face {
            body: &*source.bodies[c.of[0] as usize],
            time: source.time_end,
            x: nodes.map(|n| point(self.at.q, n)),
        };
        let place = face.descend(c.weights);
        let SurfaceSample {
            distance,
            normal,
            velocity,
        } = place.sample;
        if !(distance.is_finite() && normal.iter().chain(&velocity).all(|c| c.is_finite())) {
            return Err(());
        }
        let thickness = source.potential.thickness();
        if distance >= thickness || place.is_corner() {
            return Ok(None);
        }
        let (corner, of_corner) = face.lowest_corner();
        if !(of_corner.distance - distance > SAME * thickness) {
            return Ok(None);
        }
        let slope = face.slope(&place);
        // Where the field gives no way out of the body, as on the axis of a
        // needle that is through, there is no force.
        let Some(normal) = unit(slope) else {
            return Ok(None);
        };
        let area = self.area(c.of[1]);
        let repel = |distance: f64| match source.impacts.stiffness(c.of) {
            None => source.potential.evaluate(distance, area),
            Some(k) => {
                let depth = thickness - distance;
                Repulsion {
                    energy: 0.5 * k * depth * depth,
                    force: k * depth,
                    curvature: k,
                }
            }
        };
        let repulsion = repel(distance);
        let mut normal_force = repulsion.force * norm(slope);
        let corner = (of_corner.distance < thickness).then(|| {
            let r = repel(of_corner.distance);
            normal_force -= r.force * norm(of_corner.normal);
            let force = scale(-r.force, of_corner.normal);
            (nodes[corner], r.energy, force)
        });
        Ok(Some(Touch {
            place,
            nodes,
            slope,
            normal,
            normal_force: normal_force.max(0.0),
            repulsion,
            corner,
        }))
    }

    fn coefficient(&self, body: u32, touch: &Touch) -> f64 {
        let source = self.source;
        if source.coefficients.is_empty() {
            return source.body_coefficients[body as usize];
        }
        let of_nodes = touch.nodes.map(|n| source.coefficients[n as usize]);
        let of_cloth = (0..3).map(|i| touch.place.weights[i] * of_nodes[i]).sum();
        coefficient(&*source.bodies[body as usize], of_cloth)
    }

    /// Way of a point of a triangle in this step relative to the surface,
    /// across `normal`.
    fn slid(&self, touch: &Touch, weights: Vec3, normal: Vec3) -> Vec3 {
        let at = |q: &[f64]| blend(weights, &touch.nodes.map(|n| point(q, n)));
        let moved = sub(at(self.at.q), at(self.at.q_start));
        let carried = scale(self.at.dt, touch.place.sample.velocity);
        tangential(sub(moved, carried), normal)
    }

    fn anchored(
        &self,
        f: &FrictionAnchored,
        body: u32,
        area: f64,
        touch: &Touch,
        anchor: Option<&Anchor>,
    ) -> (FrictionAnchored, AnchorState) {
        let source = self.source;
        let slid = self.slid(touch, touch.place.weights, touch.normal);
        let displacement = match anchor {
            None => slid,
            Some(a) => {
                let from = source.bodies[body as usize].from_body(a.place, source.time_end);
                let x = touch.nodes.map(|n| point(self.at.q, n));
                tangential(sub(blend(a.weights, &x), from), touch.normal)
            }
        };
        let stiffness = f.stiffness_ratio * source.potential.stiffness(area);
        let of_node = |i: usize| {
            touch.place.weights[i].powi(2) * source.inverse_masses[touch.nodes[i] as usize]
        };
        let inverse_mass = (0..3).map(of_node).sum();
        let state = AnchorState {
            displacement,
            velocity: scale(1.0 / self.at.dt, slid),
            normal: touch.normal,
            normal_force: touch.normal_force,
            stiffness,
            damping: anchor_damping(f.damping_ratio, stiffness, inverse_mass),
        };
        let coefficient = self.coefficient(body, touch);
        (FrictionAnchored { coefficient, ..*f }, state)
    }

    /// Walks over touching candidates with their anchors; remembers the first
    /// bad one.
    fn each(
        &self,
        range: Range<usize>,
        bad: &mut Option<[u32; 2]>,
        mut visit: impl FnMut([u32; 2], &Touch, Option<&Anchor>),
    ) {
        let all = &self.source.candidates[range];
        let memory = &self.source.memory;
        *bad = None;
        let Some(first) = all.first() else { return };
        let mut m = memory.partition_point(|a| a.of < first.of);
        for c in all {
            while m < memory.len() && memory[m].of < c.of {
                m += 1;
            }
            match self.touch(c) {
                Ok(Some(touch)) => visit(c.of, &touch, memory.get(m).filter(|a| a.of == c.of)),
                Ok(None) => {}
                Err(()) => *bad = bad.or(Some(c.of)),
            }
        }
    }

    pub(super) fn evaluate(&self, range: Range<usize>, task: &mut Task) {
        let Task { response, bad, .. } = task;
        response.clear();
        let (mut energy, mut deepest, mut active) = (0.0, 0.0_f64, 0);
        let thickness = self.source.potential.thickness();
        self.each(range, bad, |of, touch, anchor| {
            let mut force = scale(touch.repulsion.force, touch.slope);
            let mut k = [[0.0; 3]; 3];
            add_outer(&mut k, touch.repulsion.curvature, touch.slope);
            energy += touch.repulsion.energy;
            match &self.source.friction {
                Some(Friction::Anchored(f)) => {
                    let area = self.area(of[1]);
                    let (f, state) = self.anchored(f, of[0], area, touch, anchor);
                    let answer = f.respond(&state, self.at.dt);
                    force = axpy(force, 1.0, answer.force);
                    answer.add_curvature(&state, self.at.dt, &mut k);
                    energy += answer.energy;
                }
                Some(Friction::Lagged(f)) => {
                    if let Some(a) = anchor {
                        let n = unit(a.place).unwrap_or(touch.normal);
                        let coefficient = self.coefficient(of[0], touch);
                        let f = FrictionLagged { coefficient, ..*f };
                        let slid = self.slid(touch, a.weights, n);
                        let answer = f.respond(slid, n, norm(a.place), self.at.dt);
                        energy += answer.energy;
                        push(response, touch.nodes, a.weights, answer.force);
                        if self.curvature {
                            response.curvature.push(answer.curvature);
                        }
                    }
                }
                None => {}
            }
            push(response, touch.nodes, touch.place.weights, force);
            if self.curvature {
                response.curvature.push(k);
            }
            if let Some((node, of_corner, pull)) = touch.corner {
                energy -= of_corner;
                response.body_nodes.push(node);
                response.body_force.push(pull);
                if self.curvature {
                    // Its second derivative is negative: left out.
                    response.body_curvature.push([[0.0; 3]; 3]);
                }
            }
            deepest = deepest.max(thickness - touch.place.sample.distance);
            active += 1;
        });
        (task.energy, task.deepest, task.active) = (energy, deepest, active);
    }

    pub(super) fn remember(&self, range: Range<usize>, task: &mut Task) {
        let Task { memory, bad, .. } = task;
        memory.clear();
        let Some(friction) = &self.source.friction else {
            return;
        };
        self.each(range, bad, |of, touch, anchor| {
            let weights = touch.place.weights;
            let kept = match friction {
                Friction::Lagged(_) => {
                    let place = scale(touch.normal_force, touch.normal);
                    Anchor { of, weights, place }
                }
                Friction::Anchored(f) => {
                    let (f, state) = self.anchored(f, of[0], self.area(of[1]), touch, anchor);
                    let answer = f.respond(&state, self.at.dt);
                    match anchor {
                        Some(a) if !answer.slipping => *a,
                        _ => {
                            let x = touch.nodes.map(|n| point(self.at.q, n));
                            let place = sub(blend(weights, &x), answer.displacement);
                            let body = &self.source.bodies[of[0] as usize];
                            let place = body.to_body(place, self.source.time_end);
                            Anchor { of, weights, place }
                        }
                    }
                }
            };
            memory.push(kept);
        });
    }
}

fn push(response: &mut ContactResponse, nodes: [u32; 3], weights: Vec3, force: Vec3) {
    let [a, b, c] = nodes;
    response.nodes.push([a, b, c, c]);
    response
        .weights
        .push([weights[0], weights[1], weights[2], 0.0]);
    response.force.push(force);
}
