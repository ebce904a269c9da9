use selvedge_collision::CollisionError;
use selvedge_linsolve::LinsolveError;

/// A plan that cannot be simulated.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// Two arrays that describe the same points differ in length.
    #[error("{what} has {found} entries where the layout asks for {expected}")]
    Length {
        /// Which array.
        what: &'static str,
        /// Entries found.
        found: usize,
        /// Entries expected.
        expected: usize,
    },
    /// A mass is zero, negative or not finite.
    #[error("point {point} has mass {mass} kg; masses must be positive and finite")]
    Mass {
        /// Index of the point.
        point: usize,
        /// The mass [kg].
        mass: f64,
    },
    /// A stencil names a node that does not exist.
    #[error("term `{term}`: stencil {stencil} names node {node}, but there are {count}")]
    Node {
        /// Name of the term.
        term: String,
        /// Index of the stencil.
        stencil: usize,
        /// The node.
        node: u32,
        /// Number of nodes of its kind.
        count: usize,
    },
    /// A term couples scalar unknowns, which this assembler does not store.
    #[error("term `{term}` has scalar unknowns; this assembler stores points only")]
    Scalars {
        /// Name of the term.
        term: String,
    },
    /// The points at which scalars live descend or do not exist.
    #[error("the points of the scalars must ascend and be below {points}")]
    Owners {
        /// Number of points.
        points: usize,
    },
    /// The matrix of the plan stores lumped masses only.
    #[error("inertia couples unknowns, which the matrix `{system}` does not store")]
    CoupledMass {
        /// Name of the system.
        system: String,
    },
    /// A setting is outside its range.
    #[error("`{name}` is {value}; it must be {allowed}")]
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// A linear-algebra component refused its settings.
    #[error(transparent)]
    Linear(#[from] LinsolveError),
}

/// Why a step was not accepted. State and history are as before the step.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StepError {
    /// The Newton budget ran out above the tolerance.
    #[error(
        "Newton's method stopped after {iterations} iterations at a residual of \
         {residual:.3e} (tolerance {tolerance:.3e})"
    )]
    NotConverged {
        /// Iterations done.
        iterations: usize,
        /// Residual in the chosen norm.
        residual: f64,
        /// Tolerance in the same norm.
        tolerance: f64,
    },
    /// The Newton budget ran out with one point above its own tolerance.
    #[error(
        "Newton's method stopped after {iterations} iterations with a velocity error of \
         {error:.3e} m/s at point {point} (tolerance {tolerance:.3e} m/s)"
    )]
    PointNotConverged {
        /// Iterations done.
        iterations: usize,
        /// The point.
        point: usize,
        /// Its velocity error [m/s].
        error: f64,
        /// Tolerance [m/s].
        tolerance: f64,
    },
    /// No line-search try reduced the residual.
    #[error(
        "the line search found no smaller residual than {residual:.3e} in iteration {iteration}"
    )]
    LineSearch {
        /// Newton iteration.
        iteration: usize,
        /// Residual before the iteration.
        residual: f64,
    },
    /// A value is NaN or infinite.
    #[error(
        "{what} of point {point} at ({x:.4}, {y:.4}, {z:.4}) m is not finite{}{}",
        from_term(term),
        because(why)
    )]
    NotFinite {
        /// Which quantity.
        what: &'static str,
        /// First point met.
        point: usize,
        /// Its position at the start of the step [m].
        x: f64,
        /// See `x`.
        y: f64,
        /// See `x`.
        z: f64,
        /// Term that gave the value, where one is known.
        term: Option<Box<str>>,
        /// Why, where the term can say.
        why: Option<Box<str>>,
    },
    /// Points moved beyond the range of the contact candidates, repeatedly.
    #[error("points moved beyond the contact margin {tries} times in one step")]
    ContactMargin {
        /// Detections done.
        tries: usize,
    },
    /// A static solve found no direction that lowers the energy.
    #[error(
        "no direction lowers the energy any further; the largest unbalanced force, {force:.3e} N \
         (tolerance {tolerance:.3e} N), acts on point {point} at ({x:.4}, {y:.4}, {z:.4}) m"
    )]
    Stalled {
        /// The point.
        point: usize,
        /// Its position [m].
        x: f64,
        /// See `x`.
        y: f64,
        /// See `x`.
        z: f64,
        /// Force on it [N].
        force: f64,
        /// Tolerance [N].
        tolerance: f64,
    },
    /// The linear solver failed.
    #[error("linear solve: {0}")]
    Linear(#[from] LinsolveError),
    /// Contact detection or evaluation failed.
    #[error("contact: {0}")]
    Contact(#[from] CollisionError),
}

fn from_term(term: &Option<Box<str>>) -> String {
    term.as_ref()
        .map(|t| format!(", from term `{t}`"))
        .unwrap_or_default()
}

fn because(why: &Option<Box<str>>) -> String {
    why.as_ref().map(|w| format!(": {w}")).unwrap_or_default()
}

/// Why a simulation ended before its time.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SimulationError {
    /// The step was cut below the smallest one allowed.
    #[error(
        "the step fell to {dt:.3e} s after {rejections} rejections in a row at t = {time:.6} s; \
         the last reason: {source}"
    )]
    StepUnderflow {
        /// The refused step [s].
        dt: f64,
        /// Simulated time [s].
        time: f64,
        /// Rejections in a row.
        rejections: usize,
        /// Why the last one was rejected.
        #[source]
        source: StepError,
    },
    /// An error that a smaller step does not mend.
    #[error("at t = {time:.6} s: {source}")]
    Step {
        /// Simulated time [s].
        time: f64,
        /// The error.
        #[source]
        source: StepError,
    },
    /// The plan is not valid.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// A snapshot does not belong to this plan.
    #[error("the checkpoint does not fit this scene: {what}")]
    Snapshot {
        /// What differs.
        what: String,
    },
}
