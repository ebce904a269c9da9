//! Places on cloth and the frames there.

/// A place on cloth, in the solver's order.
#[derive(Clone, Copy, Debug)]
pub(super) struct Anchor {
    pub points: [u32; 3],
    pub weights: [f64; 3],
    pub material: [[f64; 2]; 3],
}

impl Anchor {
    /// The same triangle with the barycentric coordinates of another place.
    pub fn at(self, place: [f64; 2]) -> Self {
        let [a, b, c] = self.material;
        let cross = |p: [f64; 2], q: [f64; 2], r: [f64; 2]| {
            (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
        };
        let all = cross(a, b, c);
        let (v, w) = (cross(a, place, c) / all, cross(a, b, place) / all);
        Self {
            weights: [1.0 - v - w, v, w],
            ..self
        }
    }

    /// The place in the world, and its axes: along the warp, across it, out.
    pub fn frame(&self, x: &[[f64; 3]]) -> ([f64; 3], [[f64; 3]; 3]) {
        let corner = self.points.map(|p| x[p as usize]);
        let place =
            std::array::from_fn(|k| (0..3).map(|i| self.weights[i] * corner[i][k]).sum::<f64>());
        let m = self.material;
        let (p, q) = (
            [m[1][0] - m[0][0], m[1][1] - m[0][1]],
            [m[2][0] - m[0][0], m[2][1] - m[0][1]],
        );
        let det = p[0] * q[1] - p[1] * q[0];
        // Columns of the deformation gradient.
        let column = |s: [f64; 2]| -> [f64; 3] {
            std::array::from_fn(|k| {
                let (e1, e2) = (corner[1][k] - corner[0][k], corner[2][k] - corner[0][k]);
                (s[0] * e1 + s[1] * e2) / det
            })
        };
        let (u, v) = (column([q[1], -p[1]]), column([-q[0], p[0]]));
        let (Some(u), Some(n)) = (unit(u), unit(cross(u, v))) else {
            // A collapsed triangle has no frame.
            return (place, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        };
        (place, [u, cross(n, u), n])
    }
}

fn length(a: [f64; 3]) -> f64 {
    a[0].hypot(a[1]).hypot(a[2])
}

fn unit(a: [f64; 3]) -> Option<[f64; 3]> {
    let l = length(a);
    (l > 0.0 && l.is_finite()).then(|| a.map(|c| c / l))
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// Unit quaternion `(w, x, y, z)` of the rotation onto orthonormal axes.
pub(super) fn quaternion(axes: &[[f64; 3]; 3]) -> [f64; 4] {
    let m = |i: usize, j: usize| axes[j][i];
    let trace = m(0, 0) + m(1, 1) + m(2, 2);
    if trace > 0.0 {
        let s = 2.0 * (1.0 + trace).sqrt();
        return [
            0.25 * s,
            (m(2, 1) - m(1, 2)) / s,
            (m(0, 2) - m(2, 0)) / s,
            (m(1, 0) - m(0, 1)) / s,
        ];
    }
    let i = (0..3).fold(0, |best, i| if m(i, i) > m(best, best) { i } else { best });
    let (j, k) = ((i + 1) % 3, (i + 2) % 3);
    let s = 2.0 * (1.0 + m(i, i) - m(j, j) - m(k, k)).sqrt();
    let mut q = [(m(k, j) - m(j, k)) / s, 0.0, 0.0, 0.0];
    q[1 + i] = 0.25 * s;
    q[1 + j] = (m(j, i) + m(i, j)) / s;
    q[1 + k] = (m(k, i) + m(i, k)) / s;
    q
}

/// The third axis of a body.
pub(super) fn axis([w, x, y, z]: [f64; 4]) -> [f64; 3] {
    [
        2.0 * (x * z + w * y),
        2.0 * (y * z - w * x),
        1.0 - 2.0 * (x * x + y * y),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rotations about any axis by any angle come back as their quaternion.
    #[test]
    fn quaternions() {
        for (n, angle) in [
            ([1.0, 0.0, 0.0], 3.1),
            ([0.6, 0.0, 0.8], 0.3),
            ([0.0, 0.6, -0.8], 3.0),
            ([0.36, 0.48, 0.8], 2.2),
        ] {
            let (s, c) = f64::sin_cos(angle);
            let axes = std::array::from_fn(|j| {
                let e: [f64; 3] = std::array::from_fn(|i| f64::from(u8::from(i == j)));
                let (t, d) = (cross(n, e), n[j] * (1.0 - c));
                std::array::from_fn(|i| c * e[i] + s * t[i] + d * n[i])
            });
            let q = quaternion(&axes);
            let (s, c) = (0.5 * angle).sin_cos();
            let expected = [c, s * n[0], s * n[1], s * n[2]];
            let sign = (0..4).map(|i| q[i] * expected[i]).sum::<f64>().signum();
            for i in 0..4 {
                assert!((sign * q[i] - expected[i]).abs() < 1e-12, "{q:?}");
            }
            for i in 0..3 {
                assert!((axis(q)[i] - axes[2][i]).abs() < 1e-12);
            }
        }
    }

    /// Barycentric coordinates give the place back, beyond the triangle too;
    /// the frame of stretched and turned cloth has the world's directions.
    #[test]
    fn anchors() {
        let anchor = Anchor {
            points: [0, 1, 2],
            weights: [0.0; 3],
            material: [[0.1, 0.2], [0.3, 0.25], [0.15, 0.5]],
        };
        for place in [[0.18, 0.3], [0.5, -0.1]] {
            let b = anchor.at(place).weights;
            for k in 0..2 {
                let back: f64 = (0..3).map(|i| b[i] * anchor.material[i][k]).sum();
                assert!((back - place[k]).abs() < 1e-14);
            }
        }
        // Warp along −z, stretched by 1.2, weft along −x, normal up.
        let x: Vec<[f64; 3]> = anchor
            .material
            .iter()
            .map(|m| [-m[1], 1.0, -1.2 * m[0]])
            .collect();
        let (place, axes) = anchor.at([0.2, 0.3]).frame(&x);
        let expected = [[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        for (a, e) in axes
            .iter()
            .chain([&place])
            .zip(expected.iter().chain([&[-0.3, 1.0, -0.24]]))
        {
            for k in 0..3 {
                assert!((a[k] - e[k]).abs() < 1e-12, "{axes:?} {place:?}");
            }
        }
    }
}
