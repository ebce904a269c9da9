use super::FabricError;
use super::error::{positive, value};

/// Flexural rigidities of an orthotropic sheet per unit width, measured on
/// strips cut along the warp, the weft and the bias (45°).
///
/// ```text
/// B(ψ) = B_u c⁴ + B_v s⁴ + 2 B_x c² s²,   B_x = 2 B_b − (B_u + B_v)/2,   c = cos ψ, s = sin ψ
/// ```
/// `B(ψ) > 0` for every `ψ` iff `B_u, B_v > 0` and `B_x > −√(B_u B_v)`.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct BendingRigidity {
    /// `B_u`, warp [N·m].
    pub warp: f64,
    /// `B_v`, weft [N·m].
    pub weft: f64,
    /// `B_b`, at 45° [N·m].
    pub bias: f64,
}

impl BendingRigidity {
    /// The three measured rigidities [N·m].
    ///
    /// # Errors
    /// [`FabricError::Value`] when the rigidity is not positive in every
    /// direction.
    pub fn new(warp: f64, weft: f64, bias: f64) -> Result<Self, FabricError> {
        let rigidity = Self { warp, weft, bias };
        rigidity.validate()?;
        Ok(rigidity)
    }

    /// The same rigidity `D` [N·m] in every direction.
    ///
    /// # Errors
    /// [`FabricError::Value`] unless `D > 0`.
    pub fn isotropic(rigidity: f64) -> Result<Self, FabricError> {
        positive("bending.rigidity", rigidity)?;
        Self::new(rigidity, rigidity, rigidity)
    }

    /// Twist coefficient `B_x` of the plate law [N·m].
    pub fn twist(&self) -> f64 {
        2.0 * self.bias - 0.5 * (self.warp + self.weft)
    }

    /// `B(ψ)` of a strip at `angle` \[rad\] from the warp [N·m].
    pub fn rigidity(&self, angle: f64) -> f64 {
        let (s, c) = angle.sin_cos();
        let (c2, s2) = (c * c, s * s);
        self.warp * c2 * c2 + self.weft * s2 * s2 + 2.0 * self.twist() * c2 * s2
    }

    /// Checks that the rigidity is finite and positive in every direction.
    ///
    /// # Errors
    /// [`FabricError::Value`] naming the rigidity at fault.
    pub fn validate(&self) -> Result<(), FabricError> {
        positive("bending.warp", self.warp)?;
        positive("bending.weft", self.weft)?;
        positive("bending.bias", self.bias)?;
        let root = self.warp.sqrt() * self.weft.sqrt();
        let sound = self.twist() > -root; // false for NaN too
        if !sound {
            let limit = 0.25 * (self.warp + self.weft) - 0.5 * root;
            return Err(value(
                "bending.bias",
                self.bias,
                format!("above {limit:.3e} N·m, or some direction between has no rigidity"),
            ));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The law passes through the three measured values.
    #[test]
    fn passes_through_measurements() {
        let b = BendingRigidity::new(2e-5, 1.5e-5, 1e-5).unwrap();
        for (degrees, want) in [(0.0, 2e-5), (90.0, 1.5e-5), (45.0, 1e-5), (135.0, 1e-5)] {
            let got = b.rigidity(f64::to_radians(degrees));
            assert!((got / want - 1.0).abs() < 1e-14, "{degrees}: {got}");
        }
    }

    /// The limit of the bias rigidity is exactly where a direction loses its
    /// rigidity.
    #[test]
    fn positivity_limit() {
        let (u, v): (f64, f64) = (4e-5, 1e-5);
        let limit = 0.25 * (u + v) - 0.5 * (u * v).sqrt();
        let just_above = BendingRigidity::new(u, v, limit * 1.001).unwrap();
        let least = (0..1800)
            .map(|i| just_above.rigidity(f64::from(i) * 1e-3))
            .fold(f64::INFINITY, f64::min);
        assert!(least > 0.0 && least < 1e-3 * u, "{least}");
        assert!(BendingRigidity::new(u, v, limit * 0.999).is_err());
        assert!(BendingRigidity::isotropic(-1e-5).is_err());
        assert!(BendingRigidity::isotropic(f64::INFINITY).is_err());
    }
}
