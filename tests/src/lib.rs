//! Support for tests across crates: small simulations put together by hand,
//! without a scene file.
#![doc = ""]
#![doc = include_str!("../README.md")]

use selvedge_collision::ContactSource;
use selvedge_energy::DofLayout;
use selvedge_integrator::{
    AssemblyOptions, BackwardEuler, ControlSettings, DualSystem, EndReason, Fixed, Inertia,
    NewtonSettings, NewtonSystem, Outcome, Pins, RelaxationSettings, ScenePlan, Settings,
    Simulation, SimulationError, State, StopSettings, Term,
};
use selvedge_linsolve::{BlockFilter, BlockJacobi, Direct, Mpcg, MpcgSettings, StopNorm, Sums};
use selvedge_shell_model::fabric::{BendingRigidity, Fabric, MembraneModuli};
use selvedge_shell_model::sheet::Sheet;
use selvedge_shell_model::{
    BendingOptions, DampingKind, SharedScalar, ShellMesh, bending_term, drag_term, lumped_masses,
    membrane_term, seam_term,
};

pub mod suite;

/// Gravity of a [`Setup`], along −y [m/s²].
pub const GRAVITY: f64 = 9.81;

/// Linear solver of a [`Setup`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Solver {
    /// Conjugate gradients in double precision.
    Double,
    /// Conjugate gradients in single precision, sums in double.
    Single,
    /// The same with sums in single precision too.
    SingleThroughout,
    /// Sparse Cholesky, for statics.
    Direct,
}

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
    /// Linear solver.
    pub solver: Solver,
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
            gravity: [0.0, -GRAVITY, 0.0],
            pinned: Vec::new(),
            terms: Vec::new(),
            contacts: Vec::new(),
            newton: NewtonSettings {
                tolerance: 1e-7,
                iterations: 30,
                ..NewtonSettings::default()
            },
            solver: Solver::Double,
            linear_tolerance: 1e-6,
            settings: Settings {
                duration: 1.0,
                control: ControlSettings::default(),
                relaxation: RelaxationSettings::OFF,
                stop: StopSettings {
                    early: false,
                    ..StopSettings::default()
                },
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
        let options = BendingOptions {
            damping: self.damping,
            ..BendingOptions::default()
        };
        let bending = bending_term(&self.mesh, fabric, &options).expect("bending");
        if !bending.is_empty() {
            terms.push(Term::fabric(bending));
        }
        if let Some(drag) = drag_term(&self.mesh, fabric).expect("drag") {
            terms.push(Term::fixed(drag));
        }
        let masses = lumped_masses(&self.mesh, fabric).expect("masses");
        let weights: Vec<f64> = masses.iter().flat_map(|m| [1.0 / m; 3]).collect();
        let settings = MpcgSettings {
            tolerance: self.linear_tolerance,
            max_iterations: 5000,
            norm: StopNorm::Weighted(weights.into()),
            ..MpcgSettings::default()
        };
        let system = system(points, &terms, self.solver, settings);
        let pins = (!self.pinned.is_empty()).then(|| {
            let mut filter = BlockFilter::new();
            for &p in &self.pinned {
                filter.fix(p, [0.0; 3]).expect("a free point");
            }
            let places = self
                .pinned
                .iter()
                .map(|p| self.positions[*p as usize])
                .collect();
            Pins {
                filter,
                points: self.pinned.clone(),
                trajectory: Box::new(Fixed(places)),
            }
        });
        let plan = ScenePlan {
            layout: DofLayout::points(points),
            owners: Vec::new(),
            inertia: Inertia {
                weightless: Vec::new(),
                masses,
                gravity: self.gravity,
                ..Inertia::default()
            },
            terms,
            contacts: self.contacts,
            pins,
            system,
        };
        let mut state = State::at_rest(&self.positions);
        state.v.copy_from_slice(self.velocities.as_flattened());
        let integrator = BackwardEuler::new(self.newton).expect("Newton settings");
        Simulation::new(plan, state, Box::new(integrator), self.settings).expect("a valid plan")
    }
}

