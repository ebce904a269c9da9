//! Sewing a garment together on its body, in stages, before the drape.

use std::sync::atomic::{AtomicBool, Ordering};

use selvedge_collision::Untangle;
use selvedge_garment::assemble::{AssembleSettings, preassemble, prolong, untangle};
use selvedge_garment::place::BodyField;
use selvedge_integrator::{
    ControlSettings, CurvaturePolicy, NewtonSettings, Outcome, RelaxationSettings, Settings, State,
    StopSettings,
};

use crate::build::{Built, BuiltScene, Sewn, StageOptions, broad_phase};
use crate::cascade;
use crate::driver::{Progress, RunError, RunOptions, chain, tick};
use crate::file::model::Cloth;
use crate::process::Stopwatch;
use crate::result::figures;
use crate::summary::{StageSummary, Status};
use crate::watchdog::{Scope, Stage, Verdict, Watchdog};

/// How an assembly ended.
pub(crate) enum Assembled {
    /// The garment is sewn and near its body.
    Done {
        /// Where its points are, at rest.
        state: State,
        /// The stages.
        summaries: Vec<StageSummary>,
        /// Whether it comes from the drape on a coarser mesh: full stiffness
        /// from the start.
        carried: bool,
    },
    /// A stage was interrupted or failed.
    Cut {
        /// The last state.
        state: State,
        /// The stages so far.
        summaries: Vec<StageSummary>,
        /// Stopped or failed.
        status: Status,
        /// Why.
        reason: String,
    },
}

/// Sews every garment of the scene, where `assemble.coarsest` says so on
/// coarser meshes first ([`cascade`]). Without those:
///
/// 1. *wrap*: geometry alone closes the seams around the body.
/// 2. *close seams*: soft fabric, no gravity, contact of cloth with cloth
///    unless something still crosses.
/// 3. *untangle*: contact of cloth with cloth, still no gravity, until the
///    fabric has its full stiffness.
///
/// Velocities are zero between and after the stages.
pub(crate) fn assemble(
    built: &BuiltScene,
    mut state: State,
    mut dog: Option<&mut Watchdog>,
    options: &RunOptions,
    progress: &mut (dyn Progress + Send),
    interrupt: &AtomicBool,
) -> Result<Assembled, RunError> {
    if let Some(followed) = cascade::follow(built, &state, options, progress, interrupt)? {
        return Ok(followed);
    }
    let mut summaries = vec![wrap(built, &mut state)];
    progress.note("assembly: wrapped around the body");
    let crossed = summaries[0].self_intersections > 0;
    for (name, what, stage) in stages(built, crossed) {
        let clock = Stopwatch::start();
        if stage.self_contact && summaries.last().is_some_and(|s| s.self_intersections > 0) {
            let clearance = built.scene().contact.body_thickness;
            on_garments(built, &mut state, clearance, &|sewn, field, settings, x| {
                take_apart(built, sewn, field, settings, x);
            });
        }
        state.time = 0.0;
        state.v.fill(0.0);
        let Built { mut simulation, .. } = built.simulation(state.clone(), &stage)?;
        let scope = Scope {
            built,
            directory: &options.directory,
            start: &state.q,
            version: &options.version,
            stage: Stage { name, crossed },
        };
        if let Some(dog) = &mut dog {
            dog.enter(scope.stage, built.scene());
        }
        let failed = |reason: String| Some((Status::Failed, format!("{name}: {reason}")));
        let cut = loop {
            if interrupt.load(Ordering::Relaxed) {
                break Some((
                    Status::Stopped,
                    format!(
                        "interrupted while sewing, stage `{name}` at t = {:.4} s",
                        simulation.state().time
                    ),
                ));
            }
            if let Some(dog) = &mut dog {
                dog.begin(&simulation);
            }
            let verdict = match (simulation.advance(), &mut dog) {
                (Ok(Outcome::Ended(_)), _) => break None,
                (Ok(Outcome::Accepted { dt, report }), dog) => {
                    progress.tick(&tick(name, &simulation, dt, &report));
                    match dog {
                        Some(dog) => dog.accepted(&mut simulation, dt, &report, &scope),
                        None => Verdict::Fine,
                    }
                }
                (Ok(Outcome::Rejected { dt, reason }), Some(dog)) => {
                    dog.rejected(&mut simulation, dt, &reason, &scope)
                }
                (Ok(Outcome::Rejected { .. }), None) => Verdict::Fine,
                (Err(e), Some(dog)) => break failed(dog.gave_up(&mut simulation, &e, &scope)),
                (Err(e), None) => break failed(chain(&e)),
            };
            if let Verdict::Stop(reason) = verdict {
                break failed(reason);
            }
        };
        state = simulation.state().clone();
        built.cloth_alone(&mut state);
        let counters = simulation.counters();
        summaries.push(summarise(
            built,
            &state,
            StageSummary {
                simulated_s: state.time,
                steps: counters.steps,
                rejected_steps: counters.rejected,
                ..empty(name, what, clock)
            },
        ));
        if let Some((status, reason)) = cut {
            // The drape has not begun.
            state.time = 0.0;
            return Ok(Assembled::Cut {
                state,
                summaries,
                status,
                reason,
            });
        }
    }
    state.time = 0.0;
    state.v.fill(0.0);
    Ok(Assembled::Done {
        state,
        summaries,
        carried: false,
    })
}

