//! Woven cloth from its construction.

mod draft;
mod error;
mod text;
mod woven;

pub use draft::Draft;
pub use error::{Family, WeaveError};
pub use woven::Woven;