fn system(
    points: usize,
    terms: &[Term],
    solver: Solver,
    settings: MpcgSettings,
) -> Box<dyn NewtonSystem> {
    let options = AssemblyOptions::default();
    match solver {
        Solver::Double => {
            let cg = Mpcg::<f64>::new(Box::new(BlockJacobi::default()), settings);
            Box::new(DualSystem::new(points, terms, options, Box::new(cg)).expect("system"))
        }
        Solver::Single | Solver::SingleThroughout => {
            let sums = match solver {
                Solver::SingleThroughout => Sums::OfVectors,
                _ => Sums::Double,
            };
            let settings = MpcgSettings { sums, ..settings };
            let cg = Mpcg::<f32>::new(Box::new(BlockJacobi::default()), settings);
            Box::new(DualSystem::new(points, terms, options, Box::new(cg)).expect("system"))
        }
        Solver::Direct => {
            let direct = Box::new(Direct::default());
            Box::new(DualSystem::<f64>::new(points, terms, options, direct).expect("system"))
        }
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

/// Number of a sheet's points in each of its rows, which lie at equal `v`.
pub fn rows(sheet: &Sheet) -> Vec<Vec<u32>> {
    let mut rows: Vec<Vec<u32>> = Vec::new();
    let mut at = f64::NEG_INFINITY;
    for (i, p) in sheet.flat.iter().enumerate() {
        if p[1] > at {
            at = p[1];
            rows.push(Vec::new());
        }
        if let Some(row) = rows.last_mut() {
            row.push(i as u32);
        }
    }
    rows
}

/// Points of a sheet that lie between the ends of their row: with the ends and
/// where between them.
pub fn straight_pairs(sheet: &Sheet) -> Vec<(u32, [u32; 2], f64)> {
    let mut pairs = Vec::new();
    for row in rows(sheet) {
        let [a, b] = [row[0], row[row.len() - 1]];
        let [start, end] = [a, b].map(|p| sheet.flat[p as usize][0]);
        for &p in &row[1..row.len() - 1] {
            let share = (sheet.flat[p as usize][0] - start) / (end - start);
            pairs.push((p, [a, b], share));
        }
    }
    pairs
}

/// Springs of so many N/m that keep the rows of a sheet straight, so that it
/// bends to a cylinder.
pub fn straight_rows(sheet: &Sheet, stiffness: f64) -> selvedge_shell_model::Term {
    seam_term(&straight_pairs(sheet), SharedScalar::new(stiffness))
}

/// Stiffness [N/m] for [`straight_rows`] that bending of a rigidity [N·m] over
/// rows so far apart [m] does not move.
pub fn tie_stiffness(rigidity: f64, spacing: f64) -> f64 {
    1e5 * rigidity / (spacing * spacing)
}

/// Mean position of some points [m].
pub fn mean(simulation: &Simulation, points: &[u32]) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for &p in points {
        let x = point(simulation, p);
        for i in 0..3 {
            sum[i] += x[i] / points.len() as f64;
        }
    }
    sum
}

/// `layers` copies of a mesh without any connection, one after the other.
///
/// # Panics
/// When the mesh is not valid.
pub fn stacked(mesh: &ShellMesh, layers: u32) -> ShellMesh {
    let n = mesh.points() as u32;
    let triangles =
        (0..layers).flat_map(|l| mesh.triangles().iter().map(move |t| t.map(|p| p + l * n)));
    let material = (0..layers).flat_map(|_| mesh.material().iter().copied());
    let fabric = (0..layers).flat_map(|_| mesh.fabric().iter().copied());
    ShellMesh::new(
        (layers * n) as usize,
        triangles.collect(),
        material.collect(),
        fabric.collect(),
    )
    .expect("copies of a valid mesh")
}

/// The exact bits of positions and velocities.
pub fn bits(simulation: &Simulation) -> Vec<u64> {
    let state = simulation.state();
    state
        .q
        .iter()
        .chain(&state.v)
        .map(|x| x.to_bits())
        .collect()
}

/// Settings for statics: steps so long that inertia plays no part and
/// backward Euler's own damping takes all motion away.
pub fn to_rest(setup: &mut Setup, step: f64, steps: usize) {
    setup.solver = Solver::Direct;
    setup.damping = DampingKind::Off;
    setup.newton = NewtonSettings {
        tolerance: 1e-9,
        iterations: 100,
        line_search_tries: 20,
        ..NewtonSettings::default()
    };
    setup.settings.duration = step * steps as f64;
    setup.settings.control.max_step = step;
}
