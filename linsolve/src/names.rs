//! Components by the names of scene files.

use crate::{
    BlockIc, BlockJacobi, Chebyshev, Diagonal, Direct, LinearSolver, LinsolveError, Mpcg,
    MpcgSettings, Multigrid, NoPreconditioner, NodeIc, NodeJacobi, Preconditioner, Real, ScalarIc,
};

/// Valid names for [`preconditioner_by_name`].
pub const PRECONDITIONERS: [&str; 9] = [
    "none",
    "diagonal",
    "block-jacobi",
    "node-jacobi",
    "node-ic",
    "ic",
    "block-ic",
    "chebyshev",
    "multigrid",
];

/// Valid names for [`solver_by_name`]; `"refined"` works on `f64` matrices only.
pub const SOLVERS: [&str; 3] = ["cg", "direct", "refined"];

/// A preconditioner by name.
///
/// # Errors
/// [`LinsolveError::UnknownName`], which lists the valid names.
pub fn preconditioner_by_name<T: Real>(
    name: &str,
) -> Result<Box<dyn Preconditioner<T>>, LinsolveError> {
    Ok(match name {
        "none" => Box::new(NoPreconditioner),
        "diagonal" => Box::new(Diagonal::default()),
        "block-jacobi" => Box::new(BlockJacobi::default()),
        "node-jacobi" => Box::new(NodeJacobi::default()),
        "node-ic" => Box::new(NodeIc::default()),
        "ic" => Box::new(ScalarIc::default()),
        "block-ic" => Box::new(BlockIc::default()),
        "chebyshev" => Box::new(Chebyshev::default()),
        "multigrid" => Box::new(Multigrid::default()),
        _ => return Err(unknown("preconditioner", name, &PRECONDITIONERS)),
    })
}

/// Conjugate gradients that turn to [`BlockIc`] for the second half of their
/// iterations where the first did not suffice; not where the preconditioner is
/// an incomplete factorisation itself, by its name.
pub fn rescued_cg<T: Real>(
    preconditioner: Box<dyn Preconditioner<T>>,
    settings: MpcgSettings,
) -> Mpcg<T> {
    let strong = ["ic", "block-ic", "node-ic"].contains(&preconditioner.name());
    let cg = Mpcg::new(preconditioner, settings);
    if strong {
        return cg;
    }
    cg.with_rescue(Box::new(BlockIc::default()))
}

/// A solver by name; `preconditioner` and the limits of `settings` are unused
/// by `"direct"`. `"cg"` is [`rescued_cg`]. `"refined"` takes the tolerance
/// for the outer residual and solves with 1e-3 inside.
///
/// # Errors
/// [`LinsolveError::UnknownName`], which lists the names valid for `T`.
pub fn solver_by_name<T: Real>(
    name: &str,
    preconditioner: &str,
    settings: MpcgSettings,
) -> Result<Box<dyn LinearSolver<T>>, LinsolveError> {
    let valid = if T::refined_exists() {
        &SOLVERS[..]
    } else {
        &SOLVERS[..2]
    };
    match name {
        "cg" => Ok(Box::new(rescued_cg(
            preconditioner_by_name(preconditioner)?,
            settings,
        ))),
        "direct" => Ok(Box::new(Direct::new(settings.tolerance))),
        "refined" if T::refined_exists() => {
            let inner = preconditioner_by_name::<f32>(preconditioner)?;
            T::refined(inner, settings).ok_or_else(|| unknown("solver", name, valid))
        }
        _ => Err(unknown("solver", name, valid)),
    }
}

fn unknown(what: &'static str, name: &str, valid: &[&str]) -> LinsolveError {
    LinsolveError::UnknownName {
        what,
        name: name.to_owned(),
        valid: valid.join(", "),
    }
}
