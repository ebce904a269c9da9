//! How far two results are apart.

mod bvh;
mod recordings;
mod surfaces;

use serde::Serialize;

use crate::RecordError;

pub use recordings::{
    CompareOptions, Comparison, EnergyPair, FrameComparison, LastFrame, RunFigures,
    compare_recordings,
};
pub use surfaces::{DirectedDistance, SurfaceDistance, SurfaceOptions, compare_surfaces};

/// Statistics of distances \[m\].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Distances {
    /// Number of distances.
    pub count: usize,
    /// Arithmetic mean.
    pub mean: f64,
    /// Root of the mean square.
    pub rms: f64,
    /// The smallest value that 95 % do not exceed.
    pub p95: f64,
    /// Largest one.
    pub max: f64,
    /// Point where it occurs.
    pub max_point: usize,
}

impl Distances {
    /// Statistics of distances \[m\]; zeros where there are none.
    pub fn of(distances: &[f64]) -> Self {
        let count = distances.len();
        if count == 0 {
            return Self::default();
        }
        let mean = distances.iter().sum::<f64>() / count as f64;
        let rms = (distances.iter().map(|d| d * d).sum::<f64>() / count as f64).sqrt();
        let mut max_point = 0;
        for (i, d) in distances.iter().enumerate() {
            if *d > distances[max_point] {
                max_point = i;
            }
        }
        let mut ordered = distances.to_vec();
        let rank = (count * 95).div_ceil(100) - 1;
        let (_, p95, _) = ordered.select_nth_unstable_by(rank, f64::total_cmp);
        Self {
            count,
            mean,
            rms,
            p95: *p95,
            max: distances[max_point],
            max_point,
        }
    }
}

/// Distances between points of equal index; three coordinates a point \[m\].
///
/// # Errors
/// [`RecordError::Length`] for arrays of different lengths,
/// [`RecordError::Surface`] for coordinates that are not finite.
pub fn compare_points(a: &[f64], b: &[f64]) -> Result<Distances, RecordError> {
    if a.len() != b.len() {
        let (found, expected) = (b.len(), a.len());
        return Err(RecordError::Length {
            what: "the second set of points",
            found,
            expected,
        });
    }
    if let Some(i) = a.iter().chain(b).position(|x| !x.is_finite()) {
        let reason = format!("point {} is not finite", i % a.len() / 3);
        return Err(RecordError::Surface { reason });
    }
    let distances: Vec<f64> = a
        .as_chunks::<3>()
        .0
        .iter()
        .zip(b.as_chunks::<3>().0)
        .map(|(a, b)| distance_squared(*a, *b).sqrt())
        .collect();
    Ok(Distances::of(&distances))
}

fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| a[i] - b[i])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

fn distance_squared(a: [f64; 3], b: [f64; 3]) -> f64 {
    let d = sub(a, b);
    dot(d, d)
}
