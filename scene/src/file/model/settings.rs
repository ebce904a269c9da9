use std::path::PathBuf;

use serde::{Deserialize, Serialize};

/// `true`, `false` or `"auto"`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Switch {
    /// Decided by the scene.
    Auto,
    /// On.
    On,
    /// Off.
    Off,
}

impl Serialize for Switch {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Switch::Auto => serializer.serialize_str("auto"),
            Switch::On => serializer.serialize_bool(true),
            Switch::Off => serializer.serialize_bool(false),
        }
    }
}

impl<'de> Deserialize<'de> for Switch {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(untagged)]
        enum Raw {
            Bool(bool),
            Text(String),
        }
        match Raw::deserialize(deserializer)? {
            Raw::Bool(true) => Ok(Switch::On),
            Raw::Bool(false) => Ok(Switch::Off),
            Raw::Text(word) if word == "auto" => Ok(Switch::Auto),
            Raw::Text(word) => Err(serde::de::Error::unknown_variant(
                &word,
                &["auto", "true", "false"],
            )),
        }
    }
}

/// Time and gravity.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SimulationSettings {
    /// Simulated time \[s\].
    pub duration: f64,
    /// Acceleration of gravity [m/s²].
    pub gravity: [f64; 3],
}

/// Time stepping and Newton's method.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct IntegratorSettings {
    /// Time stepping scheme.
    pub kind: IntegratorKind,
    /// What a try of the line search has to bring.
    pub line_search: LineSearchKind,
    /// Largest time step \[s\].
    pub max_step: f64,
    /// Smallest time step: when a step fails below it, the run ends with an error \[s\].
    pub min_step: f64,
    /// Residual at which a step is accepted, in the unit of `residual_norm` [m/s or N·s].
    pub newton_tolerance: f64,
    /// Velocity error of any single point that must be met as well [m/s].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point_tolerance: Option<f64>,
    /// Iterations before a step is split.
    pub newton_iterations: usize,
    /// Tries of the line search, each half as long as the one before.
    pub line_search_halvings: usize,
    /// Factor applied to the step after a failure.
    pub step_splitting: f64,
    /// Accepted steps in a row before the step grows again.
    pub recovery_steps: usize,
    /// Newton iterations above which a step does not count for that.
    pub recovery_iterations: usize,
    /// Norm of the residual.
    pub residual_norm: ResidualNormKind,
    /// Second derivatives in Newton's matrix.
    pub curvature: CurvatureKind,
    /// Largest unbalanced force at which a static solve ends \[N\].
    pub force_tolerance: f64,
    /// Whether friction acts in a static solve.
    pub static_friction: bool,
}

/// Time stepping scheme.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum IntegratorKind {
    /// Backward Euler, solved by Newton's method in velocities.
    BackwardEuler,
    /// Backward Euler, one linear system a step.
    LinearisedEuler,
    /// No time: Newton's method towards balanced forces.
    Static,
}

/// What a try of the line search has to bring.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LineSearchKind {
    /// `work` for cloth of yarns, else `residual`.
    Auto,
    /// A smaller residual.
    Residual,
    /// Less of the step's potential.
    Work,
}

/// Norm of the residual.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ResidualNormKind {
    /// Mean velocity error [m/s], the same for every mesh.
    Mass,
    /// Euclidean norm [N·s], grows with the number of points.
    Paper,
}

/// Second derivatives in Newton's matrix.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CurvatureKind {
    /// Exact; positive semidefinite for an iteration that meets trouble.
    Auto,
    /// Always exact; trouble is left to step splitting.
    Exact,
    /// Always positive semidefinite.
    Projected,
    /// Products of first derivatives only: semidefinite, no upper bound.
    GaussNewton,
}

