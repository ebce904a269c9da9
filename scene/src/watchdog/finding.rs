use selvedge_collision::ContactResponse;
use selvedge_energy::EvalPoint;
use selvedge_integrator::{Simulation, StepError};
use serde::{Deserialize, Serialize};

use super::Stage;
use crate::build::BuiltScene;

/// One kind of trouble.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Trouble {
    /// A value that is NaN or infinite.
    NotFinite,
    /// Steps are refused one after the other, or stay small.
    Stall,
    /// Mechanical energy appeared without work.
    Energy,
    /// No step is small enough.
    Underflow,
}

/// What was done about it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Answer {
    /// Listed only.
    Noted,
    /// The linear solver's tolerance was tightened.
    TighterTolerance,
    /// Curvature was projected as well.
    ProjectedCurvature,
    /// The step was cut as well.
    SmallerStep,
    /// The run ended, and the step was written down.
    Stopped,
}

/// Something that the watchdog found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// What kind of trouble.
    pub trouble: Trouble,
    /// In a sentence.
    pub what: String,
    /// `drape`, or the stage of sewing.
    #[serde(default = "drape")]
    pub stage: String,
    /// Simulated time at the start of the step, from the start of the stage [s].
    pub time_s: f64,
    /// Accepted steps before it.
    pub step: u64,
    /// Length of the step [s].
    pub dt_s: f64,
    /// Term, or kind of contact, that pulls hardest there.
    pub term: Option<String>,
    /// Points concerned, in the scene's order: one, or the four of a pair.
    pub points: Vec<u32>,
    /// Where the first of them is [m]; `null` when that is not finite.
    pub at: Option<[f64; 3]>,
    /// What was done.
    pub answer: Answer,
    /// File from which the step can be replayed.
    pub dump: Option<String>,
}

fn drape() -> String {
    Stage::DRAPE.to_owned()
}

/// Where trouble sits.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Place {
    pub term: Option<String>,
    pub points: Vec<u32>,
    pub at: Option<[f64; 3]>,
}

/// Name of a term or contact, and the points that it pulls on together.
type Puller = (String, Vec<u32>);

/// Point in the scene's order.
fn scene_point(built: &BuiltScene, p: usize) -> u32 {
    let old = &built.geometry.order.old_of_new;
    old.get(p).copied().unwrap_or(p as u32)
}

fn finite(x: [f64; 3]) -> Option<[f64; 3]> {
    x.iter().all(|x| x.is_finite()).then_some(x)
}

/// Where a refused step went wrong: as the error says, or else where the
/// forces at its start accelerate a point most.
pub(super) fn place(built: &BuiltScene, simulation: &mut Simulation, error: &StepError) -> Place {
    match error {
        StepError::NotFinite {
            point,
            x,
            y,
            z,
            term,
            ..
        } => Place {
            term: term.as_deref().map(str::to_owned),
            points: vec![scene_point(built, *point)],
            at: finite([*x, *y, *z]),
        },
        _ => hardest_pulled(built, simulation),
    }
}

/// The point that forces accelerate most, the term that pulls it hardest, and
/// the other points of that stencil or pair.
pub(super) fn hardest_pulled(built: &BuiltScene, simulation: &mut Simulation) -> Place {
    let state = simulation.state().clone();
    let at = EvalPoint {
        layout: state.layout,
        q: &state.q,
        q_start: &state.q,
        dt: simulation.next_dt(),
    };
    let mut responses = Vec::new();
    for contact in &mut simulation.plan_mut().contacts {
        let mut response = ContactResponse::default();
        // Contact that cannot be evaluated pulls nobody.
        let _ = contact.evaluate(&at, false, &mut response);
        responses.push((contact.name().to_owned(), response));
    }
    let plan = simulation.plan();
    let points = state.layout.points;
    let mut force = vec![[0.0; 3]; points];
    // Largest single pull on each point and who pulls.
    let mut pulls: Vec<(f64, Option<Puller>)> = vec![(0.0, None); points];
    let mut pull = |p: u32, f: [f64; 3], name: &str, nodes: &[u32]| {
        let p = p as usize;
        for i in 0..3 {
            force[p][i] += f[i];
        }
        let size = f.iter().map(|x| x * x).sum::<f64>();
        if size > pulls[p].0 || size.is_nan() {
            pulls[p] = (size, Some((name.to_owned(), nodes.to_vec())));
        }
    };
    for term in &plan.terms {
        let batch = term.batch.as_ref();
        let mut g = vec![0.0; batch.local_dim()];
        for e in 0..batch.len() {
            batch.gradients(&at, e..e + 1, &mut g);
            for (n, g) in batch.nodes(e).iter().zip(g.as_chunks::<3>().0) {
                pull(*n, g.map(|g| -g), batch.name(), batch.nodes(e));
            }
        }
    }
    for (name, r) in &responses {
        for ((nodes, weights), f) in r.nodes.iter().zip(&r.weights).zip(&r.force) {
            for (n, w) in nodes.iter().zip(weights) {
                pull(*n, f.map(|f| w * f), name, nodes);
            }
        }
        for (n, f) in r.body_nodes.iter().zip(&r.body_force) {
            pull(*n, *f, name, &[*n]);
        }
    }
    let rank = |p: usize| {
        plan.pins
            .as_ref()
            .map_or(0, |pins| pins.filter.rank(p as u32))
    };
    let acceleration = |p: &usize| {
        let size = force[*p].iter().map(|f| f * f).sum::<f64>();
        let a = size / plan.inertia.masses[*p].powi(2);
        if a.is_nan() { f64::INFINITY } else { a }
    };
    let free = (0..points).filter(|p| rank(*p) < 3);
    let Some(worst) = free.max_by(|a, b| acceleration(a).total_cmp(&acceleration(b))) else {
        return Place::default();
    };
    let (_, by) = std::mem::take(&mut pulls[worst]);
    let mut found = vec![scene_point(built, worst)];
    if let Some((_, nodes)) = &by {
        let others = nodes.iter().filter(|n| **n as usize != worst);
        found.extend(others.map(|n| scene_point(built, *n as usize)));
    }
    Place {
        term: by.map(|(name, _)| name),
        points: found,
        at: finite(std::array::from_fn(|i| state.q[3 * worst + i])),
    }
}
