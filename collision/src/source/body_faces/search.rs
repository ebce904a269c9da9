use super::Triangles;
use super::deepest::{Face, blend};
use crate::Aabb;
use crate::source::against_bodies::{Candidate, Guard, Search, Task};
use crate::vec3::{Vec3, norm, point, sub};

/// Appends a triangle that may touch the body.
pub(super) fn look_at(look: &Search<'_, Triangles>, triangle: u32, task: &mut Task<Vec3, ()>) {
    let source = look.source;
    let (thickness, steepness) = (source.potential.thickness(), source.settings.steepness);
    let nodes = source.element.corners[triangle as usize];
    let x = nodes.map(|n| point(look.step.q_start, n));
    let y = nodes.map(|n| point(source.envelope.end(), n));
    let way = (0..3).map(|i| norm(sub(y[i], x[i]))).fold(0.0, f64::max);
    let way = steepness * (way + source.settings.margin);
    let middle = blend([1.0 / 3.0; 3], &x);
    let radius = x.iter().map(|x| norm(sub(*x, middle))).fold(0.0, f64::max);
    let far = thickness + way + steepness * radius;
    let guard = look.guards.map(|g| &g[triangle as usize]);
    if guard.is_some_and(|g| g.distance(middle, steepness) > far) {
        return;
    }
    if !look.bounds.overlaps(&Aabb::of_points(x.iter().chain(&y))) {
        return;
    }
    let face = Face {
        body: look.body,
        time: source.time_end,
        x,
    };
    if guard.is_some() {
        let sample = face.at([1.0 / 3.0; 3]).sample;
        task.guards.push((triangle, Guard::new(middle, &sample)));
        if sample.distance > far {
            return;
        }
    }
    let limit = thickness + way;
    let Some(weights) = face.search(limit, steepness, 2.0 * thickness) else {
        return;
    };
    let place = face.descend(weights);
    // The lowest place of all, where there is but one.
    if look.body.is_convex() && place.sample.distance > limit {
        return;
    }
    let (of, weights) = (look.pair(triangle), place.weights);
    task.candidates.push(Candidate { of, weights });
    // A corner's arrival is the point's own.
    if place.is_corner() {
        return;
    }
    let predicted = nodes.map(|n| point(look.step.q_predicted, n));
    let moved = sub(blend(weights, &predicted), blend(weights, &x));
    let mass = (!source.masses.is_empty()).then(|| {
        let inverse = |i: usize| weights[i].powi(2) / source.masses[nodes[i] as usize];
        1.0 / (0..3).map(inverse).sum::<f64>()
    });
    look.foresee(of, &place.sample, moved, mass, task);
}
