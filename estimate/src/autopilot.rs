//! Settings that meet a wanted error.

use selvedge_record::compare::Distances;
use selvedge_scene::file::model::{ForcingKind, SolverSettings};
use selvedge_scene::file::{SceneFile, coarser};
use selvedge_scene::summary::{Decision, ErrorPart, ErrorReport};

use crate::companion::{Companion, Session, scaled_step, scaled_tolerance};
use crate::estimator::{attempt, unknown};
use crate::knob::{Effort, Knob, STEP, TOLERANCE, mm};
use crate::parts::{space_part, total};
use crate::{EstimateError, MaterialMap};

/// Shares of the wanted error: the mesh is what costs most.
const SPACE: f64 = 0.6;
const TIME: f64 = 0.2;
const ALGEBRAIC: f64 = 0.2;

/// Edge length of the first mesh, in edges of the scene's own.
const START: f64 = 4.0;
/// Largest step tried, in steps of the scene's own, and halvings of it.
const LONGEST_STEP: f64 = 4.0;
const HALVINGS: usize = 5;
/// Loosest tolerance tried, in tolerances of the scene's own, and how often it
/// is divided by ten.
const LOOSEST: f64 = 10.0;
const TENTHS: usize = 4;
/// How often a setting is tightened without the results coming closer. Folds
/// and friction make them scatter, which smaller steps do not mend.
const PATIENCE: usize = 2;
/// Halvings of the step on the mesh next to the finest.
const LATE_HALVINGS: usize = 2;

/// What is wanted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// Mean error of the points' positions [m].
    pub error: f64,
    /// Points of the finest mesh that is tried.
    pub max_points: usize,
}

/// A scene run with settings chosen for a wanted error.
pub struct Within {
    /// The last run, on the finest mesh.
    pub run: Companion,
    /// Name of its folder, see [`Session::folder`].
    pub name: String,
    /// Its error, and what was chosen why.
    pub report: ErrorReport,
    /// Whether the estimate is within the target.
    pub met: bool,
}

/// Chooses step, tolerance and mesh for a wanted error and runs the scene with
/// them.
///
/// A fifth of the target goes to the time step, a fifth to the tolerances, the
/// rest to the mesh. On a mesh four times as coarse as the scene's the step is
/// halved, then the tolerances are divided by ten, until what that changes is
/// within their share, or until it falls no further; the mesh is then refined
/// twofold until what is missing by Richardson's extrapolation, over at least
/// three meshes, is within its own. Every mesh is run in full, so that the last
/// one is the result. The step is then looked at again on the mesh before it.
///
/// # Errors
/// As [`Session::run`] for the runs that nothing can do without. A target out
/// of reach is no error: the finest run that is allowed comes back with
/// `met = false`.
pub fn drape_within(
    session: &mut Session<'_>,
    scene: &SceneFile,
    target: Target,
) -> Result<Within, EstimateError> {
    let before = session.cpu_s;
    let scene = &SceneFile {
        solver: SolverSettings {
            forcing: ForcingKind::EisenstatWalker,
            ..scene.solver
        },
        ..scene.clone()
    };
    let mut decisions = vec![Decision {
        setting: "solver.forcing".to_owned(),
        value: "eisenstat-walker".into(),
        why: "solves no system more exactly than the iteration around it can use".to_owned(),
    }];
    let refinable = coarser(scene, START).is_ok();
    let (mut now, length) = first_mesh(session, scene)?;
    let mesh = if refinable {
        "on the coarsest mesh"
    } else {
        "on the mesh of the file"
    };
    let mut choose = |knob: Knob, part: f64, times| {
        let effort = Effort {
            times,
            patience: PATIENCE,
            suffix: "",
        };
        let share = part * target.error;
        knob.choose(session, &mut now, share, effort, mesh, &mut decisions)
    };
    let mut time = choose(STEP, TIME, HALVINGS)?;
    let algebraic = choose(TOLERANCE, ALGEBRAIC, TENTHS)?;

    let mut levels = Levels::first(session, &now, length)?;
    match coarser(scene, 1.0) {
        Ok(_) => decisions.push(Decision {
            why: levels.refine(session, target)?,
            setting: "mesh.edge_length".to_owned(),
            value: edge_length(levels.run.built.scene()).into(),
        }),
        Err(why) => levels.space = unknown(&why),
    }
    let others = levels.space.error_m.unwrap_or(target.error) + algebraic.error_m.unwrap_or(0.0);
    if let Some(part) = levels.check_step(session, target.error - others, target, &mut decisions)? {
        time = part;
    }
    let Levels {
        run, name, space, ..
    } = levels;
    let estimate = total([&space, &time, &algebraic]);
    let own = run.result.summary.cpu_s;
    Ok(Within {
        met: estimate.is_some_and(|e| e <= target.error),
        report: ErrorReport {
            space,
            time,
            algebraic,
            cpu_s: session.cpu_s - before - own,
            target_m: Some(target.error),
            decisions,
        },
        run,
        name,
    })
}

