//! From a scene file to a simulation that holds what the scene calls for.

mod alone;
mod anchor;
mod apart;
mod bodies;
mod draped;
mod effects;
mod geometry;
mod holds;
mod passages;
mod perturb;
mod placement;
mod rest;
mod rest_shape;
mod sewn;
mod system;
mod topology;
mod trims;
mod yarn_panels;
mod yarns;

use std::sync::Arc;

use selvedge_collision::{
    Aabb, Body, BodyContact, CollisionError, CollisionMesh, ContactQuadratic, ContactSource,
    ContactStiffness, Friction, FrictionAnchored, FrictionLagged, SelfContact, SelfContactSettings,
    pair_friction,
};
use selvedge_energy::DofLayout;
use selvedge_integrator::{
    BackwardEuler, ControlSettings, CurvaturePolicy, Forcing, Inertia, Integrator, LineSearch,
    NewtonSettings, RelaxationSettings, ResidualNorm, ScenePlan, Scheme, Settings, Simulation,
    State, StaticRest, StaticSettings, StopSettings, Term,
};
use selvedge_shell_model::{
    BendingOptions, DampingKind, SharedScalar, bending_term, drag_term, lumped_masses,
    membrane_term, seam_term,
};

use crate::diagnostic::{Diagnostics, Finding};
use crate::effects::EffectRow;
use crate::file::model::{self, Cloth, FrictionModel, ResidualNormKind, Switch};
use crate::file::{Parsed, SceneFile};

pub use bodies::BuiltBody;
pub use geometry::{Geometry, Part};
pub use holds::{BuiltAttachment, PinGroup};
pub use passages::Passages;
pub use sewn::Sewn;
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

/// Least and greatest coefficient of each kind of contact \[1\].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrictionRange {
    /// Cloth on cloth.
    pub on_cloth: [f64; 2],
    /// Cloth on bodies; zeros without bodies.
    pub on_bodies: [f64; 2],
}

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

/// Loosest relative tolerance of a linear solve that `eisenstat-walker` takes.
const LOOSEST: f64 = 0.1;

