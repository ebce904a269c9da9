//! From a scene file to a simulation that holds what the scene calls for.

mod alone;
mod anchor;
mod apart;
mod bodies;
mod contact;
mod cuts;
mod draped;
mod effects;
mod gauge;
mod geometry;
mod holds;
mod passages;
mod perturb;
mod placement;
mod rest;
mod rest_shape;
mod select;
mod sewn;
mod stage;
mod system;
mod topology;
mod touching;
mod trims;
mod yarn_panels;
mod yarns;

use selvedge_collision::{Aabb, CollisionError};
use selvedge_energy::DofLayout;
use selvedge_integrator::{
    BackwardEuler, Inertia, Integrator, ScenePlan, Simulation, State, StaticRest, Term,
};
use selvedge_shell_model::{
    BendingOptions, DampingKind, SharedScalar, bending_term, drag_term, lumped_masses,
    membrane_term, seam_term,
};

use crate::diagnostic::{Diagnostics, Finding};
use crate::driver::{Progress, Silent};
use crate::effects::EffectRow;
use crate::file::model;
use crate::file::{Parsed, SceneFile};

pub use bodies::BuiltBody;
pub use contact::FrictionRange;
pub use geometry::{Geometry, Part};
pub use holds::{BuiltAttachment, PinGroup};
pub use passages::Passages;
pub use sewn::Sewn;
pub use stage::StageOptions;
pub use system::broad_phase;
pub(crate) use topology::Topology;
pub use trims::Trims;
use yarns::Dissipation;
pub use yarns::YarnCloth;

/// A scene whose inputs have been read: meshes, bodies, fabrics.
#[derive(Clone)]
pub struct BuiltScene {
    /// The scene file.
    pub parsed: Parsed,
    /// All cloth.
    pub geometry: Geometry,
    /// All obstacles.
    pub bodies: Vec<BuiltBody>,
    /// Buttons and buttonholes.
    pub trims: Trims,
    /// Findings that do not stop a run.
    pub warnings: Diagnostics,
    /// Size [m] and seed of what the start was displaced by.
    perturbation: Option<(f64, u64)>,
}

/// A simulation and what moves with it.
pub struct Built {
    /// The simulation.
    pub simulation: Simulation,
    /// Springs whose other ends may move.
    pub attachments: Vec<BuiltAttachment>,
    /// What is on and off, and why.
    pub effects: Vec<EffectRow>,
    /// Which points every pin of the scene holds.
    pub pins: Vec<PinGroup>,
}

impl BuiltScene {
    /// Reads and meshes everything that the scene names.
    ///
    /// # Errors
    /// All findings, when one is an error.
    pub fn new(parsed: Parsed) -> Result<Self, Diagnostics> {
        Self::watched(parsed, &mut Silent)
    }

