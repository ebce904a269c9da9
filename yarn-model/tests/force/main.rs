//! Energies and inertia of yarn networks.

mod common;
mod derivatives;
mod golden;
mod inertia;
mod limits;
mod wrapping;
