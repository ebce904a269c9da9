use std::ops::Range;

use super::{Alone, Points, Samples};
use crate::Aabb;
use crate::source::against_bodies::{Candidate, Guard, Search, Task};
use crate::vec3::{norm, point, sub};

/// Appends those of some points that may touch the body: what a distance known
/// before, the body's box and its field cannot rule out.
pub(super) fn search(
    look: &Search<'_, Points>,
    range: Range<usize>,
    task: &mut Task<Alone, Samples>,
) {
    let source = look.source;
    let (near, steepness) = (source.potential.thickness(), source.settings.steepness);
    let (start, end) = (look.step.q_start, source.envelope.end());
    // How far the field may fall on the way of a point, and the thickness.
    let limit = |p: u32| {
        let way = norm(sub(point(end, p), point(start, p))) + source.settings.margin;
        near + steepness * way
    };
    let mut scratch = std::mem::take(&mut task.scratch);
    let Samples { places, samples } = &mut scratch;
    places.clear();
    for &p in &source.element.of[range] {
        let (x, y) = (point(start, p), point(end, p));
        let guard = look.guards.map(|g| g[p as usize].distance(x, steepness));
        if guard.is_some_and(|distance| distance > limit(p)) {
            continue;
        }
        if look.bounds.overlaps(&Aabb::of_points(&[x, y])) {
            let of = look.pair(p);
            task.candidates.push(Candidate { of, weights: [] });
            places.push(x);
        }
    }
    look.body.sample_many(places, source.time_end, samples);
    let found = std::mem::take(&mut task.candidates);
    for (c, s) in found.iter().zip(&*samples) {
        let p = c.of.element;
        let way = sub(point(look.step.q_predicted, p), point(start, p));
        let mass = source.masses.get(p as usize).copied();
        look.foresee(c.of, s, way, mass, task);
    }
    task.candidates = found;
    if look.guards.is_some() {
        let all = task.candidates.iter().zip(&*places).zip(&*samples);
        let guards = all.map(|((c, x), s)| (c.of.element, Guard::new(*x, s)));
        task.guards.extend(guards);
    }
    // Keep what the field cannot rule out, and what it cannot tell.
    let mut k = 0;
    task.candidates.retain(|c| {
        let far = samples
            .get(k)
            .is_some_and(|s| s.distance > limit(c.of.element));
        k += 1;
        !far
    });
    task.scratch = scratch;
}
