//! Names in a scene file to components.

use selvedge_collision::{
    BroadPhase, BruteForce, BvhParry, CollisionBackend, HashGrid, ProximityBackend,
};
use selvedge_integrator::{
    AssemblyOptions, BorderedSystem, DualSystem, Inertia, MatrixFreeSystem, NewtonSystem,
    PlanError, ReassembledSystem, Scatter, Term,
};
use selvedge_linsolve::{
    BlockFilter, ByStiffness, Filter, LinearSolver, LinsolveError, Mpcg, MpcgSettings, NoFilter,
    Real, StopNorm, Sums, preconditioner_by_name, rescued_cg, solver_by_name,
};

use crate::file::SceneFile;
use crate::file::model::{
    self, BroadPhaseKind, MatrixKind, Precision, PreconditionerKind, ProductKind, ResidualNormKind,
    SolverKind,
};

/// Newton's matrix and solver as the scene names them.
///
/// # Errors
/// [`PlanError`] for what the components refuse.
pub fn system(
    scene: &SceneFile,
    terms: &[Term],
    inertia: &Inertia,
    owners: &[u32],
) -> Result<Box<dyn NewtonSystem>, PlanError> {
    match (scene.solver.kind, scene.solver.precision) {
        // Refinement is in double precision outside, whatever is inside.
        (SolverKind::Refined, _) | (_, Precision::F64) => {
            with_precision::<f64>(scene, terms, inertia, owners)
        }
        (_, Precision::Mixed | Precision::F32) => {
            with_precision::<f32>(scene, terms, inertia, owners)
        }
    }
}

fn with_precision<T: Real>(
    scene: &SceneFile,
    terms: &[Term],
    inertia: &Inertia,
    owners: &[u32],
) -> Result<Box<dyn NewtonSystem>, PlanError>
where
    BlockFilter: Filter<T>,
    NoFilter: Filter<T>,
{
    let options = AssemblyOptions {
        scatter: match scene.assembly.scatter {
            model::Scatter::Coloured => Scatter::Coloured,
            model::Scatter::Atomics => Scatter::Atomics,
        },
        chunk: scene.assembly.chunk,
    };
    let masses = &inertia.masses;
    let of_yarns = inertia.coupled.is_some();
    let solver = solver::<T>(scene, inertia)?;
    let mass = inertia.coupled.as_deref();
    if scene.solver.product == ProductKind::MatrixFree {
        let system = MatrixFreeSystem::new(masses.len(), owners, terms, mass, options, solver)?;
        return Ok(Box::new(system));
    }
    if of_yarns {
        let system = BorderedSystem::new(masses.len(), owners, terms, mass, options, solver)?;
        return Ok(Box::new(system));
    }
    Ok(match scene.solver.matrix {
        MatrixKind::Dual => Box::new(DualSystem::new(masses.len(), terms, options, solver)?),
        MatrixKind::Reassembled => Box::new(ReassembledSystem::new(
            masses.len(),
            terms,
            options,
            solver,
        )?),
    })
}

/// Points from which multigrid beats incomplete factorisation; see
/// `docs/theory/linear-systems.md`.
const MULTIGRID_FROM: usize = 5000;

/// Stiffness over mass ([`ByStiffness`]) above which what multigrid takes to prepare pays
/// there; at 14 (garments with edges of 1 cm) both cost the same.
const MULTIGRID_ABOVE: f64 = 12.0;

fn solver<T: Real>(
    scene: &SceneFile,
    inertia: &Inertia,
) -> Result<Box<dyn LinearSolver<T>>, LinsolveError> {
    // An inexact step is a descent direction only in the norm of its residual.
    let norm = match scene.integrator.residual_norm {
        ResidualNormKind::Mass => {
            let points = inertia.masses.iter().flat_map(|m| [1.0 / m; 3]);
            let scalars = inertia.scalar_masses.iter().map(|m| 1.0 / m);
            StopNorm::Weighted(points.chain(scalars).collect())
        }
        ResidualNormKind::Paper => StopNorm::Euclidean,
    };
    let settings = MpcgSettings {
        tolerance: scene.solver.tolerance,
        max_iterations: scene.solver.max_iterations,
        norm,
        sums: match scene.solver.precision {
            Precision::F32 => Sums::OfVectors,
            Precision::Mixed | Precision::F64 => Sums::Double,
        },
        ..MpcgSettings::default()
    };
    let kind = match scene.solver.kind {
        SolverKind::Cg => "cg",
        SolverKind::Direct => "direct",
        SolverKind::Refined => "refined",
    };
    let matrix_free = scene.solver.product == ProductKind::MatrixFree;
    let many = inertia.masses.len() >= MULTIGRID_FROM;
    let preconditioner = match scene.solver.preconditioner {
        PreconditionerKind::Auto if matrix_free => "node-jacobi",
        PreconditionerKind::Auto if inertia.coupled.is_some() => "node-ic",
        PreconditionerKind::Auto if many => "multigrid",
        PreconditionerKind::Auto => "block-ic",
        PreconditionerKind::None => "none",
        PreconditionerKind::Diagonal => "diagonal",
        PreconditionerKind::BlockJacobi => "block-jacobi",
        PreconditionerKind::NodeJacobi => "node-jacobi",
        PreconditionerKind::NodeIc => "node-ic",
        PreconditionerKind::IncompleteCholesky => "block-ic",
        PreconditionerKind::Chebyshev => "chebyshev",
        PreconditionerKind::Multigrid => "multigrid",
    };
    if matrix_free {
        // The rescue that comes with the name would factor a matrix.
        let preconditioner = preconditioner_by_name(preconditioner)?;
        return Ok(Box::new(Mpcg::new(preconditioner, settings)));
    }
    if kind == "cg"
        && preconditioner == "multigrid"
        && scene.solver.preconditioner == PreconditionerKind::Auto
    {
        let masses = inertia.masses.clone().into();
        let chosen = ByStiffness::new(
            masses,
            MULTIGRID_ABOVE,
            preconditioner_by_name("multigrid")?,
        );
        return Ok(Box::new(rescued_cg(Box::new(chosen), settings)));
    }
    solver_by_name::<T>(kind, preconditioner, settings)
}

/// The broad phase that the scene names.
pub fn broad_phase(kind: BroadPhaseKind) -> Box<dyn BroadPhase> {
    match kind {
        BroadPhaseKind::Bvh => Box::new(BvhParry::new()),
        BroadPhaseKind::Grid => Box::new(HashGrid::new()),
        BroadPhaseKind::BruteForce => Box::new(BruteForce),
    }
}

/// The collision back-end on the broad phase that the scene names.
pub fn backend(kind: BroadPhaseKind) -> Box<dyn CollisionBackend> {
    Box::new(ProximityBackend::new(broad_phase(kind)))
}
