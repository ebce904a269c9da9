//! Settings that meet a wanted error.

use selvedge_record::compare::Distances;
use selvedge_scene::build::BuiltScene;
use selvedge_scene::driver::RunResult;
use selvedge_scene::file::model::{ForcingKind, SolverSettings};
use selvedge_scene::file::{SceneFile, coarser};
use selvedge_scene::summary::{Decision, ErrorPart, ErrorReport};

use crate::companion::{Companion, Session, scaled_step, scaled_tolerance};
use crate::estimator::{attempt, unknown};
use crate::knob::{Effort, Knob, STEP, TOLERANCE, mm};
use crate::parts::{EFFECTIVITY, beside_path, numerics, space_part, total};
use crate::path::path_part;
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
/// Halvings of the step, and tenths of the tolerances, on the mesh next to the
/// finest.
const LATE_HALVINGS: usize = 2;
const LATE_TENTHS: usize = 1;

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
    /// The scene of the last run, on the finest mesh.
    pub built: BuiltScene,
    /// How it ended.
    pub result: RunResult,
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
/// three meshes, is within its own. Every mesh is run in full, garments from where
/// they rest on the one before, so that the last one is the result. Tolerances
/// and step are then looked at again on the mesh before it, and how far apart other
/// beginnings end there: what that leaves of the target is for the others, and
/// where it leaves nothing they are tightened no further.
///
/// # Errors
/// As [`Session::run`] for the runs that nothing can do without. A target out
/// of reach, or below what the path decides, is no error: the finest run that is allowed comes back with
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
    let mut algebraic = choose(TOLERANCE, ALGEBRAIC, TENTHS)?;

    let mut levels = Levels::first(now, length);
    let refined = match coarser(scene, 1.0) {
        Ok(_) => Ok(levels.refine(session, SPACE * target.error, target.max_points)?),
        Err(why) => Err(why),
    };
    let path = levels.path(session)?;
    match refined {
        Ok(mut why) => {
            let room = beside_path(target.error, &path);
            levels.check(
                session,
                room,
                target,
                &mut time,
                &mut algebraic,
                &mut decisions,
            )?;
            let share = room - numerics([&time, &algebraic]).unwrap_or(room);
            if share > 0.0 && levels.space.error_m.is_some_and(|e| e > share) {
                why = levels.refine(session, share, target.max_points)?;
            }
            decisions.push(Decision {
                why,
                setting: "mesh.edge_length".to_owned(),
                value: edge_length(levels.run.built.scene()).into(),
            });
        }
        Err(why) => levels.space = unknown(&why),
    }
    levels.record(session)?;
    let Levels {
        run,
        name,
        coarse,
        space,
        ..
    } = levels;
    let own = run.cpu_s;
    let (built, result) = session.result(&name, coarse.as_ref(), run)?;
    let report = ErrorReport {
        space,
        time,
        algebraic,
        path,
        cpu_s: session.cpu_s - before - own,
        target_m: Some(target.error),
        decisions,
        effectivity: &EFFECTIVITY,
    };
    Ok(Within {
        met: total(&report).is_some_and(|e| e <= target.error),
        report,
        built,
        result,
        name,
    })
}

/// The finest mesh so far.
struct Levels {
    run: Companion,
    name: String,
    /// Whether it was recorded as the scene asks for.
    recorded: bool,
    /// The run on the mesh before.
    coarse: Option<Companion>,
    /// Meshes compared.
    compared: usize,
    /// From `run` to `coarse`, and from there to the mesh before.
    near: Option<Distances>,
    far: Option<Distances>,
    /// Edges in the scene's own.
    length: f64,
    space: ErrorPart,
}

impl Levels {
    /// The mesh on which step and tolerances were chosen, as it was run there.
    fn first(run: Companion, length: f64) -> Self {
        Self {
            run,
            name: level_name(length),
            recorded: false,
            coarse: None,
            compared: 0,
            near: None,
            far: None,
            length,
            space: unknown("one mesh alone tells nothing"),
        }
    }

    /// Runs the first mesh again where it is the result: it has no recording.
    fn record(&mut self, session: &mut Session<'_>) -> Result<(), EstimateError> {
        if !self.recorded {
            let scene = self.run.built.scene();
            let recording = session.parsed.scene.output.recording;
            let mut scene = scene.clone();
            scene.output.recording = recording;
            self.run = session.run(&self.name, None, scene, true)?;
            self.recorded = true;
        }
        Ok(())
    }

    /// Where other beginnings end, on the mesh next to the finest.
    fn path(&self, session: &mut Session<'_>) -> Result<ErrorPart, EstimateError> {
        let (run, mesh) = match &self.coarse {
            Some(coarse) => (coarse, "on the mesh twice as coarse"),
            None => (&self.run, "on the same mesh"),
        };
        let end = MaterialMap::new(run.surface())?;
        path_part(session, run.built.scene(), &end, mesh)
    }

