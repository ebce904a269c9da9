use crate::file::model::DenseKey;

/// A rigid motion by keyframes: translation and rotation about a pivot.
#[derive(Clone, Debug)]
pub struct Motion {
    keys: Vec<DenseKey>,
    pivot: [f64; 3],
    eased: bool,
}

impl Motion {
    /// Keys in the order of time; `eased` motions come to rest at every key.
    ///
    /// # Panics
    /// When there is no key.
    pub fn new(keys: Vec<DenseKey>, pivot: [f64; 3], eased: bool) -> Self {
        assert!(!keys.is_empty(), "a motion has at least one key");
        Self { keys, pivot, eased }
    }

    /// Where a point that starts at `p` [m] is at a time [s]; before the first
    /// and after the last key the motion rests.
    pub fn place(&self, p: [f64; 3], time: f64) -> [f64; 3] {
        let (translation, rotation) = self.at(time);
        let arm = std::array::from_fn(|i| p[i] - self.pivot[i]);
        let turned = rotate(rotation, arm);
        std::array::from_fn(|i| self.pivot[i] + translation[i] + turned[i])
    }

    fn at(&self, time: f64) -> ([f64; 3], [f64; 3]) {
        let after = self.keys.partition_point(|k| k.time <= time);
        let Some(b) = self.keys.get(after) else {
            let last = &self.keys[self.keys.len() - 1];
            return (last.translation, last.rotation);
        };
        if after == 0 {
            return (b.translation, b.rotation);
        }
        let a = &self.keys[after - 1];
        let mut s = (time - a.time) / (b.time - a.time);
        if self.eased {
            s = s * s * (3.0 - 2.0 * s);
        }
        // Rotation vectors of neighbouring keys are close or parallel, see
        // `dense_keys`; between them they are interpolated as vectors.
        let mix = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|i| a[i] + s * (b[i] - a[i]));
        (
            mix(a.translation, b.translation),
            mix(a.rotation, b.rotation),
        )
    }
}

/// Rodrigues' formula for the rotation vector `w` [rad].
fn rotate(w: [f64; 3], p: [f64; 3]) -> [f64; 3] {
    let angle = w[0].hypot(w[1]).hypot(w[2]);
    if angle == 0.0 {
        return p;
    }
    let k = w.map(|x| x / angle);
    let (s, c) = angle.sin_cos();
    let cross = [
        k[1] * p[2] - k[2] * p[1],
        k[2] * p[0] - k[0] * p[2],
        k[0] * p[1] - k[1] * p[0],
    ];
    let along = k[0] * p[0] + k[1] * p[1] + k[2] * p[2];
    std::array::from_fn(|i| c * p[i] + s * cross[i] + (1.0 - c) * along * k[i])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quarter turn about z in one second, at rest before and after.
    #[test]
    fn quarter_turn() {
        let key = |time, angle| DenseKey {
            time,
            translation: [0.0, 0.0, time],
            rotation: [0.0, 0.0, angle],
        };
        let quarter = std::f64::consts::FRAC_PI_2;
        let motion = Motion::new(
            vec![key(0.0, 0.0), key(1.0, quarter)],
            [1.0, 0.0, 0.0],
            false,
        );
        let close = |a: [f64; 3], b: [f64; 3]| (0..3).all(|i| (a[i] - b[i]).abs() < 1e-12);
        assert!(close(motion.place([2.0, 0.0, 0.0], -1.0), [2.0, 0.0, 0.0]));
        let half = std::f64::consts::FRAC_1_SQRT_2;
        assert!(close(
            motion.place([2.0, 0.0, 0.0], 0.5),
            [1.0 + half, half, 0.5]
        ));
        assert!(close(motion.place([2.0, 0.0, 0.0], 9.0), [1.0, 1.0, 1.0]));
    }
}
