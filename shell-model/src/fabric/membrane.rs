use super::FabricError;
use super::error::{positive, value};

/// In-plane moduli of an orthotropic sheet, integrated through the thickness.
///
/// ```text
/// σ = C ε,   C = [[k_u, k_uv, 0], [k_uv, k_v, 0], [0, 0, k_s]],   ε = (ε_uu, ε_vv, γ_uv),  γ_uv = 2 ε_uv
/// ```
/// after \[Volino2009\]. `C` must be positive definite.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct MembraneModuli {
    /// `k_u`, warp [N/m].
    pub warp: f64,
    /// `k_v`, weft [N/m].
    pub weft: f64,
    /// `k_s`, shear against the engineering shear strain [N/m].
    pub shear: f64,
    /// `k_uv`, warp-weft coupling [N/m].
    pub coupling: f64,
}

impl MembraneModuli {
    /// The four entries of `C` [N/m].
    ///
    /// # Errors
    /// [`FabricError::Value`] unless `warp, weft, shear > 0` and
    /// `coupling² < warp · weft`.
    pub fn direct(warp: f64, weft: f64, shear: f64, coupling: f64) -> Result<Self, FabricError> {
        let moduli = Self {
            warp,
            weft,
            shear,
            coupling,
        };
        moduli.validate()?;
        Ok(moduli)
    }

    /// From three strip tests: uniaxial moduli `E_u` along the warp, `E_v`
    /// along the weft, `E_b` at 45° (the bias) [N/m], and Poisson's ratio
    /// `ν_uv` (weft contraction per warp extension).
    ///
    /// ```text
    /// G = 1 / (4/E_b − 1/E_u − 1/E_v + 2 ν_uv/E_u),   ν_vu = ν_uv E_v/E_u,   Δ = 1 − ν_uv ν_vu
    /// k_u = E_u/Δ,   k_v = E_v/Δ,   k_uv = ν_uv E_v/Δ,   k_s = G
    /// ```
    ///
    /// # Errors
    /// [`FabricError::Value`] for a modulus that is not positive, for `Δ ≤ 0`
    /// (field `poisson`) and for `G ≤ 0` or infinite (field `bias`): no
    /// orthotropic sheet has such a set of moduli.
    pub fn from_moduli(e_u: f64, e_v: f64, e_b: f64, nu_uv: f64) -> Result<Self, FabricError> {
        positive("membrane.warp", e_u)?;
        positive("membrane.weft", e_v)?;
        positive("membrane.bias", e_b)?;
        let delta = 1.0 - nu_uv * (nu_uv * e_v / e_u);
        if !(delta.is_finite() && delta > 0.0) {
            let limit = (e_u / e_v).sqrt();
            return Err(value(
                "membrane.poisson",
                nu_uv,
                format!("between -{limit:.4} and {limit:.4} (the square root of warp/weft)"),
            ));
        }
        let shear_compliance = 4.0 / e_b - 1.0 / e_u - 1.0 / e_v + 2.0 * nu_uv / e_u;
        if !(shear_compliance.is_finite() && shear_compliance > 0.0) {
            let limit = 4.0 / (1.0 / e_u + 1.0 / e_v - 2.0 * nu_uv / e_u);
            return Err(value(
                "membrane.bias",
                e_b,
                format!("below {limit:.4} N/m, or the shear modulus is not positive"),
            ));
        }
        Self::direct(
            e_u / delta,
            e_v / delta,
            1.0 / shear_compliance,
            nu_uv * e_v / delta,
        )
    }

    /// Isotropic sheet in plane stress from `E h` [N/m] and Poisson's ratio.
    ///
    /// ```text
    /// k_u = k_v = E h/(1 − ν²),   k_uv = ν k_u,   k_s = E h/(2 (1 + ν))
    /// ```
    ///
    /// # Errors
    /// [`FabricError::Value`] unless `E h > 0` and `−1 < ν < 1`.
    pub fn isotropic(young_times_thickness: f64, poisson: f64) -> Result<Self, FabricError> {
        positive("membrane.stiffness", young_times_thickness)?;
        if !(poisson > -1.0 && poisson < 1.0) {
            return Err(value(
                "membrane.poisson",
                poisson,
                "between -1 and 1, both excluded",
            ));
        }
        let warp = young_times_thickness / (1.0 - poisson * poisson);
        let shear = young_times_thickness / (2.0 * (1.0 + poisson));
        Self::direct(warp, warp, shear, poisson * warp)
    }

