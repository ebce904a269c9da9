use serde::{Deserialize, Serialize};

/// A rotation as a scene file gives it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Rotation {
    /// Intrinsic angles about x, then the new y, then the new z \[deg\]:
    /// `R = R_x R_y R_z`.
    Euler([f64; 3]),
    /// Angle about an axis.
    AxisAngle {
        /// Axis, of any length.
        axis: [f64; 3],
        /// Angle \[deg\]; may exceed a full turn.
        angle: f64,
    },
}

impl Rotation {
    /// Axis times angle \[rad\].
    ///
    /// For axis and angle whole turns are kept; Euler angles give the shortest
    /// such vector. A zero axis gives zero.
    pub fn vector(&self) -> [f64; 3] {
        match self {
            Rotation::AxisAngle { axis, angle } => {
                let length = norm(*axis);
                if length > 0.0 {
                    axis.map(|a| a / length * angle.to_radians())
                } else {
                    [0.0; 3]
                }
            }
            Rotation::Euler(angles) => {
                let q = quaternion(*angles);
                let sine = norm([q[1], q[2], q[3]]);
                if sine == 0.0 {
                    return [0.0; 3];
                }
                // the quaternion with w ≥ 0 has an angle of at most half a turn
                let (w, sign) = (q[0].abs(), if q[0] < 0.0 { -1.0 } else { 1.0 });
                let angle = 2.0 * sine.atan2(w);
                [q[1], q[2], q[3]].map(|x| sign * x / sine * angle)
            }
        }
    }

    /// The rotation matrix, by rows.
    pub fn matrix(&self) -> [[f64; 3]; 3] {
        let [x, y, z] = self.vector();
        let angle = norm([x, y, z]);
        if angle == 0.0 {
            return [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        }
        let [x, y, z] = [x / angle, y / angle, z / angle];
        let (s, c) = angle.sin_cos();
        let d = 1.0 - c;
        [
            [c + x * x * d, x * y * d - z * s, x * z * d + y * s],
            [y * x * d + z * s, c + y * y * d, y * z * d - x * s],
            [z * x * d - y * s, z * y * d + x * s, c + z * z * d],
        ]
    }
}

/// `(w, x, y, z)` of `R_x R_y R_z`, angles in degrees.
fn quaternion(angles: [f64; 3]) -> [f64; 4] {
    let half = angles.map(|a| (0.5 * a).to_radians().sin_cos());
    let [(sx, cx), (sy, cy), (sz, cz)] = half;
    [
        cx * cy * cz - sx * sy * sz,
        sx * cy * cz + cx * sy * sz,
        cx * sy * cz - sx * cy * sz,
        cx * cy * sz + sx * sy * cz,
    ]
}

fn norm(v: [f64; 3]) -> f64 {
    v[0].hypot(v[1]).hypot(v[2])
}

/// How a motion passes between keyframes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Interpolation {
    /// Constant velocity between keyframes.
    Linear,
    /// Coming to rest at every keyframe.
    Eased,
}

/// One keyframe of a rigid motion, relative to the start.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Keyframe {
    /// Time \[s\].
    pub time: f64,
    /// Displacement \[m\].
    pub translation: [f64; 3],
    /// Rotation about the pivot.
    pub rotation: Rotation,
}

/// A keyframe with its rotation as a vector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DenseKey {
    /// Time \[s\].
    pub time: f64,
    /// Displacement \[m\].
    pub translation: [f64; 3],
    /// Axis times angle \[rad\].
    pub rotation: [f64; 3],
}

/// Keyframes less than a third of a turn apart, so that interpolating along the
/// shorter way keeps whole turns.
///
/// Keys in between are added where the rotation vectors of two keys are
/// parallel, which is the case for turns about one axis.
pub fn dense_keys(motion: &[Keyframe]) -> Vec<DenseKey> {
    const APART: f64 = 2.0;
    // guards against absurd angles, far beyond any real motion
    const MOST: f64 = 10_000.0;
    let mut dense: Vec<DenseKey> = Vec::with_capacity(motion.len());
    for key in motion {
        let next = DenseKey {
            time: key.time,
            translation: key.translation,
            rotation: key.rotation.vector(),
        };
        if let Some(last) = dense.last().copied() {
            let (a, b) = (last.rotation, next.rotation);
            let turn = norm([b[0] - a[0], b[1] - a[1], b[2] - a[2]]);
            if turn > APART && parallel(a, b) {
                let parts = (turn / APART).ceil().min(MOST);
                for i in 1..parts as usize {
                    let s = i as f64 / parts;
                    let mix = |p: f64, q: f64| p + s * (q - p);
                    let mix3 = |p: [f64; 3], q: [f64; 3]| {
                        [mix(p[0], q[0]), mix(p[1], q[1]), mix(p[2], q[2])]
                    };
                    dense.push(DenseKey {
                        time: mix(last.time, next.time),
                        translation: mix3(last.translation, next.translation),
                        rotation: mix3(a, b),
                    });
                }
            }
        }
        dense.push(next);
    }
    dense
}

fn parallel(a: [f64; 3], b: [f64; 3]) -> bool {
    let cross = [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ];
    norm(cross) <= 1e-9 * norm(a) * norm(b)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Euler angles mean `R_x R_y R_z`, checked against the three factors.
    #[test]
    fn euler_order() {
        let angles = [30.0, -50.0, 140.0];
        let about = |i: usize| {
            let mut axis = [0.0; 3];
            axis[i] = 1.0;
            let angle = angles[i];
            Rotation::AxisAngle { axis, angle }.matrix()
        };
        let multiply = |a: [[f64; 3]; 3], b: [[f64; 3]; 3]| {
            let mut c = [[0.0; 3]; 3];
            for i in 0..3 {
                for j in 0..3 {
                    c[i][j] = (0..3).map(|k| a[i][k] * b[k][j]).sum();
                }
            }
            c
        };
        let want = multiply(multiply(about(0), about(1)), about(2));
        let got = Rotation::Euler(angles).matrix();
        for i in 0..3 {
            for j in 0..3 {
                assert!((want[i][j] - got[i][j]).abs() < 1e-14, "{want:?} {got:?}");
            }
        }
    }

    /// Ten turns stay ten turns.
    #[test]
    fn whole_turns_survive() {
        let key = |time, angle| Keyframe {
            time,
            translation: [time, 0.0, 0.0],
            rotation: Rotation::AxisAngle {
                axis: [2.0, 0.0, 0.0],
                angle,
            },
        };
        let dense = dense_keys(&[key(0.0, 0.0), key(5.0, 3600.0)]);
        assert_eq!(dense.len(), 33); // 62.83 rad in steps of at most 2 rad
        for pair in dense.windows(2) {
            let turn = pair[1].rotation[0] - pair[0].rotation[0];
            assert!((turn - 62.83185307179586 / 32.0).abs() < 1e-12);
            assert!((pair[1].time - pair[0].time - 5.0 / 32.0).abs() < 1e-12);
        }
    }
}
