use std::ops::Range;
use std::sync::Arc;

use selvedge_energy::EvalPoint;

use super::envelope::Envelope;
use super::self_contact::inverse_masses;
use super::{CHUNK, ContactSource, StepStart, check_margin, check_step, in_order};
use crate::friction::{AnchorState, anchor_damping};
use crate::vec3::{Vec3, add_outer, axpy, norm, point, scale, sub, tangential, unit};
use crate::{
    Aabb, Body, CollisionError, ContactPotential, ContactQuadratic, ContactResponse, Friction,
    FrictionAnchored, FrictionLagged, SurfaceSample,
};

/// How far detection looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyContactSettings {
    /// Room beyond the predicted motion of a point [m].
    pub margin: f64,
    /// Fraction by which the predicted motion is overshot [1].
    pub overshoot: f64,
    /// Largest slope of a body's distance field [1]. Points whose distance
    /// exceeds their possible way times this are left out of a step; 1 for
    /// exact distances, more for interpolated ones.
    pub steepness: f64,
}

impl Default for BodyContactSettings {
    fn default() -> Self {
        Self {
            margin: 1e-3,
            overshoot: 0.25,
            steepness: 1.5,
        }
    }
}

/// Points of cloth against bodies.
///
/// ```text
/// E = Σ E_c(φ(x)),   f = -E_c'(φ) ∇φ,   K = E_c'' ∇φ ∇φᵀ
/// ```
/// `φ` is the distance in the pose at the end of the step. The curvature is
/// the Gauss-Newton part, without `∇²φ`. Friction acts in the plane across
/// `∇φ`, on the velocity relative to the surface; its anchors are kept in the
/// body's own frame and move with it. A body may bring its own friction
/// coefficient.
pub struct BodyContact {
    bodies: Vec<Arc<dyn Body>>,
    points: Vec<u32>,
    point_count: usize,
    potential: Box<dyn ContactPotential>,
    friction: Option<Friction>,
    inverse_masses: Vec<f64>,
    areas: Vec<f64>,
    settings: BodyContactSettings,
    envelope: Envelope,
    time_end: f64,
    candidates: Vec<Candidate>,
    memory: Vec<Anchor>,
    spare: Vec<Anchor>,
    tasks: Vec<Task>,
    active: usize,
    deep: usize,
    deepest: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Candidate {
    body: u32,
    point: u32,
}

/// A friction anchor in the body's frame.
#[derive(Clone, Copy, Debug)]
struct Anchor {
    of: Candidate,
    place: Vec3,
}

/// Scratch and results of one chunk.
#[derive(Clone, Debug, Default)]
struct Task {
    positions: Vec<Vec3>,
    samples: Vec<SurfaceSample>,
    response: ContactResponse,
    candidates: Vec<Candidate>,
    memory: Vec<Anchor>,
    energy: f64,
    deepest: f64,
    deep: usize,
    bad: Option<Candidate>,
}

impl BodyContact {
    /// Contact of all of `points` points without friction, with the quadratic
    /// penalty of [`ContactQuadratic::body`].
    pub fn new(points: usize, bodies: Vec<Arc<dyn Body>>) -> Self {
        Self {
            bodies,
            points: (0..points as u32).collect(),
            point_count: points,
            potential: Box::new(ContactQuadratic::body()),
            friction: None,
            inverse_masses: Vec::new(),
            areas: Vec::new(),
            settings: BodyContactSettings::default(),
            envelope: Envelope::default(),
            time_end: 0.0,
            candidates: Vec::new(),
            memory: Vec::new(),
            spare: Vec::new(),
            tasks: Vec::new(),
            active: 0,
            deep: 0,
            deepest: 0.0,
        }
    }

    /// Only some points touch bodies: leave out those pinned to one.
    ///
    /// # Errors
    /// [`CollisionError::PointOutOfRange`].
    pub fn with_points(mut self, mut points: Vec<u32>) -> Result<Self, CollisionError> {
        points.sort_unstable();
        points.dedup();
        let count = self.point_count;
        if let Some(index) = points.iter().position(|p| *p as usize >= count) {
            let (what, point) = ("body contact", points[index]);
            return Err(CollisionError::PointOutOfRange {
                what,
                index,
                point,
                points: count,
            });
        }
        self.points = points;
        Ok(self)
    }

    /// Another potential. One whose stiffness is per area needs
    /// [`with_areas`](Self::with_areas).
    #[must_use]
    pub fn with_potential(mut self, potential: Box<dyn ContactPotential>) -> Self {
        self.potential = potential;
        self
    }

    /// Rest areas of all points [m²], for a stiffness per area; without them
    /// every point counts as 1 cm².
    ///
    /// # Errors
    /// [`CollisionError::Length`].
    pub fn with_areas(mut self, areas: Vec<f64>) -> Result<Self, CollisionError> {
        if areas.len() != self.point_count {
            let (found, expected) = (areas.len(), self.point_count);
            return Err(CollisionError::Length {
                what: "areas",
                found,
                expected,
            });
        }
        self.areas = areas;
        Ok(self)
    }

