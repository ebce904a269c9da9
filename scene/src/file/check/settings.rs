//! Settings that have to go together.

use super::super::model::{
    IntegratorKind, MatrixKind, Precision, PreconditionerKind, ProductKind, SolverKind,
};
use super::super::suggest::show;
use super::Check;

/// Steps above which a run is taken for a mistake: it would not end.
const MOST_STEPS: f64 = 1e9;

impl Check<'_> {
    /// Nothing that reads a matrix goes with one that does not exist.
    fn matrix_free(&mut self) {
        let solver = &self.scene.solver;
        let fits = matches!(
            solver.preconditioner,
            PreconditionerKind::Auto
                | PreconditionerKind::None
                | PreconditionerKind::Diagonal
                | PreconditionerKind::BlockJacobi
                | PreconditionerKind::NodeJacobi
                | PreconditionerKind::Chebyshev
        );
        if solver.kind != SolverKind::Cg {
            self.error(
                "scene::solver",
                "solver.kind",
                "`solver.product` = \"matrix-free\" needs `solver.kind` = \"cg\"",
                "`solver.kind = \"cg\"`",
            );
        }
        if !fits {
            self.error(
                "scene::solver",
                "solver.preconditioner",
                "`solver.product` = \"matrix-free\" has no matrix to factor",
                "\"auto\", \"node-jacobi\", \"block-jacobi\", \"diagonal\", \"none\" or \"chebyshev\"",
            );
        }
        if solver.matrix == MatrixKind::Reassembled {
            self.error(
                "scene::solver",
                "solver.matrix",
                "`solver.product` = \"matrix-free\" has no matrix to store",
                "leave it out",
            );
        }
    }

    /// What a search for rest cannot have.
    fn statics(&mut self) {
        if !self.scene.cut.is_empty() {
            self.error(
                "scene::statics",
                "cut.0",
                "nothing is cut in a static solve, which has no time",
                "another `integrator.kind`",
            );
        } else if self.scene.topology.changes {
            self.error(
                "scene::statics",
                "topology.changes",
                "yarns do not leave their contacts in a static solve",
                "`topology.changes = false`, or another `integrator.kind`",
            );
        }
        if self.scene.relaxation.enabled {
            self.error(
                "scene::statics",
                "relaxation.enabled",
                "a static solve has no time in which cloth could gain its stiffness",
                "leave it out",
            );
        }
    }

    pub(super) fn settings(&mut self) {
        let scene = self.scene;
        let integrator = &scene.integrator;
        if integrator.min_step > integrator.max_step {
            self.error(
                "scene::value",
                "integrator.min_step",
                format!(
                    "`integrator.min_step` = {} s is more than `max_step` = {} s",
                    show(integrator.min_step),
                    show(integrator.max_step)
                ),
                "at most `max_step`; leave it out for `max_step` / 2^20",
            );
        }
        let duration = scene.simulation.duration;
        let steps = duration / integrator.max_step;
        if steps > MOST_STEPS {
            self.error(
                "scene::value",
                "integrator.max_step",
                format!(
                    "{} s in steps of at most {} s are {} steps",
                    show(duration),
                    show(integrator.max_step),
                    show(steps.round())
                ),
                format!(
                    "at most {} steps: a longer `integrator.max_step` or a shorter \
                     `simulation.duration`, both in s",
                    show(MOST_STEPS)
                ),
            );
        }
        let relaxation = &scene.relaxation;
        if relaxation.enabled && duration > 0.0 && relaxation.duration >= duration {
            self.warning(
                "scene::relaxation",
                "simulation.duration",
                format!(
                    "the whole run of {} s is inside the relaxation window of {} s",
                    show(duration),
                    show(relaxation.duration)
                ),
                "a longer `simulation.duration`, or `relaxation.enabled = false`",
            );
        }
        let g = scene.simulation.gravity;
        let size = g[0].hypot(g[1]).hypot(g[2]);
        if size > 50.0 {
            self.warning(
                "scene::gravity",
                "simulation.gravity",
                format!(
                    "gravity of {} m/s² is {} times that of Earth",
                    show(size),
                    (size / 9.81).round()
                ),
                "the unit is m/s²: [0, -9.81, 0]",
            );
        }
        if scene.solver.kind == SolverKind::Direct && scene.solver.matrix == MatrixKind::Reassembled
        {
            self.warning(
                "scene::solver",
                "solver.matrix",
                "`solver.matrix` = \"reassembled\" only concerns iterative solvers",
                "leave it out",
            );
        }
        if scene.solver.precision == Precision::F32 && scene.solver.kind != SolverKind::Cg {
            self.error(
                "scene::solver",
                "solver.precision",
                "`solver.precision` = \"f32\" needs `solver.kind` = \"cg\": the others work in double precision",
                "`solver.precision = \"mixed\"` or `\"f64\"`",
            );
        }
        if integrator.kind == IntegratorKind::Static {
            self.statics();
        }
        if scene.solver.product == ProductKind::MatrixFree {
            self.matrix_free();
        }
        let frames = duration * scene.output.frame_rate;
        if scene.output.recording && frames > 1e5 {
            self.warning(
                "scene::output",
                "output.frame_rate",
                format!("the recording would have {frames:.0} frames"),
                "a lower `output.frame_rate`; it is in frames per simulated second",
            );
        }
    }
}
