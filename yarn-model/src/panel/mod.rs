//! Yarns laid on panels that are flat in 2D and curved in 3D.
//!
//! A [`PanelSet`] is a triangle mesh whose corners carry flat coordinates; its
//! panels are the connected pieces of the flat coordinates. Each panel is
//! knitted ([`knitted_panel`]) or woven ([`woven_panel`]) within its
//! [`Outline`], with wales and warps along y, placed in 3D through its
//! triangles, and sewn to its neighbours ([`PanelSet::sew`]).
//!
//! # Edges
//!
//! Every stretch of a panel's border carries a *rod*, a yarn whose nodes lie
//! evenly along it; panels that meet share it. Whatever ends near the border is
//! merged into the rod's nodes: ends of yarns, and the free heads and feet of
//! loops whose neighbours are cut away. A node of a rod is a weld of all its
//! yarns: one point, arc lengths held. So a cut edge cannot run, and a seam
//! needs no energy of its own.

mod error;
mod knitted;
mod mesh;
mod outline;
mod seams;
mod settle;
mod sew;
mod surface;
mod woven;

pub use error::PanelError;
pub use knitted::knitted_panel;
pub use mesh::{Panel, PanelSet};
pub use outline::Outline;
pub use seams::{Seam, SeamSide};
pub use settle::Settled;
pub use sew::{SewingOptions, Sewn, SewnRod};
pub use surface::PanelSurface;
pub use woven::{PanelWeave, woven_panel};