/// Moves the points of a garment, in the frame of its pattern.
type Work<'a> = dyn Fn(&Sewn, BodyField<'_>, &AssembleSettings, &mut Vec<[f64; 3]>) + 'a;

/// Applies `work` to the points of every garment, in the frame of its pattern.
fn on_garments(built: &BuiltScene, state: &mut State, clearance: f64, work: &Work<'_>) {
    let g = &built.geometry;
    for (part, cloth) in g.parts.iter().zip(&built.scene().cloth) {
        let Some(sewn) = &part.garment else { continue };
        let field = sewn.field(&built.bodies);
        let asked = &built.scene().assemble;
        let settings = AssembleSettings {
            clearance,
            iterations: asked.pre_iterations,
            panel_clearance: layers(sewn, cloth, asked.layer_clearance),
            kept: part.hold.clone(),
            ..AssembleSettings::default()
        };
        let (x, _) = state.q.as_chunks_mut::<3>();
        let point = |k: u32| g.order.new_of_old[k as usize] as usize;
        let places = part.points.clone().map(|k| sewn.place_back(x[point(k)]));
        let mut places: Vec<[f64; 3]> = places.collect();
        work(sewn, &field, &settings, &mut places);
        for (k, p) in part.points.clone().zip(places) {
            x[point(k)] = sewn.place(p);
        }
    }
}

/// Puts garments where a coarser mesh, `from` in the scene's order, has come to
/// rest, and takes apart what crosses there.
pub(crate) fn carry(
    coarse: &BuiltScene,
    from: &[f64],
    built: &BuiltScene,
    state: &mut State,
) -> StageSummary {
    let clock = Stopwatch::start();
    let g = &built.geometry;
    let (from, _) = from.as_chunks::<3>();
    for (part, before) in g.parts.iter().zip(&coarse.geometry.parts) {
        let (Some(sewn), Some(was)) = (&part.garment, &before.garment) else {
            continue;
        };
        let places = before
            .points
            .clone()
            .map(|k| was.place_back(from[k as usize]));
        let places: Vec<[f64; 3]> = places.collect();
        let fine = prolong(&was.mesh, &places, &sewn.mesh);
        let (x, _) = state.q.as_chunks_mut::<3>();
        for (k, p) in part.points.clone().zip(fine) {
            x[g.order.new_of_old[k as usize] as usize] = sewn.place(p);
        }
    }
    let clearance = built.scene().contact.body_thickness;
    on_garments(built, state, clearance, &|sewn, field, settings, x| {
        take_apart(built, sewn, field, settings, x);
    });
    let what = "geometry alone, from the drape with edges twice as long";
    summarise(built, state, empty("carry over", what, clock))
}

fn wrap(built: &BuiltScene, state: &mut State) -> StageSummary {
    let clock = Stopwatch::start();
    let clearance = built.scene().assemble.clearance;
    on_garments(built, state, clearance, &|sewn, field, settings, x| {
        *x = preassemble(&sewn.mesh, field, settings).0;
        take_apart(built, sewn, field, settings, x);
    });
    built.perturb_garments(state);
    let what = "geometry alone, no forces";
    summarise(built, state, empty("wrap", what, clock))
}

