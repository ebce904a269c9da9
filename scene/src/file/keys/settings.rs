use super::super::spec::Kind::{Bool, Choice, Path, Switch};
use super::super::spec::{
    FRACTION, NOT_NEGATIVE, POSITIVE, Range, Table, derived, integer, key, number, optional,
};

pub(super) static INTEGRATOR: Table = Table::new(
    "",
    &[
        derived(
            "kind",
            Choice(&[
                (
                    "backward-euler",
                    "backward Euler, solved by Newton's method in velocities",
                ),
                (
                    "linearised-euler",
                    "backward Euler, one linear system a step; the residual is reported, not \
                     controlled",
                ),
                (
                    "static",
                    "no motion: iterations of Newton's method, each with less energy, until all \
                     forces are balanced; at most `simulation.duration` / `max_step` of them, \
                     each booked as a step of `max_step`",
                ),
            ]),
            "`backward-euler`; `linearised-euler` for cloth of yarns",
            "Time stepping scheme.",
        ),
        key(
            "line_search",
            Choice(&[
                ("auto", "`work` for cloth of yarns, else `residual`"),
                ("residual", "a smaller residual"),
                (
                    "work",
                    "less of the potential of the step, by the work of the residual along the way",
                ),
            ]),
            "\"auto\"",
            "What a try of the line search has to bring.",
        ),
        key(
            "max_step",
            number("s", Range::up_to(1.0)),
            "1e-3",
            "Largest time step.",
        )
        .hint("s, not ms"),
        derived(
            "min_step",
            number("s", Range::up_to(1.0)),
            "`max_step` / 2^20",
            "Smallest time step: when a step fails below it, the run ends with an error.",
        ),
        derived(
            "newton_tolerance",
            number("m/s or N·s", POSITIVE),
            "0.01 m/s for `residual_norm = \"mass\"`, 0.001 N·s for `\"paper\"`",
            "Residual at which a step is accepted, in the unit of `residual_norm`.",
        ),
        optional(
            "point_tolerance",
            number("m/s", POSITIVE),
            "Velocity error of any single point that must be met as well: the norm alone hides \
             points of little mass beside heavy ones.",
        ),
        key(
            "newton_iterations",
            integer(1, 1000),
            "5",
            "Iterations before a step is split.",
        ),
        key(
            "line_search_halvings",
            integer(1, 60),
            "5",
            "Tries of the line search, each half as long as the one before.",
        ),
        key(
            "step_splitting",
            number("", FRACTION),
            "0.75",
            "Factor applied to the step after a failure.",
        ),
        key(
            "recovery_steps",
            integer(1, 1_000_000),
            "5",
            "Accepted steps in a row before the step grows again.",
        ),
        key(
            "recovery_iterations",
            integer(1, 1000),
            "3",
            "Newton iterations above which a step does not count for that.",
        ),
        key(
            "residual_norm",
            Choice(&[
                ("mass", "mean velocity error [m/s], the same for every mesh"),
                (
                    "paper",
                    "Euclidean norm [N·s], grows with the number of points",
                ),
            ]),
            "\"mass\"",
            "Norm of the residual.",
        ),
        key(
            "curvature",
            Choice(&[
                (
                    "auto",
                    "exact; positive semidefinite for an iteration that meets trouble",
                ),
                ("exact", "always exact; trouble is left to step splitting"),
                ("projected", "always positive semidefinite"),
                (
                    "gauss-newton",
                    "products of first derivatives only: semidefinite, no upper bound",
                ),
            ]),
            "\"auto\"",
            "Second derivatives in Newton's matrix.",
        ),
        key(
            "force_tolerance",
            number("N", POSITIVE),
            "1e-6",
            "Largest unbalanced force on any free point or arc length at which a `static` solve ends.",
        ),
        key(
            "static_friction",
            Bool,
            "false",
            "Whether friction acts in a `static` solve: it then sticks where the solve begins, and \
             the state of rest is one of many.",
        ),
    ],
);

pub(super) static RELAXATION: Table = Table::new(
    "",
    &[
        derived(
            "enabled",
            Bool,
            "true; false for cloth of yarns and with `integrator.kind` = \"static\"",
            "Whether to begin gently.",
        ),
        key(
            "duration",
            number("s", NOT_NEGATIVE),
            "0.1",
            "Length of the window.",
        ),
        key(
            "step_fraction",
            number("", Range::up_to(1.0)),
            "0.0625",
            "First step relative to `integrator.max_step`.",
        ),
        key(
            "stiffness_start",
            number("", Range::up_to(1.0)),
            "0.01",
            "Fabric stiffness at the start of the window, relative to its own.",
        ),
    ],
);

pub(super) static STOP: Table = Table::new(
    "",
    &[
        key(
            "early",
            Bool,
            "true",
            "Whether to end before `simulation.duration` when the cloth is at rest.",
        ),
        key(
            "percentile",
            number("%", Range::up_to(100.0)),
            "99",
            "Percentile of the points' kinetic energies that counts.",
        ),
        derived(
            "kinetic_energy",
            number("J", POSITIVE),
            "1e-8 J; 1e-14 J for cloth of yarns, whose points weigh some milligrams",
            "Kinetic energy of one point below which it rests.",
        ),
        key(
            "window",
            number("s", NOT_NEGATIVE),
            "0.1",
            "Time for which every step has to stay below.",
        ),
    ],
);

