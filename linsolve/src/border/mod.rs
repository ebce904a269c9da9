//! Scalar unknowns beside points.

mod matrix;
mod pattern;

pub use matrix::BorderedMatrix;
pub use pattern::BorderPattern;