    /// Adds friction. `masses` of all points [kg] set the damping of anchors.
    ///
    /// # Errors
    /// [`CollisionError::Parameter`] for a bad parameter,
    /// [`CollisionError::Length`] for too few masses.
    pub fn with_friction(
        mut self,
        friction: Friction,
        masses: &[f64],
    ) -> Result<Self, CollisionError> {
        friction.validate()?;
        if masses.len() != self.point_count {
            let (found, expected) = (masses.len(), self.point_count);
            return Err(CollisionError::Length {
                what: "masses",
                found,
                expected,
            });
        }
        self.inverse_masses = inverse_masses(masses);
        self.friction = Some(friction);
        Ok(self)
    }

    /// Other settings.
    ///
    /// # Errors
    /// [`CollisionError::Parameter`] for a negative or infinite value, or a
    /// steepness below one.
    pub fn with_settings(mut self, settings: BodyContactSettings) -> Result<Self, CollisionError> {
        check_margin(settings.margin, settings.overshoot)?;
        if !(settings.steepness >= 1.0 && settings.steepness.is_finite()) {
            return Err(CollisionError::Parameter {
                name: "steepness",
                value: settings.steepness,
                requirement: "finite and at least 1",
            });
        }
        self.settings = settings;
        Ok(self)
    }

    /// The bodies.
    pub fn bodies(&self) -> &[Arc<dyn Body>] {
        &self.bodies
    }

    /// Points deeper than three thicknesses inside a body in the last
    /// evaluation. There the nearest surface may be the wrong one.
    pub fn deep_points(&self) -> usize {
        self.deep
    }

    fn area(&self, p: u32) -> f64 {
        self.areas.get(p as usize).copied().unwrap_or(1e-4)
    }

    /// Tasks of `CHUNK` candidates of one body each: first candidate and count.
    fn ranges(&self) -> Vec<Range<usize>> {
        let mut out = Vec::with_capacity(self.candidates.len() / CHUNK + self.bodies.len());
        let mut from = 0;
        for run in self.candidates.chunk_by(|a, b| a.body == b.body) {
            let end = from + run.len();
            while from < end {
                let to = (from + CHUNK).min(end);
                out.push(from..to);
                from = to;
            }
        }
        out
    }

    /// Samples a chunk at `q`; remembers the first bad one.
    fn sample(&self, range: Range<usize>, q: &[f64], task: &mut Task) {
        let all = &self.candidates[range];
        task.bad = None;
        task.positions.clear();
        task.positions.extend(all.iter().map(|c| point(q, c.point)));
        let Some(first) = all.first() else {
            return task.samples.clear();
        };
        let body = &self.bodies[first.body as usize];
        body.sample_many(&task.positions, self.time_end, &mut task.samples);
        // A body of the user's own may return too few.
        let finite = |s: &SurfaceSample| {
            s.distance.is_finite() && s.normal.iter().chain(&s.velocity).all(|c| c.is_finite())
        };
        task.bad = (0..all.len())
            .find(|i| !task.samples.get(*i).is_some_and(finite))
            .map(|i| all[i]);
    }

    fn bad_sample(&self, c: Candidate) -> CollisionError {
        let body = self.bodies[c.body as usize].name().into();
        CollisionError::NotFiniteSample {
            body,
            point: c.point,
        }
    }
}

/// A touching point.
struct Touch {
    force: Vec3,
    curvature: f64,
    energy: f64,
    /// Unit normal of the surface and size of the normal force.
    normal: Vec3,
    normal_force: f64,
    slope: Vec3,
}

struct Pass<'a> {
    source: &'a BodyContact,
    at: &'a EvalPoint<'a>,
    curvature: bool,
}

