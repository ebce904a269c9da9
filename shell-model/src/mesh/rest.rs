use crate::ModelError;

/// Smallest height over longest edge of a rest triangle \[1\].
const MIN_ASPECT: f64 = 1e-4;
/// Smallest area over squared longest edge \[1\], also with slivers allowed.
const MIN_RELATIVE_AREA: f64 = 1e-14;

/// Rest shape of a triangle: what turns positions into the deformation
/// gradient.
///
/// ```text
/// U = r_1u (x_1 − x_0) + r_2u (x_2 − x_0),   V = r_1v (x_1 − x_0) + r_2v (x_2 − x_0)
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestTriangle {
    /// `r_1u, r_1v, r_2u, r_2v` [1/m]: material gradients of the hat functions
    /// of corners 1 and 2; corner 0 has minus their sum.
    pub inverse: [f64; 4],
    /// Rest area \[m²\].
    pub area: f64,
}

impl RestTriangle {
    /// Rest shape from the material coordinates `(u, v)` of the corners \[m\].
    ///
    /// # Errors
    /// [`ModelError::NotFinite`], [`ModelError::InvertedTriangle`] or
    /// [`ModelError::DegenerateTriangle`], all naming `triangle`.
    pub fn new(
        corners: &[[f64; 2]; 3],
        triangle: usize,
        allow_slivers: bool,
    ) -> Result<Self, ModelError> {
        if !corners.iter().flatten().all(|c| c.is_finite()) {
            return Err(ModelError::NotFinite {
                what: "material coordinates of triangle",
                index: triangle,
            });
        }
        let [a, b, c] = *corners;
        let (e1, e2) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
        let e3 = [c[0] - b[0], c[1] - b[1]];
        let det = e1[0] * e2[1] - e1[1] * e2[0];
        let area = 0.5 * det.abs();
        let longest2 = [e1, e2, e3]
            .iter()
            .map(|e| e[0] * e[0] + e[1] * e[1])
            .fold(0.0, f64::max);
        let aspect = 2.0 * area / longest2;
        // `aspect` is NaN when all corners coincide.
        let solid = area > MIN_RELATIVE_AREA * longest2
            && (allow_slivers || aspect > MIN_ASPECT)
            && (1.0 / det).is_finite();
        if !solid {
            let aspect = if aspect.is_nan() { 0.0 } else { aspect };
            return Err(ModelError::DegenerateTriangle {
                triangle,
                area,
                aspect,
            });
        }
        if det < 0.0 {
            return Err(ModelError::InvertedTriangle {
                triangle,
                area: 0.5 * det,
            });
        }
        let inverse = [e2[1] / det, -e2[0] / det, -e1[1] / det, e1[0] / det];
        Ok(Self { inverse, area })
    }

    /// Material gradients `(∂/∂u, ∂/∂v)` of the three hat functions [1/m].
    #[inline]
    pub fn gradients(&self) -> [[f64; 2]; 3] {
        let [a, b, c, d] = self.inverse;
        [[-a - c, -b - d], [a, b], [c, d]]
    }

    /// Columns `U = ∂x/∂u` and `V = ∂x/∂v` of the deformation gradient \[1\].
    #[inline]
    pub fn columns(&self, x: &[[f64; 3]; 3]) -> [[f64; 3]; 2] {
        let [a, b, c, d] = self.inverse;
        let mut columns = [[0.0; 3]; 2];
        for i in 0..3 {
            let (d1, d2) = (x[1][i] - x[0][i], x[2][i] - x[0][i]);
            columns[0][i] = a * d1 + c * d2;
            columns[1][i] = b * d1 + d * d2;
        }
        columns
    }
}
