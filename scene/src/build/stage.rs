//! What a scene file asks of the integrator.

use selvedge_integrator::{
    ControlSettings, CurvaturePolicy, Forcing, LineSearch, NewtonSettings, RelaxationSettings,
    ResidualNorm, Scheme, Settings, StaticSettings, StopSettings,
};

use super::{BuiltScene, Passages};
use crate::file::model::{self, ResidualNormKind};

/// What differs between the stages of a garment's assembly and the drape.
#[derive(Clone, Debug)]
pub struct StageOptions {
    /// Whether cloth collides with itself, where the scene lets it.
    pub self_contact: bool,
    /// Whether friction acts.
    pub friction: bool,
    /// Gravity [m/s²].
    pub gravity: [f64; 3],
    /// Steps, relaxation, stop.
    pub settings: Settings,
    /// Newton's method.
    pub newton: NewtonSettings,
    /// Search for rest in place of time stepping: without damping.
    pub statics: Option<StaticSettings>,
    /// Drag instead of the fabrics' own [1/s].
    pub drag: Option<f64>,
    /// Whether points of held labels are attached to where they are.
    pub hold_labels: bool,
}

/// Loosest relative tolerance of a linear solve that `eisenstat-walker` takes.
const LOOSEST: f64 = 0.1;

/// Tries of a static solve's line search, at least.
const STATIC_TRIES: usize = 8;

impl BuiltScene {
    /// The stage that the scene file describes: the drape itself.
    pub fn drape_stage(&self) -> StageOptions {
        let scene = self.scene();
        let i = &scene.integrator;
        let r = &scene.relaxation;
        let s = &scene.stop;
        let statics = (i.kind == model::IntegratorKind::Static).then(|| StaticSettings {
            tolerance: i.force_tolerance,
            max_move: self.max_move(),
            line_search_tries: i.line_search_halvings.max(STATIC_TRIES),
            curvature: curvature(i.curvature),
            ..StaticSettings::default()
        });
        let passages = self.geometry.passages.as_ref();
        let cut = passages.and_then(Passages::last_cut);
        StageOptions {
            self_contact: true,
            friction: statics.is_none() || i.static_friction,
            gravity: scene.simulation.gravity,
            settings: Settings {
                duration: scene.simulation.duration,
                control: ControlSettings {
                    max_step: i.max_step,
                    splitting: i.step_splitting,
                    recovery_steps: i.recovery_steps,
                    recovery_iterations: i.recovery_iterations,
                    min_step_fraction: (i.min_step / i.max_step).min(0.5),
                },
                relaxation: if r.enabled {
                    RelaxationSettings {
                        duration: r.duration,
                        step_fraction: r.step_fraction,
                        stiffness_start: r.stiffness_start,
                    }
                } else {
                    RelaxationSettings::OFF
                },
                stop: StopSettings {
                    early: s.early,
                    percentile: s.percentile,
                    kinetic_energy: s.kinetic_energy,
                    window: s.window,
                    not_before: cut.unwrap_or(0.0),
                },
            },
            newton: NewtonSettings {
                tolerance: i.newton_tolerance,
                point_tolerance: i.point_tolerance,
                iterations: i.newton_iterations,
                line_search_tries: i.line_search_halvings,
                scheme: match i.kind {
                    model::IntegratorKind::BackwardEuler | model::IntegratorKind::Static => {
                        Scheme::Newton
                    }
                    model::IntegratorKind::LinearisedEuler => Scheme::Linearised,
                },
                line_search: match i.line_search {
                    model::LineSearchKind::Residual => LineSearch::Residual,
                    model::LineSearchKind::Work => LineSearch::Work,
                    model::LineSearchKind::Auto if self.geometry.yarns.is_some() => {
                        LineSearch::Work
                    }
                    model::LineSearchKind::Auto => LineSearch::Residual,
                },
                norm: match i.residual_norm {
                    ResidualNormKind::Mass => ResidualNorm::Mass,
                    ResidualNormKind::Paper => ResidualNorm::Paper,
                },
                curvature: curvature(i.curvature),
                forcing: match scene.solver.forcing {
                    model::ForcingKind::Constant => Forcing::Constant,
                    model::ForcingKind::EisenstatWalker => Forcing::EisenstatWalker {
                        tightest: scene.solver.tolerance,
                        loosest: LOOSEST.max(scene.solver.tolerance),
                    },
                },
            },
            drag: statics.map(|_| 0.0),
            statics,
            hold_labels: true,
        }
    }

    /// Largest change of any unknown in one iteration of a static solve [m].
    fn max_move(&self) -> f64 {
        let scene = self.scene();
        if let Some(yarns) = &self.geometry.yarns {
            let radii = yarns.network.materials.iter().map(|m| m.radius);
            return radii.fold(f64::INFINITY, f64::min);
        }
        // Nothing is passed through in one move.
        let mut most = scene.mesh.edge_length;
        if !self.bodies.is_empty() {
            most = most.min(scene.contact.body_thickness);
        }
        if self.self_contact().0 {
            most = most.min(0.5 * scene.contact.thickness);
        }
        most
    }
}

fn curvature(kind: model::CurvatureKind) -> CurvaturePolicy {
    match kind {
        model::CurvatureKind::Auto => CurvaturePolicy::Auto,
        model::CurvatureKind::Exact => CurvaturePolicy::Exact,
        model::CurvatureKind::Projected => CurvaturePolicy::Projected,
        model::CurvatureKind::GaussNewton => CurvaturePolicy::GaussNewton,
    }
}
