use crate::fabric::BendingRigidity;

/// Bending rigidity as a function of the bending direction `ψ` from the warp.
///
/// ```text
/// B(ψ) = b_0 + b_2 cos 2ψ + b_4 cos 4ψ
/// ```
/// The same law as [`BendingRigidity`], sorted by harmonics. All in [N·m].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DirectionalRigidity {
    /// Mean over directions.
    pub b0: f64,
    /// Warp against weft.
    pub b2: f64,
    /// Axes against bias.
    pub b4: f64,
}

impl From<&BendingRigidity> for DirectionalRigidity {
    fn from(b: &BendingRigidity) -> Self {
        let (sum, twist) = (b.warp + b.weft, b.twist());
        Self {
            b0: 0.375 * sum + 0.25 * twist,
            b2: 0.5 * (b.warp - b.weft),
            b4: 0.125 * sum - 0.25 * twist,
        }
    }
}

impl DirectionalRigidity {
    /// `B` for bending along the unit vector `(c, s)` of the material plane.
    #[inline]
    pub fn along(&self, [c, s]: [f64; 2]) -> f64 {
        let cos2 = c * c - s * s;
        self.b0 + self.b2 * cos2 + self.b4 * (2.0 * cos2 * cos2 - 1.0)
    }

    /// Smallest value over all directions.
    pub fn min(&self) -> f64 {
        let at = |cos2: f64| self.b0 + self.b2 * cos2 + self.b4 * (2.0 * cos2 * cos2 - 1.0);
        let ends = at(1.0).min(at(-1.0));
        let turning = -self.b2 / (4.0 * self.b4);
        if turning.abs() < 1.0 {
            ends.min(at(turning))
        } else {
            ends
        }
    }

    /// The law that hinges need so that the sheet shows `self`.
    ///
    /// Hinges see the curvature across their own edge alone: over a mesh
    /// without a preferred direction, `b_2` shows up as two thirds and `b_4`
    /// as one third of what was put in. `None` when the harmonics so magnified
    /// would leave some direction with less than a tenth of the mean.
    pub fn calibrated(&self) -> Option<Self> {
        let law = Self {
            b2: 1.5 * self.b2,
            b4: 3.0 * self.b4,
            ..*self
        };
        (law.min() >= 0.1 * self.b0).then_some(law)
    }
}

/// What the number in a fabric's bending rigidity means.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum HingeNorm {
    /// The flexural rigidity of the laboratory: `c_b = 1`.
    #[default]
    Plate,
    /// The factor of the discrete-shells literature, `c_b = 3`; for fabrics
    /// that were fitted through it.
    DiscreteShells,
}

impl HingeNorm {
    /// `c_b` in `k_e = c_b B l̄²/(Ā_1 + Ā_2)`.
    pub fn factor(self) -> f64 {
        match self {
            HingeNorm::Plate => 1.0,
            HingeNorm::DiscreteShells => 3.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Both forms of the law agree in every direction, and the minimum is one.
    #[test]
    fn harmonics() {
        let b = BendingRigidity {
            warp: 2e-5,
            weft: 1.1e-5,
            bias: 0.8e-5,
        };
        let law = DirectionalRigidity::from(&b);
        let mut least = f64::INFINITY;
        for i in 0..1000 {
            let angle = f64::from(i) * 0.00315;
            let along = law.along([angle.cos(), angle.sin()]);
            assert!((along - b.rigidity(angle)).abs() < 1e-19);
            least = least.min(along);
        }
        assert!(
            (law.min() - least).abs() < 1e-5 * least,
            "{} {least}",
            law.min()
        );
        assert_eq!(law.calibrated(), None);
        let mild = DirectionalRigidity {
            b0: 1.0,
            b2: 0.1,
            b4: 0.05,
        };
        assert_eq!(
            mild.calibrated(),
            Some(DirectionalRigidity {
                b0: 1.0,
                b2: 0.15000000000000002,
                b4: 0.15000000000000002
            })
        );
    }
}