/// Largest move of a crossing in one round, in edge lengths.
const UNTANGLE_STEP: f64 = 0.4;

/// Takes a garment that crosses itself apart, by geometry.
fn take_apart(
    built: &BuiltScene,
    sewn: &Sewn,
    field: BodyField<'_>,
    settings: &AssembleSettings,
    x: &mut Vec<[f64; 3]>,
) {
    let mesh = &sewn.mesh;
    let step = UNTANGLE_STEP * mesh.settings.edge_length;
    let mut broad = broad_phase(built.scene().contact.broad_phase);
    let mut pass = Untangle::new(&mesh.triangles);
    let mut shorten = |x: &mut [[f64; 3]]| {
        let crossings = pass.pass(x.as_flattened_mut(), step, broad.as_mut());
        let corners = crossings.iter().flat_map(|c| {
            let [a, b] = c.edge;
            mesh.triangles[c.triangle as usize]
                .into_iter()
                .chain([a, b])
        });
        corners.collect()
    };
    untangle(mesh, x, field, settings, &mut shorten);
}

/// Distance that the layer of each panel adds [m]; empty without layers.
fn layers(sewn: &Sewn, cloth: &Cloth, each: f64) -> Vec<f64> {
    if !cloth.is_layered() {
        return Vec::new();
    }
    let panels = sewn.mesh.panels.iter();
    panels
        .map(|p| f64::from(cloth.layer_of(&p.name)) * each)
        .collect()
}

/// What has not crossed yet is kept apart from the start; what has crossed
/// can only come free without contact of cloth with cloth.
fn stages(built: &BuiltScene, crossed: bool) -> [(&'static str, &'static str, StageOptions); 2] {
    let a = &built.scene().assemble;
    let drape = built.drape_stage();
    let least = built.scene().integrator.min_step;
    let stage = |self_contact: bool, duration: f64, stiffness_start: f64| StageOptions {
        self_contact,
        friction: false,
        gravity: [0.0; 3],
        settings: Settings {
            duration,
            control: ControlSettings {
                max_step: a.max_step,
                min_step_fraction: (least / a.max_step).min(0.5),
                ..drape.settings.control
            },
            relaxation: RelaxationSettings {
                duration,
                step_fraction: 0.25,
                stiffness_start,
            },
            stop: StopSettings {
                early: false,
                ..drape.settings.stop
            },
        },
        newton: NewtonSettings {
            curvature: CurvaturePolicy::Projected,
            ..drape.newton
        },
        statics: None,
        drag: None,
        hold_labels: false,
    };
    [
        (
            "close seams",
            if crossed {
                "fabric from 1 % stiffness; no gravity, no self-contact, no friction"
            } else {
                "self-contact; fabric from 1 % stiffness; no gravity, no friction"
            },
            stage(!crossed, a.seam_time, 1e-2),
        ),
        (
            "untangle",
            "self-contact; fabric from 10 % stiffness; no gravity, no friction",
            stage(true, a.settle_time, 0.1),
        ),
    ]
}

/// The stage of a name; `None` for what is no stage of sewing.
pub(crate) fn stage(built: &BuiltScene, crossed: bool, name: &str) -> Option<StageOptions> {
    let all = stages(built, crossed).into_iter();
    all.map(|(n, _, s)| (n, s))
        .find(|(n, _)| *n == name)
        .map(|(_, s)| s)
}

pub(crate) fn empty(name: &str, what: &str, clock: Stopwatch) -> StageSummary {
    StageSummary {
        name: name.to_owned(),
        what: what.to_owned(),
        simulated_s: 0.0,
        wall_s: clock.wall().as_secs_f64(),
        cpu_s: clock.user(),
        steps: 0,
        rejected_steps: 0,
        max_abs_edge_strain: 0.0,
        mean_abs_edge_strain: 0.0,
        max_penetration_m: 0.0,
        self_intersections: 0,
        defects: Vec::new(),
    }
}

pub(crate) fn summarise(built: &BuiltScene, state: &State, summary: StageSummary) -> StageSummary {
    let f = figures(built, &state.q, 0.0);
    StageSummary {
        max_abs_edge_strain: f.max_strain,
        mean_abs_edge_strain: f.mean_strain,
        max_penetration_m: f.max_penetration,
        self_intersections: f.self_intersections,
        defects: f.defects,
        ..summary
    }
}
