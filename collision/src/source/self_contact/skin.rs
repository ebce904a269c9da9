use super::NAME;
use crate::CollisionError;

/// Positions of the last search, and how far points may drift from them before
/// the next one. A drift common to all points brings no two of them together
/// and does not count.
#[derive(Clone, Debug, Default)]
pub(super) struct Skin {
    /// Coordinates of all points [m]; empty when there is no skin.
    place: Vec<f64>,
    /// Drift allowed [m].
    radius: f64,
}

impl Skin {
    /// Takes `start` for a new search if the predicted motion of a step stays
    /// within `radius` for `steps` steps; otherwise there is no skin.
    pub fn lay(&mut self, start: &[f64], predicted: &[f64], steps: f64, radius: f64) -> bool {
        self.place.clear();
        if steps * drift(start, predicted) > radius {
            return false;
        }
        self.place.extend_from_slice(start);
        self.radius = radius;
        true
    }

    /// Whether the last search covers both places of all points and all ways
    /// between them.
    pub fn holds(&self, start: &[f64], end: &[f64]) -> bool {
        self.is_laid()
            && drift(&self.place, start) <= self.radius
            && (std::ptr::eq(start, end) || drift(&self.place, end) <= self.radius)
    }

    pub fn is_laid(&self) -> bool {
        !self.place.is_empty()
    }

    pub fn place(&self) -> &[f64] {
        &self.place
    }

    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// The radius, zero without a skin, and the places.
    pub fn to_numbers(&self) -> Vec<f64> {
        let mut out = vec![if self.is_laid() { self.radius } else { 0.0 }];
        out.extend_from_slice(&self.place);
        out
    }

    /// Inverse of [`to_numbers`](Self::to_numbers) for `count` coordinates;
    /// also gives the numbers that follow.
    pub fn from_numbers(numbers: &[f64], count: usize) -> Result<(Self, &[f64]), CollisionError> {
        let fail = |reason| CollisionError::History {
            source_name: NAME.into(),
            reason,
        };
        let (&radius, rest) = numbers.split_first().ok_or_else(|| fail("no header"))?;
        if radius == 0.0 {
            return Ok((Self::default(), rest));
        }
        if !(radius > 0.0 && radius.is_finite()) || rest.len() < count {
            return Err(fail("wrong length"));
        }
        let (place, rest) = rest.split_at(count);
        Ok((
            Self {
                place: place.to_vec(),
                radius,
            },
            rest,
        ))
    }

    pub fn heap_bytes(&self) -> usize {
        8 * self.place.capacity()
    }
}

/// Largest distance of a point from where the mean motion alone would take it;
/// infinite when a coordinate is not finite.
fn drift(from: &[f64], to: &[f64]) -> f64 {
    let (from, _) = from.as_chunks::<3>();
    let (to, _) = to.as_chunks::<3>();
    let mut mean = [0.0; 3];
    for (a, b) in from.iter().zip(to) {
        for i in 0..3 {
            mean[i] += b[i] - a[i];
        }
    }
    let mean = mean.map(|m| m / from.len().max(1) as f64);
    let mut largest = 0.0_f64;
    for (a, b) in from.iter().zip(to) {
        let d = [0, 1, 2].map(|i| b[i] - a[i] - mean[i]);
        let square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        if square.is_nan() {
            return f64::INFINITY;
        }
        largest = largest.max(square);
    }
    largest.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A common drift is free, one point's own is not.
    #[test]
    fn only_relative_drift_counts() {
        let start = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        let mut skin = Skin::default();
        assert!(skin.lay(&start, &start, 6.0, 1e-3));
        let moved: Vec<f64> = start.iter().map(|x| x + 0.5).collect();
        assert!(skin.holds(&moved, &moved));
        let mut bent = moved.clone();
        bent[8] += 1.6e-3;
        assert!(!skin.holds(&moved, &bent));
        bent[8] = f64::NAN;
        assert!(!skin.holds(&bent, &moved));
        let numbers = skin.to_numbers();
        let (again, rest) = Skin::from_numbers(&numbers, 9).expect("its own numbers");
        assert_eq!((again.place(), rest.len()), (skin.place(), 0));
    }

    /// Fast motion gets no skin.
    #[test]
    fn fast_motion_is_swept() {
        let start = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0];
        let end = [0.0, 0.0, 0.0, 1.0, 0.0, 1e-3];
        let mut skin = Skin::default();
        assert!(!skin.lay(&start, &end, 6.0, 1e-3));
        assert!(!skin.is_laid());
    }
}