    /// [`new`](Self::new) that tells of what takes its time: shells that are draped
    /// for yarns to be laid on.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn watched(
        parsed: Parsed,
        progress: &mut (dyn Progress + Send),
    ) -> Result<Self, Diagnostics> {
        let mut warnings = parsed.warnings.clone();
        let geometry = Geometry::new(&parsed, progress, &mut warnings)?;
        let around = Aabb::of_points(&geometry.positions);
        let bodies = match bodies::build(&parsed, &around, &mut warnings) {
            Ok(bodies) => bodies,
            Err(errors) => {
                // What was suspicious before may be the reason.
                warnings.extend(errors);
                return Err(warnings);
            }
        };
        warnings.extend(placement::examine(&parsed, &geometry, &bodies));
        let trims = Trims::new(&parsed, &geometry).unwrap_or_else(|errors| {
            warnings.extend(errors);
            Trims::default()
        });
        if warnings.has_errors() {
            return Err(warnings);
        }
        Ok(Self {
            parsed,
            geometry,
            bodies,
            trims,
            warnings,
            perturbation: None,
        })
    }

    /// The scene file's values.
    pub fn scene(&self) -> &SceneFile {
        &self.parsed.scene
    }

    /// Puts the simulation of a stage together, from a state of the cloth in
    /// the solver's order. Trims sit down on it anew; points of theirs in the
    /// state are left out.
    ///
    /// # Errors
    /// All findings, when one is an error.
    pub fn simulation(&self, mut state: State, stage: &StageOptions) -> Result<Built, Diagnostics> {
        let scene = self.scene();
        let refuse = |message: String| -> Diagnostics {
            Finding::error("scene::plan", self.parsed.locations.name(), message).into()
        };
        let g = &self.geometry;
        let mut fabrics = g.fabrics.clone();
        if let Some(drag) = stage.drag {
            for f in &mut fabrics {
                f.drag = drag;
            }
        }
        let damping = match scene.damping.kind {
            _ if stage.statics.is_some() => DampingKind::Off,
            model::DampingKind::Rate => DampingKind::Rate,
            model::DampingKind::Incremental => DampingKind::Incremental,
            model::DampingKind::None => DampingKind::Off,
        };
        let model_error = |e: selvedge_shell_model::ModelError| refuse(e.to_string());
        let dissipates = Dissipation {
            damping: damping != DampingKind::Off,
            friction: stage.friction,
        };
        let yarns = g.yarns.as_ref();
        let yarns = yarns.map(|y| y.parts(stage.gravity, dissipates));
        let mut masses = match &yarns {
            Some(yarns) => yarns.inertia.masses.clone(),
            None => lumped_masses(&g.mesh, &fabrics).map_err(model_error)?,
        };
        self.cloth_alone(&mut state);
        let trims = self
            .trims
            .parts(&self.parsed, state.q.as_chunks::<3>().0)
            .map_err(refuse)?;
        let mut terms = Vec::new();
        let membrane = membrane_term(&g.mesh, &fabrics, damping).map_err(model_error)?;
        if !membrane.is_empty() {
            terms.push(Term::fabric(membrane));
        }
        let rest_angles = g.rest_angles(scene);
        let options = BendingOptions {
            damping,
            rest_angles: rest_angles.as_deref(),
            ..BendingOptions::default()
        };
        let bending = bending_term(&g.mesh, &fabrics, &options).map_err(model_error)?;
        if !bending.is_empty() {
            terms.push(Term::fabric(bending));
        }
        if let Some(drag) = drag_term(&g.mesh, &fabrics).map_err(model_error)? {
            terms.push(Term::fixed(drag));
        }
        if !g.spring_seams.is_empty() {
            let stiffness = SharedScalar::new(scene.assemble.seam_stiffness);
            terms.push(Term::fixed(seam_term(&g.spring_seams, stiffness)));
        }
        let mut attachments = holds::attachments(&self.parsed, g, &self.bodies)?;
        if stage.hold_labels {
            attachments.extend(self.held_labels(&state)?);
        }
        for attachment in &mut attachments {
            if let Some(term) = attachment.term.take() {
                terms.push(term);
            }
        }
        let mut weightless = Vec::new();
        if let Some(trims) = trims {
            terms.push(trims.term);
            state.q.extend(trims.points.as_flattened());
            state.v.resize(state.q.len(), 0.0);
            masses.extend(trims.masses);
            weightless = trims.weightless;
            state.layout = DofLayout::points(masses.len());
        }
        let mut inertia = Inertia {
            gravity: stage.gravity,
            weightless,
            ..Inertia::default()
        };
        let mut owners = Vec::new();
        if let Some(yarns) = yarns {
            // Gravity is an energy of theirs: it pulls on arc lengths too.
            inertia = yarns.inertia;
            terms.extend(yarns.terms);
            owners = yarns.owners;
        }
        inertia.masses = masses;
        let pins = holds::pins(&self.parsed, g)?;
        let moves = pins.as_ref().is_some_and(|p| p.moves)
            || attachments.iter().any(BuiltAttachment::moves)
            || self.bodies.iter().any(|b| b.moves);

        let collision_error = |e: CollisionError| refuse(e.to_string());
        let contacts = self
            .contacts(stage, &inertia.masses[..g.mesh.points()], pins.as_ref())
            .map_err(collision_error)?;
        let system =
            system::system(scene, &terms, &inertia, &owners).map_err(|e| refuse(e.to_string()))?;
        let (mut pins, groups) = match pins {
            Some(p) => (Some(p.pins), p.groups),
            None => (None, Vec::new()),
        };
        if let Some(yarns) = &g.yarns
            && yarns.sliding
        {
            yarns.hold(&mut pins);
        }
        let plan = ScenePlan {
            layout: state.layout,
            owners,
            inertia,
            terms,
            contacts,
            pins,
            system,
        };
        let integrator: Result<Box<dyn Integrator>, _> = match stage.statics {
            Some(_) if moves => {
                let message = "a static solve needs everything that holds or hinders the cloth to \
                               stand still";
                return Err(refuse(message.to_owned()));
            }
            Some(statics) => StaticRest::new(statics).map(|i| Box::new(i) as _),
            None => BackwardEuler::new(stage.newton).map(|i| Box::new(i) as _),
        };
        let integrator = integrator.map_err(|e| refuse(e.to_string()))?;
        let mut settings = stage.settings;
        // Rest says nothing while something is going to move.
        settings.stop.early &= !moves && stage.statics.is_none();
        let effects = effects::rows(self, stage, &plan, &settings, moves);
        let simulation = Simulation::new(plan, state, integrator, settings)
            .map_err(|e| refuse(e.to_string()))?;
        Ok(Built {
            simulation,
            attachments,
            effects,
            pins: groups,
        })
    }

    /// Takes the points of trims out of a state.
    pub fn cloth_alone(&self, state: &mut State) {
        if self.geometry.yarns.is_some() {
            return;
        }
        let points = self.geometry.mesh.points();
        state.layout = DofLayout::points(points);
        state.q.truncate(3 * points);
        state.v.truncate(3 * points);
    }

    /// Springs at the points of labels that the pattern's cloth holds.
    fn held_labels(&self, state: &State) -> Result<Vec<BuiltAttachment>, Diagnostics> {
        let g = &self.geometry;
        let (x, _) = state.q.as_chunks::<3>();
        let mut held = Vec::new();
        for (i, part) in g.parts.iter().enumerate() {
            for label in &part.hold {
                let path = format!("cloth.{i}.hold");
                let Some(points) = part.labels.get(label) else {
                    let known: Vec<&str> = part.labels.keys().map(String::as_str).collect();
                    let message = format!(
                        "no edge is labelled `{label}`; there are {}",
                        known.join(", ")
                    );
                    return Err(self
                        .parsed
                        .locations
                        .error("scene::hold", &path, message)
                        .into());
                };
                let points: Vec<u32> = points
                    .iter()
                    .map(|p| g.order.new_of_old[*p as usize])
                    .collect();
                let start = points.iter().map(|p| x[*p as usize]).collect();
                let body = self.bodies.iter().find(|b| b.moves).map(|b| b.body.clone());
                let built = holds::attachment(&points, HOLD_STIFFNESS, start, None, body)
                    .map_err(|m| self.parsed.locations.error("scene::hold", &path, m))?;
                held.push(built);
            }
        }
        Ok(held)
    }
}

/// Stiffness of the springs that hold a labelled edge to the body [N/m].
const HOLD_STIFFNESS: f64 = 100.0;
