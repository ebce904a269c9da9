//! Support for tests across crates: small simulations put together by hand,
//! without a scene file.

use selvedge_collision::ContactSource;
use selvedge_energy::DofLayout;
use selvedge_integrator::{
    AssemblyOptions, BackwardEuler, ControlSettings, DualSystem, EndReason, Fixed, Inertia,
    NewtonSettings, Outcome, Pins, RelaxationSettings, ScenePlan, Settings, Simulation,
    SimulationError, State, StopSettings, Term,
};
use selvedge_linsolve::{BlockFilter, BlockJacobi, Mpcg, MpcgSettings, StopNorm};
use selvedge_shell_model::fabric::{BendingRigidity, Fabric, MembraneModuli};
use selvedge_shell_model::{
    BendingOptions, DampingKind, ShellMesh, bending_term, drag_term, lumped_masses, membrane_term,
};

/// A cloth and what acts on it; every field may be changed before
/// [`simulation`](Self::simulation).
pub struct Setup {
    /// The mesh.
    pub mesh: ShellMesh,
    /// Initial positions [m].
    pub positions: Vec<[f64; 3]>,
    /// Initial velocities [m/s].
    pub velocities: Vec<[f64; 3]>,
    /// Fabrics by index.
    pub fabrics: Vec<Fabric>,
    /// Damping of the fabrics.
    pub damping: DampingKind,
    /// Gravity [m/s²].
    pub gravity: [f64; 3],
    /// Points that stay where they are.
    pub pinned: Vec<u32>,
    /// Further terms.
    pub terms: Vec<Term>,
    /// Contacts.
    pub contacts: Vec<Box<dyn ContactSource>>,
    /// Newton's method.
    pub newton: NewtonSettings,
    /// Relative tolerance of the linear solver.
    pub linear_tolerance: f64,
    /// Steps, relaxation, stop.
    pub settings: Settings,
}

impl Setup {
    /// A mesh of one fabric, nothing pinned, tight tolerances, no relaxation,
    /// no early stop.
    pub fn new(mesh: ShellMesh, positions: Vec<[f64; 3]>, fabric: Fabric) -> Self {
        Self {
            velocities: vec![[0.0; 3]; positions.len()],
            mesh,
            positions,
            fabrics: vec![fabric],
            damping: DampingKind::Rate,
            gravity: [0.0, -9.81, 0.0],
            pinned: Vec::new(),
            terms: Vec::new(),
            contacts: Vec::new(),
            newton: NewtonSettings { tolerance: 1e-7, iterations: 30, ..NewtonSettings::default() },
            linear_tolerance: 1e-6,
            settings: Settings {
                duration: 1.0,
                control: ControlSettings::default(),
                relaxation: RelaxationSettings::OFF,
                stop: StopSettings { early: false, ..StopSettings::default() },
            },
        }
    }

    /// Puts plan and integrator together.
    ///
    /// # Panics
    /// When the setup is not valid.
    pub fn simulation(self) -> Simulation {
        let points = self.mesh.points();
        let mut terms = self.terms;
        let fabric = &self.fabrics;
        let membrane = membrane_term(&self.mesh, fabric, self.damping).expect("membrane");
        terms.push(Term::fabric(membrane));
        let options = BendingOptions { damping: self.damping, ..BendingOptions::default() };
        let bending = bending_term(&self.mesh, fabric, &options).expect("bending");
        if !bending.is_empty() {
            terms.push(Term::fabric(bending));
        }
        if let Some(drag) = drag_term(&self.mesh, fabric).expect("drag") {
            terms.push(Term::fixed(drag));
        }
        let masses = lumped_masses(&self.mesh, fabric).expect("masses");
        let weights: Vec<f64> = masses.iter().flat_map(|m| [1.0 / m; 3]).collect();
        let solver = Mpcg::<f64>::new(
            Box::new(BlockJacobi::default()),
            MpcgSettings {
                tolerance: self.linear_tolerance,
                max_iterations: 5000,
                norm: StopNorm::Weighted(weights.into()),
                ..MpcgSettings::default()
            },
        );
        let options = AssemblyOptions::default();
        let system =
            DualSystem::new(points, &terms, options, Box::new(solver)).expect("system");
        let pins = (!self.pinned.is_empty()).then(|| {
            let mut filter = BlockFilter::new();
            for &p in &self.pinned {
                filter.fix(p, [0.0; 3]).expect("a free point");
            }
            let places = self.pinned.iter().map(|p| self.positions[*p as usize]).collect();
            Pins { filter, points: self.pinned.clone(), trajectory: Box::new(Fixed(places)) }
        });
        let plan = ScenePlan {
            layout: DofLayout::points(points),
            inertia: Inertia { masses, gravity: self.gravity },
            terms,
            contacts: self.contacts,
            pins,
            system: Box::new(system),
        };
        let mut state = State::at_rest(&self.positions);
        state.v.copy_from_slice(self.velocities.as_flattened());
        let integrator = BackwardEuler::new(self.newton).expect("Newton settings");
        Simulation::new(plan, state, Box::new(integrator), self.settings).expect("a valid plan")
    }
}

/// Runs to the end, counting nothing.
///
/// # Errors
/// What the simulation returns.
pub fn run(simulation: &mut Simulation) -> Result<EndReason, SimulationError> {
    loop {
        if let Outcome::Ended(reason) = simulation.advance()? {
            return Ok(reason);
        }
    }
}

/// A fabric without any dissipation: `k` isotropic with Poisson's ratio zero
/// [N/m], `rigidity` [N·m], `density` [kg/m²].
///
/// # Panics
/// For values that no fabric can have.
pub fn plain_fabric(stiffness: f64, rigidity: f64, density: f64) -> Fabric {
    let membrane = MembraneModuli::isotropic(stiffness, 0.0).expect("moduli");
    let bending = BendingRigidity::isotropic(rigidity).expect("rigidity");
    let mut fabric = Fabric::new("plain", density, membrane, bending).expect("fabric");
    fabric.membrane_damping = 0.0;
    fabric.bending_damping = 0.0;
    fabric.drag = 0.0;
    fabric
}

/// Position of point `i` [m].
pub fn point(simulation: &Simulation, i: u32) -> [f64; 3] {
    let q = &simulation.state().q;
    std::array::from_fn(|k| q[3 * i as usize + k])
}
