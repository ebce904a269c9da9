//! Detection, forces and friction's memory, step by step.

use selvedge_energy::{DofLayout, EvalPoint};

use super::bounds::Moves;
use super::memory::Memory;
use super::near::{Near, Visit};
use super::overlap::Overlap;
use super::pass::{LaggedContact, Pairs, Pass, Task};
use super::skin::Skin;
use super::{NAME, SelfContact, SelfContactSettings};
use crate::proximity::check_positions;
use crate::source::{CHUNK, ContactSource, StepStart, check_point, check_step, in_order};
use crate::vec3::{combine, point, sub, tangential};
use crate::{CollisionError, ContactResponse, Friction, FrictionLagged};

/// Steps that a skin has to last to be worth its wider search.
const SKIN_STEPS: f64 = 6.0;

/// By how many thicknesses a pair may come closer before the candidates that may
/// be in contact are listed again.
const NEAR: f32 = 0.5;

/// Thicknesses from which a pair keeps its bound from step to step.
const ENOUGH: f32 = 1.5;

impl ContactSource for SelfContact {
    fn name(&self) -> &str {
        NAME
    }

    fn detect(&mut self, step: &StepStart<'_>) -> Result<(), CollisionError> {
        check_step(step.dt)?;
        let mesh = &self.pairs.mesh;
        check_positions(mesh.points(), step.q_start)?;
        check_positions(mesh.points(), step.q_predicted)?;
        let SelfContactSettings {
            margin,
            overshoot,
            skin,
            release,
        } = self.settings;
        let skin = skin.min(mesh.longest_drift());
        let count = 3 * mesh.points();
        let (start, predicted) = (&step.q_start[..count], &step.q_predicted[..count]);
        self.near.clear();
        if !self.skin.holds(start, predicted) {
            if self
                .skin
                .lay(start, predicted, (1.0 + overshoot) * SKIN_STEPS, skin)
            {
                self.search_skin()?;
            } else {
                self.envelope
                    .set(mesh.points(), step, overshoot, 0.5 * margin)?;
                let reach = self.pairs.potential.thickness() + margin;
                self.backend.detect(
                    mesh,
                    step.q_start,
                    self.envelope.end(),
                    reach,
                    &mut self.pairs.candidates,
                )?;
                let Pairs {
                    bounds, candidates, ..
                } = &mut self.pairs;
                bounds.take(candidates, start);
            }
        }
        let Pairs {
            bounds,
            candidates,
            mesh,
            potential,
            ..
        } = &mut self.pairs;
        let enough = ENOUGH * potential.thickness() as f32;
        bounds.advance(mesh, candidates, start, enough, &mut self.moves);
        if release > 0.0 {
            if !self.pairs.overlap.measured {
                let start = self.overlaps(step.q_start);
                self.pairs.overlap.set(step.time, start);
            }
            let overlap = &mut self.pairs.overlap;
            overlap.begin_step(step.time, step.dt, release);
        }
        if let Some(Friction::Lagged(_)) = self.pairs.friction {
            self.lag(step);
        }
        Ok(())
    }

    fn evaluate(
        &mut self,
        at: &EvalPoint<'_>,
        curvature: bool,
        out: &mut ContactResponse,
    ) -> Result<f64, CollisionError> {
        check_point(at, self.pairs.mesh.points())?;
        let (mut energy, mut deepest, mut active) = (0.0, 0.0_f64, 0);
        let Sweep {
            pass,
            near,
            tasks,
            count,
            ..
        } = self.sweep(at, curvature);
        in_order(
            count.div_ceil(CHUNK),
            tasks,
            |i, task| pass.evaluate(of_chunk(i, count, near), task),
            |task| {
                out.extend(&task.response);
                energy += task.energy;
                deepest = deepest.max(task.deepest);
                active += task.active;
            },
        );
        if let Some(Friction::Lagged(f)) = &self.pairs.friction {
            for c in &self.lagged {
                let moved = c.nodes.map(|n| sub(point(at.q, n), point(at.q_start, n)));
                let u = tangential(combine(&c.weights, &moved), c.normal);
                let f = FrictionLagged {
                    coefficient: self.pairs.coefficient(f.coefficient, &c.nodes, &c.weights),
                    ..*f
                };
                let answer = f.respond(u, c.normal, c.force, at.dt);
                energy += answer.energy;
                out.nodes.push(c.nodes);
                out.weights.push(c.weights);
                out.force.push(answer.force);
                if curvature {
                    out.curvature.push(answer.curvature);
                }
            }
        }
        (self.active, self.deepest) = (active, deepest);
        Ok(energy)
    }

    fn covers(&self, at: &EvalPoint<'_>) -> bool {
        if self.skin.is_laid() {
            let count = 3 * self.pairs.mesh.points();
            return at.q.len() >= count && self.skin.holds(&at.q[..count], &at.q[..count]);
        }
        self.envelope
            .contains(at, 0..self.pairs.mesh.points() as u32)
    }

    fn commit(&mut self, at: &EvalPoint<'_>) {
        if check_point(at, self.pairs.mesh.points()).is_err() {
            return;
        }
        let Sweep {
            pass,
            near,
            tasks,
            memory,
            count,
        } = self.sweep(at, false);
        memory.clear();
        in_order(
            count.div_ceil(CHUNK),
            tasks,
            |i, task| pass.remember(of_chunk(i, count, near), task),
            |task| memory.append(&mut task.memory),
        );
        self.near.clear();
        std::mem::swap(&mut self.spare, &mut self.pairs.memory);
    }

    fn active(&self) -> usize {
        self.active
    }