impl BuiltScene {
    /// Reads and meshes everything that the scene names.
    ///
    /// # Errors
    /// All findings, when one is an error.
    pub fn new(parsed: Parsed) -> Result<Self, Diagnostics> {
        let mut warnings = parsed.warnings.clone();
        let geometry = Geometry::new(&parsed, &mut warnings)?;
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
            damping: stage.statics.is_none(),
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

    /// Whether cloth may touch itself, and why.
    pub fn self_contact(&self) -> (bool, &'static str) {
        match self.scene().contact.self_contact {
            _ if self.geometry.yarns.is_some() => (false, "yarns touch where they cross"),
            Switch::On => (true, "the scene says so"),
            Switch::Off => (false, "the scene says so"),
            Switch::Auto if self.scene().cloth.iter().any(Cloth::is_layered) => {
                (true, "there are layers")
            }
            Switch::Auto if self.geometry.sewn => (true, "a sewn garment touches itself"),
            Switch::Auto if self.geometry.parts.len() > 1 => {
                (true, "there are several pieces of cloth")
            }
            Switch::Auto if !self.bodies.is_empty() => {
                (true, "cloth on a body can fold onto itself")
            }
            Switch::Auto => (false, "a single piece without a body"),
        }
    }

    /// Least and greatest coefficients of friction that the materials give.
    pub fn friction(&self) -> FrictionRange {
        let range = |values: &mut dyn Iterator<Item = f64>| {
            values
                .map(|v| [v, v])
                .reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
                .unwrap_or_default()
        };
        let g = &self.geometry;
        let of_cloth = |f: &u16| self.fabric_friction(*f);
        let cloth = match &g.yarns {
            Some(_) => range(&mut self.point_friction().into_iter()),
            None => range(&mut g.mesh.fabric().iter().map(of_cloth)),
        };
        let bodies = range(&mut self.bodies.iter().filter_map(|b| b.body.friction()));
        FrictionRange {
            on_cloth: cloth,
            on_bodies: [0, 1].map(|i| pair_friction(cloth[i], bodies[i])),
        }
    }

    fn fabric_friction(&self, fabric: u16) -> f64 {
        let own = self.geometry.fabrics[usize::from(fabric)].friction;
        self.scene().contact.friction.unwrap_or(own)
    }

    /// Coefficient of the cloth at every point: the mean over the triangles
    /// around it, weighted by area.
    fn point_friction(&self) -> Vec<f64> {
        if let Some(yarns) = &self.geometry.yarns {
            let of_yarns = yarns.point_friction();
            return match self.scene().contact.friction {
                Some(mu) => vec![mu; of_yarns.len()],
                None => of_yarns,
            };
        }
        let mesh = &self.geometry.mesh;
        let mut sums = vec![[0.0; 2]; mesh.points()];
        let mut equal = true;
        let first = mesh.fabric().first().map(|f| self.fabric_friction(*f));
        for (t, points) in mesh.triangles().iter().enumerate() {
            let (mu, area) = (self.fabric_friction(mesh.fabric()[t]), mesh.rest_area(t));
            equal &= Some(mu) == first;
            for p in points {
                sums[*p as usize][0] += area * mu;
                sums[*p as usize][1] += area;
            }
        }
        match first {
            // Without the round-off of a mean.
            Some(mu) if equal => vec![mu; mesh.points()],
            _ => sums.iter().map(|[s, a]| s / a).collect(),
        }
    }

    fn contacts(
        &self,
        stage: &StageOptions,
        masses: &[f64],
        pins: Option<&holds::BuiltPins>,
    ) -> Result<Vec<Box<dyn ContactSource>>, CollisionError> {
        let c = &self.scene().contact;
        let rubs = self.friction();
        let friction = |coefficient: f64| match c.friction_model {
            _ if !stage.friction || coefficient <= 0.0 => None,
            FrictionModel::None => None,
            FrictionModel::Anchored => Some(Friction::Anchored(FrictionAnchored {
                stiffness_ratio: c.anchor_stiffness,
                ..FrictionAnchored::new(coefficient)
            })),
            FrictionModel::Lagged => Some(Friction::Lagged(FrictionLagged::new(coefficient))),
        };
        let quadratic = |base: ContactQuadratic, thickness: f64, stiffness: f64| {
            let stiffness = ContactStiffness::PerPair(stiffness);
            Box::new(ContactQuadratic {
                thickness,
                stiffness,
                ..base
            })
        };
        let mut contacts: Vec<Box<dyn ContactSource>> = Vec::new();
        if !self.bodies.is_empty() {
            let bodies: Vec<Arc<dyn Body>> = self.bodies.iter().map(|b| b.body.clone()).collect();
            let still: Vec<bool> = self.bodies.iter().map(|b| !b.moves).collect();
            let mut contact = BodyContact::new(masses.len(), bodies)
                .with_potential(quadratic(
                    ContactQuadratic::body(),
                    self.body_thickness(),
                    c.body_stiffness,
                ))
                .with_still(&still)?;
            // Steps of a static solve are no motion.
            if stage.statics.is_none() {
                contact = contact.with_masses(masses)?;
            }
            if let Some(friction) = friction(rubs.on_bodies[1]) {
                contact = contact
                    .with_friction(friction, masses)?
                    .with_coefficients(self.point_friction())?;
            }
            if let Some(pins) = pins {
                let filter = &pins.pins.filter;
                let free = (0..masses.len() as u32)
                    .filter(|p| filter.rank(*p) < 3)
                    .collect();
                contact = contact.with_points(free)?;
            }
            contacts.push(Box::new(contact));
        }
        if stage.self_contact && self.self_contact().0 {
            let g = &self.geometry;
            let links: Vec<[u32; 2]> = g
                .spring_seams
                .iter()
                .flat_map(|(p, e, _)| e.map(|e| [*p, e]))
                .collect();
            let mesh = CollisionMesh::new(
                g.mesh.points(),
                g.mesh.triangles().to_vec(),
                g.mesh.material(),
                &links,
                c.thickness,
            )?;
            let mut contact = SelfContact::new(mesh)
                .with_backend(system::backend(c.broad_phase))
                .with_settings(SelfContactSettings {
                    release: c.release,
                    ..SelfContactSettings::default()
                })?
                .with_potential(quadratic(
                    ContactQuadratic::cloth(),
                    c.thickness,
                    c.stiffness,
                ));
            if let Some(friction) = friction(rubs.on_cloth[1]) {
                contact = contact
                    .with_friction(friction, masses)?
                    .with_coefficients(self.point_friction())?;
            }
            contacts.push(Box::new(contact));
        }
        Ok(contacts)
    }

    /// Distance that cloth keeps from bodies [m]: with yarns at least two
    /// radii, since their points lie in the middle of two yarns.
    pub fn body_thickness(&self) -> f64 {
        let yarns = self.geometry.yarns.as_ref().map(|y| &y.network.materials);
        let radii = yarns.into_iter().flatten().map(|m| 2.0 * m.radius);
        radii.fold(self.scene().contact.body_thickness, f64::max)
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

fn curvature(kind: model::CurvatureKind) -> CurvaturePolicy {
    match kind {
        model::CurvatureKind::Auto => CurvaturePolicy::Auto,
        model::CurvatureKind::Exact => CurvaturePolicy::Exact,
        model::CurvatureKind::Projected => CurvaturePolicy::Projected,
        model::CurvatureKind::GaussNewton => CurvaturePolicy::GaussNewton,
    }
}

/// Tries of a static solve's line search, at least.
const STATIC_TRIES: usize = 8;

/// Stiffness of the springs that hold a labelled edge to the body [N/m].
const HOLD_STIFFNESS: f64 = 100.0;
