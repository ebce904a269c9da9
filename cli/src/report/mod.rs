//! The report: one HTML page that needs no network, no server and no other file.
//!
//! [`render`] turns plain data ([`ReportData`]) into the page: status and figures,
//! shaded pictures, maps with colour scales, an orbitable view with a time slider,
//! plots, the assembly's stages, the effect ledger, cost and settings.
//! [`picture_png`] draws a single picture.
//!
//! Pictures come from a software renderer of our own, so they are the same bytes
//! on every run and need no graphics driver; only the 3D view uses WebGL 2, and
//! says so where there is none.

mod camera;
mod colour;
mod data;
mod envelope;
mod error;
mod gallery;
mod leaves;
mod page;
mod picture;
mod plot;
mod quantise;
mod raster;
mod scalebar;
mod shade;
mod stats;
mod study;
mod study_plot;
mod summary;
mod tables;
mod text;
mod ticks;
mod viewer;
mod viewer_yarns;

pub use camera::View;
pub use colour::{ColourMap, MISSING};
pub use data::{
    AssemblyStage, Field, Point, ReportData, ReportFrame, ReportMesh, ReportSurface, ReportYarns,
    Series,
};
pub use error::ReportError;
pub use page::{MAX_BYTES, render, render_within};
pub use picture::{MAX_SIDE, Paint, Picture, PictureStyle, Subject, picture, picture_png};
pub use study::render_study;
pub use text::escape;
