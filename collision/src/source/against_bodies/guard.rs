use crate::SurfaceSample;
use crate::vec3::{Vec3, norm, sub};

/// A distance that was sampled once, and where.
#[derive(Clone, Copy, Debug)]
pub struct Guard {
    place: [f32; 3],
    distance: f32,
}

/// Room for the rounding of places within a kilometre of the origin [m].
const ROUNDING: f64 = 2e-4;

impl Guard {
    /// Nothing is known.
    pub const UNKNOWN: Self = Self {
        place: [0.0; 3],
        distance: f32::NEG_INFINITY,
    };

    pub fn new(place: Vec3, sample: &SurfaceSample) -> Self {
        if !place.iter().all(|x| x.abs() < 1e3) {
            return Self::UNKNOWN;
        }
        Self {
            place: place.map(|x| x as f32),
            distance: sample.distance as f32,
        }
    }

    /// A lower bound of the distance at `p`, for a field no steeper than
    /// `steepness`. NaN, which excludes nothing, where the sample was.
    #[inline]
    pub fn distance(&self, p: Vec3, steepness: f64) -> f64 {
        let way = norm(sub(p, self.place.map(f64::from)));
        f64::from(self.distance) - steepness * way - ROUNDING
    }
}
