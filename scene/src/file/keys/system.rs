//! Linear systems: how they are put together and solved.

use super::super::spec::Kind::Choice;
use super::super::spec::{FRACTION, Table, derived, integer, key, number};

pub(super) static SOLVER: Table = Table::new(
    "",
    &[
        derived(
            "kind",
            Choice(&[
                ("cg", "filtered conjugate gradients"),
                ("direct", "sparse Cholesky factorisation"),
                (
                    "refined",
                    "single-precision conjugate gradients, refined in double precision",
                ),
            ]),
            "`cg`; `direct` with `integrator.kind` = \"static\"",
            "Linear solver.",
        ),
        key(
            "preconditioner",
            Choice(&[
                (
                    "auto",
                    "`incomplete-cholesky` below 5000 points; from there `multigrid` where the \
                     matrix is stiff for its masses, else `block-jacobi`; `node-ic` for yarns: \
                     the fastest here",
                ),
                ("none", "none"),
                ("diagonal", "inverse diagonal"),
                ("block-jacobi", "inverse 3×3 diagonal blocks"),
                (
                    "node-jacobi",
                    "inverse diagonal blocks of points with their arc lengths",
                ),
                (
                    "node-ic",
                    "incomplete Cholesky on blocks of points with their arc lengths",
                ),
                ("incomplete-cholesky", "block incomplete Cholesky, IC(0)"),
                ("chebyshev", "Chebyshev polynomial on block-jacobi"),
                (
                    "multigrid",
                    "algebraic multigrid: iterations hardly grow with the number of points",
                ),
            ]),
            "\"auto\"",
            "Preconditioner of `cg` and `refined`.",
        ),
        key(
            "tolerance",
            number("", FRACTION),
            "1e-2",
            "Residual relative to the right-hand side.",
        ),
        key(
            "forcing",
            Choice(&[
                ("constant", "always to `tolerance`"),
                (
                    "eisenstat-walker",
                    "to between `tolerance` and 0.1, the more exactly the faster the residual of \
                     Newton's iteration falls",
                ),
            ]),
            "\"constant\"",
            "How exactly the systems of one step are solved.",
        ),
        key(
            "max_iterations",
            integer(1, 1_000_000),
            "500",
            "Iterations of one solve.",
        ),
        derived(
            "precision",
            Choice(&[
                (
                    "mixed",
                    "matrix and vectors in single, the rest in double precision",
                ),
                ("f64", "double precision throughout"),
                (
                    "f32",
                    "as `mixed`, with the sums of `cg` in single precision too",
                ),
            ]),
            "`mixed`; `f64` with `integrator.kind` = \"static\"",
            "Precision of the linear systems.",
        ),
        key(
            "matrix",
            Choice(&[
                ("dual", "static pattern and contacts kept apart"),
                (
                    "reassembled",
                    "everything rebuilt every iteration: the baseline",
                ),
            ]),
            "\"dual\"",
            "Storage of the matrix.",
        ),
        key(
            "product",
            Choice(&[
                (
                    "assembled",
                    "with the matrix, put together once for each system",
                ),
                (
                    "matrix-free",
                    "stencil by stencil, the matrix is never put together: for `cg` with \
                     `none`, `diagonal`, `block-jacobi`, `node-jacobi` (which `auto` then is) \
                     or `chebyshev`",
                ),
            ]),
            "\"assembled\"",
            "How the matrix of `cg` is multiplied with.",
        ),
    ],
);

pub(super) static ASSEMBLY: Table = Table::new(
    "",
    &[
        key(
            "scatter",
            Choice(&[
                (
                    "coloured",
                    "stencils of one colour in parallel, plain writes",
                ),
                ("atomics", "atomic additions: not repeatable to the bit"),
            ]),
            "\"coloured\"",
            "How local matrices reach the global one.",
        ),
        key(
            "reorder",
            Choice(&[
                (
                    "auto",
                    "`rcm` for meshes, yarns as they were knitted or woven",
                ),
                ("rcm", "reverse Cuthill-McKee"),
                ("none", "as the mesh numbers them"),
            ]),
            "\"auto\"",
            "Order of the points in memory.",
        ),
        key(
            "threads",
            integer(0, 4096),
            "0",
            "Threads; 0 takes all cores. Results do not depend on it.",
        ),
        key(
            "chunk",
            integer(1, 65_536),
            "64",
            "Stencils handed to a thread at once, at least; a term has 48 such pieces at most.",
        ),
    ],
);
