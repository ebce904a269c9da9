//! Smooth tubes around yarns, for pictures and other programs.

mod centres;
mod paths;
mod skin;
mod spline;
#[cfg(test)]
mod tests;

pub use centres::strand_centres;
pub use paths::StrandPaths;
pub use skin::{TubeMesh, Tubes};