/// The finest mesh so far.
struct Levels {
    run: Companion,
    name: String,
    /// The run on the mesh before, unless that is the first, where the step
    /// was chosen.
    coarse: Option<Companion>,
    /// Edges in the scene's own.
    length: f64,
    space: ErrorPart,
}

impl Levels {
    fn first(
        session: &mut Session<'_>,
        chosen: &Companion,
        length: f64,
    ) -> Result<Self, EstimateError> {
        let name = level_name(length);
        Ok(Self {
            run: session.run(&name, chosen.built.scene().clone(), true)?,
            name,
            coarse: None,
            length,
            space: unknown("one mesh alone tells nothing"),
        })
    }

    /// Halves the edges until the mesh's part is within its share; returns why
    /// it went no further.
    fn refine(
        &mut self,
        session: &mut Session<'_>,
        target: Target,
    ) -> Result<String, EstimateError> {
        let share = SPACE * target.error;
        let mut far: Option<Distances> = None;
        let mut compared = 0;
        loop {
            // Two meshes show no order.
            if compared >= 2 && self.space.error_m.is_some_and(|e| e <= share) {
                return Ok(format!(
                    "the mesh is off by {} mm, its share is {} mm",
                    mm(self.space.error_m),
                    mm(Some(share))
                ));
            }
            // Halving the edges makes four times the points.
            let points = 4 * self.run.result.summary.points;
            if points > target.max_points {
                return Ok(format!(
                    "half of it would take about {points} points, more than the {} allowed",
                    target.max_points
                ));
            }
            let finer = match coarser(self.run.built.scene(), 0.5) {
                Ok(scene) => scene,
                Err(why) => return Ok(why),
            };
            let name = level_name(0.5 * self.length);
            let next = match attempt(session, &name, finer, true)? {
                Ok(next) => next,
                Err(why) => return Ok(format!("half of it could not be run: {why}")),
            };
            let near = MaterialMap::new(next.surface())?.distance(&self.run.surface());
            self.space = space_part(near, far.replace(near));
            let coarse = std::mem::replace(&mut self.run, next);
            self.coarse = (compared > 0).then_some(coarse);
            self.name = name;
            self.length *= 0.5;
            compared += 1;
        }
    }

    /// What the step is off by on the mesh next to the finest: a coarse mesh
    /// folds in fewer ways and may show less of it. Where more than `left`
    /// \[m\], and smaller steps help, the finest run is made again with them.
    fn check_step(
        &mut self,
        session: &mut Session<'_>,
        left: f64,
        target: Target,
        decisions: &mut Vec<Decision>,
    ) -> Result<Option<ErrorPart>, EstimateError> {
        let Some(mut coarse) = self.coarse.take() else {
            return Ok(None);
        };
        let effort = Effort {
            times: if left > 0.0 { LATE_HALVINGS } else { 0 },
            patience: 1,
            suffix: "-late",
        };
        let share = left.max(TIME * target.error);
        let before = coarse.built.scene().integrator.max_step;
        let mesh = "on the mesh twice as coarse";
        let part = STEP.choose(session, &mut coarse, share, effort, mesh, decisions)?;
        let factor = coarse.built.scene().integrator.max_step / before;
        if factor < 1.0 {
            let scene = scaled_step(self.run.built.scene(), factor);
            let name = format!("{}-late", self.name);
            if let Ok(run) = attempt(session, &name, scene, true)? {
                (self.run, self.name) = (run, name);
            }
        }
        Ok(Some(part))
    }
}

/// The coarsest mesh that can be run, and its edges in the scene's own.
fn first_mesh(
    session: &mut Session<'_>,
    scene: &SceneFile,
) -> Result<(Companion, f64), EstimateError> {
    let mut length = START;
    while length > 1.0 {
        if let Ok(coarse) = coarser(scene, length) {
            let coarse = scaled_step(&coarse, LONGEST_STEP);
            let coarse = scaled_tolerance(&coarse, LOOSEST);
            if let Ok(run) = attempt(session, &format!("estimate/first-{length}"), coarse, false)? {
                return Ok((run, length));
            }
        }
        length *= 0.5;
    }
    let own = scaled_tolerance(&scaled_step(scene, LONGEST_STEP), LOOSEST);
    Ok((session.run("estimate/first-1", own, false)?, 1.0))
}

fn edge_length(scene: &SceneFile) -> f64 {
    let own = scene.cloth.iter().filter_map(|c| c.edge_length());
    own.reduce(f64::min).unwrap_or(scene.mesh.edge_length)
}

fn level_name(length: f64) -> String {
    format!("estimate/mesh-{length}x")
}
