//! How wrong a simulation is, without a reference, and the settings that meet
//! a wanted error.
//!
//! [`estimate()`] takes a finished run and makes a few cheaper companions of it:
//! on meshes two and four times as coarse, with steps half as long, with
//! tolerances ten times tighter, begun another way. What the result changes by tells what is
//! still missing:
//!
//! ```text
//! space      e = |x_a − x_2a| / (2^p − 1),   p = log2(|x_2a − x_4a| / |x_a − x_2a|) ∈ [1, 2]
//! time       e = 2 |x_h − x_h/2|             backward Euler is of first order
//! algebraic  e = 10/9 |x_τ − x_τ/10|
//! path       e = |x − x'|                    x' begun another way
//! ```
//! [Richardson1911]. `|·|` is the mean distance [m] between the same points of
//! the cloth, found by their place in the panel ([`MaterialMap`]), whatever the
//! meshes. The first three are added up; the last, which is chance, adds to them
//! in squares: the estimate, see [`total`].
//!
//! [`drape_within`] turns it around: it chooses the step, the tolerance and
//! the mesh so that the estimate stays below a wanted error, runs the scene
//! with them, and tells what it chose and why.
//!
//! Friction and folds make the rest shape of cloth depend on its history. Two
//! runs may then differ by more than either is wrong: by their path. It is measured
//! with other steps while sewing, or with another start.

mod autopilot;
mod companion;
mod error;
mod estimator;
mod kept;
mod knob;
mod material;
mod parts;
mod path;

pub use autopilot::{Target, Within, drape_within};
pub use companion::{Companion, Session, scaled_step, scaled_tolerance};
pub use error::EstimateError;
pub use estimator::estimate;
pub use material::{MaterialMap, Surface};
pub use parts::{EFFECTIVITY, algebraic_part, space_part, time_part, total};
pub use selvedge_scene::file::coarser;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
