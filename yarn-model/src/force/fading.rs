use selvedge_energy::Curvature;

use super::dihedral::Dihedral;
use crate::vec3::{Block, V, outer, put, put_both, square};

/// Height of a wing below which an element fades, in contact lengths.
pub(super) const FADE: f64 = 0.5;

/// Weight of a wing of height `eta`, full from `high` on, with its first two
/// derivatives.
#[inline(always)]
fn weight(eta: f64, high: f64) -> [f64; 3] {
    if eta >= high {
        return [1.0, 0.0, 0.0];
    }
    let inverse = 1.0 / high;
    let x = eta * inverse;
    let x2 = x * x;
    let y = 1.0 - x;
    let xy = x * y;
    [
        x2 * x2 * (35.0 - 84.0 * x + 70.0 * x2 - 20.0 * x2 * x),
        140.0 * xy * xy * xy * inverse,
        420.0 * xy * xy * (1.0 - 2.0 * x) * inverse * inverse,
    ]
}

/// Weight of an element, that of both wings.
#[inline(always)]
pub(super) fn both(frame: &Dihedral, high: f64) -> f64 {
    let [a, b] = frame.heights().map(|eta| weight(eta, high)[0]);
    a * b
}

/// Energy of an element with a wing in line with its axis, in units of `k_w
/// L`: that of wings lying flat.
#[inline(always)]
pub(super) fn flat(rest: f64) -> f64 {
    0.5 * rest * rest
}

/// An element at an evaluation: its energy is a function of the angle and of
/// the heights of its wings.
#[derive(Debug)]
pub(super) struct Wrapped {
    frame: Dihedral,
    /// Energy [J].
    pub value: f64,
    /// Derivatives by `σ ψ`, which is the frame's angle, and both heights.
    slope: [f64; 3],
    curvature: [[f64; 3]; 3],
    /// Whether heights matter here.
    fading: bool,
}

impl Wrapped {
    /// From `ψ − ψ0`, σ, `k_w L`, the height where fading ends (0 without) and
    /// the energy of a wing in line with the axis in units of `k_w L`.
    #[inline(always)]
    pub fn new(frame: Dihedral, strain: f64, sigma: f64, k: f64, high: f64, flat: f64) -> Self {
        let [a, b] = frame.heights().map(|eta| weight(eta, high));
        let below = 0.5 * strain * strain - flat;
        let tilt = sigma * strain;
        let fading = a[0] * b[0] != 1.0;
        Self {
            frame,
            value: k * (flat + a[0] * b[0] * below),
            slope: [
                k * a[0] * b[0] * tilt,
                k * a[1] * b[0] * below,
                k * a[0] * b[1] * below,
            ],
            curvature: [
                [
                    k * a[0] * b[0],
                    k * a[1] * b[0] * tilt,
                    k * a[0] * b[1] * tilt,
                ],
                [
                    k * a[1] * b[0] * tilt,
                    k * a[2] * b[0] * below,
                    k * a[1] * b[1] * below,
                ],
                [
                    k * a[0] * b[1] * tilt,
                    k * a[1] * b[1] * below,
                    k * a[0] * b[2] * below,
                ],
            ],
            fading,
        }
    }

    /// `∂V/∂x` by `x0, x1, x3, x4`.
    #[inline(always)]
    pub fn gradient(&self) -> [V; 4] {
        let mut g = self.frame.gradient().map(|g| g * self.slope[0]);
        if self.fading {
            let heights = self.frame.height_gradients();
            for (height, slope) in heights.iter().zip(&self.slope[1..]) {
                for (g, h) in g.iter_mut().zip(height) {
                    *g += h * *slope;
                }
            }
        }
        g
    }

    /// Writes `∂²V/∂x²`.
    #[inline(always)]
    pub fn hessian(&self, curvature: Curvature, h: &mut [[f64; 12]; 12]) {
        let psi = self.frame.gradient();
        let exact = curvature == Curvature::Exact;
        if !self.fading {
            let k = self.curvature[0][0];
            for i in 0..4 {
                put(h, 3 * i, 3 * i, &square(k, psi[i]));
                for j in i + 1..4 {
                    put_both(h, 3 * i, 3 * j, &(psi[i] * k * psi[j].transpose()));
                }
            }
        } else {
            let [a, b] = self.frame.height_gradients();
            let inner = match exact {
                true => self.curvature,
                false => semidefinite(self.curvature, self.frame.heights()),
            };
            let of = |i: usize| [psi[i], a[i], b[i]];
            for i in 0..4 {
                for j in i..4 {
                    let (left, right) = (of(i), of(j));
                    let mut block = Block::zeros();
                    for (c, row) in inner.iter().enumerate() {
                        let v = right[0] * row[0] + right[1] * row[1] + right[2] * row[2];
                        block += outer(left[c], v);
                    }
                    if i == j {
                        block = (block + block.transpose()) * 0.5;
                        put(h, 3 * i, 3 * i, &block);
                    } else {
                        put_both(h, 3 * i, 3 * j, &block);
                    }
                }
            }
            for w in 0..2 {
                let slope = self.slope[1 + w];
                match curvature {
                    Curvature::Exact => self.frame.add_second_height(w, slope, h),
                    Curvature::Projected => self.frame.add_second_height_positive(w, slope, h),
                    Curvature::GaussNewton => {}
                }
            }
        }
        match curvature {
            Curvature::Exact => self.frame.add_second(self.slope[0], h),
            Curvature::Projected => self.frame.add_second_positive(self.slope[0], h),
            Curvature::GaussNewton => {}
        }
    }
}

/// The nearest semidefinite matrix, with angles measured as lengths at the
/// lower of the two heights.
fn semidefinite(h: [[f64; 3]; 3], heights: [f64; 2]) -> [[f64; 3]; 3] {
    let reach = heights[0].min(heights[1]);
    let scale = [1.0 / reach, 1.0, 1.0];
    let scaled = Block::from_fn(|i, j| h[i][j] * scale[i] * scale[j]);
    // The eigenvalues of NaN take for ever.
    if !scaled.iter().all(|x| x.is_finite()) {
        return h;
    }
    let eigen = scaled.symmetric_eigen();
    let mut kept = Block::zeros();
    for (value, vector) in eigen
        .eigenvalues
        .iter()
        .zip(eigen.eigenvectors.column_iter())
    {
        kept += square(value.max(0.0), vector.into());
    }
    std::array::from_fn(|i| std::array::from_fn(|j| kept[(i, j)] / (scale[i] * scale[j])))
}
