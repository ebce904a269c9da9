/// What can be wrong with an energy's derivatives.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EnergyError {
    /// A value, gradient or second derivative is NaN or infinite.
    #[error("term `{term}`: stencil {stencil} gives a {what} that is not finite")]
    NotFinite {
        /// Name of the batch.
        term: String,
        /// Index of the stencil.
        stencil: usize,
        /// "value", "gradient" or "hessian".
        what: &'static str,
    },
    /// A derivative disagrees with finite differences.
    #[error(
        "term `{term}`: stencil {stencil}: the {what} differs from finite differences \
         by {relative_error:.1e} (allowed {allowed:.1e})"
    )]
    Derivative {
        /// Name of the batch.
        term: String,
        /// Index of the stencil.
        stencil: usize,
        /// "gradient" or "hessian".
        what: &'static str,
        /// Error relative to the largest entry [1].
        relative_error: f64,
        /// Error that was allowed [1].
        allowed: f64,
    },
    /// A second derivative that should be positive semidefinite is not.
    #[error(
        "term `{term}`: stencil {stencil}: smallest eigenvalue {smallest:.3e} N/m \
         against a norm of {norm:.3e} N/m"
    )]
    Indefinite {
        /// Name of the batch.
        term: String,
        /// Index of the stencil.
        stencil: usize,
        /// Smallest eigenvalue [N/m].
        smallest: f64,
        /// Largest absolute eigenvalue [N/m].
        norm: f64,
    },
    /// A rigid motion changes the value, or internal forces do not balance.
    #[error(
        "term `{term}`: stencil {stencil}: {what} {amount:.1e}, relative to the term's own scale"
    )]
    NotInvariant {
        /// Name of the batch.
        term: String,
        /// Index of the stencil.
        stencil: usize,
        /// What is not balanced.
        what: &'static str,
        /// Imbalance relative to the term's scale [1].
        amount: f64,
    },
}
