//! Coulomb friction of contacts, in two models.

mod anchored;
mod lagged;

pub use anchored::{AnchorResponse, AnchorState, FrictionAnchored};
pub(crate) use anchored::{anchor_damping, from_frame, to_frame};
pub use lagged::{FrictionLagged, LaggedResponse};

use crate::CollisionError;
use crate::error::check_length;

/// Friction model of a contact source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Friction {
    /// True stick and slip with anchors: the default for drapes.
    Anchored(FrictionAnchored),
    /// Smooth and variational, creeps slowly: for line searches on an energy.
    Lagged(FrictionLagged),
}

/// Coefficient of two materials from those of each on itself,
/// `μ = √(μ_a μ_b)` \[1\]: a side without friction rubs on nothing.
///
/// ```
/// use selvedge_collision::pair_friction;
/// assert_eq!(pair_friction(0.3, 0.3), 0.3);
/// assert_eq!(pair_friction(0.3, 0.0), 0.0);
/// ```
#[inline]
pub fn pair_friction(a: f64, b: f64) -> f64 {
    (a * b).sqrt()
}

/// Inverses of masses \[1/kg\]: zero for a point that does not move, or has no mass to
/// speak of.
pub(crate) fn inverse_masses(masses: &[f64]) -> Vec<f64> {
    let moves = |m: &f64| *m > 0.0 && m.is_finite();
    masses
        .iter()
        .map(|m| if moves(m) { 1.0 / m } else { 0.0 })
        .collect()
}

/// Checks coefficients of single points: as many as there are points, finite
/// and not negative. Returns the one that all share, if they do.
pub(crate) fn common_coefficient(
    coefficients: &[f64],
    points: usize,
) -> Result<Option<f64>, CollisionError> {
    check_length("friction coefficients", coefficients.len(), points)?;
    if let Some(&value) = coefficients.iter().find(|c| !(**c >= 0.0 && c.is_finite())) {
        return Err(CollisionError::Parameter {
            name: "friction coefficient",
            value,
            requirement: "finite and not negative",
        });
    }
    let first = coefficients.first().copied();
    Ok(first.filter(|f| coefficients.iter().all(|c| c == f)))
}

impl Friction {
    /// The same model with another coefficient \[1\].
    #[must_use]
    pub fn with_coefficient(self, coefficient: f64) -> Self {
        match self {
            Self::Anchored(f) => Self::Anchored(FrictionAnchored { coefficient, ..f }),
            Self::Lagged(f) => Self::Lagged(FrictionLagged { coefficient, ..f }),
        }
    }

    /// Friction coefficient \[1\].
    pub fn coefficient(&self) -> f64 {
        match self {
            Self::Anchored(f) => f.coefficient,
            Self::Lagged(f) => f.coefficient,
        }
    }

    /// Checks the parameters.
    ///
    /// # Errors
    /// [`CollisionError::Parameter`] for the first bad one.
    pub fn validate(&self) -> Result<(), CollisionError> {
        let fail = |name, value, requirement| {
            Err(CollisionError::Parameter {
                name,
                value,
                requirement,
            })
        };
        let mu = self.coefficient();
        if !(mu >= 0.0 && mu.is_finite()) {
            return fail("friction coefficient", mu, "finite and not negative");
        }
        match self {
            Self::Anchored(f) if !(f.stiffness_ratio > 0.0 && f.stiffness_ratio.is_finite()) => {
                fail(
                    "anchor stiffness ratio",
                    f.stiffness_ratio,
                    "positive and finite",
                )
            }
            Self::Anchored(f) if !(f.damping_ratio >= 0.0 && f.damping_ratio.is_finite()) => fail(
                "anchor damping ratio",
                f.damping_ratio,
                "finite and not negative",
            ),
            Self::Lagged(f) if !(f.creep_speed > 0.0 && f.creep_speed.is_finite()) => {
                fail("creep speed", f.creep_speed, "positive and finite")
            }
            _ => Ok(()),
        }
    }
}
