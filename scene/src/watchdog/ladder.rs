use selvedge_integrator::{CurvaturePolicy, Simulation};

use crate::file::SceneFile;

/// What each rung of the ladder changes.
#[derive(Clone, Copy, Debug)]
pub struct Ladder {
    tolerance: f64,
}

impl Ladder {
    /// The ladder of a scene.
    pub fn of(scene: &SceneFile) -> Self {
        Self {
            tolerance: scene.solver.tolerance,
        }
    }

    /// Puts a simulation on a rung; 0 is the scene's own settings.
    pub fn apply(&self, simulation: &mut Simulation, rung: u8) {
        let tolerance = match rung {
            0 => self.tolerance,
            _ => (1e-3 * self.tolerance).max(1e-10).min(self.tolerance),
        };
        simulation.force_tolerance(tolerance, rung >= 1);
        simulation.force_curvature((rung >= 2).then_some(CurvaturePolicy::Projected));
    }
}
