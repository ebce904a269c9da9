use super::Fabric;
use super::FabricError;
use super::error::value;

/// Energy of a fabric in a homogeneous state, with derivatives.
///
/// ```text
/// W = ½ (N_xx E_xx + 2 N_xy E_xy + N_yy E_yy) + ½ (B_u l_x² + B_v l_y²)
/// N_xx = k_u E_xx + k_uv E_yy,   N_yy = k_uv E_xx + k_v E_yy,   N_xy = 2 k_s E_xy
/// ```
/// `x` is the warp, `y` the weft. Strips measure no coupling of the two
/// curvatures, and none is assumed here.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct FabricState {
    /// Membrane energy [J/m²].
    pub membrane_energy: f64,
    /// Stress resultants `N` in the order xx, xy, yy [N/m].
    pub stress: [f64; 3],
    /// `∂N/∂E` in the same order [N/m].
    pub tangent: [[f64; 3]; 3],
    /// Bending energy [J/m²].
    pub bending_energy: f64,
    /// Moments per width `∂W/∂l` about the bends along warp and weft \[N\].
    pub moments: [f64; 2],
    /// Their derivatives [N·m].
    pub bending_tangent: [[f64; 2]; 2],
}

impl Fabric {
    /// State at the Green strain `E_xx, E_xy, E_yy` \[1\] and the curvatures
    /// `l_x, l_y` along warp and weft [1/m].
    ///
    /// ```
    /// use selvedge_shell_model::fabric::library;
    /// let linen = library::get("linen")?;
    /// let state = linen.evaluate([0.01, 0.0, 0.0], [0.0, 0.0])?;
    /// assert_eq!(state.stress[0], 0.01 * linen.membrane.warp);
    /// # Ok::<(), selvedge_shell_model::fabric::FabricError>(())
    /// ```
    ///
    /// # Errors
    /// [`FabricError::Value`] for a number that is not finite, and for a strain
    /// that no deformation has: `I + 2E` has to be positive definite.
    pub fn evaluate(
        &self,
        strain: [f64; 3],
        curvature: [f64; 2],
    ) -> Result<FabricState, FabricError> {
        let names = ["strain xx", "strain xy", "strain yy"];
        let all = names.into_iter().zip(strain);
        for (name, x) in all.chain(["curvature x", "curvature y"].into_iter().zip(curvature)) {
            if !x.is_finite() {
                return Err(value(name, x, "finite"));
            }
        }
        let [xx, xy, yy] = strain;
        for (name, x) in [("strain xx", xx), ("strain yy", yy)] {
            if x <= -0.5 {
                return Err(value(name, x, "greater than -0.5: a length cannot vanish"));
            }
        }
        let most = 0.5 * ((1.0 + 2.0 * xx) * (1.0 + 2.0 * yy)).sqrt();
        if xy.abs() >= most {
            return Err(value(
                "strain xy",
                xy,
                format!("between -{most:.4} and {most:.4}: an angle cannot vanish"),
            ));
        }
        let (c, b) = (&self.membrane, &self.bending);
        let tangent = [
            [c.warp, 0.0, c.coupling],
            [0.0, 2.0 * c.shear, 0.0],
            [c.coupling, 0.0, c.weft],
        ];
        let stress = tangent.map(|row| (0..3).map(|j| row[j] * strain[j]).sum::<f64>());
        let moments = [b.warp * curvature[0], b.weft * curvature[1]];
        Ok(FabricState {
            membrane_energy: 0.5 * (stress[0] * xx + 2.0 * stress[1] * xy + stress[2] * yy),
            stress,
            tangent,
            bending_energy: 0.5 * (moments[0] * curvature[0] + moments[1] * curvature[1]),
            moments,
            bending_tangent: [[b.warp, 0.0], [0.0, b.weft]],
        })
    }
}
