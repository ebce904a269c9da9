//! Points that arrive at a body faster than its contact force can stop.

use crate::SurfaceSample;
use crate::vec3::{Vec3, dot};

/// How a point approaches a body within a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arrival {
    /// Distance at the start of the step \[m\].
    pub gap: f64,
    /// What the distance falls by until the end, along the normal \[m\].
    pub closing: f64,
}

/// What has to be done about a fast arrival.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Answer {
    /// The step is too long: the point may come this deep, and would come
    /// deeper \[m\].
    Refuse { depth: f64, limit: f64 },
    /// Stiffness that stops it [N/m].
    Stop(f64),
}

/// Depth below the thickness at which a fast point stops, in thicknesses.
const STOP: f64 = 2.0;

impl Arrival {
    /// Of a point that moves by `way` \[m\] in a step of `dt` \[s\]; `s` is the
    /// sample where it begins, of the body's last pose.
    pub fn new(s: &SurfaceSample, way: Vec3, dt: f64) -> Self {
        let carried = dt * dot(s.velocity, s.normal);
        Self {
            gap: s.distance + carried,
            closing: carried - dot(way, s.normal),
        }
    }

    /// What to do about a point of some mass \[kg\] in a step of `dt` \[s\];
    /// `None` for one that the contact force can stop, because that takes up
    /// `capacity` \[J\] until the point is `deepest` \[m\] behind the surface.
    ///
    /// A fast point may move as far as the surface in one step, or by a
    /// thickness. Near the surface it meets a stiffness `k = m c / h²` with
    /// `c = closing / L`, `L` twice the thickness, which a free point in
    /// backward Euler goes `d₁ = L (d₀ + closing) / (L + closing) < L` deep
    /// against, and never comes back from.
    pub fn answer(
        &self,
        mass: f64,
        dt: f64,
        thickness: f64,
        deepest: f64,
        capacity: f64,
    ) -> Option<Answer> {
        let speed = self.closing / dt;
        let fast = self.closing > 0.0 && 0.5 * mass * speed * speed > capacity;
        // Farther inside, the nearest surface may be the wrong one.
        if !fast || self.gap < -2.0 * deepest {
            return None;
        }
        let free = self.gap.max(thickness);
        if self.closing > free {
            let (depth, limit) = (self.closing - self.gap, free - self.gap);
            return Some(Answer::Refuse { depth, limit });
        }
        let depth = thickness - self.gap;
        (depth + self.closing > 0.0).then(|| {
            let way = (STOP * thickness).max(depth);
            Answer::Stop(mass * self.closing / (way * dt * dt))
        })
    }
}

/// Stiffness of every fast arrival of a step.
#[derive(Clone, Debug)]
pub(super) struct Impacts<K> {
    /// In ascending order; empty in nearly every step.
    of: Vec<(K, f64)>,
    step: [f64; 2],
}

impl<K> Default for Impacts<K> {
    fn default() -> Self {
        Self {
            of: Vec::new(),
            step: [0.0; 2],
        }
    }
}

impl<K: Ord + Copy> Impacts<K> {
    /// Takes over what a detection found. What an earlier detection of the
    /// same step found stays: a later one sees the point stopped already.
    pub fn update(&mut self, time: f64, dt: f64, found: &mut Vec<(K, f64)>) {
        if self.step != [time, dt] {
            self.of.clear();
            self.step = [time, dt];
        }
        if found.is_empty() {
            return;
        }
        self.of.append(found);
        self.of
            .sort_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)));
        self.of.dedup_by_key(|i| i.0);
    }

    /// Stiffness of a candidate [N/m], where it is one of them.
    #[inline]
    pub fn stiffness(&self, c: K) -> Option<f64> {
        if self.of.is_empty() {
            return None;
        }
        let place = self.of.binary_search_by(|i| i.0.cmp(&c)).ok()?;
        Some(self.of[place].1)
    }

    pub fn heap_bytes(&self) -> usize {
        size_of::<(K, f64)>() * self.of.capacity()
    }
}