    /// Checks that `C` is finite and positive definite.
    ///
    /// # Errors
    /// [`FabricError::Value`] naming the first modulus at fault.
    pub fn validate(&self) -> Result<(), FabricError> {
        positive("membrane.warp", self.warp)?;
        positive("membrane.weft", self.weft)?;
        positive("membrane.shear", self.shear)?;
        let limit = self.warp.sqrt() * self.weft.sqrt();
        let definite = self.coupling.abs() < limit; // false for NaN too
        if !definite {
            return Err(value(
                "membrane.coupling",
                self.coupling,
                format!(
                    "between -{limit:.4} and {limit:.4} N/m (the square root of warp times weft)"
                ),
            ));
        }
        Ok(())
    }

    /// `C` [N/m], rows and columns in the order `ε_uu, ε_vv, γ_uv`.
    pub fn matrix(&self) -> [[f64; 3]; 3] {
        [
            [self.warp, self.coupling, 0.0],
            [self.coupling, self.weft, 0.0],
            [0.0, 0.0, self.shear],
        ]
    }

    /// Modulus that a uniaxial strip test at `angle` \[rad\] from the warp
    /// measures [N/m].
    ///
    /// ```text
    /// 1/E(φ) = nᵀ C⁻¹ n,   n = (cos²φ, sin²φ, cos φ sin φ)
    /// ```
    pub fn modulus(&self, angle: f64) -> f64 {
        let (s, c) = angle.sin_cos();
        let det = self.warp * self.weft - self.coupling * self.coupling;
        let (a, b) = (c * c, s * s);
        let normal = (self.weft * a * a + self.warp * b * b - 2.0 * self.coupling * a * b) / det;
        1.0 / (normal + a * b / self.shear)
    }

    /// Poisson's ratio `ν_uv` \[1\]: weft contraction per warp extension.
    pub fn poisson(&self) -> f64 {
        self.coupling / self.weft
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_4;

    /// The strip moduli given are the ones the sheet shows, at any angle.
    #[test]
    fn moduli_round_trip() {
        let (eu, ev, eb, nu) = (2000.0, 1300.0, 150.0, 0.21);
        let m = MembraneModuli::from_moduli(eu, ev, eb, nu).unwrap();
        for (angle, want) in [(0.0, eu), (2.0 * FRAC_PI_4, ev), (FRAC_PI_4, eb)] {
            assert!((m.modulus(angle) / want - 1.0).abs() < 1e-13, "{angle}");
        }
        assert!((m.poisson() - nu).abs() < 1e-15);
        for i in 0..=18 {
            let phi = f64::from(i) * 5f64.to_radians();
            let (s, c) = phi.sin_cos();
            let law =
                c.powi(4) / eu + s.powi(4) / ev + (c * s).powi(2) * (1.0 / m.shear - 2.0 * nu / eu);
            assert!((m.modulus(phi) * law - 1.0).abs() < 1e-12);
        }
    }

    /// An isotropic sheet has one modulus in every direction.
    #[test]
    fn isotropic_is_isotropic() {
        let m = MembraneModuli::isotropic(700.0, 0.3).unwrap();
        for i in 0..24 {
            assert!((m.modulus(f64::from(i) * 0.27) / 700.0 - 1.0).abs() < 1e-13);
        }
    }

    /// Sets of numbers that no sheet can have are refused by name.
    #[test]
    fn impossible_sets() {
        let field = |r: Result<MembraneModuli, FabricError>| match r.unwrap_err() {
            FabricError::Value { field, .. } => field,
            other => panic!("{other}"),
        };
        assert_eq!(
            field(MembraneModuli::direct(1.0, 4.0, 1.0, 2.0)),
            "membrane.coupling"
        );
        assert_eq!(
            field(MembraneModuli::direct(1.0, 4.0, 1.0, f64::NAN)),
            "membrane.coupling"
        );
        assert_eq!(
            field(MembraneModuli::direct(1.0, 4.0, 0.0, 0.0)),
            "membrane.shear"
        );
        // stiffer on the bias than the yarns allow: G < 0
        assert_eq!(
            field(MembraneModuli::from_moduli(100.0, 100.0, 250.0, 0.0)),
            "membrane.bias"
        );
        assert_eq!(
            field(MembraneModuli::from_moduli(100.0, 400.0, 20.0, 0.5)),
            "membrane.poisson"
        );
        assert_eq!(
            field(MembraneModuli::isotropic(100.0, 1.0)),
            "membrane.poisson"
        );
    }
}