    fn max_penetration(&self) -> f64 {
        self.deepest
    }

    fn candidates(&self) -> usize {
        self.pairs.candidates.len()
    }

    fn history(&self) -> Vec<f64> {
        let mut out = self.pairs.overlap.to_numbers();
        out.extend(self.skin.to_numbers());
        out.extend(self.pairs.memory.to_numbers());
        out
    }

    fn restore_history(&mut self, history: &[f64]) -> Result<(), CollisionError> {
        let mesh = &self.pairs.mesh;
        let limits = [mesh.points(), mesh.triangles().len(), mesh.edges().len()];
        let anchored = matches!(self.pairs.friction, Some(Friction::Anchored(_)));
        let (overlap, rest) = Overlap::from_numbers(history, mesh.points())?;
        let (skin, memory) = Skin::from_numbers(rest, 3 * mesh.points())?;
        self.pairs.memory = Memory::from_numbers(memory, anchored, limits)?;
        self.pairs.overlap = overlap;
        self.skin = skin;
        self.near.clear();
        // The candidates are those of the last search, so that a restored run
        // goes on with the same bits.
        if self.skin.is_laid() {
            self.search_skin()?;
        }
        Ok(())
    }

    fn heap_bytes(&self) -> usize {
        let tasks: usize = self
            .tasks
            .iter()
            .map(|t| {
                t.response.heap_bytes()
                    + t.memory.heap_bytes()
                    + 80 * t.lagged.capacity()
                    + 4 * t.near.capacity()
            })
            .sum();
        self.pairs.mesh.heap_bytes()
            + self.backend.heap_bytes()
            + self.envelope.heap_bytes()
            + self.skin.heap_bytes()
            + 8 * (self.pairs.inverse_masses.capacity() + self.pairs.coefficients.capacity())
            + 8 * (self.pairs.candidates.vertex_triangle.capacity()
                + self.pairs.candidates.edge_edge.capacity())
            + 4 * self.pairs.candidates.least.capacity()
            + self.pairs.bounds.heap_bytes()
            + self.moves.heap_bytes()
            + self.near.heap_bytes()
            + self.pairs.memory.heap_bytes()
            + self.pairs.overlap.heap_bytes()
            + self.spare.heap_bytes()
            + size_of::<LaggedContact>() * self.lagged.capacity()
            + tasks
    }
}

/// What a pass over the candidates works with.
struct Sweep<'a> {
    pass: Pass<'a>,
    /// Those that may be in contact, where bounds tell.
    near: Option<&'a Near>,
    tasks: &'a mut Vec<Task>,
    /// Room for the memory of the next step.
    memory: &'a mut Memory,
    /// Number of all candidates.
    count: usize,
}

impl SelfContact {
    fn sweep<'a>(&'a mut self, at: &'a EvalPoint<'_>, curvature: bool) -> Sweep<'a> {
        let count = self.pairs.candidates.len();
        let moves = &mut self.moves;
        let moves = moves.from_start(&self.pairs.bounds, count, at.q_start, at.q);
        let pass = Pass::new(&self.pairs, at, curvature).with_moves(moves);
        let (near, tasks) = (&mut self.near, &mut self.tasks);
        Sweep {
            near: moves.map(|moves| list_near(&pass, moves, count, near, tasks)),
            pass,
            tasks,
            memory: &mut self.spare,
            count,
        }
    }

    /// Finds all pairs that come into contact while the skin holds.
    fn search_skin(&mut self) -> Result<(), CollisionError> {
        let reach = self.pairs.potential.thickness() + 2.0 * self.skin.radius();
        let place = self.skin.place();
        let candidates = &mut self.pairs.candidates;
        self.backend
            .detect(&self.pairs.mesh, place, place, reach, candidates)?;
        self.pairs.bounds.take(candidates, place);
        Ok(())
    }

    /// Normal forces at the start of the step, for lagged friction.
    fn lag(&mut self, step: &StepStart<'_>) {
        let layout = DofLayout::points(self.pairs.mesh.points());
        let q = step.q_start;
        let at = EvalPoint {
            layout,
            q,
            q_start: q,
            dt: step.dt,
        };
        let pass = Pass::new(&self.pairs, &at, false);
        let (lagged, count) = (&mut self.lagged, self.pairs.candidates.len());
        lagged.clear();
        in_order(
            count.div_ceil(CHUNK),
            &mut self.tasks,
            |i, task| pass.lag(chunk(i, count), task),
            |task| lagged.append(&mut task.lagged),
        );
    }
}

/// The list of candidates that may be in contact at `moves`, made anew where
/// the last one does not hold.
fn list_near<'a>(
    pass: &Pass<'_>,
    moves: &Moves,
    count: usize,
    near: &'a mut Near,
    tasks: &mut Vec<Task>,
) -> &'a Near {
    if !near.holds(moves) {
        let room = NEAR * pass.thickness() as f32;
        near.begin(moves, room);
        in_order(
            count.div_ceil(CHUNK),
            tasks,
            |i, task| pass.list_near(chunk(i, count), room, task),
            |task| near.push(&task.near),
        );
    }
    near
}

/// Candidates that task `i` looks at.
fn of_chunk(i: usize, count: usize, near: Option<&Near>) -> Visit<'_> {
    match near {
        Some(near) => Visit::Near(near.of(i).iter()),
        None => chunk(i, count),
    }
}

/// Candidates of task `i`.
fn chunk(i: usize, count: usize) -> Visit<'static> {
    Visit::All(i * CHUNK..((i + 1) * CHUNK).min(count))
}
