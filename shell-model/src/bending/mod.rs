//! Out-of-plane elasticity.

mod arctangent;
mod blocks;
mod collapse;
mod frame;
mod hinge;
mod law;
mod quadratic;
mod rigidity;

pub use hinge::{BendingHinge, HingeRest};
pub use law::{AngleLaw, PlainAngle, TangentAngle};
pub use quadratic::{BendingQuadratic, QuadraticRest};
pub use rigidity::{DirectionalRigidity, HingeNorm};

pub(crate) use frame::{Floors, HingeFrame};