impl Pass<'_> {
    fn touch(&self, c: Candidate, s: &SurfaceSample) -> Option<Touch> {
        let potential = &self.source.potential;
        if !(s.distance < potential.thickness()) {
            return None;
        }
        // A field without a slope gives no direction: no force.
        let normal = unit(s.normal)?;
        let r = potential.evaluate(s.distance, self.source.area(c.point));
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

    fn coefficient(&self, c: Candidate, of_cloth: f64) -> f64 {
        self.source.bodies[c.body as usize]
            .friction()
            .unwrap_or(of_cloth)
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
        let stiffness = f.stiffness_ratio * source.potential.stiffness(source.area(c.point));
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
                coefficient: self.coefficient(c, f.coefficient),
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

    fn evaluate(&self, range: Range<usize>, task: &mut Task) {
        self.source.sample(range.clone(), self.at.q, task);
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
                            coefficient: self.coefficient(c, f.coefficient),
                            ..*f
                        };
                        let answer = f.respond(self.slid(c, s, n), n, lambda, self.at.dt);
                        force = axpy(force, 1.0, answer.force);
                        for i in 0..3 {
                            k[i] = crate::vec3::add(k[i], answer.curvature[i]);
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
            deep += usize::from(s.distance < -3.0 * thickness);
        });
        (task.energy, task.deepest, task.deep) = (energy, deepest, deep);
    }

    fn remember(&self, range: Range<usize>, task: &mut Task) {
        self.source.sample(range.clone(), self.at.q, task);
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

impl ContactSource for BodyContact {
    fn name(&self) -> &str {
        "body-contact"
    }

    fn detect(&mut self, step: &StepStart<'_>) -> Result<(), CollisionError> {
        check_step(step.dt)?;
        let BodyContactSettings {
            margin,
            overshoot,
            steepness,
        } = self.settings;
        self.envelope
            .set(self.point_count, step, overshoot, margin)?;
        self.time_end = step.time + step.dt;
        let reach = self.potential.thickness() + margin;
        let mut tasks = std::mem::take(&mut self.tasks);
        let mut candidates = std::mem::take(&mut self.candidates);
        candidates.clear();
        for (body, b) in self.bodies.iter().enumerate() {
            let bounds = b.bounds(self.time_end).inflate(reach);
            let body = body as u32;
            let end = self.envelope.end();
            let points = &self.points;
            let time = self.time_end;
            in_order(
                points.len().div_ceil(CHUNK),
                &mut tasks,
                |i, task: &mut Task| {
                    task.candidates.clear();
                    task.positions.clear();
                    for &point_ in &points[i * CHUNK..((i + 1) * CHUNK).min(points.len())] {
                        let (x, y) = (point(step.q_start, point_), point(end, point_));
                        if bounds.overlaps(&Aabb::of_points(&[x, y])) {
                            task.candidates.push(Candidate {
                                body,
                                point: point_,
                            });
                            task.positions.push(x);
                        }
                    }
                    b.sample_many(&task.positions, time, &mut task.samples);
                    // Keep what the field cannot rule out, and what it cannot tell.
                    let mut k = 0;
                    let samples = &task.samples;
                    task.candidates.retain(|c| {
                        let (x, y) = (point(step.q_start, c.point), point(end, c.point));
                        let way = norm(sub(y, x)) + margin;
                        let far = samples.get(k).is_some_and(|s| {
                            s.distance > self.potential.thickness() + steepness * way
                        });
                        k += 1;
                        !far
                    });
                },
                |task| candidates.append(&mut task.candidates),
            );
        }
        self.candidates = candidates;
        self.tasks = tasks;
        Ok(())
    }

    fn evaluate(
        &mut self,
        at: &EvalPoint<'_>,
        curvature: bool,
        out: &mut ContactResponse,
    ) -> Result<f64, CollisionError> {
        let (found, expected) = (at.q.len().min(at.q_start.len()), 3 * self.point_count);
        if found < expected {
            return Err(CollisionError::Length {
                what: "positions",
                found,
                expected,
            });
        }
        let mut tasks = std::mem::take(&mut self.tasks);
        let before = out.body_nodes.len();
        let (mut energy, mut deepest, mut deep, mut bad) = (0.0, 0.0_f64, 0, None);
        let ranges = self.ranges();
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
            Some(c) => Err(self.bad_sample(c)),
            None => Ok(energy),
        }
    }

    fn covers(&self, at: &EvalPoint<'_>) -> bool {
        self.envelope.contains(at, self.points.iter().copied())
    }

    fn commit(&mut self, at: &EvalPoint<'_>) {
        if self.friction.is_none() || at.q.len().min(at.q_start.len()) < 3 * self.point_count {
            return;
        }
        let mut tasks = std::mem::take(&mut self.tasks);
        let mut memory = std::mem::take(&mut self.spare);
        memory.clear();
        let ranges = self.ranges();
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
        let mut out = Vec::with_capacity(5 * self.memory.len());
        for a in &self.memory {
            out.extend([f64::from(a.of.body), f64::from(a.of.point)]);
            out.extend(a.place);
        }
        out
    }

    fn restore_history(&mut self, history: &[f64]) -> Result<(), CollisionError> {
        let fail = |reason| {
            Err(CollisionError::History {
                source_name: self.name().into(),
                reason,
            })
        };
        let (rows, []) = history.as_chunks::<5>() else {
            return fail("wrong length");
        };
        let memory: Vec<Anchor> = rows
            .iter()
            .map(|r| Anchor {
                of: Candidate {
                    body: r[0] as u32,
                    point: r[1] as u32,
                },
                place: [r[2], r[3], r[4]],
            })
            .collect();
        let fits = |c: Candidate| {
            (c.body as usize) < self.bodies.len() && (c.point as usize) < self.point_count
        };
        if !memory.iter().all(|a| fits(a.of)) {
            return fail("made with other bodies or points");
        }
        if !memory.is_sorted_by(|a, b| a.of < b.of) {
            return fail("not in order");
        }
        self.memory = memory;
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
            + 8 * (self.inverse_masses.capacity() + self.areas.capacity())
            + 8 * self.candidates.capacity()
            + size_of::<Anchor>() * (self.memory.capacity() + self.spare.capacity())
            + self.envelope.heap_bytes()
            + tasks
    }
}