pub(super) static DAMPING: Table = Table::new(
    "",
    &[
        key(
            "kind",
            Choice(&[
                ("rate", "forces proportional to the rate of strain"),
                (
                    "incremental",
                    "a potential of the strain gained in the step: variational",
                ),
                ("none", "no dissipation in the fabric, no drag"),
            ]),
            "\"rate\"",
            "Form of the dissipation.",
        ),
        optional(
            "drag",
            number("1/s", Range::zero_to(1e6)),
            "Drag of still air, instead of every fabric's own.",
        ),
        optional(
            "membrane",
            number("s", Range::zero_to(1e3)),
            "Viscous over elastic membrane moduli, instead of every fabric's own.",
        ),
        optional(
            "bending",
            number("s", Range::zero_to(1e3)),
            "Viscous over elastic bending rigidity, instead of every fabric's own.",
        ),
    ],
);

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
                    "`multigrid` from 5000 points, else `incomplete-cholesky`; `node-ic` for \
                     yarns: the fastest here",
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

pub(super) static CONTACT: Table = Table::new(
    "",
    &[
        key(
            "self",
            Switch,
            "\"auto\"",
            "Contact of cloth with cloth; `auto` decides by the scene (`selvedge plan`).",
        ),
        key(
            "broad_phase",
            Choice(&[
                ("bvh", "tree of boxes"),
                ("grid", "hash grid"),
                ("brute-force", "every pair: for tests"),
            ]),
            "\"bvh\"",
            "Search for nearby pairs.",
        ),
        key(
            "potential",
            Choice(&[("quadratic", "penalty on the missing distance")]),
            "\"quadratic\"",
            "Repulsion.",
        ),
        key(
            "stiffness",
            number("N/m", Range::up_to(1e9)),
            "100",
            "Stiffness of the repulsion of one pair.",
        ),
        key(
            "body_stiffness",
            number("N/m", Range::up_to(1e9)),
            "1000",
            "Stiffness of the repulsion of one point from a body.",
        ),
        key(
            "thickness",
            number("m", Range::up_to(0.1)),
            "1e-3",
            "Distance that cloth keeps from cloth.",
        )
        .hint("m, not mm"),
        key(
            "body_thickness",
            number("m", Range::up_to(0.1)),
            "1.5e-3",
            "Distance that cloth keeps from bodies; cloth of yarns at least two radii of its \
             thickest yarn.",
        )
        .hint("m, not mm"),
        key(
            "release",
            number("s", Range::zero_to(1e3)),
            "0.02",
            "Time in which cloth that begins closer to cloth than `thickness` parts; 0: at once.",
        ),
        optional(
            "part_crossed",
            Bool,
            "Whether sheets and meshes that cross each other where the scene puts them are moved \
             apart as they are, the one with fewer points by the shortest way along an axis or \
             a diagonal and two `thickness` more; a message says which, and how far. Garments \
             stay. Bodies and pins are not looked at.",
        ),
        optional(
            "friction",
            number("", Range::zero_to(100.0)),
            "Coulomb friction coefficient of every pair, cloth on cloth and cloth on bodies, \
             instead of the geometric mean of the two materials' own coefficients.",
        ),
        key(
            "friction_model",
            Choice(&[
                ("anchored", "springs to anchors that slip: true sticking"),
                ("lagged", "smoothed and variational: creeps slowly"),
                ("none", "no friction"),
            ]),
            "\"anchored\"",
            "Friction.",
        ),
        key(
            "anchor_stiffness",
            number("", Range::up_to(10.0)),
            "0.1",
            "Stiffness of the anchors of `friction_model = \"anchored\"`, relative to that of the \
             contact.",
        ),
    ],
);

pub(super) static MESH: Table = Table::new(
    "",
    &[key(
        "edge_length",
        number("m", Range::up_to(10.0)),
        "0.01",
        "Target edge length of cloth meshes.",
    )
    .hint("m, not mm or cm")],
);

pub(super) static OUTPUT: Table = Table::new(
    "",
    &[
        derived(
            "directory",
            Path,
            "`out/NAME`",
            "Folder of the results, relative to where the program runs.",
        ),
        key(
            "frame_rate",
            number("1/s", Range::up_to(1e5)),
            "30",
            "Recorded frames per simulated second.",
        ),
        key(
            "checkpoint_seconds",
            number("s", NOT_NEGATIVE),
            "60",
            "Seconds of computing between checkpoints; 0 writes none.",
        ),
        key("report", Bool, "true", "Whether to write `report.html`."),
        key("recording", Bool, "true", "Whether to write `run.mcap`."),
    ],
);

pub(super) static ASSEMBLE: Table = Table::new(
    "",
    &[
        key(
            "clearance",
            number("m", Range::zero_to(1.0)),
            "0.02",
            "Least distance of the panels from the body at the start.",
        )
        .hint("m, not mm or cm"),
        key(
            "layer_clearance",
            number("m", Range::zero_to(1.0)),
            "5e-3",
            "What `clearance` grows by for every `layer`.",
        )
        .hint("m, not mm or cm"),
        key(
            "pre_iterations",
            integer(0, 1_000_000),
            "1500",
            "Iterations that bend the panels around the body before sewing.",
        ),
        key(
            "seam_time",
            number("s", NOT_NEGATIVE),
            "0.5",
            "Time over which the seams are closed.",
        ),
        key(
            "seam_stiffness",
            number("N/m", Range::up_to(1e9)),
            "1000",
            "Stiffness of a seam spring.",
        ),
        key(
            "settle_time",
            number("s", NOT_NEGATIVE),
            "0.3",
            "Time to settle after sewing.",
        ),
        key(
            "max_step",
            number("s", Range::up_to(1.0)),
            "1e-3",
            "Largest time step of both. They go without velocities, so that it decides where \
             the drape begins.",
        )
        .hint("s, not ms"),
        key(
            "coarsest",
            number("m", Range::zero_to(1.0)),
            "0.04",
            "Edge length of the mesh on which garments are sewn and draped first; every mesh of \
             half its edges starts from there, down to the garment's own. 0: sewn on its own mesh.",
        )
        .hint("m, not mm or cm"),
    ],
);
