//! Values over the cloth.

use selvedge_collision::ContactResponse;
use selvedge_energy::EvalPoint;
use selvedge_integrator::Simulation;
use selvedge_shell_model::strain::principal_stretches;

use crate::build::BuiltScene;

/// Values over the cloth at the end, in the scene's order.
pub(crate) struct Maps {
    pub contact_force: Vec<f64>,
    pub stretches: Vec<[f64; 2]>,
    pub body_distance: Vec<f64>,
}

pub(crate) fn maps(built: &BuiltScene, simulation: &mut Simulation) -> Maps {
    let g = &built.geometry;
    let state = simulation.state().clone();
    let (points, _) = state.q[..3 * g.mesh.points()].as_chunks::<3>();
    let mut response = ContactResponse::default();
    let at = EvalPoint {
        layout: state.layout,
        q: &state.q,
        q_start: &state.q,
        dt: simulation.settings().control.max_step,
    };
    for contact in &mut simulation.plan_mut().contacts {
        // A contact that cannot be evaluated leaves its part of the map empty.
        let _ = contact.evaluate(&at, false, &mut response);
    }
    let size = |f: &[f64; 3]| f[0].hypot(f[1]).hypot(f[2]);
    let mut force = vec![0.0; points.len()];
    for ((nodes, weights), f) in response
        .nodes
        .iter()
        .zip(&response.weights)
        .zip(&response.force)
    {
        for (&n, w) in nodes.iter().zip(weights) {
            if *w != 0.0 {
                force[n as usize] += w.abs() * size(f);
            }
        }
    }
    for (&n, f) in response.body_nodes.iter().zip(&response.body_force) {
        force[n as usize] += size(f);
    }
    let mut distance = vec![
        f64::INFINITY;
        if built.bodies.is_empty() {
            0
        } else {
            points.len()
        }
    ];
    let mut samples = Vec::new();
    for body in &built.bodies {
        samples.clear();
        body.body.sample_many(points, state.time, &mut samples);
        for (d, s) in distance.iter_mut().zip(&samples) {
            *d = d.min(s.distance);
        }
    }
    let solver = principal_stretches(&g.mesh, &state.q);
    let mut stretches = vec![[1.0; 2]; solver.len()];
    for (s, &t) in solver.iter().zip(&g.triangle_order) {
        stretches[t as usize] = *s;
    }
    let body_distance = if distance.is_empty() {
        distance
    } else {
        g.recorded(&distance)
    };
    Maps {
        contact_force: g.recorded(&force),
        stretches,
        body_distance,
    }
}
