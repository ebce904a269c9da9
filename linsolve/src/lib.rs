//! Block sparse operators, filters, Krylov and direct solvers, preconditioners
