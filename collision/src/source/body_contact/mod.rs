mod guard;
mod impact;
mod pass;

use std::ops::Range;
use std::sync::Arc;

use selvedge_energy::EvalPoint;

use super::envelope::Envelope;
use super::self_contact::inverse_masses;
use super::{CHUNK, ContactSource, StepStart, check_margin, check_step, in_order};
use crate::friction::common_coefficient;
use crate::vec3::{Vec3, dot, norm, point, sub};
use crate::{
    Aabb, Body, CollisionError, ContactPotential, ContactQuadratic, ContactResponse, Friction,
    SurfaceSample, pair_friction,
};
use guard::Guard;
use impact::{Answer, Arrival, Impacts};
use pass::{Anchor, Candidate, Pass, Task};

/// How far detection looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyContactSettings {
    /// Room beyond the predicted motion of a point \[m\].
    pub margin: f64,
    /// Fraction by which the predicted motion is overshot \[1\].
    pub overshoot: f64,
    /// Largest slope of a body's distance field \[1\]. Points whose distance
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
/// body's own frame and move with it. A body that brings its own friction
/// coefficient rubs with the [geometric mean](crate::pair_friction) of its
/// and the cloth's, another one with the cloth's.
///
/// A step in which a point and a body approach so fast that the point would end
/// [too deep](CollisionError::Overrun) is refused, for a shorter one. A point
/// faster than the penalty can stop is led to the surface in shorter steps and
/// stopped there, see [`with_masses`](Self::with_masses).
pub struct BodyContact {
    bodies: Vec<Arc<dyn Body>>,
    points: Vec<u32>,
    point_count: usize,
    potential: Box<dyn ContactPotential>,
    friction: Option<Friction>,
    /// Coefficient of each body with cloth of the common coefficient.
    body_coefficients: Vec<f64>,
    /// Coefficients of the points; empty where all are that of the friction.
    coefficients: Vec<f64>,
    inverse_masses: Vec<f64>,
    areas: Vec<f64>,
    /// Masses of the points; empty where fast arrivals are let pass.
    masses: Vec<f64>,
    impacts: Impacts,
    settings: BodyContactSettings,
    envelope: Envelope,
    /// What is known of the distance of every point to every still body;
    /// empty for bodies that move.
    guards: Vec<Vec<Guard>>,
    time_end: f64,
    candidates: Vec<Candidate>,
    /// Candidates of each task.
    ranges: Vec<Range<usize>>,
    memory: Vec<Anchor>,
    spare: Vec<Anchor>,
    tasks: Vec<Task>,
    active: usize,
    deep: usize,
    deepest: f64,
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
            body_coefficients: Vec::new(),
            coefficients: Vec::new(),
            inverse_masses: Vec::new(),
            areas: Vec::new(),
            masses: Vec::new(),
            impacts: Impacts::default(),
            settings: BodyContactSettings::default(),
            envelope: Envelope::default(),
            guards: Vec::new(),
            time_end: 0.0,
            candidates: Vec::new(),
            ranges: Vec::new(),
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

    /// Refuses an array that has not one entry for every point.
    fn one_a_point(&self, what: &'static str, found: usize) -> Result<(), CollisionError> {
        let expected = self.point_count;
        if found == expected {
            return Ok(());
        }
        Err(CollisionError::Length {
            what,
            found,
            expected,
        })
    }

    /// Rest areas of all points \[m²\], for a stiffness per area; without them
    /// every point counts as 1 cm².
    ///
    /// # Errors
    /// [`CollisionError::Length`].
    pub fn with_areas(mut self, areas: Vec<f64>) -> Result<Self, CollisionError> {
        self.one_a_point("areas", areas.len())?;
        self.areas = areas;
        Ok(self)
    }