/// Gentle start.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RelaxationSettings {
    /// Whether to begin gently.
    pub enabled: bool,
    /// Length of the window \[s\].
    pub duration: f64,
    /// First step relative to `integrator.max_step`.
    pub step_fraction: f64,
    /// Fabric stiffness at the start of the window, relative to its own.
    pub stiffness_start: f64,
}

/// Early end.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StopSettings {
    /// Whether to end before `simulation.duration` when the cloth is at rest.
    pub early: bool,
    /// Percentile of the points' kinetic energies that counts [%].
    pub percentile: f64,
    /// Kinetic energy of one point below which it rests \[J\].
    pub kinetic_energy: f64,
    /// Time for which every step has to stay below \[s\].
    pub window: f64,
}

/// Dissipation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DampingSettings {
    /// Form of the dissipation.
    pub kind: DampingKind,
    /// Drag of still air, instead of every fabric's own [1/s].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drag: Option<f64>,
    /// Viscous over elastic membrane moduli, instead of every fabric's own \[s\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub membrane: Option<f64>,
    /// Viscous over elastic bending rigidity, instead of every fabric's own \[s\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bending: Option<f64>,
}

/// Form of the dissipation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DampingKind {
    /// Forces proportional to the rate of strain.
    Rate,
    /// A potential of the strain gained in the step: variational.
    Incremental,
    /// No dissipation in the fabric, no drag, no damping of yarns.
    None,
}

/// Linear systems.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SolverSettings {
    /// Linear solver.
    pub kind: SolverKind,
    /// Preconditioner of `cg` and `refined`.
    pub preconditioner: PreconditionerKind,
    /// Residual relative to the right-hand side.
    pub tolerance: f64,
    /// How the tolerance follows from the iteration.
    pub forcing: ForcingKind,
    /// Iterations of one solve.
    pub max_iterations: usize,
    /// Precision of the linear systems.
    pub precision: Precision,
    /// Storage of the matrix.
    pub matrix: MatrixKind,
    /// How the matrix is multiplied with.
    pub product: ProductKind,
}

/// How exactly the linear systems of a step are solved.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ForcingKind {
    /// To `tolerance`.
    Constant,
    /// To between `tolerance` and 0.1, by the progress of the iteration.
    EisenstatWalker,
}

/// Linear solver.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SolverKind {
    /// Filtered conjugate gradients.
    Cg,
    /// Sparse Cholesky factorisation.
    Direct,
    /// Single-precision conjugate gradients, refined in double precision.
    Refined,
}

/// Preconditioner of `cg` and `refined`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PreconditionerKind {
    /// By the number of points.
    Auto,
    /// None.
    None,
    /// Inverse diagonal.
    Diagonal,
    /// Inverse 3×3 diagonal blocks.
    BlockJacobi,
    /// Inverse diagonal blocks of points with their arc lengths.
    NodeJacobi,
    /// Incomplete Cholesky on blocks of points with their arc lengths.
    NodeIc,
    /// Block incomplete Cholesky, IC(0).
    IncompleteCholesky,
    /// Chebyshev polynomial on block-jacobi.
    Chebyshev,
    /// Algebraic multigrid by smoothed aggregation.
    Multigrid,
}

/// Precision of the linear systems.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Precision {
    /// Matrix and vectors in single, the rest in double precision.
    Mixed,
    /// Double precision throughout.
    F64,
    /// As mixed, with the sums of conjugate gradients in single precision too.
    F32,
}

/// Storage of the matrix.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MatrixKind {
    /// Static pattern and contacts kept apart.
    Dual,
    /// Everything rebuilt every iteration: the baseline.
    Reassembled,
}

/// How the matrix of conjugate gradients is multiplied with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ProductKind {
    /// Put together once for each system.
    Assembled,
    /// Stencil by stencil.
    MatrixFree,
}

/// Summation of forces and matrices.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AssemblySettings {
    /// How local matrices reach the global one.
    pub scatter: Scatter,
    /// Order of the points in memory.
    pub reorder: Reorder,
    /// Threads; 0 takes all cores. Results do not depend on it.
    pub threads: usize,
    /// Stencils handed to a thread at once.
    pub chunk: usize,
}

