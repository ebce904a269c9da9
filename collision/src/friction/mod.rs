//! Coulomb friction of contacts, in two models.

mod anchored;
mod lagged;

pub use anchored::{AnchorResponse, AnchorState, FrictionAnchored};
pub(crate) use anchored::{anchor_damping, from_frame, to_frame};
pub use lagged::{FrictionLagged, LaggedResponse};

use crate::CollisionError;

/// Friction model of a contact source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Friction {
    /// True stick and slip with anchors: the default for drapes.
    Anchored(FrictionAnchored),
    /// Smooth and variational, creeps slowly: for line searches on an energy.
    Lagged(FrictionLagged),
}

impl Friction {
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