    /// Masses of all points \[kg\]: with them, points that arrive so fast that
    /// the penalty cannot stop them are stopped all the same.
    ///
    /// Fast is what has more kinetic energy towards the body, `½ m u²`, than
    /// the penalty takes up until the point is three thicknesses inside. Such
    /// a point may move no farther than the surface, or a thickness, in one
    /// step; where it touches, the stiffness is that of a stop within two
    /// thicknesses, without a rebound. Nothing changes for points that are
    /// not fast.
    ///
    /// # Errors
    /// [`CollisionError::Length`].
    pub fn with_masses(mut self, masses: &[f64]) -> Result<Self, CollisionError> {
        self.one_a_point("masses", masses.len())?;
        self.masses = masses.to_vec();
        Ok(self)
    }

    /// Adds friction. `masses` of all points \[kg\] set the damping of anchors.
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
        self.one_a_point("masses", masses.len())?;
        self.inverse_masses = inverse_masses(masses);
        self.friction = Some(friction);
        self.pair(friction.coefficient());
        Ok(self)
    }

    /// Coefficients of all points \[1\], each of the cloth there on itself, in
    /// place of the one of [`with_friction`](Self::with_friction), which has
    /// to come first. Equal coefficients cost nothing.
    ///
    /// # Errors
    /// [`CollisionError::Length`], and [`CollisionError::Parameter`] for one
    /// that is negative or not finite.
    pub fn with_coefficients(mut self, coefficients: Vec<f64>) -> Result<Self, CollisionError> {
        let common = common_coefficient(&coefficients, self.point_count)?;
        match (self.friction, common) {
            (None, _) => {}
            (Some(f), Some(common)) => {
                self.friction = Some(f.with_coefficient(common));
                self.pair(common);
            }
            (Some(_), None) => self.coefficients = coefficients,
        }
        Ok(self)
    }

    /// Coefficients of the bodies with cloth of one coefficient.
    fn pair(&mut self, of_cloth: f64) {
        let bodies = self.bodies.iter();
        self.body_coefficients = bodies.map(|b| coefficient(&**b, of_cloth)).collect();
    }

    /// Says which bodies never move. Distances to them are remembered, so that
    /// points far away are not asked for in every step; results do not change.
    ///
    /// # Errors
    /// [`CollisionError::Length`] when there is not one value a body.
    pub fn with_still(mut self, still: &[bool]) -> Result<Self, CollisionError> {
        if still.len() != self.bodies.len() {
            let (found, expected) = (still.len(), self.bodies.len());
            return Err(CollisionError::Length {
                what: "still bodies",
                found,
                expected,
            });
        }
        let guard = |still: &bool| vec![Guard::UNKNOWN; if *still { self.point_count } else { 0 }];
        self.guards = still.iter().map(guard).collect();
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

    fn bad_sample(&self, c: Candidate) -> CollisionError {
        let body = self.bodies[c.body as usize].name().into();
        CollisionError::NotFiniteSample {
            body,
            point: c.point,
        }
    }
}

/// Depth in thicknesses beyond which the nearest surface may be the wrong one.
const DEEP: f64 = 3.0;

/// Depth [m] at the end of the step of a point that moves by `way` [m] in a
/// step of `dt` [s], where that is beyond the limit and comes from this step's
/// approach. `s` is the sample where the point begins, of the body's last pose.
fn foreseen_depth(s: &SurfaceSample, way: Vec3, dt: f64, limit: f64) -> Option<f64> {
    let closing = dt * dot(s.velocity, s.normal) - dot(way, s.normal);
    let depth = -(s.distance + dot(way, s.normal));
    // What begins deeper is past help: it must not hold up the run.
    (closing > limit && depth > limit && depth - closing < limit).then_some(depth)
}

/// Coefficient of a body with cloth \[1\].
fn coefficient(body: &dyn Body, of_cloth: f64) -> f64 {
    match body.friction() {
        Some(of_body) => pair_friction(of_body, of_cloth),
        None => of_cloth,
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
        let mut guards = std::mem::take(&mut self.guards);
        candidates.clear();
        let mut fresh = Vec::new();
        let limit = DEEP * self.potential.thickness();
        let mut overrun = None;
        let mut impacts = Vec::new();
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
        self.impacts.update(step.time, step.dt, &mut impacts);
        match overrun {
            Some((c, depth, limit)) => Err(CollisionError::Overrun {
                body: self.bodies[c.body as usize].name().into(),
                point: c.point,
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