/// How local matrices reach the global one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scatter {
    /// Stencils of one colour in parallel, plain writes.
    Coloured,
    /// Atomic additions: not repeatable to the bit.
    Atomics,
}

/// Order of the points in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reorder {
    /// Reverse Cuthill-McKee for meshes; yarns as they were knitted or woven.
    Auto,
    /// Reverse Cuthill-McKee.
    Rcm,
    /// As the mesh numbers them.
    None,
}

/// Contact and friction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ContactSettings {
    /// Contact of cloth with cloth; `auto` decides by the scene (`selvedge plan`).
    #[serde(rename = "self")]
    pub self_contact: Switch,
    /// Search for nearby pairs.
    pub broad_phase: BroadPhaseKind,
    /// Repulsion.
    pub potential: PotentialKind,
    /// Stiffness of the repulsion of one pair [N/m].
    pub stiffness: f64,
    /// Stiffness of the repulsion of one point from a body [N/m].
    pub body_stiffness: f64,
    /// Distance that cloth keeps from cloth \[m\].
    pub thickness: f64,
    /// Distance that cloth keeps from bodies \[m\].
    pub body_thickness: f64,
    /// Whether bodies meet edges and insides of triangles too, not points alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body_faces: Option<bool>,
    /// Time in which cloth that begins closer to cloth than its thickness parts \[s\].
    pub release: f64,
    /// Whether separate pieces that cross at the start are moved apart.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub part_crossed: Option<bool>,
    /// Coulomb friction coefficient of every pair, instead of the materials' own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction: Option<f64>,
    /// Friction.
    pub friction_model: FrictionModel,
    /// Stiffness of the anchors of `friction_model = "anchored"`, relative to that of the contact.
    pub anchor_stiffness: f64,
}

/// Search for nearby pairs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BroadPhaseKind {
    /// Tree of boxes.
    Bvh,
    /// Hash grid.
    Grid,
    /// Every pair: for tests.
    BruteForce,
}

/// Repulsion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PotentialKind {
    /// Penalty on the missing distance.
    Quadratic,
}

/// Friction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FrictionModel {
    /// Springs to anchors that slip: true sticking.
    Anchored,
    /// Smoothed and variational: creeps slowly.
    Lagged,
    /// No friction.
    None,
}

/// Triangulation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeshSettings {
    /// Target edge length of cloth meshes \[m\].
    pub edge_length: f64,
}

/// Results.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OutputSettings {
    /// Folder of the results, relative to where the program runs.
    pub directory: PathBuf,
    /// Recorded frames per simulated second [1/s].
    pub frame_rate: f64,
    /// Seconds of computing between checkpoints; 0 writes none \[s\].
    pub checkpoint_seconds: f64,
    /// Whether to write `report.html`.
    pub report: bool,
    /// Whether to write `run.mcap`.
    pub recording: bool,
}

/// Sewing a garment together on its body.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AssembleSettings {
    /// Least distance of the panels from the body at the start \[m\].
    pub clearance: f64,
    /// What `clearance` grows by for every layer \[m\].
    pub layer_clearance: f64,
    /// Iterations that bend the panels around the body before sewing.
    pub pre_iterations: usize,
    /// Time over which the seams are closed \[s\].
    pub seam_time: f64,
    /// Stiffness of a seam spring [N/m].
    pub seam_stiffness: f64,
    /// Time to settle after sewing \[s\].
    pub settle_time: f64,
    /// Largest time step of both \[s\]. Sewing goes without velocities, so that
    /// its steps decide where it ends and are none of the drape's.
    pub max_step: f64,
    /// Edge length of the mesh on which a garment is sewn \[m\]; finer ones
    /// start from its drape. 0 sews on the garment's own mesh.
    pub coarsest: f64,
}
