//! Out-of-plane elasticity.

mod arctangent;
mod frame;
mod hinge;
mod quadratic;
mod rigidity;

pub use hinge::{AngleLaw, BendingHinge, HingeRest, PlainAngle, TangentAngle};
pub use quadratic::{BendingQuadratic, QuadraticRest};
pub use rigidity::{DirectionalRigidity, HingeNorm};

pub(crate) use frame::{Floors, HingeFrame};