    /// Halves the edges until the mesh's part is within `share` [m]; returns why
    /// it went no further.
    fn refine(
        &mut self,
        session: &mut Session<'_>,
        share: f64,
        max_points: usize,
    ) -> Result<String, EstimateError> {
        loop {
            // Two meshes show no order.
            if self.compared >= 2 && self.space.error_m.is_some_and(|e| e <= share) {
                return Ok(format!(
                    "the mesh is off by {} mm, its share is {} mm",
                    mm(self.space.error_m),
                    mm(Some(share))
                ));
            }
            // Halving the edges makes four times the points.
            let points = 4 * self.run.points();
            if points > max_points {
                return Ok(format!(
                    "half of it would take about {points} points, more than the {max_points} \
                     allowed"
                ));
            }
            let mut finer = match coarser(self.run.built.scene(), 0.5) {
                Ok(scene) => scene,
                Err(why) => return Ok(why),
            };
            finer.output.recording = session.parsed.scene.output.recording;
            let name = level_name(0.5 * self.length);
            let next = match attempt(session, &name, Some(&self.run), finer, true)? {
                Ok(next) => next,
                Err(why) => return Ok(format!("half of it could not be run: {why}")),
            };
            let near = MaterialMap::new(next.surface())?.distance(&self.run.surface());
            self.far = self.near.replace(near);
            self.space = space_part(near, self.far);
            self.coarse = Some(std::mem::replace(&mut self.run, next));
            self.recorded = true;
            self.name = name;
            self.length *= 0.5;
            self.compared += 1;
        }
    }

    /// What tolerances and step are off by on the mesh next to the finest: a
    /// coarse mesh folds in fewer ways and may show less of it. Where it is more
    /// than what the other parts leave of `room` [m], and tightening helps, the
    /// finest run is made again.
    fn check(
        &mut self,
        session: &mut Session<'_>,
        room: f64,
        target: Target,
        time: &mut ErrorPart,
        algebraic: &mut ErrorPart,
        decisions: &mut Vec<Decision>,
    ) -> Result<(), EstimateError> {
        // Both were chosen on the first mesh.
        let coarse = self.coarse.take_if(|_| self.compared > 1);
        let Some(mut coarse) = coarse else {
            return Ok(());
        };
        let before = coarse.built.scene().clone();
        let error = |part: &ErrorPart| part.error_m.unwrap_or(target.error);
        for knob in [TOLERANCE, STEP] {
            let tolerance = knob.is(&TOLERANCE);
            let (other, part, share, times) = if tolerance {
                (error(time), &mut *algebraic, ALGEBRAIC, LATE_TENTHS)
            } else {
                (error(algebraic), &mut *time, TIME, LATE_HALVINGS)
            };
            let left = room - error(&self.space) - other;
            let effort = Effort {
                times: if left > 0.0 { times } else { 0 },
                patience: 1,
                suffix: "-late",
            };
            let share = left.max(share * target.error);
            let mesh = "on the mesh twice as coarse";
            *part = knob.choose(session, &mut coarse, share, effort, mesh, decisions)?;
        }
        let now = coarse.built.scene();
        let tightened = now.integrator != before.integrator || now.solver != before.solver;
        if tightened && let Ok(mut scene) = coarser(now, 0.5) {
            scene.output.recording = session.parsed.scene.output.recording;
            let name = format!("{}-late", self.name);
            match attempt(session, &name, Some(&coarse), scene, true)? {
                Ok(run) => (self.run, self.name) = (run, name),
                // The run at hand has other settings than what was compared.
                Err(why) => {
                    (*time, *algebraic) = (unknown(&why), unknown(&why));
                    return Ok(());
                }
            }
            let near = MaterialMap::new(self.run.surface())?.distance(&coarse.surface());
            self.near = Some(near);
            self.space = space_part(near, self.far);
        }
        self.coarse = Some(coarse);
        Ok(())
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
            let name = format!("estimate/first-{length}");
            if let Ok(run) = attempt(session, &name, None, coarse, false)? {
                return Ok((run, length));
            }
        }
        length *= 0.5;
    }
    let own = scaled_tolerance(&scaled_step(scene, LONGEST_STEP), LOOSEST);
    Ok((session.run("estimate/first-1", None, own, false)?, 1.0))
}

fn edge_length(scene: &SceneFile) -> f64 {
    let own = scene.cloth.iter().filter_map(|c| c.edge_length());
    own.reduce(f64::min).unwrap_or(scene.mesh.edge_length)
}

fn level_name(length: f64) -> String {
    format!("estimate/mesh-{length}x")
}
